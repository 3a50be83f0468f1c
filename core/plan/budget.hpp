// Shadows of a plan for its error budget   (THEORY 12.22 to 12.27).
#pragma once

#include <cstdint>
#include <span>

#include "core/plan/spec.hpp"

namespace freeflex {

/// Adds one shadow to a plan of a scene, with all modes and points and without publication. If the rung does
/// not support the scene, returns false and adds an error at the origin of the budget or of `auto`.
/// \param structure  of the scene, with all modes  \param resolving  result of resolving_substeps()
/// for the structure
bool add_shadow(const Scene& scene, const Structure& structure, PlanShadow::Kind kind, Fidelity rung,
                std::int32_t resolving, Plan& plan, Faults& faults);

/// Returns true if a rung supports a scene. Rungs with true geometry support neither rigid links nor bodies
/// nor a subset of the modes. Coupled rungs do not support mass matrices.
bool carries(Fidelity rung, const Scene& scene, const Structure& structure);

/// Returns the rung with which the given rung is compared. If the rung has true geometry, this is the rung
/// itself. Otherwise it is `spin-loaded` if the scene has mass matrices. It is `coupled` if the scene has
/// rigid links or bodies, or keeps only its lowest modes. In all other scenes it is `exact-bars`.
Fidelity best_rung_beside(Fidelity rung, const Scene& scene, const Structure& structure);

/// Warns if the best rung is not `exact-bars`, because then no estimate includes the true lengths and
/// directions of links.
/// \param judge  key of the scene that asks for the comparison
void warn_of_best_rung(const Scene& scene, const Structure& structure, const char* judge,
                       const Origin& origin, Faults& faults);

/// Fills plan.budget with the shadows that scene.error_budget asks for. Adds an error at the origin of the
/// budget if the coupled rungs do not support the scene.  \param structure  structure of the scene, with all
/// modes
void compile_budget(const Scene& scene, const Structure& structure, Plan& plan, Faults& faults);

/// Sets the horizon of a plan's error budget [s]. After each horizon, the comparison starts again.
void set_horizon(double horizon, Plan& plan);

/// Returns the natural frequencies of all modes [rad/s].
std::span<const double> frequencies_of(const Structure& structure);

}  // namespace freeflex
