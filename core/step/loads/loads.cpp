#include "core/step/loads/loads.hpp"

#include <algorithm>
#include <cassert>

#include "core/step/linear/kernels.hpp"
#include "core/step/vector.hpp"

namespace freeflex {
namespace {

/// Adds the moment of a world force F at r to the table: L_c,ab += (e_c x r)_a F_b   (THEORY 8.2).
void add_moment(const Vec3& r, const Vec3& F, std::array<double, 27>& moment) noexcept {
  const Mat3 arm = {0.0, -r[2], r[1], r[2], 0.0, -r[0], -r[1], r[0], 0.0};  // row c: e_c x r
  for (std::size_t ca = 0; ca < 9; ++ca)
    for (std::size_t b = 0; b < 3; ++b) moment[3 * ca + b] += arm[ca] * F[b];
}

/// Returns the projection of torques onto those that a group supports. For a collinear group it is
/// 1 - e_g e_g^T, where e_g is the direction of its line (THEORY 8.9).
Mat3 torque_projection(const PlanGroup& group) noexcept {
  if (group.torque_rank == 0) return {};
  Mat3 P = {1, 0, 0, 0, 1, 0, 0, 0, 1};
  if (group.torque_rank == 2)
    for (std::size_t i = 0; i < 3; ++i)
      for (std::size_t j = 0; j < 3; ++j) P[3 * i + j] -= group.line[i] * group.line[j];
  return P;
}

constexpr Mat3 kUnit = {1, 0, 0, 0, 1, 0, 0, 0, 1};

/// Adds a world torque T, of which only the projection by P acts, to the table: L_c,ab += P_ca T_b
/// (THEORY 8.2). P is torque_projection for a group, and the unit matrix for a body   (THEORY 16.13).
void add_torque(const Mat3& P, const Vec3& T, std::array<double, 27>& moment) noexcept {
  for (std::size_t ca = 0; ca < 9; ++ca)
    for (std::size_t b = 0; b < 3; ++b) moment[3 * ca + b] += P[ca] * T[b];
}

bool has_load(const Vec3& force, const Vec3& torque) noexcept { return !is_zero(force) || !is_zero(torque); }

void clear(LoadPattern& pattern) noexcept {
  pattern.force_W = {};
  pattern.moment_W = {};
  pattern.has_world = false;
  pattern.num_direct = 0;
  pattern.uses_table = false;
  pattern.force_B = {};
  pattern.torque_B = {};
  pattern.has_body = false;
}

/// Sets the resultant and the moment table of the world loads, F_W = sum_i F_i   (THEORY 8.1), L_c,ab
/// (THEORY 8.2).
void set_world_rigid(const StepPlan& plan, const SumsOnPoints& sums, LoadPattern& pattern) noexcept {
  for (const std::int32_t i : sums.points) {
    const PlanPoint& point = plan.points[index(i)];
    const Vec3& force = sums.force_W[load_index(plan, i)];
    if (is_zero(force)) continue;
    pattern.has_world = true;
    pattern.force_W = add(pattern.force_W, force);
    add_moment(point.r, force, pattern.moment_W);
  }
  for (std::size_t k = 0; k < plan.groups.size(); ++k) {
    if (!has_load(sums.group_force_W[k], sums.group_torque_W[k])) continue;
    pattern.has_world = true;
    pattern.force_W = add(pattern.force_W, sums.group_force_W[k]);
    add_moment(plan.groups[k].centre, sums.group_force_W[k], pattern.moment_W);
    add_torque(torque_projection(plan.groups[k]), sums.group_torque_W[k], pattern.moment_W);
  }
  for (const Vec3& torque : sums.torque_W) {
    if (is_zero(torque)) continue;
    pattern.has_world = true;
    add_torque(kUnit, torque, pattern.moment_W);
  }
}

/// Stores the world forces one by one if they act on at most kMaxDirect points (THEORY 8.4). Returns false if
/// a table is needed, because they act on more points or because there are wrenches or torques.
bool try_direct(const StepPlan& plan, const SumsOnPoints& sums, LoadPattern& pattern) noexcept {
  for (std::size_t k = 0; k < plan.groups.size(); ++k)
    if (has_load(sums.group_force_W[k], sums.group_torque_W[k])) return false;
  if (!std::all_of(sums.torque_W.begin(), sums.torque_W.end(), is_zero)) return false;
  for (const std::int32_t i : sums.points) {
    const Vec3& force = sums.force_W[load_index(plan, i)];
    if (is_zero(force)) continue;
    if (pattern.num_direct == LoadPattern::kMaxDirect) {
      pattern.num_direct = 0;
      return false;
    }
    pattern.direct_row[index(pattern.num_direct)] = plan.points[index(i)].row;
    pattern.direct_force_W[index(pattern.num_direct)] = force;
    ++pattern.num_direct;
  }
  return true;
}

/// Sets the table of the world loads: Q_l,ab = sum_i b_il,a F_i,b   (THEORY 8.5), and for torques on bodies
/// Q_l,ab = theta_l,a T_b   (THEORY 16.13).
void set_table(const StepPlan& plan, std::span<const double> group_rows, const SumsOnPoints& sums,
               LoadPattern& pattern) noexcept {
  pattern.uses_table = true;
  const std::size_t n = index(plan.num_padded);
  std::fill(pattern.table.begin(), pattern.table.end(), 0.0);
  for (const std::int32_t i : sums.points) {
    if (const Vec3& force = sums.force_W[load_index(plan, i)]; !is_zero(force))
      add_outer(point_rows(plan, plan.points[index(i)].row), force, n, pattern.table.data());
  }
  for (std::size_t k = 0; k < plan.groups.size(); ++k) {
    const double* rows = group_rows.data() + 6 * k * n;
    if (!is_zero(sums.group_force_W[k])) add_outer(rows, sums.group_force_W[k], n, pattern.table.data());
    if (!is_zero(sums.group_torque_W[k]))
      add_outer(rows + 3 * n, sums.group_torque_W[k], n, pattern.table.data());
  }
  for (std::size_t k = 0; k < sums.torque_W.size(); ++k)
    if (!is_zero(sums.torque_W[k]))
      add_outer(rotation_rows(plan, static_cast<std::int32_t>(k)), sums.torque_W[k], n, pattern.table.data());
}

/// Sets the resultant, the moment and the generalized forces of the loads in body axes   (THEORY 8.7):
///   F_B = sum_i F_i,   L_B = sum_i r_i x F_i,   Q_B,l = sum_i b_il . F_i
/// A torque T on a body adds T to L_B and theta_l . T to Q_B,l   (THEORY 16.13).
void set_body(const StepPlan& plan, std::span<const double> group_rows, const SumsOnPoints& sums,
              LoadPattern& pattern) noexcept {
  const std::size_t n = index(plan.num_padded);
  const auto add_rows = [&](const double* rows, const Vec3& f) {
    combine_rows(rows, f, pattern.has_body, n, pattern.Q_B.data());
    pattern.has_body = true;
  };
  for (const std::int32_t i : sums.points) {
    const PlanPoint& point = plan.points[index(i)];
    const Vec3& force = sums.force_B[load_index(plan, i)];
    if (is_zero(force)) continue;
    pattern.force_B = add(pattern.force_B, force);
    pattern.torque_B = add(pattern.torque_B, cross(point.r, force));
    add_rows(point_rows(plan, point.row), force);
  }
  for (std::size_t k = 0; k < plan.groups.size(); ++k) {
    const double* rows = group_rows.data() + 6 * k * n;
    if (!is_zero(sums.group_force_B[k])) {
      pattern.force_B = add(pattern.force_B, sums.group_force_B[k]);
      pattern.torque_B = add(pattern.torque_B, cross(plan.groups[k].centre, sums.group_force_B[k]));
      add_rows(rows, sums.group_force_B[k]);
    }
    if (!is_zero(sums.group_torque_B[k])) {
      const Vec3 torque = multiply(torque_projection(plan.groups[k]), sums.group_torque_B[k]);
      pattern.torque_B = add(pattern.torque_B, torque);
      add_rows(rows + 3 * n, sums.group_torque_B[k]);
    }
  }
  for (std::size_t k = 0; k < sums.torque_B.size(); ++k) {
    if (is_zero(sums.torque_B[k])) continue;
    pattern.torque_B = add(pattern.torque_B, sums.torque_B[k]);
    add_rows(rotation_rows(plan, static_cast<std::int32_t>(k)), sums.torque_B[k]);
  }
}

/// Converts the world loads to loads in body axes, for a body that keeps its attitude   (THEORY 8.6, 14.4).
void fold_world(const StepPlan& plan, LoadPattern& pattern) noexcept {
  if (!pattern.uses_table && pattern.num_direct == 0) return;
  const bool has_body = pattern.has_body;
  pattern.has_body = false;
  project(plan, pattern, plan.scope.R_WB, 1.0, has_body, pattern.Q_B.data());
  pattern.has_body = true;
  pattern.uses_table = false;
  pattern.num_direct = 0;
}

}  // namespace

std::size_t load_index(const StepPlan& plan, std::int32_t point) noexcept {
  return index(is_coupled(plan) ? point : plan.points[index(point)].row);
}

SumsOnPoints make_load_sums(const StepPlan& plan) {
  SumsOnPoints sums;
  std::size_t num_sums = 0;
  for (std::size_t i = 0; i < plan.points.size(); ++i) {
    const auto point = static_cast<std::int32_t>(i);
    if (!is_coupled(plan) && plan.points[i].row < 0) continue;
    sums.points.push_back(point);
    num_sums = std::max(num_sums, load_index(plan, point) + 1);
  }
  for (auto* v : {&sums.force_W, &sums.force_B}) v->resize(num_sums);
  for (auto* v : {&sums.group_force_W, &sums.group_torque_W, &sums.group_force_B, &sums.group_torque_B})
    v->resize(plan.groups.size());
  for (auto* v : {&sums.torque_W, &sums.torque_B}) v->resize(plan.particles.attitude_points.size());
  sums.wheel_torques.resize(plan.wheels.size());
  return sums;
}

void clear(LoadSums& sums) noexcept {
  for (auto* v : {&sums.force_W, &sums.force_B, &sums.group_force_W, &sums.group_torque_W,
                  &sums.group_force_B, &sums.group_torque_B, &sums.torque_W, &sums.torque_B})
    std::fill(v->begin(), v->end(), Vec3{});
  std::fill(sums.wheel_torques.begin(), sums.wheel_torques.end(), 0.0);
}

void add_loads(const StepPlan& plan, const LoadSet& loads, LoadSums& sums) noexcept {
  const bool is_body = loads.axes == 1;
  for (const PointForce& f : loads.forces) {
    Vec3& sum = (is_body ? sums.force_B : sums.force_W)[load_index(plan, f.point)];
    sum = add(sum, f.force);
  }
  for (const Wrench& w : loads.wrenches) {
    Vec3& force = (is_body ? sums.group_force_B : sums.group_force_W)[index(w.group)];
    Vec3& torque = (is_body ? sums.group_torque_B : sums.group_torque_W)[index(w.group)];
    force = add(force, w.force);
    torque = add(torque, w.torque);
  }
  for (const PointTorque& t : loads.torques) {
    Vec3& sum = (is_body ? sums.torque_B : sums.torque_W)[index(attitude_index_of(plan, t.point))];
    sum = add(sum, t.torque);
  }
  for (const WheelTorque& w : loads.wheels) sums.wheel_torques[index(w.wheel)] += w.torque;
}

CommandComponents::CommandComponents(const StepPlan& plan) noexcept
    : torques(3 * plan.points.size()),
      group_forces(torques + 3 * plan.particles.attitude_points.size()),
      group_torques(group_forces + 3 * plan.groups.size()),
      motors(group_torques + 3 * plan.groups.size()),
      count(motors + plan.wheels.size()) {}

double command_coefficient(const CommandComponents& components, const LoadSums& sums, const Mat3& R_WB,
                           std::size_t component) noexcept {
  const auto of = [&](std::size_t first, const std::vector<Vec3>& world, const std::vector<Vec3>& body) {
    const std::size_t item = (component - first) / 3, axis = (component - first) % 3;
    const Vec3& W = world[item];
    return body[item][axis] + ((R_WB[axis] * W[0] + R_WB[3 + axis] * W[1]) + R_WB[6 + axis] * W[2]);
  };
  if (component < components.torques) return of(0, sums.force_W, sums.force_B);
  if (component < components.group_forces) return of(components.torques, sums.torque_W, sums.torque_B);
  if (component < components.group_torques)
    return of(components.group_forces, sums.group_force_W, sums.group_force_B);
  if (component >= components.motors) return sums.wheel_torques[component - components.motors];
  return of(components.group_torques, sums.group_torque_W, sums.group_torque_B);
}

Array make_group_rows(const StepPlan& plan) {
  const std::size_t n = index(plan.num_padded);
  Array rows(6 * plan.groups.size() * n, 0.0);
  for (std::size_t k = 0; k < plan.groups.size(); ++k) {
    const PlanGroup& group = plan.groups[k];
    for (const std::int32_t i : carriers_of_group(plan, k)) {
      const PlanPoint& point = mass_point(plan, i);
      const Vec3 d = sub(point.r, group.centre);
      for (std::size_t a = 0; a < 3; ++a) {
        Vec3 unit{};
        unit[a] = point.mass / group.mass;
        combine_rows(point_rows(plan, point.row), unit, true, n, rows.data() + (6 * k + a) * n);
        const Mat3& J = group.inverse_inertia;
        const Vec3 f = scale(point.mass, cross({J[a], J[3 + a], J[6 + a]}, d));
        combine_rows(point_rows(plan, point.row), f, true, n, rows.data() + (6 * k + 3 + a) * n);
      }
    }
  }
  return rows;
}

LoadPattern make_pattern(const StepPlan& plan) {
  LoadPattern pattern;
  pattern.table.resize(9 * index(plan.num_padded));
  pattern.Q_B.resize(index(plan.num_padded));
  pattern.wheel_torques.resize(plan.wheels.size());
  if (is_coupled(plan)) pattern.sums = make_load_sums(plan);
  return pattern;
}

void set_pattern(const StepPlan& plan, std::span<const double> group_rows, const SumsOnPoints& sums,
                 LoadPattern& pattern) noexcept {
  clear(pattern);
  std::copy(sums.wheel_torques.begin(), sums.wheel_torques.end(), pattern.wheel_torques.begin());
  set_world_rigid(plan, sums, pattern);
  if (is_coupled(plan)) {
    pattern.sums = sums;  // both patterns have the same sizes, so nothing is allocated
    for (const auto* v : {&sums.force_B, &sums.group_force_B, &sums.group_torque_B, &sums.torque_B})
      for (const Vec3& each : *v) pattern.has_body |= !is_zero(each);
    return;
  }
  if (!try_direct(plan, sums, pattern)) set_table(plan, group_rows, sums, pattern);
  set_body(plan, group_rows, sums, pattern);
  if (!plan.has_rotation) fold_world(plan, pattern);
}

LoadPattern build_pattern(const StepPlan& plan, const LoadSet& loads) {
  SumsOnPoints sums = make_load_sums(plan);
  add_loads(plan, loads, sums);
  return build_pattern(plan, sums);
}

LoadPattern build_pattern(const StepPlan& plan, const SumsOnPoints& sums) {
  LoadPattern pattern = make_pattern(plan);
  set_pattern(plan, make_group_rows(plan), sums, pattern);
  if (!pattern.uses_table) pattern.table = {};
  if (!pattern.has_body || is_coupled(plan)) pattern.Q_B = {};
  return pattern;
}

bool project(const StepPlan& plan, const LoadPattern& pattern, const Mat3& R_WB, double amplitude,
             bool accumulate, double* Q) noexcept {
  const std::size_t n = index(plan.num_padded);
  if (pattern.uses_table) {
    Mat3 weights{};
    for (std::size_t a = 0; a < 3; ++a)
      for (std::size_t b = 0; b < 3; ++b) weights[3 * a + b] = R_WB[3 * b + a] * amplitude;
    combine_table(pattern.table.data(), weights, accumulate, n, Q);
    accumulate = true;
  }
  for (std::int32_t k = 0; k < pattern.num_direct; ++k) {
    const Vec3 f_B = scale(amplitude, multiply_transposed(R_WB, pattern.direct_force_W[index(k)]));
    combine_rows(point_rows(plan, pattern.direct_row[index(k)]), f_B, accumulate, n, Q);
    accumulate = true;
  }
  if (pattern.has_body) {
    combine_one(pattern.Q_B.data(), amplitude, accumulate, n, Q);
  }
  return pattern.has_world || pattern.has_body;
}

BodyResultant body_resultant(const StepPlan& plan, const LoadPattern& pattern) noexcept {
  assert(is_coupled(plan));
  BodyResultant all;
  const LoadSums& sums = pattern.sums;
  const auto add_force = [&](const Vec3& arm, const Vec3& force) {
    all.force = add(all.force, force);
    all.torque = add(all.torque, cross(arm, force));
  };
  for (std::size_t i = 0; i < sums.force_B.size(); ++i)
    if (!is_zero(sums.force_B[i])) add_force(plan.points[i].r, sums.force_B[i]);
  for (std::size_t k = 0; k < plan.groups.size(); ++k) {
    add_force(plan.groups[k].centre, sums.group_force_B[k]);
    all.torque = add(all.torque, multiply(torque_projection(plan.groups[k]), sums.group_torque_B[k]));
  }
  for (const Vec3& torque : sums.torque_B) all.torque = add(all.torque, torque);
  return all;
}

namespace {

/// Returns J_g^-1 T of a group at the present positions of its carriers, and their centre of mass. A group
/// whose points were on a line at rest takes no torque about the line that they are nearest to now
/// (THEORY 8.8, 8.9).
Vec3 present_acceleration(const StepPlan& plan, std::size_t number, std::span<const Vec3> x, Vec3 torque,
                          Vec3& centre) noexcept {
  const PlanGroup& group = plan.groups[number];
  centre = {};
  for (const std::int32_t i : carriers_of_group(plan, number))
    centre = add_scaled(centre, mass_point(plan, i).mass / group.mass, x[index(i)]);
  if (group.torque_rank == 0) return {};
  Mat3 J{};
  Vec3 line{};
  for (const std::int32_t i : carriers_of_group(plan, number)) {
    const PlanPoint& point = mass_point(plan, i);
    const Vec3 y = sub(x[index(i)], centre);
    const double square = dot(y, y);
    for (std::size_t a = 0; a < 3; ++a)
      for (std::size_t b = 0; b < 3; ++b)
        J[3 * a + b] += point.mass * ((a == b ? square : 0.0) - y[a] * y[b]);
    line = add_scaled(line, point.mass * dot(sub(point.r, group.centre), group.line), y);
  }
  if (group.torque_rank == 2) {
    line = scale(1.0 / length(line), line);
    torque = add_scaled(torque, -dot(line, torque), line);
    const double trace = J[0] + J[4] + J[8];
    for (std::size_t a = 0; a < 3; ++a)
      for (std::size_t b = 0; b < 3; ++b) J[3 * a + b] += trace * line[a] * line[b];
  }
  return solve_by_adjugate(J, torque);
}

}  // namespace

void add_point_forces(const StepPlan& plan, const LoadPattern& pattern, const Mat3& R_WB, double amplitude,
                      std::span<const Vec3> x, std::span<Vec3> forces) noexcept {
  if (!pattern.has_world && !pattern.has_body) return;
  const LoadSums& sums = pattern.sums;
  const auto in_body_axes = [&](const Vec3& W, const Vec3& B) {
    return scale(amplitude, add(multiply_transposed(R_WB, W), B));
  };
  for (std::size_t i = 0; i < sums.force_W.size(); ++i)
    if (!is_zero(sums.force_W[i]) || !is_zero(sums.force_B[i]))
      forces[i] = add(forces[i], in_body_axes(sums.force_W[i], sums.force_B[i]));
  for (std::size_t k = 0; k < plan.groups.size(); ++k) {
    const PlanGroup& group = plan.groups[k];
    const Vec3 force = in_body_axes(sums.group_force_W[k], sums.group_force_B[k]);
    const Vec3 torque = in_body_axes(sums.group_torque_W[k], sums.group_torque_B[k]);
    if (!has_load(force, torque)) continue;
    Vec3 centre = group.centre;
    const Vec3 theta = x.empty() || is_zero(torque) ? multiply(group.inverse_inertia, torque)
                                                    : present_acceleration(plan, k, x, torque, centre);
    for (const std::int32_t i : carriers_of_group(plan, k)) {
      const PlanPoint& point = mass_point(plan, i);
      const Vec3 arm = sub(x.empty() || is_zero(torque) ? point.r : x[index(i)], centre);
      const Vec3 a = add_scaled(cross(theta, arm), 1.0 / group.mass, force);
      forces[index(i)] = add_scaled(forces[index(i)], point.mass, a);
    }
  }
}

}  // namespace freeflex
