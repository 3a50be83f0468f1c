// The live error budget: shadows that step beside the state on better plans, and how far it is from them
// (THEORY X96-X98). Same rules as the step.
#pragma once

#include "core/step/step.hpp"

namespace freeflex {

/// How far one state is from another, over all points.
struct ErrorSize {
  double position = 0.0;      // [m] root mean square over the points
  double attitude = 0.0;      // [rad]
  double elastic = 0.0;       // [-] |V - V*| / |V*|, body axes
  double displacement = 0.0;  // [m] |V - V*|, root mean square over the points
};

/// What the state is off by since the shadows last stood where it does. Parts do not add up exactly: they are
/// differences of motions.
struct BudgetReading {
  double age = 0.0;  // [s] of motion that the errors have grown over, at most PlanBudget::horizon
  bool is_lost =
      false;  // the shadow of the full equations left the numbers: no estimate until the next horizon
  // [rad] by which the body turned, times the share of the vibration that is in modes which the best shadow
  // does not resolve: as large may be what it does not see   (X98)
  double unresolved = 0.0;
  ErrorSize total;                           // estimate: kCover times the distance from the best shadow (X97)
  ErrorSize integration, truncation, model;  // distances: period; modes left out; rung
};

/// Factor between the distance from the best shadow and the estimate. Set on 200 random scenes, shown on 200
/// others (tests/tools/estimates_test): the shadow's own errors stand in it.
inline constexpr double kCover = 1.25;

/// State of the shadows, and which state they stand beside, known by its tick and epoch; for any other they
/// start anew. So no order of calls gives a stale estimate: one that misses ticks gives a young one, and its
/// age says so. Allocated by make_budget; nothing after.
struct Budget {
  struct Shadow {
    State state;
    Workspace workspace;
  };
  std::vector<Shadow> shadows;  // those of PlanBudget::shadows
  bool is_lost = false;
  bool points_tell_modes = true;                 // false: bodies, whose modes the shadows take as they are
  double turned = 0.0;                           // [rad] since then
  double fast_motion = 0.0, all_motion = 0.0;    // [m^2] sums of (q' / omega)^2 of unresolved modes, of q^2
  std::int64_t sync_tick = 0;                    // at which they last stood where the state does
  std::int64_t tick = -1, epoch = -1;            // of the state that they stand beside; -1: none yet
  std::vector<Vec3> V, V_dot, V_other, scratch;  // (num_points)
};
Budget make_budget(const Plan& plan);

/// Advances state by one tick as the step without a budget does, to the bit, and then the shadows, under the
/// same slots. They start from the state at first, after a reset, when the horizon is over, and when the
/// state was stepped without them. When the step fails they stay as they are. A budget without shadows costs
/// one look at it. Allocates nothing.
void step(const Plan& plan, State& state, const Inputs& inputs, Workspace& workspace, Budget& budget,
          StepReport& report) noexcept;

/// The errors as they stand, at any time; of age zero where the shadows were not beside the state, which they
/// join. An error of that age is what the plan leaves out of its initial state. Allocates nothing.
BudgetReading read_budget(const Plan& plan, const State& state, Budget& budget) noexcept;

}  // namespace freeflex
