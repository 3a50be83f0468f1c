// Compilation of a plan from a scene, a structure and a spec.
#pragma once

#include <optional>

#include "core/plan/spec.hpp"

namespace freeflex {

/// Returns the plan that the spec asks for, with all data that the step, the bus and the tools need. If there
/// is an error, returns nullopt. All decisions are in the spec. Reports errors only, because check_start()
/// and check_motion() report the warnings, once per scene. Programs that run a scene call make_plan() of
/// core/plan/make_plan.hpp, which makes the spec.
/// \param whole  structure of the scene with all modes
std::optional<Plan> compile(const Scene& scene, const Structure& whole, const PlanSpec& spec, Faults& faults);

}  // namespace freeflex
