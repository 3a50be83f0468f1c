// Rates in curvilinear coordinates, and at filtered coordinates where a substep does not resolve all modes.
#pragma once

#include "core/step/coupled/stage.hpp"

namespace freeflex {

/// Evaluates the rates at a stage in curvilinear coordinates q, p   (THEORY 12.79, 12.80).
void evaluate_curved(const StepLoads& step_loads, const double* q, const double* p, StageState stage,
                     Workspace& workspace, StageRate& rate) noexcept;

/// Returns by how much the slow motion of stiff modes has moved since w.slow_start, at least by a floor
/// [m/s^2].
double pace_of_slow_motion(const StepPlan& plan, const CoupledWorkspace& w) noexcept;

/// Evaluates the rates at a stage with filtered coordinates, as often as it takes to find the slow motion
/// (THEORY 12.82, 12.83, 12.96).  \param q, p  [m], [m/s] (num_padded) curvilinear coordinates
void evaluate_filtered(const StepLoads& step_loads, const double* q, const double* p, const StageState& stage,
                       Workspace& workspace, StageRate& rate) noexcept;

/// Sets the filtered rates of workspace.coupled.next at the result of a step, with which the next step
/// begins.  \pre workspace.coupled.next has the curvilinear coordinates of the result
void set_filtered_rates(const StepLoads& step_loads, const StageState& result, Workspace& workspace) noexcept;

}  // namespace freeflex
