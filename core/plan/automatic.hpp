// `fidelity: auto`: the choice of a rung by the error it makes   (THEORY X99).
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "core/plan/spec.hpp"

namespace freeflex {

/// Samples at which errors are judged over a horizon.
inline constexpr int kRungSamples = 16;

/// The cheapest rung within the tolerances of scene.automatic, the last of `tried` (X99). Without one that
/// is: an error at the place of the tolerance, and nullopt. Cost: up to six runs over the horizon, each with
/// the best rung beside it.
std::optional<Fidelity> choose_rung(const Scene& scene, const Structure& structure,
                                    std::vector<PlanRung>& tried, Faults& faults);

/// What to say when a plan whose rung `fidelity: auto` chose runs at another rate [Hz]; empty: nothing.
std::string find_untried_rate(const Plan& plan, double rate);

}  // namespace freeflex
