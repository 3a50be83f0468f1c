// find_inconsistency() calls these functions. They check one plan, or a plan together with the plans within
// it.
#pragma once

#include <algorithm>
#include <cmath>
#include <functional>
#include <set>
#include <string>

#include "core/plan.hpp"

namespace freeflex {

template <typename Sequence>
bool are_finite(const Sequence& values) {
  return std::all_of(values.begin(), values.end(), [](double value) { return std::isfinite(value); });
}

inline bool is_at_least(double value, double bound) { return std::isfinite(value) && value >= bound; }

inline bool is_index(std::int64_t index, std::size_t size) {
  return index >= 0 && static_cast<std::uint64_t>(index) < size;
}

// Returns true if the values are distinct indices into `size` items.
inline bool are_indices(const std::vector<std::int32_t>& indices, std::size_t size) {
  std::set<std::int32_t> seen;
  return std::all_of(indices.begin(), indices.end(),
                     [&](std::int32_t index) { return is_index(index, size) && seen.insert(index).second; });
}

inline bool are_ascending(const std::vector<std::int32_t>& values) {
  return std::adjacent_find(values.begin(), values.end(), std::greater_equal<>()) == values.end();
}

/// Returns what is wrong with a plan, except for its fallback plan. If the plan is consistent, the text is
/// empty. (plan_check.cpp)
std::string find_own_inconsistency(const StepPlan& plan);

/// Returns what is wrong with the members that the rung of the plan needs, including histories and functions
/// of the modes. If these members are consistent, the text is empty. (rungs_check.cpp)
/// \pre is_rung(plan.fidelity) is true, and modes and points are consistent
std::string find_rung_inconsistency(const StepPlan& plan);

/// Returns what is wrong with the links at true geometry, turning bodies and curvilinear coordinates of a
/// plan. If they are consistent, the text is empty. (links_check.cpp)  \pre modes, points and particles are
/// consistent
std::string find_link_inconsistency(const StepPlan& plan);

/// Returns what is wrong with the integration of points. If it is consistent, the text is empty.
/// (points_check.cpp)  \pre the rest of the plan is consistent
std::string find_points_inconsistency(const StepPlan& plan);

/// Returns what is wrong with the tables for the verdict of a consistent plan. If they are consistent, the
/// text is empty. (rungs_check.cpp)
std::string find_verdict_inconsistency(const Plan& plan);

}  // namespace freeflex
