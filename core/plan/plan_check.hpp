// The pieces of find_inconsistency(): what must hold in one plan, and between a plan and those in it.
#pragma once

#include <algorithm>
#include <cmath>
#include <functional>
#include <set>
#include <string>

#include "core/step/plan.hpp"

namespace freeflex {

template <typename Sequence>
bool are_finite(const Sequence& values) {
  return std::all_of(values.begin(), values.end(), [](double value) { return std::isfinite(value); });
}

inline bool is_at_least(double value, double bound) { return std::isfinite(value) && value >= bound; }

inline bool is_index(std::int64_t index, std::size_t size) {
  return index >= 0 && static_cast<std::uint64_t>(index) < size;
}

// indices into size items, none twice
inline bool are_indices(const std::vector<std::int32_t>& indices, std::size_t size) {
  std::set<std::int32_t> seen;
  return std::all_of(indices.begin(), indices.end(),
                     [&](std::int32_t index) { return is_index(index, size) && seen.insert(index).second; });
}

inline bool are_ascending(const std::vector<std::int32_t>& values) {
  return std::adjacent_find(values.begin(), values.end(), std::greater_equal<>()) == values.end();
}

/// What is wrong with a plan by itself, its wide plan and shadows apart; empty when nothing. (plan_check.cpp)
std::string find_own_inconsistency(const Plan& plan);

/// What is wrong with what its rung needs, histories and functions of modes among it. (rungs_check.cpp)
/// \pre is_rung(plan.fidelity); modes and points are sound
std::string find_rung_inconsistency(const Plan& plan);

/// What is wrong with the tables by which its motion is judged. (neglect_check.cpp)
/// \pre modes and histories are sound
std::string find_neglect_inconsistency(const Plan& plan);

/// What is wrong with the shadows of a sound plan. (rungs_check.cpp)
std::string find_budget_inconsistency(const Plan& plan);

}  // namespace freeflex
