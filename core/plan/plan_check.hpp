// The pieces of find_inconsistency(): what must hold in one plan, and between a plan and those in it.
#pragma once

#include <algorithm>
#include <cmath>
#include <string>

#include "core/step/plan.hpp"

namespace freeflex {

template <typename Sequence>
bool are_finite(const Sequence& values) {
  return std::all_of(values.begin(), values.end(), [](double value) { return std::isfinite(value); });
}

/// What is wrong with a plan by itself, its wide plan and shadows apart; empty when nothing. (plan_check.cpp)
std::string find_own_inconsistency(const Plan& plan);

/// What is wrong with what its rung needs, histories and functions of modes among it. (rungs_check.cpp)
/// \pre is_rung(plan.fidelity); modes and points are sound
std::string find_rung_inconsistency(const Plan& plan);

/// What is wrong with the shadows of a sound plan. (rungs_check.cpp)
std::string find_budget_inconsistency(const Plan& plan);

}  // namespace freeflex
