// Compilation of the built-in loads of a scene and their histories.
#pragma once

#include "core/plan.hpp"
#include "core/structure/structure.hpp"

namespace freeflex {

/// Returns the sums of the forces and torques of one load at amplitude 1. A load in local axes is treated
/// like a load in body axes.
/// \pre as for compile_histories
SumsOnPoints sums_of(const Load& load, const StepPlan& plan);

/// Appends the loads of the scene to plan.histories   (THEORY 8.10 to 8.13). Adds an error for a torque that
/// a group cannot support.
/// \pre the points, groups and rows of the plan are filled
void compile_histories(const Scene& scene, const Structure& structure, StepPlan& plan, Faults& faults);

/// Returns why a group cannot support a torque in body axes [N m]. If the group can support it, the text is
/// empty. Points on a line support no torque about the line. Points at one position support no
/// torque   (THEORY 8.9).
std::string refused_torque(const PlanGroup& group, const Vec3& torque_B);

/// Sets the ticks at which a pulse starts and ends: k_1 = round(t_s / h), k_2 = round((t_s + t_p) / h). If
/// k_1 = k_2, the pulse instead acts in the tick that contains its middle, so k_1 = floor((t_s + t_p / 2) /
/// h) and k_2 = k_1 + 1 (THEORY 8.10).
void set_history_ticks(PlanHistory& history, double period);

/// Warns of loads that the step applies otherwise than the scene gives them, because the step takes loads as
/// linear between ticks. Such loads are pulses whose edges are moved to ticks (THEORY 8.10, 8.11), and sines
/// and tables that change faster than the ticks resolve (THEORY 6.1, 8.12, 8.13).
void warn_of_ticks(const Scene& scene, const StepPlan& plan, Faults& faults);

}  // namespace freeflex
