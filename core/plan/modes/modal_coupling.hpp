// Modal coupling due to dashpots and linear feedback   (THEORY 8.26 to 8.41).
#pragma once

#include "core/plan.hpp"
#include "core/structure/structure.hpp"

namespace freeflex {

/// [-] Largest off-diagonal coefficient of damping due to dashpots, over the largest diagonal one, that is
/// taken as a rounding error. If no coefficient is larger, the dashpots do not couple the modes.
inline constexpr double kUncoupled = 1e-13;

/// Largest number of coupled modes that are advanced by their matrix exponential (THEORY 8.34). The
/// exponential takes 8 n_mixed^2 operations per tick for n_mixed coupled modes, some 15 us for this many.
/// More modes are advanced by splitting (THEORY 8.38), whose cost grows with the number of modes times the
/// number of coupling forces.
inline constexpr int kMaxExactModes = 96;

/// Fills plan.feedbacks and plan.modal_coupling except for the values that depend on the period. Dashpots
/// that do not couple the modes are added to plan.decay   (THEORY 4.23, 3.49, 8.26 to 8.32). Adds an error if
/// acceleration feedback has no solution or couples more than kMaxExactModes modes.
/// \pre the modes and points of the plan are filled
void compile_modal_coupling(const Scene& scene, const Structure& structure, StepPlan& plan, Faults& faults);

/// Returns the modes on which a dashpot or a feedback acts or whose motion it senses, in ascending order.
std::vector<std::int32_t> coupled_modes(const StepPlan& plan);

/// Holds the forces of dashpots and feedback on the modes, for a motion without loads:
/// q'' + 2 decay q' + omega^2 q = out^T (by_q q + by_q_dot q')
/// (THEORY 8.39; out^T is U, by_q is W_q, by_q_dot is W_v).
struct CouplingForces {
  Eigen::MatrixXd out;       // [1/kg] per unit of force, (forces x n)
  Eigen::MatrixXd by_q;      // [N/m] (forces x n)
  Eigen::MatrixXd by_q_dot;  // [N s/m] (forces x n)
};
CouplingForces coupling_forces(const StepPlan& plan);

/// Chooses how the coupled modes are advanced: by their exponential if there are at most kMaxExactModes,
/// otherwise by splitting. Returns the number of coupled modes.
std::size_t set_modal_coupling_path(StepPlan& plan);

/// Sets the values of plan.modal_coupling that depend on the period   (THEORY 8.34, 8.37, 8.40).
void set_modal_coupling_period(StepPlan& plan);

/// Warns if feedback makes a motion grow without bound. Adds an error if only the split step makes a motion
/// grow (THEORY 8.38), because the rate is then too low for a gain. This error becomes a warning if the
/// growth is at most 1e-5 per tick. With more than 256 modes, growth is found by stepping, and growth by less
/// than 1e-4 to 2e-2 per tick may be missed. The limit is larger for plans of more modes and coupling
/// forces.
/// \pre set_modal_coupling_period was called
void check_growth(const Scene& scene, const StepPlan& plan, Faults& faults);

}  // namespace freeflex
