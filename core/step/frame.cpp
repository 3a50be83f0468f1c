#include "core/step/frame.hpp"

namespace freeflex {
namespace {

/// Rotation matrix of the Gibbs vector g, turned axes to start axes (X7).
Mat3 rotation_of_gibbs(const Vec3& g) noexcept {
  const double k = 2.0 / (1.0 + dot(g, g));
  const double xx = k * g[0] * g[0], yy = k * g[1] * g[1], zz = k * g[2] * g[2];
  const double xy = k * g[0] * g[1], xz = k * g[0] * g[2], yz = k * g[1] * g[2];
  const double x = k * g[0], y = k * g[1], z = k * g[2];
  return {1.0 - (yy + zz), xy - z, xz + y, xy + z, 1.0 - (xx + zz), yz - x, xz - y, yz + x, 1.0 - (xx + yy)};
}

/// Rates of the Gibbs vector and of the angular momentum, both in the axes of the step's start (X7, X8).
struct Rates {
  Vec3 g, H;
};

/// The turning part of a step: what stays the same over it.
struct Turning {
  const Plan& plan;
  const Mat3& R_WB;
  bool has_moment;

  Rates rates(const Vec3& g, const Vec3& H, const RigidLoad& load) const noexcept {
    const Mat3 R = rotation_of_gibbs(g);
    const Vec3 w = multiply(plan.inverse_inertia, multiply_transposed(R, H));
    // g_dot = (w + g x w + g (g.w)) / 2
    const Vec3 g_dot = scale(0.5, add_scaled(add(w, cross(g, w)), dot(g, w), g));
    if (!has_moment) return {g_dot, {}};
    return {g_dot, multiply(R, moment_B(load, multiply(R_WB, R)))};
  }
};

/// Gibbs vectors at the middle and end of the step and the gain of angular momentum, start axes.
struct Turn {
  Vec3 g_middle, g_end, H_gain;
};

/// Runge's and Kutta's method of order 4 with its own interpolant of order 3 for the middle (X8).
Turn turn(const Turning& turning, const Vec3& H, const StepLoads& loads, double h) noexcept {
  const Rates k1 = turning.rates({}, H, loads[0]);
  const Rates k2 = turning.rates(scale(0.5 * h, k1.g), add_scaled(H, 0.5 * h, k1.H), loads[1]);
  const Rates k3 = turning.rates(scale(0.5 * h, k2.g), add_scaled(H, 0.5 * h, k2.H), loads[1]);
  const Rates k4 = turning.rates(scale(h, k3.g), add_scaled(H, h, k3.H), loads[2]);
  Turn turn{};
  for (std::size_t i = 0; i < 3; ++i) {
    turn.g_end[i] = h / 6.0 * ((k1.g[i] + k4.g[i]) + 2.0 * (k2.g[i] + k3.g[i]));
    turn.g_middle[i] = h / 24.0 * ((5.0 * k1.g[i] - k4.g[i]) + 4.0 * (k2.g[i] + k3.g[i]));
    turn.H_gain[i] = h / 6.0 * ((k1.H[i] + k4.H[i]) + 2.0 * (k2.H[i] + k3.H[i]));
  }
  return turn;
}

/// q_WB o (1, g) / sqrt(1 + g.g) as an increment, so that rounding stays behind in the low part (X9).
void turn_attitude(const Vec3& g, Frame& frame) noexcept {
  const double s = dot(g, g);
  const double norm = __builtin_sqrt(1.0 + s);
  const Quat turned =
      multiply(frame.q_WB, {-s / (norm * (1.0 + norm)), g[0] / norm, g[1] / norm, g[2] / norm});
  // the norm is drawn back to 1 slowly: what its own rounding feeds in stays below eps / 256 a step
  const Quat& q = frame.q_WB;
  const double excess = (q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]) - 1.0;
  for (std::size_t i = 0; i < 4; ++i)
    add_compensated(frame.q_WB[i], frame.q_WB_low[i], turned[i] - 0x1p-9 * excess * q[i]);
}

/// Translation under gravity and the resultant, exact for forces quadratic in time (X6).
void translate(const Plan& plan, const std::array<Vec3, 3>& force_W, Frame& frame) noexcept {
  const double h = plan.period;
  for (std::size_t i = 0; i < 3; ++i) {
    const double start = force_W[0][i], middle = force_W[1][i], end = force_W[2][i];
    const double mean = (start + end + 4.0 * middle) / 6.0;
    const double weighted = (start + 2.0 * middle) / 3.0;  // 2 int (1 - s) F(s) ds
    const double p_gain = h * frame.v_WB_low[i] + 0.5 * h * h * (weighted / plan.mass + plan.gravity_W[i]);
    add_compensated(frame.p_WB[i], frame.p_WB_low[i], h * frame.v_WB[i] + p_gain);
    add_compensated(frame.v_WB[i], frame.v_WB_low[i], h * (mean / plan.mass + plan.gravity_W[i]));
  }
}

bool is_zero_moment(const RigidLoad& load) noexcept { return !load.has_moment_W && is_zero(load.torque_B); }

}  // namespace

void add_pattern(const LoadPattern& pattern, double amplitude, RigidLoad& load) noexcept {
  if (pattern.has_world) {
    load.force_W = add_scaled(load.force_W, amplitude, pattern.force_W);
    for (std::size_t i = 0; i < load.moment_W.size(); ++i)
      load.moment_W[i] += amplitude * pattern.moment_W[i];
    load.has_moment_W = true;
  }
  if (pattern.has_body) {
    load.force_B = add_scaled(load.force_B, amplitude, pattern.force_B);
    load.torque_B = add_scaled(load.torque_B, amplitude, pattern.torque_B);
  }
}

Vec3 resultant_W(const RigidLoad& load, const Mat3& R_WB) noexcept {
  return is_zero(load.force_B) ? load.force_W : add(load.force_W, multiply(R_WB, load.force_B));
}

Vec3 moment_B(const RigidLoad& load, const Mat3& R_WB) noexcept {
  if (!load.has_moment_W) return load.torque_B;
  Vec3 moment = load.torque_B;
  for (std::size_t c = 0; c < 3; ++c) {
    const double* t = load.moment_W.data() + 9 * c;
    moment[c] += (R_WB[0] * t[0] + R_WB[3] * t[1] + R_WB[6] * t[2]) +
                 (R_WB[1] * t[3] + R_WB[4] * t[4] + R_WB[7] * t[5]) +
                 (R_WB[2] * t[6] + R_WB[5] * t[7] + R_WB[8] * t[8]);
  }
  return moment;
}

Frame advance_frame(const Plan& plan, const Frame& from, const Mat3& R_WB, const StepLoads& loads) noexcept {
  Frame to = from;
  const bool has_moment = !(is_zero_moment(loads[0]) && is_zero_moment(loads[1]) && is_zero_moment(loads[2]));
  Turn turned{};
  if (has_moment || !is_zero(from.H_W)) {
    turned = turn({plan, R_WB, has_moment}, multiply_transposed(R_WB, from.H_W), loads, plan.period);
    turn_attitude(turned.g_end, to);
    const Vec3 H_gain = multiply(R_WB, turned.H_gain);
    for (std::size_t i = 0; i < 3; ++i) add_compensated(to.H_W[i], to.H_W_low[i], H_gain[i]);
  }
  std::array<Vec3, 3> force_W{loads[0].force_W, loads[1].force_W, loads[2].force_W};
  const bool has_force_B =
      !(is_zero(loads[0].force_B) && is_zero(loads[1].force_B) && is_zero(loads[2].force_B));
  if (has_force_B) {
    const std::array<Vec3, 3> g{Vec3{}, turned.g_middle, turned.g_end};
    for (std::size_t k = 0; k < 3; ++k)
      force_W[k] = add(force_W[k], multiply(R_WB, multiply(rotation_of_gibbs(g[k]), loads[k].force_B)));
  }
  translate(plan, force_W, to);
  return to;
}

}  // namespace freeflex
