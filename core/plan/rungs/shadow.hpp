// The shadow of a plan for its verdict   (THEORY 15.1).
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "core/plan/spec.hpp"

namespace freeflex {

/// Fills plan.verdict: the shadow, how it is stepped, and the errors that it shares with the plan. If no
/// better plan supports the scene, the plan has no shadow, and plan.verdict states why.
/// \param structure  structure of the scene, with all modes
/// \param of_plan  structure from which the plan was compiled; it may have other modes for equal frequencies
void compile_verdict(const Scene& scene, const Structure& structure, const Structure& of_plan, Plan& plan);

/// Returns a plan of a scene with all modes and all rows at a rate [Hz]. Adds an error if the rung does not
/// support the scene.
std::optional<Plan> whole_plan(const Scene& scene, const Structure& structure, Fidelity rung, double rate,
                               Faults& faults);
/// Returns the indices of the modes of a plan among those of its structure.
std::vector<std::int32_t> indices_of_modes(const StepPlan& plan);

/// Sets what the shadow of a plan needs for the present period of the plan.
void set_shadow_rate(Plan& plan);

/// Returns the time that one step of a plan takes on a processor of 2026 [s], from its modes and points. The
/// share of a processor that a shadow takes is computed from this time, so that it is the same in every run
/// (THEORY 15.9).
double seconds_of_step(const StepPlan& plan);

}  // namespace freeflex
