#include "service/verdict_thread.hpp"

#include <algorithm>
#include <chrono>
#include <thread>

namespace freeflex::service {
namespace {

constexpr std::size_t kMostCommands = 1024;  // that may wait, 12 MB
// Number of commands after which a state follows that the shadow does not read, so that the thread takes the
// commands. Without it the commands of a long step, or of a horizon that is not judged, would wait for its
// end.
constexpr std::int32_t kMostUnfollowed = 256;
// [B] most memory of the states that wait, and least number of them
constexpr std::size_t kStateBytes = 64'000'000, kLeastStates = 8;
constexpr std::chrono::milliseconds kIdle{1};

/// Returns a state with memory for a motion on the plan and on its fallback plan. Copies have the same
/// memory.
MotionState roomy_state(const Plan& plan) {
  MotionState state = make_state(plan);
  for (Array* v : modal_arrays(state)) v->resize(index(plan_of_all_modes(plan).num_padded));
  return state;
}

/// Returns the number of states that may wait: those of one horizon and of the delay.
std::size_t num_states(const Plan& plan, const PlanShadow& shadow) {
  const auto wanted =
      static_cast<std::size_t>((shadow.horizon_ticks + shadow.delay_ticks) / shadow.ticks + 2);
  const std::size_t bytes =
      16 * sizeof(double) * index(plan_of_all_modes(plan).num_padded) + sizeof(MotionState);
  return std::clamp(kStateBytes / bytes, kLeastStates, std::max(wanted, kLeastStates));
}

/// Returns the number of results that may wait: those of all states, and those that are not due yet.
std::size_t num_results(std::size_t most_states, const PlanShadow& shadow) {
  return std::max(most_states, static_cast<std::size_t>(shadow.delay_ticks / shadow.ticks + 2)) + 2;
}

}  // namespace

VerdictThread::VerdictThread(const Plan& plan)
    : shadow_(plan.verdict.shadows.front()),
      commands_({}, kMostCommands),
      states_(roomy_state(plan), num_states(plan, shadow_)),
      results_({}, num_results(states_.num_places(), shadow_)),
      judgement_(plan) {}

/// Returns whether the shadow reads a state: at the start of each horizon, and in the horizons that are
/// judged after each of its steps. The same rule as Shadow::needs(), from the tick alone.
bool VerdictThread::needs(const Motion& motion) const noexcept {
  const std::int64_t age = motion.tick() - epoch_start_;
  if (motion.epoch() != epoch_ || age % shadow_.horizon_ticks == 0) return true;
  return age / shadow_.horizon_ticks % shadow_.every == 0 && age % shadow_.ticks == 0;
}

void VerdictThread::command(std::int64_t tick, std::span<const ForceCommand> commands) noexcept {
  for (const ForceCommand& each : commands) {
    if (has_fallen_behind()) return;
    TickCommand* const draft = commands_.draft();
    if (draft == nullptr) {
      has_fallen_behind_.store(true, std::memory_order_relaxed);
      return;
    }
    draft->tick = tick;
    draft->command = each;
    commands_.offer();
    ++num_unfollowed_;
  }
}

void VerdictThread::take(const Motion& motion) noexcept {
  const bool is_needed = needs(motion);
  if (motion.epoch() != epoch_) {
    epoch_ = motion.epoch();
    epoch_start_ = motion.tick();
    judged_ = {};
    has_fallen_behind_.store(false, std::memory_order_relaxed);
  }
  take_due(motion.tick());
  if (has_fallen_behind() || (!is_needed && num_unfollowed_ < kMostUnfollowed)) return;
  MotionState* const draft = states_.draft();
  if (draft == nullptr) {  // a shadow cannot start within an epoch
    has_fallen_behind_.store(true, std::memory_order_relaxed);
    return;
  }
  *draft = motion.state();
  states_.offer();
  last_fed_ = motion.tick();
  num_unfollowed_ = 0;
}

/// Takes the verdicts that are due at a tick, and drops those that came too late.
void VerdictThread::take_due(std::int64_t tick) noexcept {
  while (const JudgedTick* const result = results_.front()) {
    const std::int64_t due = result->tick + shadow_.delay_ticks;
    if (due > tick && result->epoch == epoch_) return;
    if (result->epoch == epoch_ && due == tick)
      judged_ = *result;
    else if (result->epoch == epoch_)
      num_late_.fetch_add(1, std::memory_order_relaxed);
    results_.drop();
  }
}

bool VerdictThread::is_ready(std::int64_t tick) const noexcept {
  if (has_fallen_behind() || tick - shadow_.delay_ticks < epoch_start_) return true;
  const std::int64_t due = std::min(last_fed_, tick - shadow_.delay_ticks);
  return taken_epoch_.load(std::memory_order_acquire) == epoch_ &&
         taken_tick_.load(std::memory_order_acquire) >= due;
}

void VerdictThread::run() noexcept {
  while (!is_stopping_.load(std::memory_order_relaxed))
    if (!judge_next()) std::this_thread::sleep_for(kIdle);
}

/// Takes the next state with the commands before it. Returns false if there is none.
bool VerdictThread::judge_next() noexcept {
  const MotionState* const next = states_.front();
  if (next == nullptr) return false;
  // the states of an epoch that is not judged any more are dropped, which makes room for the next epoch
  const bool is_judged = !has_fallen_behind();
  const std::int64_t tick = next->tick;
  while (const TickCommand* const command = commands_.front()) {
    if (command->tick >= tick) break;
    if (is_judged) judgement_.command(command->tick, {&command->command, 1});
    commands_.drop();
  }
  if (is_judged && judgement_.take(*next)) {
    if (JudgedTick* const draft = results_.draft(); draft != nullptr) {
      *draft = {judgement_.now(), judgement_.worst(), tick, next->epoch};
      results_.offer();
    } else {
      num_late_.fetch_add(1, std::memory_order_relaxed);
    }
  }
  taken_tick_.store(tick, std::memory_order_release);
  taken_epoch_.store(next->epoch, std::memory_order_release);
  states_.drop();
  return true;
}

}  // namespace freeflex::service
