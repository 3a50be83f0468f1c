// Commands at the loop: what is taken off the ring, decided and answered.
#include "freeflex_msgs/applied_t.hpp"
#include "freeflex_msgs/control_t.hpp"
#include "service/loop.hpp"

namespace freeflex::service {

using freeflex_msgs::control_t;
using io::Reason;

/// Takes commands in the order they came. A command is only taken while its answer, and the answers that a
/// reset would owe to the pending ones, have room; otherwise it waits where it is.
void Simulation::drain() noexcept {
  for (int i = 0; i < kMaxDrained; ++i) {
    if (output_.acks.num_free() < desk_.num_pending() + 2) return;
    if (!inbound_.try_pop(*inbound_entry_)) return;
    // the memory is the ingress's: nothing in it is trusted, and an entry of another kind is dropped
    switch (inbound_entry_->kind) {
      case InboundKind::kForce:
        if (io::is_sane(inbound_entry_->force, *names_))
          handle_force(inbound_entry_->force, inbound_entry_->received_ns);
        break;
      case InboundKind::kControl:
        if (io::is_sane(inbound_entry_->control)) handle_control(inbound_entry_->control);
        break;
    }
  }
}

void Simulation::handle_force(const ForceCommand& command, std::int64_t received_ns) noexcept {
  CommandDesk::Decision decision{Reason::kWrongMode, state_.tick};
  if (!has_faulted_) decision = desk_.submit(command, received_ns, state_.tick, output_.applied.num_free());
  answer({.sender = command.sender,
          .sequence = command.sequence,
          .reason = decision.reason,
          .tick = decision.tick,
          .found = command.start_tick});
}

void Simulation::handle_control(const io::ControlCommand& control) noexcept {
  const Reason reason = obey(control);
  answer({.sender = control.sender,
          .sequence = control.sequence,
          .reason = reason,
          .tick = state_.tick,
          .command = control.command,
          .found = control.count,
          .most = most_count(control.command)});
}

/// Elastic modes for SHAPES, pages for SCENE, else 0.
std::int64_t Simulation::most_count(std::int32_t command) const noexcept {
  if (command == control_t::SHAPES) return active_plan(plan_, state_).num_elastic;
  return command == control_t::SCENE ? output_.num_scene_pages[state_.is_wide ? 1 : 0] : 0;
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
      // also ends the steps of a STEP that are left
      if (is_advancing()) {
        set_steps(0);
        offer_all();
      }
      return Reason::kAccepted;
    case control_t::STEP:
      if (is_free_running) return Reason::kWrongMode;
      set_steps(steps_left_ + control.count);
      return Reason::kAccepted;
    case control_t::SHAPES:
    case control_t::SCENE:
      if (control.count > most_count(control.command)) return Reason::kBadControl;
      return output_.requests.try_push(
                 {control.command, static_cast<std::int32_t>(control.count), state_.is_wide})
                 ? Reason::kAccepted
                 : Reason::kQueueFull;
    default:
      return Reason::kBadControl;
  }
}

/// Back to the initial state at the same tick, in a new epoch; a fault is over.
Reason Simulation::reset() noexcept {
  if (output_.applied.num_free() < 1) return Reason::kQueueFull;
  for (int i = 0; i < desk_.num_pending(); ++i) {
    const ForceCommand& command = desk_.pending(i);
    answer({.sender = command.sender,
            .sequence = command.sequence,
            .reason = Reason::kEpochEnded,
            .tick = state_.tick,
            .found = command.start_tick});
  }
  desk_.clear();
  reset_state(plan_, state_);
  last_load_tick_ = state_.tick;
  applied_entry_->tick = state_.tick;
  push_applied(freeflex_msgs::applied_t::RESET, nullptr, nullptr);
  if (has_faulted_) {
    has_faulted_ = false;
    fault_ = {};
    set_steps(ran_before_fault_ ? kForever : 0);
  }
  offer_all();
  return Reason::kAccepted;
}

/// The drain made sure that the ring takes it.
void Simulation::answer(AckEntry entry) noexcept {
  entry.mode = mode();
  output_.acks.try_push(entry);
  std::atomic<std::int64_t>& count = entry.reason == Reason::kAccepted
                                         ? output_.num_accepted
                                         : output_.num_rejected[static_cast<std::size_t>(entry.reason)];
  count.store(count.load(std::memory_order_relaxed) + 1, std::memory_order_relaxed);
}

}  // namespace freeflex::service
