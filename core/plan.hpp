// The plan that programs run: what the step reads, the tables for the verdict, what the daemon publishes and
// accepts, and a report on how the plan was made.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "core/command_limits.hpp"
#include "core/error/tables.hpp"
#include "core/step/plan.hpp"

namespace freeflex {

/// Holds what a service publishes of the motion, and the limits of one command.
struct PlanService {
  ChannelRates rates{};
  double status_rate = 0.0;  // [Hz]
  std::vector<std::int32_t> published_points;
  std::vector<std::int32_t> published_groups;
  double force_limit = 0.0, torque_limit = 0.0;  // [N], [N m] for one command; 0: no limit
};

/// Holds the decision on one feature: whether the plan keeps or omits it, why, and by how much the omission
/// may change the motion beyond rounding error   (THEORY 14.15).
struct PlanFeature {
  Feature feature = Feature::kDamping;
  bool is_left_out = false;
  std::int32_t count = 0;  // number of modes or points concerned
  std::string why;
  // largest errors within the horizon, under the built-in loads and from the initial state
  double error = 0.0;           // [m] of the elastic displacement of any point that is read or pushed
  double relative_error = 0.0;  // [-] error over the largest elastic displacement of such a point
  double link_error = 0.0;      // [N], [N m] in any published link force
  // The errors under commands, per newton. To get the error of a command, multiply by the force on a pushable
  // point plus the sum of the changes of this force.
  double error_per_force = 0.0;           // [m/N]
  double relative_error_per_force = 0.0;  // [-] error over the static displacement under the force
  double link_error_per_force = 0.0;      // [-], [m]
};

/// Holds the result for one rung that `fidelity: auto` tried: the largest error estimates over the horizon
/// (THEORY 12.28).
struct PlanRung {
  Fidelity rung = Fidelity::kRigid;
  double position = 0.0, attitude = 0.0, elastic = 0.0;  // [m] rms, [rad], [-]
  bool is_finite = false;                                // false: the motion became infinite or NaN
  bool meets = false;  // true: the estimates meet every tolerance of the scene
};

/// Holds why a plan integrates its modes or its points   (THEORY 12.136).
struct PlanIntegration {
  std::string why_modes;  // why it integrates modes; empty: it integrates points, or the rung has no choice
  // [s] counted times of a tick: on modes, on points, and on points after a change of the loads; 0: not
  // counted
  double on_modes = 0.0, on_points = 0.0, after_change = 0.0;
};

/// Holds what the set-up decided and why. No program steps or judges a motion with it.
struct PlanReport {
  std::vector<PlanFeature> features;  // empty: not examined; every feature is kept
  double tolerance = 0.0;             // [-] tolerance for omitting small modes
  double horizon = 0.0;               // [s] simulated time over which the errors of omission were estimated
  std::vector<PlanRung> tried_rungs;  // the rungs that `fidelity: auto` tried, cheapest first; the last one
                                      // was chosen
  PlanIntegration integration;
  double frequency_accuracy = 0.0;  // [-]
  double conditioning = 0.0;        // [-]
};

/// Holds a compiled scene. The parts are bases only so that expressions like `plan.points` stay short.
struct Plan : StepPlan, PlanService, PlanReport {
  std::string name;
  std::uint64_t scene_hash = 0;
  CommandLimits command_limits;
  PlanVerdict verdict;
};

}  // namespace freeflex
