// Shadows of a plan for its error budget, and the choice of a rung by the error it makes (THEORY X96-X99).
#pragma once

#include <optional>

#include "core/step/budget.hpp"
#include "core/structure/structure.hpp"

namespace freeflex {

/// Fills plan.budget with the shadows that scene.error_budget asks for. Errors, at its place, when the
/// coupled rungs cannot carry the scene. \param structure  of the scene, with all modes
void compile_budget(const Scene& scene, const Structure& structure, Plan& plan, Faults& faults);

/// Steps a tick of the shadows, and their plans, for the plan's period   (X96).
void set_shadow_rates(Plan& plan);

/// A horizon [s] in ticks, at least 1.
std::int64_t horizon_in_ticks(double horizon, double period);

/// Samples at which errors are judged over a horizon.
inline constexpr int kRungSamples = 16;

/// The cheapest rung within the tolerances of scene.automatic, the last of `tried` (X99). Without one that
/// is: an error at the place of the tolerance, and nullopt. Cost: up to six runs over the horizon, each with
/// the best rung beside it.
std::optional<Fidelity> choose_rung(const Scene& scene, const Structure& structure,
                                    std::vector<PlanRung>& tried, Faults& faults);

/// What to say when a plan whose rung `fidelity: auto` chose runs at another rate [Hz]; empty: nothing.
std::string find_untried_rate(const Plan& plan, double rate);

/// "rigid", "separated", "spin-loaded", "coupled", "exact-bars", "full".
const char* name_of(Fidelity rung);

}  // namespace freeflex
