// The part of a plan that only the estimate of the error reads. The step does not read it.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "core/step/plan.hpp"

namespace freeflex {

/// Holds a shadow: a better plan of the same scene, with all modes and all points, which makes `substeps`
/// steps in each tick of the plan that it accompanies.
struct PlanShadow {
  enum class Kind : std::int32_t {
    kBest = 0,  // the rung that best_rung_beside returns
    kFine = 1,  // the rung of the accompanied plan, at half its period or less
    kFull = 2,  // the rung and the period of the accompanied plan, with every mode
  };
  Kind kind = Kind::kBest;
  std::int32_t substeps = 1;
  StepPlan plan;
};

/// Holds the plans for the error budget. The shadows are stepped in parallel with the state
/// (THEORY 12.22 to 12.26). There are no shadows if the scene does not ask for an error budget.
struct PlanBudget {
  double horizon = 0.0;            // [s] time between restarts of the shadows; 0: no budget
  std::int64_t horizon_ticks = 0;  // the horizon in ticks, at least 1
  std::vector<PlanShadow> shadows;
};

/// Largest number of modes of PlanUnmodelled whose error is integrated.
inline constexpr std::int32_t kMostShadowedModes = 32;

/// Number of values per elastic coordinate that give the torque of loads on displaced points: 27 values for
/// loads in world axes, in the layout of LoadPattern::moment_W, then 3 values for loads in body axes
/// (THEORY X148).
inline constexpr std::size_t kArmSize = 30;

/// Specifies which modes of the structure a plan omits. Plan files hold the numbers.
enum class LacksModes : std::uint8_t {
  kNone = 0,
  kSmallModes = 1,  // Small modes are omitted, but their motion is known.
  kNotKept = 2,     // The set-up found only the lowest modes, so the motion of the others is unknown.
};

/// Holds the stiffness of bodies that is due to accelerations, on rungs that omit this stiffness, and bounds
/// on the effects of the interior of superelements   (THEORY X143, 12.56).
struct PlanUnmodelledBodies {
  Array push_rows;          // [kg] (pairs x 6) stiffness per acceleration and angular acceleration; empty on
                            // the coupled rungs
  double inner_load = 0.0;  // [m s^2] bound on the displacement of inner masses, per square of the spin
  // [-] (judged) how far each mode moves the points of links with unknown internal forces, compared with a
  // free beam; empty if there are no such links
  Array unquantified_factor;
  Array load_sizes;  // [N] (histories) size_of_forces of each history; empty if there are no links with
                     // unknown internal forces
};

/// Holds the items that messages about a verdict name. Links with unknown internal forces are matrices, rigid
/// links, plates and links with mass, because no table gives the forces inside them.
struct PlanNamed {
  // (judged) for each mode, the link with unknown internal forces whose points move most in the mode, as an
  // index into Plan::links; -1: no such link
  std::vector<std::int32_t> links;
  // The modes of PlanUnmodelled::left_out_rows, with their numbers in the scene, from 1, and their
  // frequencies [Hz].
  std::vector<std::int32_t> left_out;
  std::vector<double> left_out_frequency;
};

/// Holds the terms that the rung neglects. The step does not use these terms. The verdict is computed from
/// them (THEORY X140, X141). "Products of the spin" below are the entries xx, yy, zz, xy, xz, yz of w w^T, in
/// this order.
struct PlanUnmodelled {
  bool is_known = false;          // false: the plan is stepped beside another plan, so it has no tables
  bool is_rigid = false;          // true: the plan is on the rung `rigid`, but the structure has elastic
                                  // modes
  bool has_unquantified = false;  // true: the neglected terms of some items are not computed (matrices, rigid
                                  // links, mass in links, wheels)
  LacksModes lacks_modes = LacksModes::kNone;
  double tolerance = 0.0;  // [m] tolerance of the scene; 0: no tolerance given
  // [m] displacement of the omitted small modes, rms over all points
  double left_out = 0.0;
  // [m/N] largest error that the omissions of the plan cause under commands, per newton of the commands
  double error_per_force = 0.0;
  std::vector<std::int32_t> fast_loads;            // indices of histories that change faster than the ticks
                                                   // resolve
  std::int32_t num_judged = 0;                     // number of pairs (l, l), which come first in `pairs`
  std::vector<std::array<std::int32_t, 2>> pairs;  // (l, u), indices of modes of this plan
  Array load_rows;  // [N/m^2] (pairs x num_elastic) stiffness per quasi-static coordinate
  // [N s/m^2] (pairs x num_elastic) stiffness per rate of a coordinate; empty without damping
  Array rate_rows;
  Array spin_rows;      // [N s^2/m] (pairs x 6) stiffness per product of the spin
  Array coriolis_rows;  // [-] (pairs x 3) sum m b_l x b_u / M; zero for (l, l)
  Array root_quartic;   // [sqrt(N/m^3)] (judged) root of (stiffness / displacement^2) of the mode
  // number of modes whose errors are integrated; these are the first modes of the plan
  std::int32_t num_shadowed = 0;
  // [kg m] (num_shadowed x 6) centrifugal load per product of the spin. Its derivative with respect to the
  // spin is the angular momentum that a mode adds   (THEORY X148)
  Array inertia_rows;
  Array load_arms;  // [N] (histories x num_shadowed x kArmSize) result of set_arms for each history
  // [N/m^2] (num_shadowed (num_shadowed + 1) / 2 x num_shadowed) third derivatives of the strain energy with
  // respect to a pair of modes a <= b and a third mode. If a = b, the entry is half the derivative
  // (THEORY X147)
  Array shadow_rows;
  // [s^2] (judged x 6) square of the fraction of a mode's amplitude that Coriolis forces transfer to other
  // modes, per product of the spin; empty on rungs with Coriolis forces
  Array coriolis_transfer;
  // [1/m] (omitted modes x num_elastic) relative stiffness change of each omitted mode per metre of
  // quasi-static response of each kept mode. Only the lowest omitted modes have a row.
  Array left_out_rows;
  Array left_out_spin;  // [s^2] (omitted modes x 6) relative stiffness change per product of the spin
  // effect of the centrifugal load; both arrays are empty on rungs that include this load
  Array spin_loads;     // [kg m] (num_elastic x 6)
  Array spin_left_out;  // [m^2 s^4] (6 x 6) square of the quasi-static response of omitted modes
  PlanUnmodelledBodies bodies;
  // [sqrt(N)/m^2] (forms x num_shadowed x num_shadowed) symmetric matrices H_r. The fourth-order terms of the
  // strain energy of the first modes are V_4 = 1/8 sum_r (x^T H_r x)^2   (THEORY X146)
  Array quartic_forms;
  // [1/m^2] (wheels x pairs) axis . (theta_l x theta_u) for each pair of modes (l, u): the gyroscopic
  // coupling per unit of momentum of each wheel   (THEORY 16.24)
  Array gyroscopic;
  PlanNamed named;
  // (components of PlanHistory::stiffening of each history in turn x pairs) [N/m] the part of the stiffness
  // of load_rows by the loads that the plan has
  Array stiffened_rows;
};

/// Holds the tables for the verdict on a motion.
struct PlanError {
  PlanUnmodelled unmodelled;
  std::vector<PlanUnmodelled> fallback_unmodelled;  // for the fallback plan, if there is one
  PlanBudget budget;
};

}  // namespace freeflex
