// Members of a plan that the coupled rungs of the fidelity ladder need   (THEORY section 12).
#pragma once

#include <numbers>

#include "core/plan.hpp"
#include "core/plan/spec.hpp"

namespace freeflex {

/// Fills plan.coupled except for the values that depend on the period. Adds an error for acceleration
/// feedback, for rigid links in combination with true bars, and if the modes of a collinear shape do not let
/// the points rotate about their line.
/// \pre the modes, points and modal coupling of the plan are filled, and the plan's rung is coupled or above
void compile_coupled(const Scene& scene, const Structure& structure, const PlanSpec& spec, StepPlan& plan,
                     Faults& faults);

/// Largest omega h of a mode that a substep resolves [-]. Stiffer axial modes are curvilinear (THEORY 12.77).
inline constexpr double kResolvedPhase = 1.0;

/// Largest omega h of any mode that a substep takes without the filter [-]   (THEORY 12.82). Below 2 the
/// filter costs accuracy and gains nothing.
inline constexpr double kFilterPhase = 2.0;
/// Largest omega h of a mode whose vibration acts on the other modes [-]: beyond, the filter takes it out.
inline constexpr double kLongestPhase = std::numbers::pi;

/// Returns the damping ratios zeta_l [-] of all modes of a structure: those that the scene gives plus those
/// that follow from loss factors   (THEORY 4.23, 4.24).
Eigen::VectorXd damping_ratios(const Damping& damping, const Structure& structure);

/// Largest omega h of a mode on the rung `corotational` [-], omega_n h / n_sub <= 1000   (THEORY 12.32). The
/// difference between true and linear bar forces acts stage by stage, and with stiff bars the method loses
/// its order. At this limit, the elastic error of a 20-point truss that rotates at 5 rad/s is some 1 %. The
/// error grows with the square of omega h (tests/motion/rungs_test).
inline constexpr double kMaxBarPhase = 1000.0;

/// Largest rate of dashpots and feedback times a substep [-], sigma h / n_sub <= 1   (THEORY 12.32). Dashpots
/// and feedback act stage by stage. The classical Runge-Kutta method is stable up to 2.5, and its order is 4.
inline constexpr double kMaxStagePhase = 1.0;

/// Largest phase of the fastest rate in a substep of the rung `full` [rad], max(omega_n, sigma) h / n_sub <=
/// 1/2 (THEORY 12.29). With this limit, the elastic error of the trusses in tests/motion/full_rung_test is
/// below 1e-6.
inline constexpr double kFullPhase = 0.5;

/// Largest rotation of the body in a substep of the coupled rungs, at the rate of rotation at the start [rad]
/// (THEORY 12.30). The error of the method of order 4 is then 5e-8 of the rotation.
inline constexpr double kRotationPhase = 0.05;

/// Largest number of substeps of a tick. At some 10 us each, this number of substeps takes most of a second.
inline constexpr std::int32_t kMaxSubsteps = 65536;

/// Returns the rate of rotation of the body at the start, including the nutation that wheels cause [rad/s]:
/// |w| + |h_w| / (I_1 I_2)^(1/2)   (THEORY 12.30).
double rotation_rate(const StepPlan& plan);

/// Sets PlanCoupled::num_substeps and PlanCoupled::functions for the period of the plan
/// (THEORY 12.14, 12.29, 12.30).
void set_coupled_period(StepPlan& plan);

/// Returns a warning if the period is too long for the damping of true strains (THEORY 12.114), and an empty
/// text otherwise.  \pre set_coupled_period was called
std::string find_unresolved_damping(const StepPlan& plan);

/// Adds an error if the period is too long for forces that act stage by stage   (THEORY 12.32).
/// \pre set_coupled_period was called
void check_stages(const Scene& scene, const StepPlan& plan, Faults& faults);

}  // namespace freeflex
