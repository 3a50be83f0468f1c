// A hostile ingress, the verifier and the simulation run alternately in one thread. Whatever the ingress
// writes, only commands that the holder of the key sealed are applied, each at most once.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdio>
#include <map>
#include <set>

#include "tests/service/hostile_ingress.hpp"
#include "tests/service/rig.hpp"
#include "tests/service/verifier_rig.hpp"

namespace freeflex::testing {
namespace {

using service::Key;

constexpr int kTicks = 3000;

/// The results of a run.
struct Course {
  std::vector<std::uint64_t> last;
  std::vector<service::AppliedEntry> applied;
  std::vector<service::AckEntry> acks;
  std::map<std::int64_t, std::vector<std::byte>> sealed;  // by sequence
};

/// Runs the octahedron with a verifier. At each tick the ingress performs `acts_a_tick` hostile actions
/// twice. Between the two times, at every hundredth tick, the ingress receives a genuine push, which its
/// actions may destroy.
Course run_course(std::uint64_t seed, int acts_a_tick, bool has_pushes) {
  const Key key = make_key("test");
  const Plan plan = octahedron_plan();
  auto names = std::make_unique<io::NameTable>();
  io::fill_name_table(plan, *names);
  auto ingress = std::make_unique<service::SharedBlock>();
  auto settings = std::make_unique<service::IngressSettings>();
  settings->are_keys_required = true;
  service::PacketHandler packet_handler(*ingress, *settings);
  service::Verifier verifier({key}, {.session = kSession, .channel_prefix = "TEST"}, *names, *ingress,
                             [](service::LineKind, const std::string&) {});
  FakeClock clock;
  auto output = std::make_unique<service::Output>(plan);
  service::Simulation simulation(plan, {.until_tick = kTicks}, clock, verifier.block().inbound, *output,
                                 nullptr);
  HostileIngress hostile(*ingress, seed);
  Course course;
  std::int64_t sequence = 0;
  clock.on_sleep = [&] {
    const service::Verifier::Time time{1'700'000'000'000'000, clock.boot_ns()};
    for (int i = 0; i < acts_a_tick; ++i) hostile.act();
    if (has_pushes && output->tick.load() % 100 == 50) {
      ++sequence;
      ForceCommand push = make_push(sequence, static_cast<int>(sequence % 8));
      push.duration_ticks = 20;
      const auto message = io::to_message(push, kSession, 0);
      course.sealed[sequence] = seal(message, "TEST_FORCE", key.sealing, time.wall_us + 1);
      hostile.overhear(course.sealed[sequence]);
      packet_handler.on_force(course.sealed[sequence], time.now_ns);
    }
    for (int i = 0; i < acts_a_tick; ++i) hostile.act();
    for (int i = 0; i < 64 && verifier.take(time); ++i) continue;
    for (service::AckEntry ack; output->acks.try_pop(ack);) course.acks.push_back(ack);
    for (service::AppliedEntry entry; output->applied.try_pop(entry);) course.applied.push_back(entry);
  };
  simulation.run();
  EXPECT_EQ(simulation.state().tick, kTicks);
  course.last = motion_bits(simulation.state());
  return course;
}

TEST(HostileIngressBesideAVerifier, GetsNoCommandApplied) {
  const Course peaceful = run_course(0, 0, false);
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    const Course attacked = run_course(seed, 20, false);
    EXPECT_TRUE(attacked.applied.empty());
    EXPECT_TRUE(attacked.acks.empty());
    EXPECT_EQ(attacked.last, peaceful.last) << "no bit of the motion changes";
  }
}

TEST(HostileIngressBesideAVerifier, CanLoseCommandsButCannotForgeOrRepeatThem) {
  const Course peaceful = run_course(0, 0, true);
  EXPECT_EQ(peaceful.acks.size(), peaceful.sealed.size());
  std::size_t num_taken = 0;
  for (std::uint64_t seed = 11; seed <= 15; ++seed) {
    const Course attacked = run_course(seed, 2, true);
    std::set<std::int64_t> taken;
    for (const service::AppliedEntry& entry : attacked.applied) {
      if (entry.kind != freeflex_msgs::applied_t::FORCE) continue;
      const std::int64_t sequence = entry.command.sequence;
      EXPECT_TRUE(taken.insert(sequence).second) << sequence << " twice";
      ASSERT_TRUE(attacked.sealed.contains(sequence)) << sequence;
      // the applied command has the same bits as the sealed command
      const auto envelope = service::read_envelope(attacked.sealed.at(sequence));
      const auto applied = io::encode(io::to_message(entry.command, kSession, 0));
      EXPECT_TRUE(std::equal(applied.begin(), applied.end(), envelope->body.begin(), envelope->body.end()));
    }
    num_taken += taken.size();
  }
  std::printf("of %zu commands behind a hostile ingress %zu came through\n", 5 * peaceful.sealed.size(),
              num_taken);
}

}  // namespace
}  // namespace freeflex::testing
