#include "core/step/energy.hpp"

#include <array>

#include "core/step/exact.hpp"
#include "core/step/vector.hpp"

namespace freeflex {
namespace {

using Vec3x2 = std::array<Sum2, 3>;
Vec3x2 exact_cross(const Vec3x2& a, const Vec3x2& b) noexcept {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}

/// Returns R_WB^T H_W with twice the digits of a double, for a quaternion q_WB = (w, v) that need not have
/// unit length:
///   H - w t + v x t,   t = 2 / |q|^2 v x H
Vec3x2 momentum_B(const Frame& frame) noexcept {
  Sum2 excess{-1.0, 0.0};  // |q|^2 - 1
  std::array<Sum2, 4> q;
  for (std::size_t i = 0; i < 4; ++i) {
    q[i] = {frame.q_WB[i], frame.q_WB_low[i]};
    excess = excess + q[i] * q[i];
  }
  const Sum2 factor{2.0, -2.0 * excess.hi * (1.0 - excess.hi)};
  Vec3x2 H;
  for (std::size_t i = 0; i < 3; ++i) H[i] = {frame.H_W[i], frame.H_W_low[i]};
  const Vec3x2 v{q[1], q[2], q[3]};
  Vec3x2 t = exact_cross(v, H);
  for (Sum2& each : t) each = factor * each;
  const Vec3x2 second = exact_cross(v, t);
  Vec3x2 H_B;
  for (std::size_t i = 0; i < 3; ++i) H_B[i] = H[i] - q[0] * t[i] + second[i];
  return H_B;
}

}  // namespace

void restore_energy(const StepPlan& plan, const Frame& from, const Vec3& h, Frame& to) noexcept {
  const Vec3x2 before = momentum_B(from), after = momentum_B(to);
  Vec3 difference, twice;
  for (std::size_t i = 0; i < 3; ++i) {
    const Sum2 gain = after[i] - before[i];
    difference[i] = gain.hi + gain.lo;
    twice[i] = (before[i].hi - h[i]) + (after[i].hi - h[i]);
  }
  const Mat3& R_PB = plan.principal.R_PB;
  const Vec3 &inverse = plan.principal.inverse_moment, d = multiply(R_PB, difference),
             s = multiply(R_PB, twice);
  // dE = 1/2 sum_i (H_i^1 - H_i^0) (H_i^0 + H_i^1 - 2 h_i) / I_i   (THEORY 7.30)
  const double excess =
      0.5 * (inverse[0] * d[0] * s[0] + inverse[1] * d[1] * s[1] + inverse[2] * d[2] * s[2]);
  // a rotation by theta changes the energy by theta . (w x H), to first order
  const Vec3 H{after[0].hi, after[1].hi, after[2].hi};
  const Vec3 slope = cross(multiply(plan.inverse_inertia, sub(H, h)), H);
  const double square = dot(slope, slope);
  // [rad] Largest correction. A larger one would be needed only if the spin is almost about a principal axis,
  // where a rotation hardly changes the energy. No correction is then made.
  constexpr double kMostRotation = 1e-10;
  if (excess * excess > kMostRotation * kMostRotation * square || square == 0.0) return;
  // half of d_theta = -dE / |w x H|^2 w x H   (THEORY 7.31)
  const Vec3 half = scale(-0.5 * excess / square, slope);
  const Quat gain = multiply(to.q_WB, {0.0, half[0], half[1], half[2]});
  for (std::size_t i = 0; i < 4; ++i) add_compensated(to.q_WB[i], to.q_WB_low[i], gain[i]);
}

}  // namespace freeflex
