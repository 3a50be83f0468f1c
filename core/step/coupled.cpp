#include "core/step/coupled.hpp"

#include <algorithm>
#include <cassert>

#include "core/step/field.hpp"
#include "core/step/history.hpp"
#include "core/step/mixing.hpp"
#include "core/step/readout.hpp"

namespace freeflex {
namespace {

/// Solves A x = b for a symmetric 3x3 matrix by its adjugate.
Vec3 solve(const Mat3& A, const Vec3& b) noexcept {
  const Vec3 x{A[0], A[1], A[2]}, y{A[3], A[4], A[5]}, z{A[6], A[7], A[8]};
  const Vec3 yz = cross(y, z), zx = cross(z, x), xy = cross(x, y);
  const double determinant = dot(x, yz);
  return scale(1.0 / determinant, add_scaled(add_scaled(scale(b[0], yz), b[1], zx), b[2], xy));
}

/// x less its part along a unit vector, or x when that is zero.
Vec3 across(const Vec3& line, const Vec3& x) noexcept { return add_scaled(x, -dot(line, x), line); }

/// Where the body stands at one stage.
struct Place {
  const double *q, *p;  // [m], [m/s] (num_padded) elastic coordinates and momenta over the mass
  Vec3 H_B;             // [kg m^2/s]
  Mat3 R_WB;
  Vec3 p_WB;  // [m]
  Instant instant;
};

/// What the motion gains there. Arrays of the caller: rate_q [m/s], rate_p [m/s^2] (num_padded).
struct Gain {
  double *rate_q, *rate_p;
  double* Q = nullptr;   // [N] (num_padded) generalized forces, where they are asked for
  Vec3 w_B{};            // [rad/s]
  Vec3 moment_B{};       // [N m] with the arms of the deformed body
  Vec3 rest_moment_B{};  // [N m] with the arms of the body at rest
  Vec3 force_W{};        // [N]
};

/// The frame's angular velocity from angular momentum, displacements V and W = b p   (X92a, X92b):
///   J = I + sum m ((r.V) 1 - r V^T),   pi = sum m V x W,   alpha = J^-1 (H - pi),   w = J^-1 I alpha
Vec3 angular_velocity(const Plan& plan, const Vec3& H_B, const CoupledWorkspace& w, Vec3& alpha) noexcept {
  alpha = {};
  if (plan.rigid_freedoms == 3) return {};
  Mat3 J = plan.inertia;
  Vec3 pi{};
  for (std::size_t i = 0; i < plan.points.size(); ++i) {
    const double m = plan.points[i].mass;
    const Vec3 &r = plan.points[i].r, mV = scale(m, w.V[i]);
    pi = add(pi, cross(mV, w.W[i]));
    const double arm = dot(r, mV);
    // symmetric by (2.6); the mean of both halves keeps it so in rounding
    const double xy = 0.5 * (r[0] * mV[1] + r[1] * mV[0]), xz = 0.5 * (r[0] * mV[2] + r[2] * mV[0]),
                 yz = 0.5 * (r[1] * mV[2] + r[2] * mV[1]);
    J[0] += arm - r[0] * mV[0], J[4] += arm - r[1] * mV[1], J[8] += arm - r[2] * mV[2];
    J[1] -= xy, J[3] -= xy, J[2] -= xz, J[6] -= xz, J[5] -= yz, J[7] -= yz;
  }
  const Vec3 H = sub(H_B, pi);
  if (plan.rigid_freedoms == 6) {
    alpha = solve(J, H);
    return solve(J, multiply(plan.inertia, alpha));
  }
  // a line carries no spin about itself: what remains is two equations, held apart from the third
  const double trace = J[0] + J[4] + J[8];
  Mat3 P{};
  for (std::size_t a = 0; a < 3; ++a) {
    Vec3 unit{};
    unit[a] = 1.0;
    const Vec3 column = across(plan.line, multiply(J, across(plan.line, unit)));
    for (std::size_t b = 0; b < 3; ++b) P[3 * b + a] = column[b] + trace * plan.line[b] * plan.line[a];
  }
  alpha = across(plan.line, solve(P, across(plan.line, H)));
  return across(plan.line, solve(P, across(plan.line, multiply(plan.inertia, alpha))));
}

/// Adds what true lengths and directions change of the bars' forces   (X94), with
///   d' = W_j - W_i + (alpha - w) x l_0 e - w x d
void add_bars(const Plan& plan, const Vec3& alpha, const Vec3& w_B, CoupledWorkspace& w) noexcept {
  const Vec3 slip = sub(alpha, w_B);
  for (const PlanBar& bar : plan.coupled.bars) {
    const std::size_t i = index(bar.first), j = index(bar.second);
    const Vec3 d = sub(w.V[j], w.V[i]);
    Vec3 excess = bar_force(bar, d).excess;
    if (bar.damping > 0.0) {
      // z_j - z_i less what the body's spin gives it: rest arms turn with alpha, the deformed ones with w
      const Vec3 d_dot =
          sub(add(sub(w.W[j], w.W[i]), cross(slip, scale(bar.length, bar.direction))), cross(w_B, d));
      excess = add(excess, damper_force(bar, d, d_dot).excess);
    }
    w.force[i] = add(w.force[i], excess);
    w.force[j] = sub(w.force[j], excess);
  }
}

/// The point that has a block of rows. On coupled rungs every point has one, in the order of the points
/// (find_rung_inconsistency): the index of either is that of the other.
std::size_t point_of_row([[maybe_unused]] const Plan& plan, std::int32_t row) noexcept {
  assert(plan.points[index(row)].row == row);
  return index(row);
}

/// Loads on the points: histories, commands, and what followers add as they turn, theta x f   (X73).
void gather_forces(const External& external, const Place& place, CoupledWorkspace& w) noexcept {
  const Plan& plan = external.plan;
  external.on_points(place.instant, place.R_WB, w.force);
  for (const PlanHistory& history : plan.histories)
    for (const PlanFollower& follower : history.followers) {
      const Vec3 theta = contract_rows(follower.turn_rows.data(), place.q, index(plan.num_padded));
      Vec3& force = w.force[point_of_row(plan, follower.row)];
      force = add_scaled(force, external.amplitude(history, place.instant), cross(theta, follower.force_B));
    }
}

/// Resultant and moments of the loads on the points.
void sum_forces(const Plan& plan, const Place& place, const CoupledWorkspace& w, Gain& gain) noexcept {
  Vec3 force_B{};
  for (std::size_t i = 0; i < plan.points.size(); ++i) {
    if (is_zero(w.force[i])) continue;
    force_B = add(force_B, w.force[i]);
    gain.rest_moment_B = add(gain.rest_moment_B, cross(plan.points[i].r, w.force[i]));
    gain.moment_B = add(gain.moment_B, cross(add(plan.points[i].r, w.V[i]), w.force[i]));
  }
  gain.force_W = multiply(place.R_WB, force_B);
}

/// Fields, dashpots, feedback and what followers stiffen: few coordinates, added after the sums over points.
void add_modal_loads(const External& external, const Place& place, Workspace& workspace,
                     Gain& gain) noexcept {
  const Plan& plan = external.plan;
  const bool has_mixing = plan.mixing.num_damping > 0 || !plan.feedbacks.empty();
  const bool has_followers =
      std::any_of(plan.histories.begin(), plan.histories.end(),
                  [](const PlanHistory& each) { return !each.stiffening.modes.empty(); });
  if (!has_field(plan) && !has_mixing && !has_followers) return;
  CoupledWorkspace& w = workspace.coupled;
  const std::size_t n = index(plan.num_padded);
  std::fill(w.Q.begin(), w.Q.end(), 0.0);
  if (has_field(plan)) {
    add_field(plan, place.R_WB, {}, place.p_WB, w.Q.data());
    const Vec3 torque =
        gradient_torque(plan, multiply_transposed(place.R_WB, sub(place.p_WB, plan.attractor_W)));
    gain.moment_B = add(gain.moment_B, torque);
    gain.rest_moment_B = add(gain.rest_moment_B, torque);
  }
  if (has_followers)
    for (const PlanHistory& history : plan.histories)
      stiffen(history, external.amplitude(history, place.instant), place.q, w.Q.data());
  if (has_mixing) {
    for (std::size_t l = 0; l < n; ++l) w.q_dot[l] = place.p[l] + gain.rate_q[l];
    add_mixing_forces(plan, place.q, w.q_dot.data(), workspace.scratch, w.Q.data());
    const DependentLoad feedback = feed_back(plan, place.q, w.q_dot.data(), w.Q.data());
    gain.moment_B = add(gain.moment_B, feedback.torque_B);
    gain.rest_moment_B = add(gain.rest_moment_B, feedback.torque_B);
    gain.force_W = add(gain.force_W, multiply(place.R_WB, feedback.force_B));
  }
  for (std::size_t l = 0; l < n; ++l) gain.rate_p[l] += w.Q[l] / plan.mass;
  if (gain.Q == nullptr) return;
  for (std::size_t l = 0; l < n; ++l) gain.Q[l] += w.Q[l];
}

/// What the motion gains beside the modes' own linear motion   (X92c to X92f), z = W + alpha x r, u below:
///   rate_q = sum m b . (V x w) / M,   rate_p = -2 decay rate_q + (sum m b . (z x w) + Q) / M,
///   moment = sum (r + V) x F
void evaluate(const External& external, const Place& place, Workspace& workspace, Gain& gain) noexcept {
  const Plan& plan = external.plan;
  CoupledWorkspace& w = workspace.coupled;
  contract_points(plan, place.q, place.p, w.V, w.W);
  Vec3 alpha;
  gain.w_B = angular_velocity(plan, place.H_B, w, alpha);
  gather_forces(external, place, w);
  sum_forces(plan, place, w, gain);
  add_bars(plan, alpha, gain.w_B, w);
  if (gain.Q != nullptr) project_points(plan, w.force, w.force, gain.Q, gain.rate_p);
  const double inverse_mass = 1.0 / plan.mass;
  for (std::size_t i = 0; i < plan.points.size(); ++i) {
    const double share = plan.points[i].mass * inverse_mass;
    const Vec3 u = add(w.W[i], cross(alpha, plan.points[i].r));
    w.drift[i] = scale(share, cross(w.V[i], gain.w_B));
    w.force[i] = add_scaled(scale(inverse_mass, w.force[i]), share, cross(u, gain.w_B));
  }
  project_points(plan, w.drift, w.force, gain.rate_q, gain.rate_p);
  const double* decay = plan.decay.data();
  for (std::size_t l = 0; l < index(plan.num_moving); ++l) gain.rate_p[l] -= 2.0 * decay[l] * gain.rate_q[l];
  add_modal_loads(external, place, workspace, gain);
}

/// Rows of PlanCoupled::functions.
struct Function {
  const double *qq, *qv, *vq, *vv;
};
Function function_of(const Plan& plan, PlanCoupled::Function function) noexcept {
  const std::size_t n = index(plan.num_padded);
  const double* first = plan.coupled.functions.data() + PlanCoupled::kNumEntries * std::size_t{function} * n;
  return {first, first + n, first + 2 * n, first + 3 * n};
}

using Stages = std::array<std::array<const double*, 2>, 4>;  // rates of (q, p) at each stage

/// (q, p) at half a step, exp(h L / 2) y + (h / 2) phi_1(h L / 2) N_1 + h phi_2(h L / 2) (N_2 - N_1)   (X93);
/// without the last when `other` is the first stage.
void half_stage(const Plan& plan, const MotionState& state, const Stages& N, std::size_t other,
                CoupledWorkspace& w) noexcept {
  const Function E = function_of(plan, PlanCoupled::kHalfStep), A = function_of(plan, PlanCoupled::kHalf1),
                 B = function_of(plan, PlanCoupled::kHalf2);
  const double *q = state.q.data(), *p = state.coupled.momentum.data();
  const double *a = N[0][0], *b = N[0][1], *c = N[other][0], *d = N[other][1];
  for (std::size_t l = 0; l < index(plan.num_moving); ++l) {
    const double x = c[l] - a[l], y = d[l] - b[l];
    w.q[l] = q[l] + ((E.qq[l] * q[l] + E.qv[l] * p[l]) + (A.qq[l] * a[l] + A.qv[l] * b[l]) +
                     (B.qq[l] * x + B.qv[l] * y));
    w.p[l] = p[l] + ((E.vq[l] * q[l] + E.vv[l] * p[l]) + (A.vq[l] * a[l] + A.vv[l] * b[l]) +
                     (B.vq[l] * x + B.vv[l] * y));
  }
}

/// (q, p) after the whole step   (X93); x and y below are the sums over the stages that phi_2 and phi_3 take.
void whole_step(const Plan& plan, const MotionState& state, const Stages& N, bool is_last, double* q_out,
                double* p_out) noexcept {
  const Function E = function_of(plan, PlanCoupled::kStep), A = function_of(plan, PlanCoupled::kWhole1),
                 B = function_of(plan, PlanCoupled::kWhole2), C = function_of(plan, PlanCoupled::kWhole3);
  const double *q = state.q.data(), *p = state.coupled.momentum.data();
  for (std::size_t l = 0; l < index(plan.num_moving); ++l) {
    std::array<double, 2> x{}, y{};
    for (std::size_t k = 0; k < 2; ++k) {
      const double n1 = N[0][k][l], n3 = N[2][k][l];
      if (!is_last) {
        x[k] = 2.0 * (n3 - n1);
        continue;
      }
      const double n2 = N[1][k][l], n4 = N[3][k][l];
      x[k] = 2.0 * ((n2 - n1) + (n3 - n1)) - (n4 - n1);
      y[k] = 4.0 * (((n1 - n2) - n3) + n4);
    }
    const double a = N[0][0][l], b = N[0][1][l];
    q_out[l] = q[l] + ((E.qq[l] * q[l] + E.qv[l] * p[l]) + (A.qq[l] * a + A.qv[l] * b) +
                       (B.qq[l] * x[0] + B.qv[l] * x[1]) + (C.qq[l] * y[0] + C.qv[l] * y[1]));
    p_out[l] = p[l] + ((E.vq[l] * q[l] + E.vv[l] * p[l]) + (A.vq[l] * a + A.vv[l] * b) +
                       (B.vq[l] * x[0] + B.vv[l] * x[1]) + (C.vq[l] * y[0] + C.vv[l] * y[1]));
  }
}

bool are_finite(const Array& values) noexcept {
  double sum = 0.0;
  for (const double x : values) sum += x - x;
  return sum == 0.0;
}

/// The turning part over one step, by the classical method, to which (X93) comes where nothing is linear:
/// Gibbs vector and angular momentum in the axes of the step's start, (k_1 + 2 k_2 + 2 k_3 + k_4) / 6 of
///   g' = (w + g x w + g (g.w)) / 2,   H' = G(g) L_B   (X7, X8)
struct AttitudeRates {
  Mat3 R_start;
  Vec3 H_start;  // [kg m^2/s]
  std::array<Vec3, 4> g_rate{}, H_rate{}, force_W{};

  void add_stage(std::size_t k, const Vec3& g, const Gain& gain) noexcept {
    const Vec3 half_w = scale(0.5, gain.w_B);
    g_rate[k] = add_scaled(add(half_w, cross(g, half_w)), dot(g, half_w), g);
    H_rate[k] = multiply(rotation_of_gibbs(g), gain.moment_B);
    force_W[k] = gain.force_W;
  }
  static Vec3 mean(const std::array<Vec3, 4>& k) noexcept {
    return scale(1.0 / 6.0, add(add(k[0], k[3]), scale(2.0, add(k[1], k[2]))));
  }
};

}  // namespace

BarForce bar_force(const PlanBar& bar, const Vec3& d) noexcept {
  const Vec3 x = add_scaled(d, bar.length, bar.direction);
  const double along = dot(bar.direction, d), l = __builtin_sqrt(dot(x, x));
  const double tension = bar.stiffness * ((2.0 * bar.length * along + dot(d, d)) / (l + bar.length));
  return {tension, add_scaled(scale(tension / l, x), -bar.stiffness * along, bar.direction)};
}

BarForce damper_force(const PlanBar& bar, const Vec3& d, const Vec3& d_dot) noexcept {
  const Vec3 x = add_scaled(d, bar.length, bar.direction);
  const double l = __builtin_sqrt(dot(x, x)), tension = bar.damping * (dot(x, d_dot) / l);
  return {tension,
          add_scaled(scale(tension / l, x), -bar.damping * dot(bar.direction, d_dot), bar.direction)};
}

void set_coupled_motion(const Plan& plan, const Vec3& w_B, MotionState& state) noexcept {
  CoupledState& coupled = state.coupled;
  const std::size_t n = index(plan.num_padded);
  const Vec3& w = coupled.w_B = w_B;
  std::copy(state.q_dot.begin(), state.q_dot.end(), coupled.momentum.begin());
  Vec3 H{};
  for (std::size_t i = 0; i < plan.points.size(); ++i) {
    const PlanPoint& point = plan.points[i];
    const double* rows = point_rows(plan, point.row);
    const Vec3 V = contract_rows(rows, state.q.data(), n), V_dot = contract_rows(rows, state.q_dot.data(), n);
    // what V' lacks in the moment of (X91) about the displaced arms: sum m r x V' is zero by (2.6)
    const Vec3 x = add(point.r, V);
    H = add_scaled(H, point.mass, add(cross(x, cross(w, x)), cross(V, V_dot)));
    combine_rows(rows, scale(point.mass / plan.mass, cross(w, V)), true, n, coupled.momentum.data());
  }
  state.H_W = multiply(rotation_matrix(state.q_WB), H);
  state.H_W_low = {};
  coupled.has_rates = false;
}

CoupledWorkspace make_coupled_workspace(const Plan& plan) {
  CoupledWorkspace w;
  const std::size_t n = index(plan.num_padded);
  for (auto* v : {&w.V, &w.W, &w.force, &w.drift}) v->resize(plan.points.size());
  for (auto* v : {&w.q, &w.p, &w.q_dot, &w.Q}) v->resize(n);
  for (auto& stage : w.rates)
    for (Array& rate : stage) rate.resize(n);
  for (auto* v : {&w.next.momentum, &w.next.rate_q, &w.next.rate_p}) v->resize(n);
  return w;
}

bool advance_coupled_rung(const External& external, const MotionState& state, bool is_fresh,
                          Workspace& workspace, Frame& frame, Vec3& force_W, Vec3& moment_B) noexcept {
  const Plan& plan = external.plan;
  CoupledWorkspace& w = workspace.coupled;
  const double h = plan.period / plan.coupled.num_parts;
  AttitudeRates turning{rotation_matrix(state.q_WB), {}};
  turning.H_start = multiply_transposed(turning.R_start, state.H_W);
  Stages N{};
  for (std::size_t k = 0; k < 4; ++k) N[k] = {w.rates[k][0].data(), w.rates[k][1].data()};
  const auto visit = [&](std::size_t k, const double* q, const double* p, const Vec3& g, const Vec3& H,
                         double t, Instant instant) {
    const Mat3 G = rotation_of_gibbs(g);
    Gain gain{w.rates[k][0].data(), w.rates[k][1].data()};
    evaluate(external,
             {q, p, multiply_transposed(G, H), multiply(turning.R_start, G),
              add_scaled(state.p_WB, t, state.v_WB), instant},
             workspace, gain);
    turning.add_stage(k, g, gain);
  };
  if (is_fresh || !state.coupled.has_rates) {
    visit(0, state.q.data(), state.coupled.momentum.data(), {}, turning.H_start, 0.0, Instant::kStart);
  } else {
    N[0] = {state.coupled.rate_q.data(), state.coupled.rate_p.data()};
    turning.add_stage(
        0, {}, {nullptr, nullptr, nullptr, state.coupled.w_B, state.coupled.moment_B, {}, state.force_W});
  }
  const auto H_at = [&](double t, std::size_t k) {
    return add_scaled(turning.H_start, t, turning.H_rate[k]);
  };
  half_stage(plan, state, N, 0, w);
  visit(1, w.q.data(), w.p.data(), scale(0.5 * h, turning.g_rate[0]), H_at(0.5 * h, 0), 0.5 * h,
        Instant::kMiddle);
  half_stage(plan, state, N, 1, w);
  visit(2, w.q.data(), w.p.data(), scale(0.5 * h, turning.g_rate[1]), H_at(0.5 * h, 1), 0.5 * h,
        Instant::kMiddle);
  whole_step(plan, state, N, false, w.q.data(), w.p.data());
  visit(3, w.q.data(), w.p.data(), scale(h, turning.g_rate[2]), H_at(h, 2), h, Instant::kEnd);
  whole_step(plan, state, N, true, workspace.next_q.data(), w.next.momentum.data());

  frame = state;
  turn_attitude(scale(h, AttitudeRates::mean(turning.g_rate)), frame);
  const Vec3 H_gain = scale(h, multiply(turning.R_start, AttitudeRates::mean(turning.H_rate)));
  for (std::size_t i = 0; i < 3; ++i) add_compensated(frame.H_W[i], frame.H_W_low[i], H_gain[i]);
  translate(plan, h, turning.force_W[0], scale(0.5, add(turning.force_W[1], turning.force_W[2])),
            turning.force_W[3], frame);

  const Mat3 R_end = rotation_matrix(frame.q_WB);
  Gain end{w.next.rate_q.data(), w.next.rate_p.data(), workspace.Q_left.data()};
  evaluate(external,
           {workspace.next_q.data(), w.next.momentum.data(), multiply_transposed(R_end, frame.H_W), R_end,
            frame.p_WB, Instant::kEnd},
           workspace, end);
  for (std::size_t l = 0; l < index(plan.num_padded); ++l)
    workspace.next_q_dot[l] = w.next.momentum[l] + w.next.rate_q[l];
  w.next.w_B = end.w_B;
  w.next.moment_B = end.moment_B;
  w.next.has_rates = true;
  force_W = end.force_W;
  moment_B = end.rest_moment_B;
  return are_finite(workspace.next_q) && are_finite(w.next.momentum) && are_finite(w.next.rate_q) &&
         are_finite(w.next.rate_p);
}

}  // namespace freeflex
