// Shadows of a plan for its error budget   (THEORY 12.22 to 12.27).
#pragma once

#include <cstdint>
#include <span>

#include "core/plan/spec.hpp"

namespace freeflex {

/// Adds one shadow to a plan of a scene. The shadow has all modes and points and publishes nothing. If the
/// rung does not support the scene, returns false and adds an error at the origin of the budget or of `auto`.
/// \param structure  structure of the scene, with all modes
/// \param resolving  result of resolving_substeps() for this structure
bool add_shadow(const Scene& scene, const Structure& structure, PlanShadow::Kind kind, Fidelity rung,
                std::int32_t resolving, Plan& plan, Faults& faults);

/// Returns true if a rung supports a scene. Rungs with true geometry support neither rigid links nor bodies
/// nor massless points nor a subset of the modes. Coupled rungs do not support links with a mass matrix.
bool carries(Fidelity rung, const Structure& structure);

/// Returns the rung with which the given rung is compared. A rung with true geometry is compared with itself.
/// Any other rung is compared with `spin-loaded` if a link has a mass matrix. If not, it is compared with
/// `coupled` if the scene has rigid links, bodies or massless points, or keeps only its lowest modes, and
/// with `corotational` in all other scenes.
Fidelity best_rung_beside(Fidelity rung, const Structure& structure);

/// Warns if the best rung is not `corotational`, because then no estimate includes the true lengths and
/// directions of links.
/// \param judge  key of the scene that asks for the comparison
void warn_of_best_rung(const Structure& structure, const char* judge, const Origin& origin, Faults& faults);

/// Fills plan.budget with the shadows that scene.error_budget asks for. Adds an error at the origin of the
/// budget if the rung of a shadow does not support the scene, or if the plan has a fallback plan.
/// \param structure  structure of the scene, with all modes
void compile_budget(const Scene& scene, const Structure& structure, Plan& plan, Faults& faults);

/// Sets the horizon of a plan's error budget [s]. At the end of each horizon, the shadows start again from
/// the state of the plan.
void set_horizon(double horizon, Plan& plan);

/// Returns the natural frequencies of all modes [rad/s].
std::span<const double> frequencies_of(const Structure& structure);

}  // namespace freeflex
