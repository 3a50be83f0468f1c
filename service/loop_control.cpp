// Command handling of the simulation loop: takes commands from the rings, accepts or rejects them, and queues
// the answers.
#include "freeflex_msgs/applied_t.hpp"
#include "freeflex_msgs/control_t.hpp"
#include "service/loop.hpp"

namespace freeflex::service {

using freeflex_msgs::control_t;
using io::Reason;

/// Takes the commands of the operator and then those from the bus, each in order of arrival. A command is
/// taken only if the ring of answers has room for its answer and for the answers that a reset would owe to
/// the waiting commands. Otherwise the command stays in the ring.
void Simulation::drain() noexcept {
  InboundEntry& entry = *inbound_entry_;
  // the operator's commands come first, so that no traffic on the bus delays them. The loop below always
  // leaves room for the answers that a reset owes to commands from the bus
  while (output_.operator_acks.num_free() >= command_queue_.num_pending() + 2 &&
         output_.operator_commands.try_pop(entry)) {
    if (entry.kind == InboundKind::kForce)
      handle_force(entry.force, entry.received_ns);
    else
      handle_control(entry.control, entry.received_ns);
  }
  for (int i = 0; i < kMaxDrained; ++i) {
    if (output_.acks.num_free() < command_queue_.num_pending() + 2) return;
    if (!inbound_.try_pop(entry)) return;
    // the ingress writes this memory, so no value in this memory is trusted. A reception time that is
    // negative or in the future is replaced by the present time, and an entry of any other kind than the
    // first two is dropped
    const std::int64_t now_ns = clock_.boot_ns();
    if (entry.received_ns < 0 || entry.received_ns > now_ns) entry.received_ns = now_ns;
    switch (entry.kind) {
      case InboundKind::kForce:
        if (io::is_sane(entry.force, *names_) && !is_operator(entry.force.sender))
          handle_force(entry.force, entry.received_ns);
        break;
      case InboundKind::kControl:
        if (io::is_sane(entry.control) && !is_operator(entry.control.sender))
          handle_control(entry.control, entry.received_ns);
        break;
      case InboundKind::kRawForce:
      case InboundKind::kRawControl:
        break;
    }
  }
}

/// Rejects a command that waited longer than max_age for its decision, because the sender may no longer want
/// the command. Returns true if the command was rejected.
template <class Command>
bool Simulation::refuse_old(const Command& command, std::int64_t received_ns) noexcept {
  const std::int64_t age_ns = clock_.boot_ns() - received_ns;
  if (static_cast<double>(age_ns) <= settings_.limits.max_age * 1e9) return false;
  answer({.sender = command.sender,
          .sequence = command.sequence,
          .reason = Reason::kTooOld,
          .tick = motion_.tick(),
          .found = age_ns / 1'000'000});
  return true;
}

void Simulation::handle_force(const ForceCommand& command, std::int64_t received_ns) noexcept {
  if (refuse_old(command, received_ns)) return;
  CommandQueue::Decision decision{Reason::kWrongMode, motion_.tick(), command.start_tick};
  if (!has_faulted_)
    decision = command_queue_.submit(command, received_ns, motion_.tick(), output_.applied.num_free());
  answer({.sender = command.sender,
          .sequence = command.sequence,
          .reason = decision.reason,
          .tick = decision.tick,
          .found = decision.found,
          .most = decision.most});
}

void Simulation::handle_control(const io::ControlCommand& control, std::int64_t received_ns) noexcept {
  if (refuse_old(control, received_ns)) return;
  const bool is_of_others = control.command == control_t::CLEAR && !is_operator(control.sender);
  const Reason reason = is_of_others && !settings_.may_bus_clear ? Reason::kNotGranted : obey(control);
  answer({.sender = control.sender,
          .sequence = control.sequence,
          .reason = reason,
          .tick = motion_.tick(),
          .command = control.command,
          .found = control.count,
          .most = most_count(control.command)});
}

/// Returns the largest allowed count: the number of elastic modes for SHAPES, the number of pages for SCENE,
/// else 0.
std::int64_t Simulation::most_count(std::int32_t command) const noexcept {
  if (command == control_t::SHAPES) return active_plan(plan_, motion_.state()).num_elastic;
  return command == control_t::SCENE ? output_.num_scene_pages[motion_.uses_fallback() ? 1 : 0] : 0;
}

Reason Simulation::obey(const io::ControlCommand& control) noexcept {
  const bool is_lockstep = settings_.timing.kind == Timing::Kind::kLockstep;
  const bool is_free_running = steps_left_ == kForever;
  switch (control.command) {
    case control_t::STOP:
      request_stop();
      return Reason::kAccepted;
    case control_t::RESET:
      return reset();
    default:
      if (has_faulted_) return Reason::kWrongMode;
  }
  switch (control.command) {
    case control_t::RUN:
      if (is_lockstep) return Reason::kWrongMode;
      set_steps(kForever);
      return Reason::kAccepted;
    case control_t::HOLD:
      // also cancels the remaining ticks of a STEP
      if (is_advancing()) {
        set_steps(0);
        offer_all();
      }
      return Reason::kAccepted;
    case control_t::STEP:
      if (is_free_running) return Reason::kWrongMode;
      set_steps(steps_left_ + control.count);
      return Reason::kAccepted;
    case control_t::CLEAR:
      return clear_senders(control.target);
    case control_t::SHAPES:
    case control_t::SCENE:
      if (control.count > most_count(control.command)) return Reason::kBadControl;
      return output_.requests.try_push(
                 {control.command, static_cast<std::int32_t>(control.count), motion_.uses_fallback()})
                 ? Reason::kAccepted
                 : Reason::kQueueFull;
    default:
      return Reason::kBadControl;
  }
}

/// Ends the loads in the slots of the senders that match the target with the next step. Removes and answers
/// the waiting commands of these senders.
Reason Simulation::clear_senders(const std::array<char, kSenderSize>& target) noexcept {
  if (!command_queue_.can_clear(output_.applied.num_free())) return Reason::kQueueFull;
  for (int i = 0; i < command_queue_.num_pending(); ++i) {
    const ForceCommand& command = command_queue_.pending(i);
    if (!is_target(target, command.sender)) continue;
    answer({.sender = command.sender,
            .sequence = command.sequence,
            .reason = Reason::kCleared,
            .tick = motion_.tick(),
            .found = command.start_tick});
  }
  command_queue_.clear_senders(target);
  return Reason::kAccepted;
}

/// Sets the motion back to the initial state at the same tick, in a new epoch. Ends a fault.
Reason Simulation::reset() noexcept {
  if (output_.applied.num_free() < 1) return Reason::kQueueFull;
  for (int i = 0; i < command_queue_.num_pending(); ++i) {
    const ForceCommand& command = command_queue_.pending(i);
    answer({.sender = command.sender,
            .sequence = command.sequence,
            .reason = Reason::kEpochEnded,
            .tick = motion_.tick(),
            .found = command.start_tick});
  }
  command_queue_.clear();
  motion_.reset();
  free_.take(motion_);
  if (verdicts_ != nullptr) verdicts_->take(motion_);
  applied_entry_->tick = motion_.tick();
  push_applied(freeflex_msgs::applied_t::RESET, nullptr, nullptr);
  if (has_faulted_) {
    has_faulted_ = false;
    fault_ = {};
    set_steps(ran_before_fault_ ? kForever : 0);
  }
  offer_all();
  return Reason::kAccepted;
}

/// Queues an answer and counts it. drain() has ensured that the ring has room for it.
void Simulation::answer(AckEntry entry) noexcept {
  entry.mode = mode();
  if (is_operator(entry.sender))
    output_.operator_acks.try_push(entry);
  else
    output_.acks.try_push(entry);
  std::atomic<std::int64_t>& count = entry.reason == Reason::kAccepted
                                         ? output_.num_accepted
                                         : output_.num_rejected[static_cast<std::size_t>(entry.reason)];
  count.store(count.load(std::memory_order_relaxed) + 1, std::memory_order_relaxed);
}

}  // namespace freeflex::service
