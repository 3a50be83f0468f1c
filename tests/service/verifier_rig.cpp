#include "tests/service/verifier_rig.hpp"

#include <random>

namespace freeflex::testing {

service::Key make_key(const std::string& id) {
  service::Key key;
  key.sealing.id = id;
  std::seed_seq seed(id.begin(), id.end());
  std::mt19937 engine(seed);
  for (unsigned char& byte : key.sealing.secret) byte = static_cast<unsigned char>(engine() & 0xFFU);
  return key;
}

freeflex_msgs::force_t force_of(std::int64_t sequence) {
  freeflex_msgs::force_t force = make_force();
  force.sequence = sequence;
  return force;
}

freeflex_msgs::control_t control_of(std::int64_t sequence) {
  freeflex_msgs::control_t control = make_control();
  control.sequence = sequence;
  return control;
}

VerifierRig::VerifierRig(std::vector<service::Key> keys) {
  settings->are_keys_required = true;
  const service::Verifier::Options options{.session = kSession, .channel_prefix = "TEST"};
  verifier = std::make_unique<service::Verifier>(
      std::move(keys), options, make_names(), *ingress,
      [this](service::LineKind, const std::string& line) { log.push_back(line); });
}

void VerifierRig::deliver(std::span<const std::byte> bytes, bool is_force) {
  if (is_force)
    packet_handler.on_force(bytes, time.now_ns);
  else
    packet_handler.on_control(bytes, time.now_ns);
  while (verifier->take(time)) continue;
}

void VerifierRig::seal_and_deliver(const freeflex_msgs::force_t& force, const service::Key& key) {
  deliver(seal(force, kForceChannel, key.sealing, valid_until()), true);
}

void VerifierRig::seal_and_deliver(const freeflex_msgs::control_t& control, const service::Key& key) {
  deliver(seal(control, kControlChannel, key.sealing, valid_until()), false);
}

std::optional<service::InboundEntry> VerifierRig::next_command() {
  auto entry = std::make_unique<service::InboundEntry>();
  if (!verifier->block().inbound.try_pop(*entry)) return std::nullopt;
  return *entry;
}

io::Admission VerifierRig::next_answer() {
  service::RejectionEntry entry{};
  if (!verifier->block().rejected.try_pop(entry)) return {};
  return entry.admission;
}

std::int64_t VerifierRig::count(io::Reason reason) const {
  return verifier->block().rejections[static_cast<std::size_t>(reason)].load();
}

}  // namespace freeflex::testing
