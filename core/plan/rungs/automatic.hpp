// The setting `fidelity: auto` chooses a rung by its estimated error (THEORY 12.28).
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "core/plan/spec.hpp"

namespace freeflex {

/// Number of equally spaced times in a horizon at which the estimated errors are compared with the
/// tolerances.
inline constexpr int kRungSamples = 16;

/// Returns the cheapest rung whose verdict is never `outside` and whose estimated errors stay within the
/// tolerances of scene.automatic: estimate(t_k) <= tolerance at t_k = k T_h / 16, k = 1 to 16
/// (THEORY 12.28). `tried` receives the rungs that were tried. The last of these is the chosen rung. If no
/// rung meets these conditions, returns nullopt and adds an error at the origin of the tolerance. The cost is
/// up to five runs over the horizon. In each run, the best rung is stepped in parallel.
std::optional<Fidelity> choose_rung(const Scene& scene, const Structure& structure,
                                    std::vector<PlanRung>& tried, Faults& faults);

/// Returns a warning if `fidelity: auto` chose the rung of the plan at a rate other than `rate` [Hz]. An
/// empty text means that there is no warning.
std::string find_untried_rate(const Plan& plan, double rate);

}  // namespace freeflex
