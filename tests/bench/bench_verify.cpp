// Measures the time that the daemon's verifier takes for a message, from the ring to the decision. The
// verifier checks first the tag, then the command in the message. Messages with a wrong tag or an unknown key
// show the time that a sender without the key can cost. The figures of `verify` include two copies of a
// message to a ring and one copy from a ring. Without keys (packet_handler), a message is copied once to a
// ring and once from the ring.
#include <benchmark/benchmark.h>

#include "tests/service/verifier_rig.hpp"

namespace {

using namespace freeflex;
using namespace freeflex::testing;

/// Returns the command make_force() with num_forces forces on pushable points instead of its own forces.
freeflex_msgs::force_t force_of_size(int num_forces) {
  freeflex_msgs::force_t force = make_force();
  force.forces.clear();
  for (int i = 0; i < num_forces; ++i) force.forces.push_back({i, {1.0, 2.0, 3.0}});
  force.num_forces = num_forces;
  if (num_forces ==
      256) {  // the largest message; it is refused only at the last check, because the scene has fewer groups
    force.wrenches.resize(16), force.num_wrenches = 16;
  }
  return force;
}

/// Returns 256 sealed messages with ascending sequence numbers above `after`.
std::vector<std::vector<std::byte>> seal_many(int num_forces, const service::Key& key, std::int64_t after,
                                              std::int64_t valid_until) {
  constexpr int kMessages = 256;
  std::vector<std::vector<std::byte>> all;
  freeflex_msgs::force_t force = force_of_size(num_forces);
  for (int i = 1; i <= kMessages; ++i) {
    force.sequence = after + i;
    all.push_back(seal(force, kForceChannel, key.sealing, valid_until));
  }
  return all;
}

enum class Sender { kHolder, kForger, kStranger };

void verify(benchmark::State& state, Sender sender) {
  const service::Key alice = make_key("alice");
  service::Key key = sender == Sender::kStranger ? make_key("stranger") : alice;
  if (sender == Sender::kForger) key.sealing.secret[0] ^= 1;
  VerifierRig rig({alice});
  std::vector<std::vector<std::byte>> messages;
  std::int64_t sequence = 0;
  std::size_t next = 0;
  for (auto _ : state) {
    if (next == messages.size()) {
      state.PauseTiming();
      while (rig.next_command() || rig.next_answer().reason != io::Reason::kAccepted) continue;
      messages = seal_many(static_cast<int>(state.range(0)), key, sequence, rig.valid_until());
      sequence += static_cast<std::int64_t>(messages.size());
      next = 0;
      state.ResumeTiming();
    }
    rig.deliver(messages[next++]);
  }
  state.counters["bytes"] = static_cast<double>(messages.front().size());
}
void all_sizes(benchmark::internal::Benchmark* benchmark) {
  // the sealed messages have about 0.25, 0.5, 1, 2, 4 and 8.2 kB
  benchmark->ArgName("forces")->Arg(1)->Arg(7)->Arg(26)->Arg(63)->Arg(136)->Arg(256);
}
BENCHMARK_CAPTURE(verify, right_tag, Sender::kHolder)->Apply(all_sizes);
BENCHMARK_CAPTURE(verify, wrong_tag, Sender::kForger)->Apply(all_sizes);
BENCHMARK_CAPTURE(verify, unknown_key, Sender::kStranger)->Apply(all_sizes);

/// Measures the time to compute the tag alone.
void tag(benchmark::State& state) {
  const service::Key alice = make_key("alice");
  const std::vector<std::byte> bytes(static_cast<std::size_t>(state.range(0)));
  for (auto _ : state) benchmark::DoNotOptimize(make_tag(bytes, kForceChannel, alice.sealing));
}
BENCHMARK(tag)->ArgName("bytes")->Arg(256)->Arg(2048)->Arg(service::kMaxRawBytes);

/// Measures the path without keys, which consists of the checks of the ingress, the copy to the ring and the
/// copy from the ring.
void packet_handler(benchmark::State& state) {
  auto block = std::make_unique<service::SharedBlock>();
  auto settings = std::make_unique<service::IngressSettings>();
  settings->session = kSession;
  settings->names = make_names();
  service::PacketHandler packet_handler(*block, *settings);
  freeflex_msgs::force_t force = force_of_size(static_cast<int>(state.range(0)));
  auto entry = std::make_unique<service::InboundEntry>();
  std::vector<std::byte> bytes = io::encode(force);
  std::int64_t sequence = 0;
  const std::size_t at = 24 + 4 + force.sender.size() + 1;
  for (auto _ : state) {
    ++sequence;
    for (std::size_t i = 0; i < 8; ++i)
      bytes[at + i] = static_cast<std::byte>(static_cast<std::uint64_t>(sequence) >> (56 - 8 * i));
    packet_handler.on_force(bytes, 1);
    block->inbound.try_pop(*entry);
  }
}
BENCHMARK(packet_handler)->Apply(all_sizes);

}  // namespace
