#include "service/loop.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>

#include "core/step/vector.hpp"
#include "freeflex_msgs/applied_t.hpp"

namespace freeflex::service {

namespace {

constexpr std::int64_t kIdleLockstep = 100'000;          // [ns] time between checks of the ring in lockstep
constexpr std::int64_t kIdleHolding = 1'000'000;         // [ns] time between checks of the ring while holding
constexpr std::int64_t kLongestSleep = 50'000'000;       // [ns] longest sleep between checks of the ring
constexpr std::int64_t kReaderWait = 20'000;             // [ns] time between checks of a full queue
constexpr std::int64_t kReaderPatience = 1'000'000'000;  // [ns] longest wait for room in a full queue
constexpr std::int64_t kReofferEvery = 1'000'000'000;    // [ns] time between repeated states while holding

}  // namespace

std::optional<Timing> parse_timing(const std::string& text) {
  if (text == "realtime") return Timing{};
  if (text == "lockstep") return Timing{Timing::Kind::kLockstep, 1.0};
  if (text == "asap") return Timing{Timing::Kind::kAsap, 1.0};
  const std::string prefix = "scaled=";
  if (!text.starts_with(prefix)) return {};
  double scale = 0.0;
  const char* const end = text.data() + text.size();
  const auto [rest, error] = std::from_chars(text.data() + prefix.size(), end, scale);
  if (error != std::errc{} || rest != end || !std::isfinite(scale) || scale <= 0.0) return {};
  return Timing{Timing::Kind::kScaled, scale};
}

std::string timing_name(const Timing& timing) {
  switch (timing.kind) {
    case Timing::Kind::kRealtime:
      return "realtime";
    case Timing::Kind::kLockstep:
      return "lockstep";
    case Timing::Kind::kAsap:
      return "asap";
    case Timing::Kind::kScaled:
      break;
  }
  std::array<char, 32> digits{};
  const auto [end, error] = std::to_chars(digits.data(), digits.data() + digits.size(), timing.scale);
  return "scaled=" + std::string(digits.data(), end);
}

Simulation::Simulation(const Plan& plan, const LoopSettings& settings, Clock& clock, InboundRing& inbound,
                       Output& output, VerdictThread* verdicts)
    : plan_(plan),
      settings_(settings),
      clock_(clock),
      inbound_(inbound),
      output_(output),
      names_(std::make_unique<io::NameTable>()),
      motion_(plan, kMotionAlone),
      verdicts_(verdicts),
      command_queue_(settings.limits.sender_share, io::max_hold_ticks(plan)),
      pacer_(plan.period / settings.timing.scale * 1e9),
      inbound_entry_(std::make_unique<InboundEntry>()),
      applied_entry_(std::make_unique<AppliedEntry>()) {
  io::fill_name_table(plan, *names_);
  io::limit_holds(plan, *names_);
  free_.take(motion_);
  if (verdicts_ != nullptr) verdicts_->take(motion_);
  for (std::size_t i = 0; i < every_.size(); ++i) every_[i] = io::ticks_between(plan.rates[i], plan.period);
}

void Simulation::run() noexcept {
  const bool runs = settings_.timing.kind != Timing::Kind::kLockstep && !settings_.starts_holding;
  set_steps(runs ? kForever : 0);
  offer_all();
  while (!is_stopping()) {
    const std::optional<std::int64_t> woken_ns = is_advancing() ? wait_for_tick() : wait_idle();
    drain();
    if (woken_ns && is_advancing() && !is_stopping()) advance(*woken_ns);
    if (output_.is_status_wanted.exchange(false, std::memory_order_acquire)) offer_status();
  }
  offer_all();
  offer_status();
  output_.is_finished.store(true, std::memory_order_release);
}

/// Returns the mode that STATUS publishes.
Mode Simulation::mode() const noexcept {
  if (is_stopping()) return Mode::kStopped;
  if (has_faulted_) return Mode::kFault;
  return is_advancing() ? Mode::kRunning : Mode::kHolding;
}

/// Sleeps until the deadline of the next tick and returns the time of waking [ns]. If the deadline is far
/// ahead, sleeps only a part of the time and returns nullopt, so that a loop with slow ticks can handle
/// commands.
std::optional<std::int64_t> Simulation::wait_for_tick() noexcept {
  if (!settings_.timing.is_paced()) return clock_.now_ns();
  const std::int64_t deadline_ns = pacer_.deadline_ns();
  if (const std::int64_t now_ns = clock_.now_ns(); deadline_ns - now_ns > kLongestSleep) {
    clock_.sleep_until(now_ns + kLongestSleep);
    return {};
  }
  clock_.sleep_until(deadline_ns);
  const std::int64_t woken_ns = clock_.now_ns();
  output_.lateness.record(woken_ns - deadline_ns);
  pacer_.wake(woken_ns);
  return woken_ns;
}

/// Sleeps for a moment while the simulation holds, and offers its state again every kReofferEvery. Returns
/// nullopt, because no tick is due.
std::optional<std::int64_t> Simulation::wait_idle() noexcept {
  const bool is_lockstep = settings_.timing.kind == Timing::Kind::kLockstep;
  const std::int64_t now_ns = clock_.now_ns();
  if (now_ns >= next_reoffer_ns_) offer_all();
  clock_.sleep_until(now_ns + (is_lockstep ? kIdleLockstep : kIdleHolding));
  return {};
}

/// A loop that is not paced would run ahead of the verdict thread, so it waits for the verdict that is due,
/// but not for longer than kReaderPatience.
void Simulation::wait_for_verdict() noexcept {
  if (settings_.timing.is_paced()) return;
  const std::int64_t give_up_ns = clock_.now_ns() + kReaderPatience;
  while (!verdicts_->is_ready(motion_.tick()) && clock_.now_ns() < give_up_ns)
    clock_.sleep_until(clock_.now_ns() + kReaderWait);
}

/// Sets the number of ticks to execute. If the loop was holding and now advances, makes the next tick due
/// now, so that no deadline lies in the past.
void Simulation::set_steps(std::int64_t steps) noexcept {
  if (!is_advancing() && steps != 0) pacer_.rebase(clock_.now_ns());
  steps_left_ = steps;
}

/// Executes one tick.
void Simulation::advance(std::int64_t woken_ns) noexcept {
  const std::span<const ForceCommand> due = command_queue_.take_due(motion_.tick());
  const std::int64_t tick = motion_.tick();
  const StepReport& report = motion_.advance(due);
  const auto num_clearances = index(command_queue_.num_due_clearances());
  if (report.status != StepStatus::kOk) return enter_fault(due.subspan(num_clearances), report);
  // the entries follow the order of the step: ends, then clearances, then commands
  for (int i = 0; i < report.num_expiries; ++i) {
    const Expiry& expiry = report.expiries[index(i)];
    std::int32_t kind = freeflex_msgs::applied_t::EXPIRED;
    if (expiry.was_lease) kind = freeflex_msgs::applied_t::LEASE_LOST;
    applied_entry_->tick = tick;
    push_applied(kind, nullptr, &expiry);
  }
  for (const ForceCommand& command : due.first(num_clearances)) {
    const Expiry end{.sender = command.sender, .slot = command.slot, .sequence = command.sequence};
    applied_entry_->tick = tick;
    push_applied(freeflex_msgs::applied_t::CLEARED, nullptr, &end);
  }
  for (const ForceCommand& command : due.subspan(num_clearances)) {
    applied_entry_->tick = tick;
    push_applied(freeflex_msgs::applied_t::FORCE, &command, nullptr);
  }
  free_.take(motion_);
  if (verdicts_ != nullptr) {
    verdicts_->command(tick, due);  // not before the step, because commands of a failed step never act
    wait_for_verdict();
    verdicts_->take(motion_);
  }
  output_.tick.store(motion_.tick(), std::memory_order_relaxed);
  if (steps_left_ != kForever) --steps_left_;
  if (settings_.until_tick > 0 && motion_.tick() >= settings_.until_tick) request_stop();
  offer_due();
  const std::int64_t end_ns = clock_.now_ns();
  output_.compute.record(end_ns - woken_ns);
  if (!command_queue_.due_received_ns().empty()) {
    const std::int64_t end_boot_ns = clock_.boot_ns();
    for (const std::int64_t received_ns : command_queue_.due_received_ns())
      output_.command_latency.record(end_boot_ns - received_ns);
  }
  command_queue_.settle(report);
  if (!settings_.timing.is_paced()) return;
  pacer_.finish_tick(end_ns);
  output_.num_overruns.store(pacer_.num_overruns(), std::memory_order_relaxed);
  output_.slip_gap_ns.store(pacer_.slip_gap_ns(), std::memory_order_relaxed);
  output_.num_slips.store(pacer_.num_slips(), std::memory_order_release);
}

/// Adds an entry to APPLIED. The command queue and reset() have reserved a place for it in the ring.
void Simulation::push_applied(std::int32_t kind, const ForceCommand* command, const Expiry* expiry) noexcept {
  applied_entry_->sequence = applied_count_++;
  applied_entry_->kind = kind;
  if (command != nullptr) applied_entry_->command = *command;
  if (expiry != nullptr) applied_entry_->expiry = *expiry;
  output_.applied.try_push(*applied_entry_);
}

/// Puts the loop into Mode::kFault, in which it executes no tick. The loop keeps the state before the failed
/// step, and the commands of the tick keep waiting, so that a reset answers them.
void Simulation::enter_fault(std::span<const ForceCommand> due, const StepReport& report) noexcept {
  has_faulted_ = true;
  ran_before_fault_ = steps_left_ == kForever;
  set_steps(0);
  fault_ = {.tick = motion_.tick(),
            .num_commands = static_cast<std::int32_t>(due.size()),
            .status = report.status,
            .joint_point = report.joint_point};
  if (!due.empty()) {
    fault_.sender = due.back().sender;
    fault_.sequence = due.back().sequence;
  }
  offer_all();
}

/// \param state  that of the motion
void Simulation::fill(const State& state, Snapshot& draft) const noexcept {
  draft.motion = state;  // copies only the MotionState, for which the draft has memory
  draft.applied_count = applied_count_;
  draft.free = free_;
  draft.num_slots = state.num_slots;
  draft.mode = mode();
  draft.fault = fault_;
  if (verdicts_ == nullptr) {
    draft.not_judged = settings_.not_judged;
    return;
  }
  draft.not_judged = verdicts_->has_fallen_behind() ? NotJudged::kBehind
                     : verdicts_->judged().tick < 0 ? NotJudged::kNotYet
                                                    : NotJudged::kJudged;
  draft.verdict = verdicts_->judged().now;
  draft.worst = verdicts_->judged().worst;
  draft.num_late = verdicts_->num_late();
}

/// Offers a snapshot on a channel. If the queue is full, a paced loop drops the snapshot and counts the loss,
/// but an unpaced loop first waits up to kReaderPatience.
void Simulation::offer_motion(std::size_t channel) noexcept {
  Queue<Snapshot>& queue = output_.motion[channel];
  Snapshot* draft = queue.draft();
  if (draft == nullptr && !settings_.timing.is_paced()) {
    const std::int64_t give_up_ns = clock_.now_ns() + kReaderPatience;
    for (std::int64_t now_ns = clock_.now_ns(); draft == nullptr && now_ns < give_up_ns;
         now_ns = clock_.now_ns()) {
      clock_.sleep_until(now_ns + kReaderWait);
      draft = queue.draft();
    }
  }
  if (draft == nullptr) {
    std::atomic<std::int64_t>& count = output_.num_dropped[channel];
    count.store(count.load(std::memory_order_relaxed) + 1, std::memory_order_relaxed);
    return;
  }
  fill(channel == kPointsChannel ? motion_.state_of_points() : motion_.state(), *draft);
  queue.offer();
}

void Simulation::offer_status() noexcept {
  Snapshot& draft = output_.status.draft();
  fill(motion_.state(), draft);
  output_.status.offer();
}

/// Offers a snapshot on every channel. Called at the start, at the end, after a reset, in a fault, at the end
/// of a STEP, and periodically while holding.
void Simulation::offer_all() noexcept {
  for (std::size_t i = 0; i < every_.size(); ++i)
    if (every_[i] > 0) offer_motion(i);
  next_reoffer_ns_ = clock_.now_ns() + kReofferEvery;
}

/// The loop calls this function after a tick. Offers a snapshot on the channels that are due. After the last
/// tick of a STEP all channels are due.
void Simulation::offer_due() noexcept {
  if (!is_advancing()) return offer_all();
  for (std::size_t i = 0; i < every_.size(); ++i)
    if (every_[i] > 0 && motion_.tick() % every_[i] == 0) offer_motion(i);
}

}  // namespace freeflex::service
