// The immutable plan that the step reads. It consists of plain arrays, in parts by who reads them. core/plan
// fills these arrays, and plan files hold their bytes. core/plan.hpp adds what other programs read.
#pragma once

#include <cstdint>
#include <vector>

#include "core/step/plan/frame.hpp"
#include "core/step/plan/loads.hpp"
#include "core/step/plan/modes.hpp"
#include "core/step/plan/points.hpp"
#include "core/step/plan/rows.hpp"
#include "core/words.hpp"

namespace freeflex {

struct PlanInitial {
  Vec3 p_WB{};                    // [m] position of the centre of mass
  Vec3 v_WB{};                    // [m/s] velocity of the centre of mass
  Quat q_WB{1.0, 0.0, 0.0, 0.0};  // [-] attitude
  Vec3 w_B{};                     // [rad/s] angular velocity, body axes
  Array q;                        // [m] (num_padded) elastic coordinates
  Array q_dot;                    // [m/s] (num_padded) rates of the elastic coordinates
  JointState joints;              // rotations of joints without inertia, empty if there are none
};

/// Holds everything that the step reads. The future motion depends only on this plan, the state and the
/// inputs. The parts are bases only so that expressions like `plan.mass` stay short.
struct StepPlan : PlanFrame, PlanModes, PlanLoads, PlanRows {
  double period = 0.0;  // [s]
  Fidelity fidelity = Fidelity::kSeparated;
  PlanInitial initial;
  PlanPoints points_method;  // has no steps if the plan integrates its modes
  // At most one plan. The state is stepped on it from the tick at which a command needs a feature that this
  // plan omits   (THEORY 14.16)
  std::vector<StepPlan> fallback;
  // (num_elastic) index of each mode in the fallback plan, ascending; empty without a fallback plan
  std::vector<std::int32_t> fallback_modes;
};

/// Returns the rows [1/m] (3 x num_padded) of the rotation theta = rows q of a body.
inline const double* rotation_rows(const StepPlan& plan, std::int32_t attitude_index) noexcept {
  return plan.particles.rotation_rows.data() + 3 * index(attitude_index) * index(plan.num_padded);
}

/// Returns the plan that has all modes that the state may have: the fallback plan if there is one, otherwise
/// the plan.
inline const StepPlan& plan_of_all_modes(const StepPlan& plan) noexcept {
  return plan.fallback.empty() ? plan : plan.fallback.front();
}

/// Returns true on the rungs on which elastic motion acts back on the body.
inline bool is_coupled(const StepPlan& plan) noexcept { return traits_of(plan.fidelity).couples; }

/// Returns whether a plan integrates the motion of its points in place of that of its modes (THEORY 12.127).
inline bool integrates_points(const StepPlan& plan) noexcept { return plan.points_method.steps > 0; }

}  // namespace freeflex
