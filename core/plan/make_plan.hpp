// Makes the plan that programs run from a scene and its structure. All decisions on a plan are made here.
#pragma once

#include <optional>

#include "core/plan/spec.hpp"

namespace freeflex {

/// Returns the plan that programs run, with a report on every feature in Plan::features (THEORY section 14)
/// and with its shadow. The plan is on the rung that the scene names or that `fidelity: auto` chooses,
/// and it omits the features that the scene does not need. Each fault is reported once. Returns nullopt if
/// there is an error. The cost is up to three times that of compile(), plus the steps over the horizons.
/// \param rate  [Hz] rate at which the plan will be stepped, for the warnings about ticks; 0: the rate of the
/// scene
std::optional<Plan> make_plan(const Scene& scene, const Structure& structure, Faults& faults,
                              double rate = 0.0);

/// Returns the plan with all features on the given rung, without a shadow, for comparisons and
/// inspection.
std::optional<Plan> make_full_plan(const Scene& scene, const Structure& structure, Fidelity rung,
                                   Faults& faults);

}  // namespace freeflex
