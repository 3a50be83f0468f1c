#include "core/step/coupled/strain_damping.hpp"

#include <algorithm>

#include "core/step/linear/kernels.hpp"
#include "core/step/links/bar.hpp"
#include "core/step/turning/turning.hpp"

namespace freeflex {
namespace {

// [-] Displacement of the differences of forces over the size of the structure. The damping of a beam is off
// by its square times EA L^2 / EI, and by the rounding error of forces over it: by 8.5e-5 on a boom at 1e-4,
// and by 2e-7 here. The joints are found to 1e-7 rad or better, and the differences are of second order.
constexpr double kProbed = 5e-6;

/// Returns the largest speed of a point in the frame [m/s]. A body counts with its spin times the size.
/// \param size  [m]
double largest_speed(const StepPlan& plan, const double* q_dot, CoupledWorkspace& probe,
                     double size) noexcept {
  const std::size_t n = index(plan.num_padded);
  contract_points(plan, q_dot, q_dot, probe.V, probe.W);
  double largest = 0.0;
  for (const Vec3& V_dot : probe.V) largest = std::max(largest, dot(V_dot, V_dot));
  for (const PlanTurningBody& body : plan.coupled.turning.bodies) {
    const Vec3 theta_dot = contract_rows(body.rows.data() + 3 * n, q_dot, n);
    largest = std::max(largest, size * size * dot(theta_dot, theta_dot));
  }
  return __builtin_sqrt(largest);
}

/// Adds the elastic forces of springs and bars that end at massless points, or of all others.
void add_elastic_bars(const StepPlan& plan, bool at_massless, CoupledWorkspace& probe) noexcept {
  const std::span<const Vec3> linear_V = linear_displacements(probe);
  for (const PlanBar& bar : plan.coupled.bars) {
    if (probe.joints.massless.holds(bar) != at_massless) continue;
    const std::size_t i = index(bar.first), j = index(bar.second);
    const auto along = [&](const Vec3& d) {
      return scale(bar.stiffness * dot(bar.direction, d), bar.direction);
    };
    const Vec3 d = sub(probe.V[j], probe.V[i]);
    const Vec3 exact = add(bar_force(bar, d).excess, along(d)), linear = along(sub(linear_V[j], linear_V[i]));
    probe.force[i] = add(probe.force[i], exact), probe.force[j] = sub(probe.force[j], exact);
    probe.linear[i] = add(probe.linear[i], linear), probe.linear[j] = sub(probe.linear[j], linear);
  }
}

/// Adds `share` times the projection of the forces beyond the linear ones to `out` [N], and clears the
/// forces.
void project_excess(const StepPlan& plan, double share, CoupledWorkspace& probe, Array& out) noexcept {
  const bool has_bodies = turns(plan);
  for (std::size_t i = 0; i < plan.points.size(); ++i)
    probe.drift[i] = !has_bodies || is_free(plan, i) ? sub(probe.force[i], probe.linear[i]) : Vec3{};
  project_points(plan, probe.drift, probe.drift, probe.q.data(), probe.p.data());
  for (TurningMotion& at : probe.bodies) at.force = at.torque = {};
  sum_body_forces(plan, probe);
  add_body_forces(plan, probe, probe.q.data());
  combine_one(probe.q.data(), share, true, out.size(), out.data());
  std::fill(probe.force.begin(), probe.force.end(), Vec3{});
  std::fill(probe.linear.begin(), probe.linear.end(), Vec3{});
}

/// Adds `share` times the elastic forces beyond the linear ones [N] at the coordinates probe.q_dot: those of
/// springs and bars, which Rayleigh's beta damps already, to out[1], and those of other links to out[0].
/// Springs and bars that end at massless points count as other links, because the rates of these points are
/// not known.
void add_excess(const StepPlan& plan, double share, CoupledWorkspace& probe,
                std::array<Array, 2>& out) noexcept {
  const double* const q = probe.q_dot.data();
  contract_points(plan, q, q, probe.V, probe.W);
  if (!probe.bodies.empty() || has_massless(probe))
    std::copy(probe.V.begin(), probe.V.end(), probe.linear_V.begin());
  if (!probe.bodies.empty()) place_bodies(plan, q, probe.V, probe.bodies);
  relax_links(plan, q, probe);
  std::fill(probe.force.begin(), probe.force.end(), Vec3{});
  std::fill(probe.linear.begin(), probe.linear.end(), Vec3{});
  std::fill(probe.joints.on_body.begin(), probe.joints.on_body.end(), Vec3{});
  std::fill(probe.joints.linear_on_body.begin(), probe.joints.linear_on_body.end(), Vec3{});
  add_elastic_bars(plan, false, probe);
  project_excess(plan, share, probe, out[1]);
  add_elastic_bars(plan, true, probe);
  add_links(plan, probe);
  combine_one(probe.Q.data(), share, true, out[0].size(), out[0].data());
  project_excess(plan, share, probe, out[0]);
}

/// Sets `to` to a + s b, component by component. relax_joints() makes the quaternions unit again.
void add_turns(const JointState& a, double s, const JointState& b, JointState& to) noexcept {
  for (std::size_t j = 0; j < a.rotation.size(); ++j)
    for (std::size_t k = 0; k < 4; ++k) to.rotation[j][k] = a.rotation[j][k] + s * b.rotation[j][k];
  for (std::size_t k = 0; k < a.angle.size(); ++k) to.angle[k] = a.angle[k] + s * b.angle[k];
}

}  // namespace

void begin_strain_damping(CoupledWorkspace& w) noexcept {
  for (CoupledWorkspace& probe : w.probe) begin_joints(probe.joints);
  std::fill(w.probe_turn.rotation.begin(), w.probe_turn.rotation.end(), Quat{});
  std::fill(w.probe_turn.angle.begin(), w.probe_turn.angle.end(), 0.0);
}

void add_strain_damping(const StepPlan& plan, const StageState& stage, CoupledWorkspace& w,
                        StageRate& rate) noexcept {
  if (w.probe.empty()) return;
  CoupledWorkspace& probe = w.probe.front();
  const std::size_t n = index(plan.num_padded);
  for (std::size_t l = 0; l < n; ++l) w.q_dot[l] = stage.p[l] + rate.rate_q[l];
  double size = 0.0;
  for (const PlanPoint& point : plan.points) size = std::max(size, dot(point.r, point.r));
  size = __builtin_sqrt(size);
  const double speed = largest_speed(plan, w.q_dot.data(), probe, size);
  if (!(speed > 0.0)) return;
  const double step = kProbed * size / speed;
  probe.joints.massless.load = w.joints.massless.load;
  for (Array& each : w.excess_rate) std::fill(each.begin(), each.end(), 0.0);
  for (const double sign : {1.0, -1.0}) {
    // the joints turn by about as much as at the last stage, and in the other direction for the other sign
    add_turns(w.stage_joints, sign, w.probe_turn, probe.stage_joints);
    for (std::size_t l = 0; l < n; ++l) probe.q_dot[l] = stage.q[l] + sign * step * w.q_dot[l];
    add_excess(plan, sign * 0.5 / step, probe, w.excess_rate);
    if (sign > 0.0) add_turns(probe.stage_joints, -1.0, w.stage_joints, w.probe_turn);
    if (probe.joints.unsolved >= 0) w.joints.unsolved = probe.joints.unsolved;
  }
  // N_p += ((t_l + beta) E'_l + t_l E'_l of springs and bars) / M   (THEORY 12.114)
  for (std::size_t l = 0; l < n; ++l) {
    if (plan.omega[l] == 0.0) continue;  // mechanisms have no strain
    const double time = plan.coupled.strain_times[l];
    const double force = (time + plan.coupled.beta) * w.excess_rate[0][l] + time * w.excess_rate[1][l];
    rate.rate_p[l] += force / plan.mass;
    if (rate.Q != nullptr) rate.Q[l] += force;
  }
}

}  // namespace freeflex
