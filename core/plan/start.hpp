// How a scene starts: its initial state in elastic coordinates, and what is to be said of it.
#pragma once

#include "core/plan/spec.hpp"

namespace freeflex {

/// Elastic coordinates of the initial state: those of its points   (THEORY X54), and what it gives by mode.
InitialModes initial_modes(const Scene& scene, const Structure& structure);

/// Errors and warnings of the start that no rung changes: a rigid part of what points are given, a spin that
/// the body has not, an attractor too near.
void check_start(const Scene& scene, const Structure& structure, Faults& faults);

/// Warns of a spin that the equations of a rung do not hold for.
void warn_of_fast_spin(const Scene& scene, const Structure& structure, Fidelity rung, Faults& faults);

/// Fills plan.initial but for its elastic coordinates.
void compile_start(const Scene& scene, const MassProperties& body, Plan& plan);

}  // namespace freeflex
