#include "core/step/rigid/principal.hpp"

#include <algorithm>
#include <array>

#include "core/step/vector.hpp"

namespace freeflex {
namespace {

/// Makes A_pq zero by one Jacobi rotation. Rotates the rows p and q of `axes` by the same angle.
void rotate(std::size_t p, std::size_t q, Mat3& A, Mat3& axes) noexcept {
  const double off = A[3 * p + q];
  if (off == 0.0) return;
  // t is the tangent of the angle of rotation: that root of t^2 + 2 theta t - 1 = 0 which has the smaller
  // magnitude
  const double theta = (A[4 * q] - A[4 * p]) / (2.0 * off);
  const double root = magnitude(theta) + __builtin_sqrt(1.0 + theta * theta);
  const double t = theta < 0.0 ? -1.0 / root : 1.0 / root;
  const double c = 1.0 / __builtin_sqrt(1.0 + t * t), s = c * t;
  const std::size_t k = 3 - p - q;
  const double kp = A[3 * k + p], kq = A[3 * k + q];
  A[4 * p] -= t * off;
  A[4 * q] += t * off;
  A[3 * p + q] = A[3 * q + p] = 0.0;
  A[3 * k + p] = A[3 * p + k] = c * kp - s * kq;
  A[3 * k + q] = A[3 * q + k] = s * kp + c * kq;
  for (std::size_t a = 0; a < 3; ++a) {
    const double x = axes[3 * p + a], y = axes[3 * q + a];
    axes[3 * p + a] = c * x - s * y;
    axes[3 * q + a] = s * x + c * y;
  }
}

}  // namespace

PlanPrincipal principal_of(const Mat3& inverse_inertia) noexcept {
  Mat3 A = inverse_inertia, axes{1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0};
  for (const auto& [i, j] : {std::array{1, 3}, {2, 6}, {5, 7}})
    A[index(i)] = A[index(j)] = 0.5 * (A[index(i)] + A[index(j)]);
  constexpr int kSweeps = 12;  // five sweeps are exact to the last bit
  for (int sweep = 0; sweep < kSweeps; ++sweep) {
    rotate(0, 1, A, axes);
    rotate(0, 2, A, axes);
    rotate(1, 2, A, axes);
  }
  std::array<std::size_t, 3> order{0, 1, 2};
  std::stable_sort(order.begin(), order.end(),
                   [&](std::size_t a, std::size_t b) { return A[4 * a] > A[4 * b]; });
  PlanPrincipal principal;
  for (std::size_t i = 0; i < 3; ++i) {
    principal.inverse_moment[i] = std::max(A[4 * order[i]], 0.0);
    std::copy_n(axes.begin() + static_cast<std::ptrdiff_t>(3 * order[i]), 3,
                principal.R_PB.begin() + static_cast<std::ptrdiff_t>(3 * i));
  }
  // make the axes right-handed
  const Mat3& R = principal.R_PB;
  const Vec3 third = cross({R[0], R[1], R[2]}, {R[3], R[4], R[5]});
  if (dot(third, {R[6], R[7], R[8]}) < 0.0)
    for (std::size_t a = 6; a < 9; ++a) principal.R_PB[a] = -principal.R_PB[a];
  return principal;
}

void set_principal(StepPlan& plan) noexcept {
  plan.principal = principal_of(plan.inverse_inertia);
  for (StepPlan& fallback : plan.fallback) set_principal(fallback);
}

}  // namespace freeflex
