// The error budget. Shadows are stepped in parallel with the state on better plans, and the errors of the
// state are estimated from the distances between state and shadows (THEORY 12.22 to 12.27). Like the step,
// these functions allocate nothing, do not call libm, and give the same bits everywhere.
#pragma once

#include "core/error/verdict.hpp"
#include "core/step/step.hpp"

namespace freeflex {

/// Ratio of the estimated error to the distance from the best shadow. The ratio is above 1 because the shadow
/// also has errors. It was determined with 200 random scenes and is tested with 200 other scenes
/// (tests/tools/estimates_test).
inline constexpr double kCover = 1.25;

/// Holds the shadows, and the tick and epoch of the state to which they belong. If the shadows are used with
/// a state of another tick or epoch, they restart from that state, and the age of the estimate starts from
/// zero. Therefore no order of calls gives an estimate that belongs to another state. make_budget allocates
/// all memory.
struct Budget {
  struct Shadow {
    State state;
    Workspace workspace;
  };
  std::vector<Shadow> shadows;  // shadows in the order of PlanBudget::shadows
  bool is_lost = false;
  bool points_give_modes = true;                 // false: the scene has bodies, so the shadows copy the
                                                 // elastic coordinates of the state
  double rotation = 0.0;                         // [rad] rotation angle of the body since sync_tick
  double fast_motion = 0.0, all_motion = 0.0;    // [m^2] sums over ticks and modes: of (q' / omega)^2 of the
                                                 // unresolved modes; of q^2 of all modes
  std::int64_t sync_tick = 0;                    // tick at which the shadows were last set to the state
  std::int64_t tick = -1, epoch = -1;            // tick and epoch of the state to which the shadows belong;
                                                 // -1: not set yet
  std::vector<Vec3> V, V_dot, V_other, scratch;  // (num_points)
};
Budget make_budget(const Plan& plan);

/// Advances the state by one tick, with the same bits as the step without a budget. Then advances the shadows
/// under the commands in the slots of the state. The shadows restart from the state at the first call, after
/// a reset, at the end of a horizon, and if the state was stepped without them. A failed step leaves the
/// shadows unchanged. A budget without shadows costs one comparison per tick. Allocates nothing.
void step(const Plan& plan, State& state, const Inputs& inputs, Workspace& workspace, Budget& budget,
          StepReport& report) noexcept;

/// Returns the present estimates. If the shadows do not belong to the state, they are first set to it, and
/// the age is zero. In this case the errors are zero, except that at the start of an epoch they include the
/// part of the initial state that the plan omits. Allocates nothing.
BudgetReading read_budget(const Plan& plan, const State& state, Budget& budget) noexcept;

}  // namespace freeflex
