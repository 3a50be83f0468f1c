#include "tests/step/hand_plan.hpp"

#include <Eigen/Dense>
#include <cstring>
#include <random>

#include "core/plan/modes/propagator.hpp"
#include "core/step/rigid/principal.hpp"
#include "core/structure/modes/dense/decompositions.hpp"

namespace freeflex::testing {
namespace {

Vec3 random_vector(int a, int b, double scale) {
  std::mt19937_64 engine(1000003u * static_cast<unsigned>(a) + static_cast<unsigned>(b) + 17u);
  std::uniform_real_distribution<double> uniform(-scale, scale);
  const double x = uniform(engine), y = uniform(engine), z = uniform(engine);
  return {x, y, z};
}

}  // namespace

Vec3 hand_point(int point) { return random_vector(point, -1, 1.0); }
Vec3 hand_shape(int point, int mode) { return random_vector(point, mode, 2.0); }

StepPlan hand_plan(double period, std::span<const Mode> modes, int num_points) {
  StepPlan plan;
  plan.period = period;
  plan.mass = 2.0;
  plan.inertia = {2.0, 0, 0, 0, 3.0, 0, 0, 0, 4.0};
  plan.inverse_inertia = {1.0 / 2.0, 0, 0, 0, 1.0 / 3.0, 0, 0, 0, 1.0 / 4.0};
  set_principal(plan);
  const std::size_t n = pad(modes.size());
  plan.num_elastic = static_cast<std::int32_t>(modes.size());
  plan.num_moving = plan.num_padded = static_cast<std::int32_t>(n);
  Propagator& p = plan.propagator;
  p.lanes.resize(n / kLanes);
  for (auto* v : {&plan.omega, &plan.decay, &plan.initial.q, &plan.initial.q_dot}) v->assign(n, 0.0);
  for (std::size_t l = 0; l < modes.size(); ++l) {
    plan.omega[l] = modes[l].omega;
    plan.decay[l] = modes[l].decay;
    plan.initial.q[l] = modes[l].q;
    plan.initial.q_dot[l] = modes[l].q_dot;
    set_mode(p, static_cast<int>(l), modes[l].omega, modes[l].decay, period, plan.mass);
  }
  plan.eckart_rows.assign(6 * n, 0.0);
  plan.rows.assign(3 * n * static_cast<std::size_t>(num_points), 0.0);
  for (int k = 0; k < num_points; ++k) {
    PlanPoint point;
    point.mass = plan.mass / num_points;
    point.r = hand_point(k);
    point.row = k;
    point.pushable = true;
    plan.points.push_back(point);
    for (std::size_t l = 0; l < modes.size(); ++l) {
      const Vec3 shape = hand_shape(k, static_cast<int>(l));
      for (std::size_t a = 0; a < 3; ++a) plan.rows[(3 * static_cast<std::size_t>(k) + a) * n + l] = shape[a];
    }
  }
  return plan;
}

PlanGroup hand_group(const StepPlan& plan, std::vector<std::int32_t> points) {
  using Eigen::Matrix3d, Eigen::Vector3d;
  PlanGroup group;
  group.points = std::move(points);
  Vector3d centre = Vector3d::Zero();
  for (const std::int32_t i : group.points) {
    const PlanPoint& point = plan.points[static_cast<std::size_t>(i)];
    group.mass += point.mass;
    centre += point.mass * Vector3d(point.r.data());
  }
  centre /= group.mass;
  Matrix3d inertia = Matrix3d::Zero();
  for (const std::int32_t i : group.points) {
    const PlanPoint& point = plan.points[static_cast<std::size_t>(i)];
    const Vector3d d = Vector3d(point.r.data()) - centre;
    inertia += point.mass * (d.squaredNorm() * Matrix3d::Identity() - d * d.transpose());
  }
  const Eigen::SelfAdjointEigenSolver<Matrix3d> eigen(inertia);
  Vector3d inverse = Vector3d::Zero();
  group.torque_rank = 0;
  for (int k = 0; k < 3; ++k) {
    if (eigen.eigenvalues()[k] < 1e-12) continue;
    inverse[k] = 1.0 / eigen.eigenvalues()[k];
    ++group.torque_rank;
  }
  const Matrix3d J = eigen.eigenvectors() * inverse.asDiagonal() * eigen.eigenvectors().transpose();
  for (int i = 0; i < 3; ++i) {
    group.centre[static_cast<std::size_t>(i)] = centre[i];
    if (group.torque_rank == 2) group.line[static_cast<std::size_t>(i)] = eigen.eigenvectors()(i, 0);
    for (int j = 0; j < 3; ++j) group.inverse_inertia[static_cast<std::size_t>(3 * i + j)] = J(i, j);
  }
  return group;
}

ForceCommand hand_command(const char* sender, int slot, std::int32_t axes) {
  ForceCommand command{};
  std::strncpy(command.sender.data(), sender, kSenderSize - 1);
  command.slot = slot;
  command.axes = axes;
  command.start_tick = -1;
  command.duration_ticks = std::int64_t{1} << 60;
  return command;
}

void add_force(ForceCommand& command, int point, const Vec3& force) {
  command.points[static_cast<std::size_t>(command.num_points++)] = {point, 0, force};
}

void add_wrench(ForceCommand& command, int group, const Vec3& force, const Vec3& torque) {
  command.wrenches[static_cast<std::size_t>(command.num_wrenches++)] = {group, 0, force, torque};
}

void HandRun::run(std::int64_t ticks, std::span<const ForceCommand> commands) {
  for (std::int64_t k = 0; k < ticks; ++k) {
    if (step_once(k == 0 ? commands : std::span<const ForceCommand>{}) != StepStatus::kOk) std::abort();
  }
}

}  // namespace freeflex::testing
