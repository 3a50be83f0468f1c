// Damping by the rates of true strains   (THEORY 12.114).
#pragma once

#include "core/step/coupled/stage.hpp"

namespace freeflex {

/// Begins a step.
void begin_strain_damping(CoupledWorkspace& w) noexcept;
/// Adds to rate.rate_p, and to rate.Q if it is set, the difference between damping by the rates of the true
/// elastic forces and by those of the linear ones. Does nothing in plans without such damping.
/// \pre rate.rate_q is set, and w.stage_joints are the rotations at the stage
void add_strain_damping(const StepPlan& plan, const StageState& stage, CoupledWorkspace& w,
                        StageRate& rate) noexcept;

}  // namespace freeflex
