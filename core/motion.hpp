// A plan in motion: the state, the memory of the step, and the estimate of the error. Start here to read the
// core.
//
// One tick, Motion::advance:
//
// clang-format off
//   step (core/step/step.cpp)
//
//   ForceCommand ─> slots ─┐                 ┌─> resultant [N], [N m] ──────> frame: p, q, v, H ─┐
//                          ├─> LoadPattern ──┤                                  ^ (*)            ├─> State
//         built-in loads ──┘                 └─> generalized forces Q [N] ────> modes: q, q' ────┘
//
//   error (core/error)
//
//   ForceCommand ─> Shadow, the same motion on a better plan ─> distance from the State ─> Judgement ─> Verdict
//
//   (*) only on the rung `coupled` and above. Below, the elastic motion does not act back on the body.
// clang-format on
//
// The motion depends only on the plan, the state and the commands. Shadow and verdict read the state and
// never change it.
#pragma once

#include <cassert>
#include <optional>
#include <span>
#include <string>

#include "core/error/judgement.hpp"
#include "core/plan.hpp"
#include "core/step/points/reading.hpp"
#include "core/step/step.hpp"

namespace freeflex {

/// Specifies what is computed beside the motion.
enum class Watch {
  kVerdict,      // the verdict, in step with the motion, unless the plan has it off
  kMotionAlone,  // nothing
};
inline constexpr Watch kMotionAlone = Watch::kMotionAlone;

/// Holds everything that a motion needs besides the plan. The constructors allocate all memory; all other
/// functions allocate nothing. The plan must outlive the motion and all its copies.
class Motion {
 public:
  /// Makes a motion at the initial values of the plan, at tick 0 and epoch 0.
  explicit Motion(const Plan& plan, Watch watch = Watch::kVerdict);
  /// Copies a motion. The two motions then give the same bits and the same verdicts for the same commands.
  Motion(const Motion& other);
  Motion& operator=(const Motion&) = delete;

  /// Advances by one tick: removes the slots that expire, applies the commands in their order, steps, and
  /// judges the new state. If the step fails, keeps everything as it was before the tick and reports why.
  /// \pre the commands passed check_command and has_slot_for
  const StepReport& advance(std::span<const ForceCommand> commands = {}) noexcept;
  /// Continues the motion on another plan with the same structure, rung and modes, such as the plan at
  /// another rate. \pre the motion was made with kMotionAlone; `plan` outlives the motion
  void set_plan(const Plan& plan) noexcept;
  /// Returns to the initial values of the plan. The tick continues, and the epoch increases by one.
  void reset() noexcept;

  const Plan& plan() const noexcept { return *plan_; }
  std::int64_t tick() const noexcept { return state_.tick; }
  std::int64_t epoch() const noexcept { return state_.epoch; }
  std::int32_t num_slots() const noexcept { return state_.num_slots; }
  bool uses_fallback() const noexcept { return state_.uses_fallback; }
  /// Returns the state, until the next tick. If the plan integrates points, this call finds the frame and the
  /// modes, which takes several products of all modes and points. The next two functions take less.
  const State& state() const noexcept {
    if (!state_.has_modes) read_modes(*plan_, state_, workspace_);
    return state_;
  }
  /// Returns the state, from which read_point() reads the present motion. If the plan integrates points, its
  /// modes may be those of an earlier tick.
  const State& state_of_points() const noexcept {
    if (!state_.has_frame) read_frame(*plan_, state_);
    return state_;
  }
  /// Returns the motion of all points, if the plan integrates points.
  const PointsAtTick& points() const noexcept {
    read_points(*plan_, state_);
    return state_.points;
  }
  /// Returns the time since the epoch began [s].
  double time() const noexcept {
    return static_cast<double>(state_.tick - state_.epoch_start_tick) * plan_->period;
  }

  /// Returns whether a command, or a load of the scene, acts just before the tick.
  bool is_pushed() const noexcept;

  bool has_verdict() const noexcept { return judgement_.has_value(); }
  /// Returns the verdict on the motion so far. If nothing is judged, its tick is -1.
  const Verdict& verdict() const noexcept { return judgement_ ? judgement_->now() : not_judged_; }
  /// Returns the worst verdict since the epoch began, or the first of several equally bad ones. If every
  /// verdict was `good`, the tick of the returned verdict is -1.
  const Verdict& worst() const noexcept { return judgement_ ? judgement_->worst() : not_judged_; }

 private:
  const Plan* plan_;
  mutable State state_;  // state() finds the frame and the modes only when they are read
  mutable Workspace workspace_;
  StepReport report_;
  std::optional<Judgement> judgement_;
  Verdict not_judged_;
};

/// Returns what to tell a user about a tick that failed with kNoEquilibrium, kNoFrame, kTurnedTooFar or
/// kOpenJoint.
/// \param tick  the last tick
std::string lost_shape_text(const Plan& plan, const StepReport& report, std::int64_t tick);

}  // namespace freeflex
