// The thread that judges the motion beside the simulation. The simulation passes it commands and states, and
// reads the verdict on tick k at tick k + D, where D is fixed in the plan (PlanShadow::delay_ticks). So the
// verdicts of a tick are the same in every run.
#pragma once

#include <atomic>
#include <cstdint>
#include <span>

#include "core/error/judgement.hpp"
#include "core/motion.hpp"
#include "service/queue.hpp"

namespace freeflex::service {

/// Holds the verdicts on one tick.
struct JudgedTick {
  Verdict now, worst;
  std::int64_t tick = -1, epoch = -1;  // of the last state that was judged
};

/// Passes commands and states from the simulation thread to the verdict thread, and verdicts back. No
/// function waits, takes a lock or allocates memory, except run(), which sleeps.
class VerdictThread {
 public:
  /// \pre plan.verdict has a shadow
  explicit VerdictThread(const Plan& plan);

  // the simulation thread:
  /// Passes the commands of a tick. Must be called before take() of the next tick.
  void command(std::int64_t tick, std::span<const ForceCommand> commands) noexcept;
  /// Passes the state at the start of an epoch and after every tick, and takes the verdict that is due.
  void take(const Motion& motion) noexcept;
  /// Returns whether the verdict that is due at a tick has been computed. A loop that is not paced waits for
  /// it.
  bool is_ready(std::int64_t tick) const noexcept;
  const JudgedTick& judged() const noexcept { return judged_; }

  // any thread:
  /// Returns the number of comparisons that came too late and were skipped.
  std::int64_t num_late() const noexcept { return num_late_.load(std::memory_order_relaxed); }
  /// Returns true if the thread fell so far behind that nothing is judged until the next reset. The reset
  /// must find room in the queue of states, which the thread makes within about a millisecond.
  bool has_fallen_behind() const noexcept { return has_fallen_behind_.load(std::memory_order_relaxed); }

  // the verdict thread:
  /// Judges until request_stop(). Sleeps while there is nothing to judge.
  void run() noexcept;
  void request_stop() noexcept { is_stopping_.store(true, std::memory_order_relaxed); }

 private:
  struct TickCommand {
    std::int64_t tick = 0;
    ForceCommand command{};
  };
  bool needs(const Motion& motion) const noexcept;
  void take_due(std::int64_t tick) noexcept;
  bool judge_next() noexcept;

  const PlanShadow& shadow_;
  Queue<TickCommand> commands_;
  Queue<MotionState> states_;
  Queue<JudgedTick> results_;
  std::atomic<std::int64_t> taken_tick_{-1}, taken_epoch_{-1};  // of the last state that the thread has taken
  std::atomic<bool> is_stopping_{false};
  std::atomic<std::int64_t> num_late_{0};
  std::atomic<bool> has_fallen_behind_{false};
  // of the simulation thread
  std::int64_t epoch_ = -1, epoch_start_ = 0, last_fed_ = -1;
  std::int32_t num_unfollowed_ = 0;  // commands since the last state
  JudgedTick judged_;
  // of the verdict thread
  Judgement judgement_;
};

}  // namespace freeflex::service
