// Built-in force histories of a scene, compiled.
#pragma once

#include "core/step/plan.hpp"
#include "core/structure/structure.hpp"

namespace freeflex {

/// One load at amplitude 1; local axes are body axes here.  \pre as for compile_histories
SumsOnPoints sums_of(const Load& load, const Plan& plan);

/// Appends the scene's loads to plan.histories   (THEORY X13). Errors: a torque that a group cannot take.
/// \pre points, groups and rows of the plan stand
void compile_histories(const Scene& scene, const Structure& structure, Plan& plan, Faults& faults);

/// Why a group cannot take a torque in body axes [N m], none about the line of its points and none on one
/// place (THEORY X12); empty when it can.
std::string idle_torque(const PlanGroup& group, const Vec3& torque_B);

/// Ticks at which a pulse starts and ends, each edge rounded to the nearest tick   (THEORY X13).
void set_history_ticks(PlanHistory& history, double period);

/// Warns of what ticks do to loads: pulses whose edges are moved, sines and tables that are faster than ticks
/// (THEORY X13).
void warn_of_ticks(const Scene& scene, const Plan& plan, Faults& faults);

}  // namespace freeflex
