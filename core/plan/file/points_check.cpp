// Consistency checks of the method that integrates points, before a plan is stepped.
#include <algorithm>
#include <cmath>

#include "core/faults.hpp"
#include "core/plan/file/plan_check.hpp"
#include "core/plan/integration/choose_method.hpp"
#include "core/step/points/history.hpp"

namespace freeflex {
namespace {

bool are_points_of(const std::vector<std::int32_t>& values, std::size_t size) {
  return std::ranges::all_of(values,
                             [size](std::int32_t value) { return value >= 0 && index(value) < size; });
}

bool has_size(const Array& values, std::size_t size) { return values.size() == size && are_finite(values); }

std::string find_in_springs(const StepPlan& plan, const PlanPoints& method) {
  const std::size_t count = method.first.size(), num_points = plan.points.size();
  if (count % 4 != 0 || method.second.size() != count || !are_points_of(method.first, num_points) ||
      !are_points_of(method.second, num_points))
    return "the springs between integrated points are out of range";
  for (const Array* each : {&method.stiffness, &method.inverse_square, &method.tension, &method.damping})
    if (!has_size(*each, each == &method.damping && each->empty() ? 0 : count))
      return "the springs between integrated points have the wrong size";
  if (!has_size(method.inverse_mass, num_points + 1) || method.inverse_mass.back() != 0.0 ||
      !has_size(method.share, size_over_points(method)))
    return "the masses of integrated points have the wrong size";
  return {};
}

std::string find_in_start(const PlanPoints& method) {
  if (method.spacing < 1 || method.spacing > method.ticks || method.num_nodes < 4 ||
      index(method.num_nodes) > kStartNodes || method.starts.size() != kPastSteps + 1)
    return "the start of the integration of points is out of range";
  for (const PlanStartValue& start : method.starts) {
    const bool is_in_range = start.node < method.num_nodes && start.node >= -1 && start.first_node >= 0 &&
                             start.first_node + 4 <= method.num_nodes;
    if (!is_in_range || !std::ranges::all_of(start.weights, [](double w) { return std::isfinite(w); }))
      return "a position that starts the integration of points is out of range";
  }
  return {};
}

}  // namespace

std::string find_points_inconsistency(const StepPlan& plan) {
  const PlanPoints& method = plan.points_method;
  if (method.steps == 0)
    return method.first.empty() && method.inverse_mass.empty()
               ? ""
               : "the plan has points that it does not integrate";
  if (std::string error = find_no_points_method(plan); !error.empty())
    return "the plan integrates points, but " + error +
           "; use a rate at which this holds, set the rate in the scene, or write integration: {by: modes} "
           "there";
  if (std::max(method.steps, method.pieces) > kMostStepsPerTick)
    return join_text("a tick takes more than ", kMostStepsPerTick, " steps of the integration of points");
  if (method.steps < 1 || method.ticks < 1 || method.ticks > kMostTicksPerStep ||
      (method.steps > 1 && method.ticks > 1) || method.pieces < 1 ||
      (method.damping.empty() && method.steps % method.pieces != 0) || method.columns < 1 ||
      method.columns > kMostColumns)
    return "the steps of the integration of points are out of range";
  if (!std::isfinite(method.noise) || !std::isfinite(method.resolved) || !std::isfinite(method.accuracy))
    return "a limit of the integration of points is not finite";
  if (std::string error = find_in_springs(plan, method); !error.empty()) return error;
  if (!method.damping.empty()) return {};
  if (std::string error = find_in_start(method); !error.empty()) return error;
  if (!has_size(method.weights, 3 * index(method.ticks) * kPastSteps))
    return "the weights of the integration of points have the wrong size";
  return {};
}

}  // namespace freeflex
