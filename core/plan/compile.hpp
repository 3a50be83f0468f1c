// Scene, structure and spec -> plan.
#pragma once

#include <optional>

#include "core/plan/spec.hpp"

namespace freeflex {

/// Everything the step, the bus and the tools need, as the spec has it: the same scene, structure and spec
/// give the same plan, and nothing is decided here. Errors alone are said; what else is to be said of a
/// scene, check_start() and check_motion() say once. nullopt on an error. Programs that run a scene call
/// make_plan() of core/plan/make_plan.hpp, which decides the spec.
std::optional<Plan> compile(const Scene& scene, const Structure& whole, const PlanSpec& spec, Faults& faults);

}  // namespace freeflex
