#include "core/step/points/history.hpp"

namespace freeflex {

PointsAtTick make_points_at_tick(const PlanPoints& plan) {
  PointsAtTick points;
  for (Array* each : {&points.x, &points.v, &points.a}) each->resize(size_over_points(plan));
  return points;
}

PointHistory make_point_history(const PlanPoints& plan) {
  PointHistory history;
  const std::size_t size = size_over_points(plan);
  for (Array* each : {&history.x, &history.x_low, &history.d, &history.v, &history.a, &history.load})
    each->resize(size);
  for (auto* all : {&history.node_d, &history.node_v, &history.node_a})
    for (Array& each : *all) each.resize(size);
  for (auto* all : {&history.changes, &history.accelerations})
    for (Array& each : *all) each.resize(size);
  return history;
}

PointsWorkspace make_points_workspace(const PlanPoints& plan) {
  PointsWorkspace w;
  const std::size_t size = size_over_points(plan);
  if (size == 0) return w;
  for (Array* each :
       {&w.x, &w.x_low, &w.d, &w.v, &w.a, &w.other_x, &w.other_low, &w.start_v, &w.start_a, &w.load})
    each->resize(size);
  w.changes.assign(kPastSteps + 1, Array(size));
  w.accelerations = w.changes;
  w.extrapolation = make_extrapolation_workspace(size);
  w.force.resize(4 * plan.inverse_mass.size());
  const std::size_t num_points = plan.inverse_mass.size() - 1;
  for (auto* each : {&w.forces, &w.x_B, &w.u, &w.rate}) each->resize(num_points);
  return w;
}

}  // namespace freeflex
