// Initial state of a scene in elastic coordinates, and checks of the initial state.
#pragma once

#include "core/plan/spec.hpp"

namespace freeflex {

/// Returns the elastic coordinates of the initial state. They are the displacements of points, projected by
/// q_l = sum_i m_i b_il . V_i / M (THEORY 4.25), plus the values given by mode.
InitialModes initial_modes(const Scene& scene, const Structure& structure);

/// Reports those errors and warnings on the initial state that apply to every rung. The causes are rigid
/// motion in the displacements of points, a spin that the body cannot have, wheels and torques that cannot
/// rotate the body, and an attractor that is too near.
void check_start(const Scene& scene, const Structure& structure, Faults& faults);

/// Warns of a spin that is too fast for the equations of a rung.
void warn_of_fast_spin(const Scene& scene, const Structure& structure, Fidelity rung, Faults& faults);

/// Fills plan.initial, except for its elastic coordinates.
void compile_start(const Scene& scene, const MassProperties& body, StepPlan& plan);

}  // namespace freeflex
