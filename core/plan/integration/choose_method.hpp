// The choice between integrating modes and integrating points, and the set-up of the latter.
#pragma once

#include <string>

#include "core/plan/spec.hpp"

namespace freeflex {

inline constexpr int kMostColumns = 8, kMostTicksPerStep = 16, kMostStepsPerTick = 100'000;

/// Returns why the points of a compiled plan cannot be integrated, or an empty text.
std::string find_no_points_method(const StepPlan& plan);

/// Decides whether a compiled plan integrates its points or its modes (THEORY 12.136), and sets up the
/// former. Returns why points cannot be integrated if they were asked for, or an empty text.
std::string choose_method(const Integration& asked, Plan& plan);

/// Returns the largest distance of a point from the centre of mass [m].
double radius_of(const StepPlan& plan);

/// Sets the steps for the period of the plan   (THEORY 12.129 to 12.135).
void set_points_period(StepPlan& plan);

}  // namespace freeflex
