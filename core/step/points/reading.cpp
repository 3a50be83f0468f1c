#include "core/step/points/reading.hpp"

#include <algorithm>

#include "core/step/coupled/stage.hpp"
#include "core/step/linear/kernels.hpp"
#include "core/step/loads/step_loads.hpp"
#include "core/step/points/frame_of_points.hpp"
#include "core/step/readout.hpp"

namespace freeflex {

void place_points(const StepPlan& plan, const PointHistory& history, double* x, double* v) noexcept {
  const PlanPoints& method = plan.points_method;
  const double h = plan.period * method.ticks / method.steps;
  const std::size_t size = history.x.size();
  if (!history.is_multistep) {
    std::copy(history.x.begin(), history.x.end(), x);
    std::copy(history.v.begin(), history.v.end(), v);
    return;
  }
  const Past a = past_of(history.accelerations, history.earliest);
  const double* const change =
      history.changes[(index(history.earliest) + kPastSteps - 1) % kPastSteps].data();
  const std::int32_t passed = method.ticks - history.ticks_left;
  const double* const weights = method.weights.data() + 3 * kPastSteps * index(passed - 1);
  sum_past(weights + kPastSteps, h, a, 1.0 / h, change, size, v);
  if (history.ticks_left == 0) std::copy(history.x.begin(), history.x.end(), x);
  if (history.ticks_left == 0) return;
  const double share = static_cast<double>(history.ticks_left) / method.ticks;
  sum_past(weights, h * h, a, -share, change, size, x);
  for (std::size_t i = 0; i < size; ++i) x[i] += history.x[i];
}

void read_points(const StepPlan& plan, State& state) noexcept {
  const PointHistory& history = state.point_history;
  if (state.points.is_set || history.num_nodes == 0) return;
  PointsAtTick& points = state.points;
  place_points(plan, history, points.x.data(), points.v.data());
  points.is_set = true;
  if (!history.is_multistep) {
    points.a = history.a;
    return;
  }
  const PlanPoints& method = plan.points_method;
  const Past a = past_of(history.accelerations, history.earliest);
  if (history.ticks_left == 0) {
    std::copy(a[kPastSteps - 1], a[kPastSteps - 1] + points.a.size(), points.a.begin());
    return;
  }
  const std::int32_t passed = method.ticks - history.ticks_left;
  const double* const weights = method.weights.data() + 3 * kPastSteps * index(passed - 1) + 2 * kPastSteps;
  sum_past(weights, 1.0, a, 0.0, history.x.data(), points.a.size(), points.a.data());
}

void read_frame(const StepPlan& plan, State& state) noexcept {
  if (state.has_frame) return;
  read_points(plan, state);
  const double *const x = state.points.x.data(), *const v = state.points.v.data();
  const std::size_t num_points = plan.points.size();
  static_cast<Frame&>(state) = {.p_WB = of_point(x, num_points),
                                .v_WB = of_point(v, num_points),
                                .q_WB = attitude_of_points(plan, x, state.point_history.attitude)};
  for (std::size_t i = 0; i < num_points; ++i)
    state.H_W = add_scaled(state.H_W, plan.points[i].mass, cross(of_point(x, i), of_point(v, i)));
  state.has_frame = true;
}

void read_modes(const StepPlan& plan, State& state, Workspace& workspace) noexcept {
  if (state.has_modes) return;
  read_frame(plan, state);
  PointsWorkspace& w = workspace.points;
  const double *const x = state.points.x.data(), *const v = state.points.v.data();
  const std::size_t num_points = plan.points.size();
  const Mat3 R = rotation_matrix(state.q_WB);
  for (std::size_t i = 0; i < num_points; ++i) {
    const PlanPoint& point = plan.points[i];
    const double share = point.mass / plan.mass;
    w.u[i] = scale(share, sub(multiply_transposed(R, of_point(x, i)), point.r));
    w.rate[i] = scale(share, multiply_transposed(R, of_point(v, i)));
  }
  CoupledState& coupled = state.coupled;
  project_points(plan, w.u, w.rate, state.q.data(), coupled.momentum.data());
  const StepLoads last{plan, state.commands_pattern, state.tick - 1 - state.epoch_start_tick,
                       plan.coupled.num_substeps - 1};
  const StageState now{state.q.data(),
                       coupled.momentum.data(),
                       multiply_transposed(R, state.H_W),
                       R,
                       state.p_WB,
                       StageTime::kEnd,
                       {}};
  StageRate rate{coupled.rate_q.data(), coupled.rate_p.data(), state.Q.data()};
  evaluate(last, now, workspace, rate);
  for (std::size_t l = 0; l < index(plan.num_padded); ++l)
    state.q_dot[l] = coupled.momentum[l] + coupled.rate_q[l];
  coupled.w_B = rate.w_B;
  coupled.w_dot_B = rate.w_dot_B;
  coupled.moment_B = rate.moment_B;
  coupled.balance_B = rate.balance_B;
  state.force_W = rate.force_W;
  state.moment_B = rate.rest_moment_B;
  state.has_modes = true;
}

}  // namespace freeflex
