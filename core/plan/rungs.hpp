// What a rung of the fidelity ladder needs of a plan beside the separated equations (THEORY section 12).
#pragma once

#include "core/plan/spec.hpp"
#include "core/step/plan.hpp"

namespace freeflex {

/// Fills plan.coupled but for what depends on the period. Errors: acceleration feedback, rigid links beside
/// true bars, modes of a line that do not let it turn about itself.
/// \pre modes, points and mixing of the plan stand; its rung is coupled or above
void compile_coupled(const Scene& scene, const Structure& structure, const PlanSpec& spec, Plan& plan,
                     Faults& faults);

/// Largest omega h of any mode on the exact-bars rung [-]. The difference of true from linear bar forces acts
/// stage by stage, and beside stiff bars it loses its order: at this size the elastic error of a 20-point
/// truss that turns at 5 rad/s is some 1 %, and it grows with the square (tests/motion/rungs_test).
inline constexpr double kMaxBarPhase = 1000.0;

/// Largest rate of dashpots and feedback [1/s] times a step [s]: they act stage by stage, where the classical
/// method is stable to 2.5 and of order 4.
inline constexpr double kMaxStagePhase = 1.0;

/// On the full rung the fastest rate turns by this in a part of a step, at most [rad]: the error of order 4
/// is below 1e-6 there (tests/motion/full_rung_test).
inline constexpr double kFullPhase = 0.5;

/// [rad] that the body turns, at the rate of the start, in a part of a step of the coupled rungs: order four
/// errs by 5e-8 of the turn.
inline constexpr double kTurnPhase = 0.05;

/// Parts of a tick: at some 10 us each this is most of a second.
inline constexpr std::int32_t kMaxParts = 65536;

/// [rad/s] How fast the body turns at the start, plus its nutation where it has wheels   (THEORY X202).
double turn_rate(const Plan& plan);

/// PlanCoupled::num_parts and functions for the plan's period   (THEORY X93, X100).
void set_coupled_period(Plan& plan);

/// An error when the period is too long for what acts stage by stage   (THEORY X94, X100).  \pre
/// set_coupled_period
void check_stages(const Scene& scene, const Plan& plan, Faults& faults);

}  // namespace freeflex
