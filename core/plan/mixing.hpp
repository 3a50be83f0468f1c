// What keeps modes from being independent: dashpots and linear feedback (THEORY X74-X76).
#pragma once

#include "core/step/plan.hpp"
#include "core/structure/structure.hpp"

namespace freeflex {

/// [-] of the largest damping coefficient: what mixes modes less is rounding of dashpots that share the
/// modes.
inline constexpr double kUnmixed = 1e-13;

/// Largest number of mixed modes that their own exponential advances. Its cost per tick is 8 n_mixed^2, some
/// 15 us for this many; more are advanced by splitting, whose cost grows with n times the number of dashpots.
inline constexpr int kMaxExactModes = 96;

/// Fills plan.feedbacks and plan.mixing but for what depends on the period; dashpots that share the modes
/// go into plan.decay   (THEORY X53, X65, X74-X76). Errors: acceleration feedback that has no solution, or
/// couples more than kMaxExactModes modes. \pre modes and points of the plan stand
void compile_mixing(const Scene& scene, const Structure& structure, Plan& plan, Faults& faults);

/// Returns the modes that a dashpot or a feedback acts on or is moved by, ascending.
std::vector<std::int32_t> mixed_modes(const Plan& plan);

/// What dashpots and feedback add to the equations of the modes where no load acts:
/// q'' + 2 decay q' + omega^2 q = out^T (by_q q + by_q_dot q')   (THEORY X76, U^T, W_q and W there).
struct MixingForces {
  Eigen::MatrixXd out;       // [1/kg] per unit of force, (forces x n)
  Eigen::MatrixXd by_q;      // [N/m] (forces x n)
  Eigen::MatrixXd by_q_dot;  // [N s/m] (forces x n)
};
MixingForces mixing_forces(const Plan& plan);

/// How the modes that dashpots and feedback of a plan mix are advanced: together while they are few, else by
/// splitting. \return their number
std::size_t set_mixing_path(Plan& plan);

/// What of plan.mixing depends on the period   (THEORY X75, X76).
void set_mixing_period(Plan& plan);

/// Feedback that drives a motion without end is a warning; an error where only the splitting of X76 does,
/// because the rate is too low for a gain. From 256 modes on growth by less than some 1e-3 a tick may go
/// unseen. \pre set_mixing_period
void check_growth(const Scene& scene, const Plan& plan, Faults& faults);

}  // namespace freeflex
