#include "tests/service/rig.hpp"

#include <algorithm>
#include <bit>

namespace freeflex::testing {

Plan octahedron_plan() {
  Scene scene = octahedron();
  publish_everything(scene);
  return plan_of(scene);
}

ForceCommand make_push(std::int64_t sequence, int slot, std::int64_t start_tick, int point, double size) {
  ForceCommand command = make_command(slot, sequence, Axes::kWorld, 60'000);
  command.start_tick = start_tick;
  add_force(command, point, size * Eigen::Vector3d(1.0, 2.0, 3.0));
  return command;
}

Rig::Rig(const Plan& plan, const service::LoopSettings& settings, service::Clock& clock_of_loop,
         std::size_t most_waiting, service::VerdictThread* verdicts)
    : loop_clock(clock_of_loop),
      output(std::make_unique<service::Output>(plan, most_waiting)),
      simulation(plan, settings, clock_of_loop, *inbound, *output, verdicts) {}

bool Rig::push(const ForceCommand& command) {
  auto entry = std::make_unique<service::InboundEntry>();
  entry->received_ns = loop_clock.boot_ns();
  entry->kind = service::InboundKind::kForce;
  entry->force = command;
  return inbound->try_push(*entry);
}

bool Rig::control(std::int32_t command, std::int64_t count, const std::string& target) {
  auto entry = std::make_unique<service::InboundEntry>();
  entry->received_ns = loop_clock.boot_ns();
  entry->kind = service::InboundKind::kControl;
  entry->control.sender = {'t', 'e', 's', 't'};
  entry->control.sequence = next_sequence++;
  entry->control.command = command;
  entry->control.count = count;
  std::copy(target.begin(), target.end(), entry->control.target.begin());
  return inbound->try_push(*entry);
}

void Rig::collect() {
  for (service::AckEntry ack; output->acks.try_pop(ack);) acks.push_back(ack);
  for (service::AppliedEntry entry; output->applied.try_pop(entry);) applied.push_back(entry);
}

const service::Snapshot* Rig::take_motion() {
  bool has_state = false;
  for (std::size_t i = 0; i < output->motion.size(); ++i) {
    const service::Snapshot* const oldest = output->motion[i].front();
    if (oldest == nullptr) continue;
    if (i == kStateChannel) taken = *oldest, has_state = true;
    output->motion[i].drop();
  }
  return has_state ? &taken : nullptr;
}

void Rig::run() {
  simulation.run();
  collect();
}

std::vector<std::uint64_t> motion_bits(const MotionState& motion) {
  std::vector<std::uint64_t> bits{static_cast<std::uint64_t>(motion.tick),
                                  static_cast<std::uint64_t>(motion.epoch)};
  const auto add = [&bits](const auto& values) {
    for (const double value : values) bits.push_back(std::bit_cast<std::uint64_t>(value));
  };
  for (const Vec3* v :
       {&motion.p_WB, &motion.p_WB_low, &motion.v_WB, &motion.v_WB_low, &motion.H_W, &motion.H_W_low})
    add(*v);
  add(motion.q_WB), add(motion.q_WB_low);
  add(motion.q), add(motion.q_low), add(motion.q_dot), add(motion.q_dot_low);
  return bits;
}

}  // namespace freeflex::testing
