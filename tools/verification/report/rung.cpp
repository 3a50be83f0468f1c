#include "tools/verification/report/rung.hpp"

#include <utility>

#include "core/plan/file/plan_bytes.hpp"
#include "core/plan/rungs/rates.hpp"
#include "core/step/linear/kernels.hpp"
#include "core/step/readout.hpp"
#include "core/step/vector.hpp"

namespace freeflex::tools {

Rung::Rung(Plan given, const CartesianSystem& system)
    : plan(std::move(given)),
      carried(system.carried),
      motion(plan, kMotionAlone),
      V(plan.points.size()),
      V_dot(plan.points.size()) {}

void Rung::take_freely(std::int64_t ticks, double free_step) {
  set_rate(free_plan.emplace(plan), 1.0 / free_step);
  for (PlanHistory& history : free_plan->histories) history.start_tick = 0, history.end_tick = ticks;
}

bool Rung::advance(const Plan& at, std::int64_t ticks) {
  motion.set_plan(at);
  for (std::int64_t k = 0; k < ticks; ++k)
    if (motion.advance().status != StepStatus::kOk) return false;
  return true;
}

void Rung::read(CartesianState& to) {
  read_points(to);
  for (std::size_t k = 0; k < carried.size(); ++k) {
    const auto [point, arm] = carried[k];
    const auto column = static_cast<Eigen::Index>(plan.points.size() + k);
    const BodyState body = read_body(plan, motion.state(), point);
    const Eigen::Quaterniond R(body.q_WP[0], body.q_WP[1], body.q_WP[2], body.q_WP[3]);
    to.p_W.col(column) = to.p_W.col(point) + R * arm;
    to.v_W.col(column) =
        to.v_W.col(point) + R * Eigen::Map<const Eigen::Vector3d>(body.w_P.data()).cross(arm);
  }
}

void Rung::read_points(CartesianState& to) {
  if (integrates_points(plan)) {
    const PointsAtTick& points = motion.points();
    const auto count = static_cast<Eigen::Index>(plan.points.size());
    const Eigen::Map<const Eigen::Matrix3Xd> x(points.x.data(), 3, count + 1),
        v(points.v.data(), 3, count + 1);
    to.p_W = x.leftCols(count).colwise() + x.col(count);
    to.v_W = v.leftCols(count).colwise() + v.col(count);
    return;
  }
  const State& state = motion.state();
  if (!plan.coupled.turning.bodies.empty()) {  // rows do not give the positions of points on turning bodies
    for (int i = 0; i < static_cast<int>(plan.points.size()); ++i) {
      const PointState point = read_point(plan, state, i);
      to.p_W.col(i) = Eigen::Map<const Eigen::Vector3d>(point.p_W.data());
      to.v_W.col(i) = Eigen::Map<const Eigen::Vector3d>(point.v_W.data());
    }
    return;
  }
  contract_points(plan, state.q.data(), state.q_dot.data(), V, V_dot);
  const Mat3 R = rotation_matrix(state.q_WB);
  const Vec3 w = angular_velocity(plan, state);
  for (std::size_t i = 0; i < plan.points.size(); ++i) {
    const Vec3 x = add(plan.points[i].r, V[i]);
    const Vec3 p = add(state.p_WB, multiply(R, x)),
               v = add(state.v_WB, multiply(R, add(cross(w, x), V_dot[i])));
    const auto column = static_cast<Eigen::Index>(i);
    to.p_W.col(column) = Eigen::Vector3d(p[0], p[1], p[2]);
    to.v_W.col(column) = Eigen::Vector3d(v[0], v[1], v[2]);
  }
}

double Rung::energy() const {
  const Invariants now = read_invariants(plan, motion.state());
  return now.kinetic_rigid + now.kinetic_elastic + now.potential;
}

std::size_t Rung::memory() const {
  const State& state = motion.state();
  const std::size_t arrays =
      state.q.size() + state.q_low.size() + state.q_dot.size() + state.q_dot_low.size() + state.Q.size();
  // the workspace contains the next state, and the loads at both ends of the step
  const std::size_t plans = plan_to_bytes(plan).size() * (free_plan ? 2 : 1);
  return plans + (2 * arrays + 2 * state.Q.size()) * sizeof(double);
}

}  // namespace freeflex::tools
