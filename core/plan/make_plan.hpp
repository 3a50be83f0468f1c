// Scene and structure -> the plan that programs run. The one place that decides what a plan is compiled to.
#pragma once

#include <optional>

#include "core/plan/spec.hpp"

namespace freeflex {

/// The plan that programs run: the rung that `fidelity: auto` chooses, less what the scene does not need,
/// with an account of every part in Plan::parts   (THEORY section 14), and its error budget. Each fault is
/// said once. nullopt on an error. Cost: up to three times that of compile(), and the steps over the
/// horizons.
std::optional<Plan> make_plan(const Scene& scene, const Structure& structure, Faults& faults);

/// The plan with everything in it on a rung, without a budget: to compare with, and to look into.
std::optional<Plan> make_whole_plan(const Scene& scene, const Structure& structure, Fidelity rung,
                                    Faults& faults);

}  // namespace freeflex
