#include "core/step/turning/spread.hpp"

#include <algorithm>

#include "core/step/coupled/stage.hpp"
#include "core/step/coupled/tables.hpp"
#include "core/step/linear/dense_lu.hpp"
#include "core/step/linear/kernels.hpp"
#include "core/step/turning/turning.hpp"

namespace freeflex {
namespace {

/// Returns A + s B.
Mat3 sum(const Mat3& A, double s, const Mat3& B) noexcept {
  Mat3 C;
  for (std::size_t k = 0; k < 9; ++k) C[k] = A[k] + s * B[k];
  return C;
}

/// Derivatives of the coefficients of T(v) by the square of the angle   (THEORY 12.59).
TangentCoefficients tangent_slopes(const Vec3& v, const FiniteRotation& rotation) noexcept {
  const double square = dot(v, v), f = rotation.half_sine;
  if (square < 1.0) {
    // sum_k (-1)^k k a^(2k - 2) / (2k + 2)!, and the same with (2k + 3)!
    double first = 0.0, second = 0.0;
    for (int k = 9; k >= 1; --k) {
      const double n = k, step = -square / ((2.0 * n + 3.0) * (2.0 * n + 4.0));
      first = 1.0 + (n + 1.0) / n * step * first;
      second = 1.0 + (n + 1.0) / n * -square / ((2.0 * n + 4.0) * (2.0 * n + 5.0)) * second;
    }
    return {-first / 24.0, -second / 120.0};
  }
  const double cosine = 1.0 - 2.0 * square * f * f, sine_per_angle = 2.0 * f * rotation.q[0];
  return {(square * sine_per_angle - 2.0 * (1.0 - cosine)) / (2.0 * square * square),
          ((1.0 - cosine) - 3.0 * (1.0 - sine_per_angle)) / (2.0 * square * square)};
}

/// A of s = A theta' + R^T w and its rate: A = 1 - c_1 [theta x] + c_2 [theta x]^2, the transpose of T.
struct Tangent {
  Vec3 theta, theta_dot;
  TangentCoefficients c, c_dot;

  Tangent(const Vec3& at, const Vec3& rate) noexcept : theta(at), theta_dot(rate) {
    const FiniteRotation turn = rotation_of(at);
    c = tangent_of(at, turn);
    const TangentCoefficients slope = tangent_slopes(at, turn);
    const double twice = 2.0 * dot(at, rate);
    c_dot = {twice * slope.first, twice * slope.second};
  }
  /// Returns A x, or A^T x with the sign 1.
  Vec3 times(const Vec3& x, double sign) const noexcept {
    const Vec3 once = cross(theta, x);
    return add_scaled(add_scaled(x, sign * c.first, once), c.second, cross(theta, once));
  }
  /// Returns A' x, or A'^T x with the sign 1.
  Vec3 rate_times(const Vec3& x, double sign) const noexcept {
    const Vec3 once = cross(theta, x), of_rate = cross(theta_dot, x);
    Vec3 result = add_scaled(scale(sign * c_dot.first, once), sign * c.first, of_rate);
    result = add_scaled(result, c_dot.second, cross(theta, once));
    return add_scaled(result, c.second, add(cross(theta_dot, once), cross(theta, of_rate)));
  }
  Mat3 matrix() const noexcept {
    Mat3 A;
    for (std::size_t k = 0; k < 3; ++k) {
      Vec3 unit{};
      unit[k] = 1.0;
      const Vec3 column = times(unit, -1.0);
      for (std::size_t i = 0; i < 3; ++i) A[3 * i + k] = column[i];
    }
    return A;
  }
};

/// Factors 1 + K D of (THEORY 12.110), with the largest pivot of each column.
void factor_bodies(SpreadWorkspace& s) noexcept {
  const std::size_t n = 3 * s.bodies.size();
  double* const F = s.factor.data();
  for (std::size_t a = 0; a < n; ++a)
    for (std::size_t b = 0; b < n; ++b) {
      const double* row = s.coupling.data() + a * n + 3 * (b / 3);
      const Mat3& D = s.bodies[b / 3].D;
      F[a * n + b] = (a == b ? 1.0 : 0.0) + row[0] * D[b % 3] + row[1] * D[3 + b % 3] + row[2] * D[6 + b % 3];
    }
  factor_dense(F, s.pivots);
}
/// Replaces the right side x by (1 + K D)^-1 x.  \param x  (3B)
void solve_bodies(const SpreadWorkspace& s, double* x) noexcept { solve_dense(s.factor.data(), s.pivots, x); }

/// Sets A, D, E of a body   (THEORY 12.108, 12.109).
void set_body_terms(const PlanTurningBody& plan, const TurningMotion& at,
                    SpreadWorkspace::Body& body) noexcept {
  const Mat3& J = plan.inertia;
  body.A = Tangent(at.theta, {}).matrix();
  const Mat3 half = multiply_transposed(body.A, J);  // A^T J
  body.D = sum(multiply(half, body.A), -1.0, J);
  body.E = sum(multiply(half, transpose(at.R)), -1.0, J);
}

/// Sets the matrices of (THEORY 12.110) and factors them. I is the inertia of the present shape.
void factor_motion(const StepPlan& plan, const Mat3& I, CoupledWorkspace& w) noexcept {
  const std::size_t n = index(plan.num_padded);
  SpreadWorkspace& s = w.spread;
  const double inverse_mass = 1.0 / plan.mass;
  const double* const C = w.C.data();
  Mat3 S = I;
  for (std::size_t a = 0; a < 3; ++a)
    for (std::size_t b = 0; b < 3; ++b) S[3 * a + b] -= inverse_mass * dot_lanes(C + a * n, C + b * n, n);
  for (std::size_t b = 0; b < s.bodies.size(); ++b) {
    const PlanTurningBody& given = plan.coupled.turning.bodies[b];
    SpreadWorkspace::Body& body = s.bodies[b];
    set_body_terms(given, w.bodies[b], body);
    const double* const rows = given.rows.data() + 3 * n;
    for (std::size_t a = 0; a < 3; ++a)
      for (std::size_t c = 0; c < 3; ++c)
        body.G[3 * a + c] = inverse_mass * dot_lanes(rows + a * n, C + c * n, n);
    body.to_spin = sum(transpose(body.E), -1.0, multiply_transposed(body.G, body.D));
    const Mat3& R = w.bodies[b].R;
    S = sum(S, 1.0, sum(multiply(multiply(R, given.inertia), transpose(R)), -1.0, given.inertia));
    S = sum(S, -1.0, multiply_transposed(body.G, body.E));
  }
  if (!s.bodies.empty()) factor_bodies(s);
  const std::size_t size = 3 * s.bodies.size();
  for (std::size_t c = 0; c < 3; ++c) {  // by_spin = (1 + coupling D)^-1 (G + coupling E)
    for (std::size_t i = 0; i < size; ++i) {
      double value = s.bodies[i / 3].G[3 * (i % 3) + c];
      for (std::size_t j = 0; j < size; ++j)
        value += s.coupling[i * size + j] * s.bodies[j / 3].E[3 * (j % 3) + c];
      s.right[i] = value;
    }
    solve_bodies(s, s.right.data());
    for (std::size_t i = 0; i < size; ++i) s.bodies[i / 3].by_spin[3 * (i % 3) + c] = s.right[i];
  }
  for (const SpreadWorkspace::Body& body : s.bodies) S = sum(S, -1.0, multiply(body.to_spin, body.by_spin));
  w.frame = w.spin = spin_matrix(plan, S);
}

/// Solves (THEORY 12.110) for the motion of the frame, which it returns, and that of the bodies, in
/// body.theta. On entry body.theta is Theta times the known part.
Vec3 solve_motion(const StepPlan& plan, Vec3 rest, CoupledWorkspace& w) noexcept {
  SpreadWorkspace& s = w.spread;
  for (std::size_t i = 0; i < s.right.size(); ++i) s.right[i] = s.bodies[i / 3].theta[i % 3];
  solve_bodies(s, s.right.data());
  for (std::size_t b = 0; b < s.bodies.size(); ++b) {
    SpreadWorkspace::Body& body = s.bodies[b];
    body.theta = {s.right[3 * b], s.right[3 * b + 1], s.right[3 * b + 2]};
    rest = sub(rest, multiply(body.to_spin, body.theta));
  }
  const Vec3 of_frame = solve_for_spin(plan, w.spin, rest);
  for (SpreadWorkspace::Body& body : s.bodies) body.theta = sub(body.theta, multiply(body.by_spin, of_frame));
  return of_frame;
}

/// Adds -(C^T w + sum Theta^T (D theta + E w)) / M to x.
void add_share_of_frame(const StepPlan& plan, const Vec3& of_frame, const CoupledWorkspace& w,
                        double* x) noexcept {
  const std::size_t n = index(plan.num_padded);
  const double share = -1.0 / plan.mass;
  combine_rows(w.C.data(), scale(share, of_frame), true, n, x);
  for (std::size_t b = 0; b < w.spread.bodies.size(); ++b) {
    const SpreadWorkspace::Body& body = w.spread.bodies[b];
    const Vec3 beyond = add(multiply(body.D, body.theta), multiply(body.E, of_frame));
    combine_rows(plan.coupled.turning.bodies[b].rows.data() + 3 * n, scale(share, beyond), true, n, x);
  }
}

/// Adds the attraction of the linear parts of the mass and of the bodies: the torque on each body about its
/// centre, and the moment on the whole. Returns the gradient of the field   (THEORY 12.113).
Symmetric attract_spread(const StepPlan& plan, const StageState& stage, CoupledWorkspace& w,
                         StageRate& rate) noexcept {
  if (plan.attractor_mu <= 0.0) return {};
  const Vec3 rho = multiply_transposed(stage.R_WB, sub(stage.p_WB, plan.attractor_W));
  const double square = dot(rho, rho), inverse_square = 1.0 / square;
  const double rate_square = plan.attractor_mu * inverse_square / __builtin_sqrt(square);
  const auto entry = [&](std::size_t a, std::size_t b) {
    return rate_square * (3.0 * inverse_square * (rho[a] * rho[b]) - (a == b ? 1.0 : 0.0));
  };
  const Mat3 gradient{entry(0, 0), entry(0, 1), entry(0, 2), entry(1, 0), entry(1, 1),
                      entry(1, 2), entry(2, 0), entry(2, 1), entry(2, 2)};
  const auto attract =
      [&](const Mat3& inertia) {  // the moment of Gamma x over a mass, 3 mu rho x I rho / r^5
        return scale(3.0 * rate_square * inverse_square, cross(rho, multiply(inertia, rho)));
      };
  Mat3 linear = w.spread.inertia;
  Vec3 moment{};
  for (std::size_t b = 0; b < w.bodies.size(); ++b) {
    TurningMotion& at = w.bodies[b];
    const Mat3& J = plan.coupled.turning.bodies[b].inertia;
    const Vec3 torque = attract(multiply(multiply(at.R, J), transpose(at.R)));
    at.torque = add(at.torque, multiply_transposed(at.R, torque));
    moment = add(moment, torque);
    linear = sum(linear, -1.0, J);
  }
  moment = add(moment, attract(linear));
  rate.moment_B = add(rate.moment_B, moment);
  rate.rest_moment_B = add(rate.rest_moment_B, moment);
  return {gradient[0], gradient[4], gradient[8], gradient[1], gradient[2], gradient[5]};
}

}  // namespace

SpreadWorkspace make_spread_workspace(const StepPlan& plan) {
  SpreadWorkspace s;
  if (!has_spread_mass(plan)) return s;
  const std::size_t count = plan.coupled.turning.bodies.size(), size = 3 * count, n = index(plan.num_padded);
  s.bodies.resize(count);
  s.pivots.resize(size);
  s.right.resize(size);
  for (auto* v : {&s.coupling, &s.factor}) v->resize(size * size);
  for (std::size_t i = 0; i < size; ++i)
    for (std::size_t j = 0; j < size; ++j) {
      const auto row = [&](std::size_t k) {
        return plan.coupled.turning.bodies[k / 3].rows.data() + (3 + k % 3) * n;
      };
      s.coupling[i * size + j] = dot_lanes(row(i), row(j), n) / plan.mass;
    }
  return s;
}

void set_spread_velocities(const StepPlan& plan, const StageState& stage, CoupledWorkspace& w,
                           StageRate& rate) noexcept {
  const std::size_t n = index(plan.num_padded);
  w.spread.inertia = sum(plan.inertia, 1.0, inertia_of(sum_tables(plan, stage, w)));
  factor_motion(plan, w.spread.inertia, w);
  Vec3 rest = sub(stage.H_B, contract_rows(w.C.data(), stage.p, n));
  for (std::size_t b = 0; b < w.bodies.size(); ++b) {
    rest = sub(rest, multiply(w.bodies[b].R, w.bodies[b].wheels));
    w.spread.bodies[b].theta = w.bodies[b].S;
  }
  rate.w_B = solve_motion(plan, rest, w);
  std::fill_n(rate.rate_q, n, 0.0);
  add_share_of_frame(plan, rate.w_B, w, rate.rate_q);
  for (std::size_t l = 0; l < n; ++l) w.q_dot[l] = stage.p[l] + rate.rate_q[l];
  for (std::size_t b = 0; b < w.bodies.size(); ++b) {
    const PlanTurningBody& given = plan.coupled.turning.bodies[b];
    TurningMotion& at = w.bodies[b];
    SpreadWorkspace::Body& body = w.spread.bodies[b];
    body.theta_dot = body.theta;
    at.v = add(cross(rate.w_B, add(given.centre, at.V)), contract_rows(given.rows.data(), w.q_dot.data(), n));
    at.s = add(multiply(body.A, body.theta_dot), multiply_transposed(at.R, rate.w_B));
  }
  for (std::size_t i = 0; i < plan.points.size(); ++i) {
    const Vec3& r = plan.points[i].r;
    if (is_free(plan, i)) {
      w.W[i] = add(cross(rate.w_B, add(r, w.V[i])),
                   contract_rows(point_rows(plan, plan.points[i].row), w.q_dot.data(), n));
      continue;
    }
    const std::size_t b = index(plan.coupled.turning.of_points[i]);
    const Vec3 arm = sub(r, plan.coupled.turning.bodies[b].centre);
    w.W[i] = add(w.bodies[b].v, multiply(w.bodies[b].R, cross(w.bodies[b].s, arm)));
  }
}

void set_spread_rates(const StepPlan& plan, const StageState& stage, CoupledWorkspace& w,
                      StageRate& rate) noexcept {
  const std::size_t n = index(plan.num_padded);
  const double inverse_mass = 1.0 / plan.mass;
  w.spread.inertia_rate =
      inertia_of(rates_by_tables(plan, rate.w_B, attract_spread(plan, stage, w, rate), w));
  for (std::size_t i = 0; i < plan.points.size(); ++i)
    w.drift[i] = is_free(plan, i) ? sub(w.force[i], w.linear[i]) : Vec3{};
  project_points(plan, w.drift, w.drift, w.load.data(), w.spare.data());
  for (std::size_t k = 0; k < plan.particles.all.size(); ++k)
    if (plan.coupled.turning.of_carriers[k] < 0 && !is_zero(w.force[plan.points.size() + k]))
      combine_rows(point_rows(plan, plan.particles.all[k].row), w.force[plan.points.size() + k], true, n,
                   w.load.data());
  for (std::size_t b = 0; b < w.bodies.size(); ++b) {
    const TurningMotion& at = w.bodies[b];
    const PlanTurningBody& given = plan.coupled.turning.bodies[b];
    const Tangent tangent(at.theta, w.spread.bodies[b].theta_dot);
    const Vec3 Js = multiply(given.inertia, at.s);
    // Theta^T (A'^T J s + A^T ((J s + h) x s + tau) - tau_lin)
    const Vec3 torque = add(cross(add(Js, at.wheels), at.s), at.torque);
    const Vec3 moment = sub(add(tangent.rate_times(Js, 1.0), tangent.times(torque, 1.0)), at.linear_torque);
    combine_rows(given.rows.data(), at.force, true, n, w.load.data());
    combine_rows(given.rows.data() + 3 * n, moment, true, n, w.load.data());
  }
  for (std::size_t l = 0; l < n; ++l)
    rate.rate_p[l] = inverse_mass * (w.inertial[l] + w.load[l]) - 2.0 * plan.decay[l] * rate.rate_q[l];
  if (rate.Q != nullptr) std::copy_n(w.load.data(), n, rate.Q);
}

void accelerate_spread(const StepPlan& plan, const StageState& stage, CoupledWorkspace& w,
                       StageRate& rate) noexcept {
  const std::size_t n = index(plan.num_padded);
  const double inverse_mass = 1.0 / plan.mass;
  double* const known = rate.q_ddot;
  for (std::size_t l = 0; l < n; ++l)
    known[l] = (rate.rate_p[l] - inverse_mass * w.C_dot_w[l]) -
               (plan.omega[l] * (plan.omega[l] * stage.q[l]) + 2.0 * plan.decay[l] * stage.p[l]);
  const Vec3& w_B = rate.w_B;
  Vec3 rest = sub(add(cross(stage.H_B, w_B), rate.moment_B), multiply(w.spread.inertia_rate, w_B));
  for (std::size_t b = 0; b < w.bodies.size(); ++b) {
    const TurningMotion& at = w.bodies[b];
    const PlanTurningBody& given = plan.coupled.turning.bodies[b];
    const Vec3& theta_dot = w.spread.bodies[b].theta_dot;
    const Tangent tangent(at.theta, theta_dot);
    const Vec3 of_frame = multiply_transposed(at.R, w_B), relative = sub(at.s, of_frame);
    // J s' and J s without the unknown theta'' and w'
    const Vec3 J_s_dot =
        multiply(given.inertia, sub(tangent.rate_times(theta_dot, -1.0), cross(relative, of_frame)));
    const Vec3 Js = multiply(given.inertia, at.s);
    const Vec3 kappa = add(tangent.rate_times(Js, 1.0), tangent.times(J_s_dot, 1.0));
    combine_rows(given.rows.data() + 3 * n, scale(-inverse_mass, kappa), true, n, known);
    const Vec3 chi = add(J_s_dot, cross(relative, add(Js, at.wheels)));
    rest = sub(rest, multiply(at.R, sub(chi, at.motors)));
  }
  rest = sub(rest, contract_rows(w.C.data(), known, n));
  for (std::size_t b = 0; b < w.bodies.size(); ++b)
    w.spread.bodies[b].theta = contract_rows(plan.coupled.turning.bodies[b].rows.data() + 3 * n, known, n);
  rate.w_dot_B = solve_motion(plan, rest, w);
  add_share_of_frame(plan, rate.w_dot_B, w, rate.q_ddot);
}

SpreadRates read_spread_rates(const StepPlan& plan, const MotionState& state, const PlanTurningBody& body,
                              const TurningMotion& at) noexcept {
  const std::size_t n = index(plan.num_padded);
  const double* const rows = body.rows.data();
  const Vec3 &w = state.coupled.w_B, &w_dot = state.coupled.w_dot_B, x = add(body.centre, at.V);
  const double *q_dot = state.q_dot.data(), *q_ddot = state.coupled.q_ddot.data();
  const Vec3 V_dot = contract_rows(rows, q_dot, n), theta_dot = contract_rows(rows + 3 * n, q_dot, n);
  const Vec3 a = add(add(cross(w_dot, x), cross(w, add(cross(w, x), scale(2.0, V_dot)))),
                     contract_rows(rows, q_ddot, n));
  const Tangent tangent(at.theta, theta_dot);
  const Vec3 of_frame = multiply_transposed(at.R, w), relative = sub(at.s, of_frame);
  const Vec3 of_rate =
      add(tangent.times(contract_rows(rows + 3 * n, q_ddot, n), -1.0), tangent.rate_times(theta_dot, -1.0));
  return {a, add(sub(of_rate, cross(relative, of_frame)), multiply_transposed(at.R, w_dot))};
}

Vec3 momenta_of_spread(const StepPlan& plan, const Vec3& w_B, const double* q, const double* q_dot,
                       double* p) noexcept {
  const std::size_t n = index(plan.num_padded);
  Vec3 H = momenta_by_tables(plan, w_B, q, q_dot, p);
  for (const PlanTurningBody& given : plan.coupled.turning.bodies) {
    const TurningMotion at = read_turning(plan, given, q, q_dot, w_B);
    const Vec3 theta_dot = contract_rows(given.rows.data() + 3 * n, q_dot, n);
    const Vec3 Js = multiply(given.inertia, at.s), at_rest = multiply(given.inertia, add(theta_dot, w_B));
    const Vec3 beyond = sub(Tangent(at.theta, theta_dot).times(Js, 1.0), at_rest);
    combine_rows(given.rows.data() + 3 * n, scale(1.0 / plan.mass, beyond), true, n, p);
    H = add(H, sub(multiply(at.R, Js), at_rest));
  }
  return H;
}

}  // namespace freeflex
