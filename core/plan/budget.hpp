// Shadows of a plan for its error budget   (THEORY X96-X98).
#pragma once

#include <cstdint>
#include <span>

#include "core/plan/spec.hpp"

namespace freeflex {

/// Adds one shadow to a plan of a scene, with every mode and point of it and nothing to publish. An error at
/// the place of what asks for it, when the rung cannot carry the scene. \param structure  of the scene, with
/// all modes  \param parts  resolving_parts() of it
bool add_shadow(const Scene& scene, const Structure& structure, PlanShadow::Kind kind, Fidelity rung,
                std::int32_t parts, Plan& plan, Faults& faults);

/// True of the rungs that can carry a scene: those with true bars take neither rigid links nor bodies.
bool carries(Fidelity rung, const Scene& scene, const Structure& structure);

/// What a rung is compared with: exact bars, or coupled where the scene has rigid links or bodies; or itself
/// in parts of half the size where that is not better.
Fidelity best_rung_beside(Fidelity rung, const Scene& scene, const Structure& structure);

/// Says so where that is coupled: what true lengths and directions change is in no estimate then.
/// \param judge  what is compared, as the scene names it
void warn_of_best_rung(const Scene& scene, const Structure& structure, const char* judge,
                       const Origin& origin, Faults& faults);

/// Fills plan.budget with the shadows that scene.error_budget asks for. Errors, at its place, when the
/// coupled rungs cannot carry the scene. \param structure  of the scene, with all modes
void compile_budget(const Scene& scene, const Structure& structure, Plan& plan, Faults& faults);

/// What a plan's errors are counted over before the comparison starts again [s].
void set_horizon(double horizon, Plan& plan);

/// [rad/s] of every mode.
std::span<const double> frequencies_of(const Structure& structure);

}  // namespace freeflex
