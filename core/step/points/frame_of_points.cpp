#include "core/step/points/frame_of_points.hpp"

#include "core/step/links/rotations.hpp"
#include "core/step/points/history.hpp"

namespace freeflex {
namespace {

/// Turns R about each of its axes in turn to the angle phi that maximizes tr(R^T A). About the axis a, with
/// S = R^T A and the other axes b and c, this is
///   tan phi = (S_cb - S_bc) / (S_bb + S_cc)
void turn_about_axes(const Mat3& A, Quat& q) noexcept {
  for (std::size_t a = 0; a < 3; ++a) {
    const std::size_t b = (a + 1) % 3, c = (a + 2) % 3;
    const Mat3 S = multiply_transposed(matrix_of(q), A);
    const double along = S[4 * b] + S[4 * c], across = S[3 * c + b] - S[3 * b + c];
    const double size = __builtin_sqrt(along * along + across * across);
    if (!(size > 0.0)) continue;
    const double cosine = along / size, sine = across / size;
    const double larger = __builtin_sqrt(0.5 * (1.0 + __builtin_fabs(cosine))), other = 0.5 * sine / larger;
    Quat turn{cosine > 0.0 ? larger : other};
    turn[1 + a] = cosine > 0.0 ? other : larger;
    q = multiply(q, turn);
  }
}

bool is_positive_definite(const Mat3& A) noexcept {
  const double minor = A[0] * A[4] - A[1] * A[3];
  return A[0] > 0.0 && minor > 0.0 &&
         dot(Vec3{A[0], A[1], A[2]}, cross(Vec3{A[3], A[4], A[5]}, Vec3{A[6], A[7], A[8]})) > 0.0;
}

}  // namespace

Quat attitude_of_points(const StepPlan& plan, const double* x, const Quat& near) noexcept {
  constexpr int kMostSteps = 40;
  constexpr double kFound = 1e-30, kFar = 0.25;  // [rad^2] squares of the last step and of the longest one
  Mat3 A{};                                      // sum m x r^T
  for (std::size_t i = 0; i < plan.points.size(); ++i) {
    const Vec3 weighted = scale(plan.points[i].mass, of_point(x, i));
    for (std::size_t a = 0; a < 3; ++a)
      for (std::size_t b = 0; b < 3; ++b) A[3 * a + b] += weighted[a] * plan.points[i].r[b];
  }
  Quat q = near;
  for (int step = 0; step < kMostSteps; ++step) {
    // with R exp(delta), sum m r x y becomes g - (tr(S) 1 - S) delta, y = R^T x, S = sum m y r^T
    const Mat3 S = multiply_transposed(matrix_of(q), A);
    const Vec3 g{S[7] - S[5], S[2] - S[6], S[3] - S[1]};
    const double trace = S[0] + S[4] + S[8];
    const Mat3 slope{trace - S[0], -S[1], -S[2], -S[3], trace - S[4], -S[5], -S[6], -S[7], trace - S[8]};
    const Vec3 delta = solve_by_adjugate(slope, g);
    const double square = dot(delta, delta);
    // tr(S) has one maximum over all rotations, and near it the symmetric part of the slope is positive
    if (square <= kFar && is_positive_definite(slope)) {
      q = multiply(q, rotation_of(delta).q);
      if (square <= kFound) break;
    } else {
      turn_about_axes(A, q);
    }
  }
  double norm = 0.0, side = 0.0;
  for (std::size_t k = 0; k < q.size(); ++k) norm += q[k] * q[k], side += q[k] * near[k];
  norm = (side < 0.0 ? -1.0 : 1.0) / __builtin_sqrt(norm);
  for (double& each : q) each *= norm;
  return q;
}

}  // namespace freeflex
