// The setting `fidelity: auto` chooses a rung by its estimated error (THEORY 12.28).
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "core/plan/spec.hpp"

namespace freeflex {

/// Returns the cheapest rung whose estimated errors stay within the tolerances of scene.automatic at every
/// tick of its horizon that is judged   (THEORY 12.28). If its verdict is not `good`, adds a warning. `tried`
/// receives the rungs that were tried. The last of these is the chosen rung. If no rung meets the tolerances,
/// returns nullopt and adds an error at the origin of the tolerance. The cost is up to five runs over the
/// horizon, each with its shadow.
std::optional<Fidelity> choose_rung(const Scene& scene, const Structure& structure,
                                    std::vector<PlanRung>& tried, Faults& faults);

/// Returns a warning if `fidelity: auto` chose the rung of the plan at a rate other than `rate` [Hz]. An
/// empty text means that there is no warning.
std::string find_untried_rate(const Plan& plan, double rate);

}  // namespace freeflex
