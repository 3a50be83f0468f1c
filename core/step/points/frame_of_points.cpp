#include "core/step/points/frame_of_points.hpp"

#include "core/step/links/rotations.hpp"
#include "core/step/points/history.hpp"

namespace freeflex {
namespace {

/// Returns the rotation that maximizes tr(R^T A): the eigenvector of the largest eigenvalue of Davenport's
/// matrix
///   K_00 = tr A,   K_0i = z_i,   K_ij = A_ij + A_ji - tr A 1,   z = (A_32 - A_23, A_13 - A_31, A_21 - A_12)
/// by Jacobi's rotations (Davenport 1968, NASA TN D-4696).
Quat best_rotation(const Mat3& A) noexcept {
  constexpr int kMostSweeps = 12;
  const double trace = A[0] + A[4] + A[8];
  double K[4][4] = {{trace, A[7] - A[5], A[2] - A[6], A[3] - A[1]}}, V[4][4] = {};
  for (std::size_t a = 0; a < 3; ++a) {
    K[a + 1][0] = K[0][a + 1];
    for (std::size_t b = 0; b < 3; ++b)
      K[a + 1][b + 1] = A[3 * a + b] + A[3 * b + a] - (a == b ? trace : 0.0);
  }
  for (std::size_t a = 0; a < 4; ++a) V[a][a] = 1.0;
  for (int sweep = 0; sweep < kMostSweeps; ++sweep)
    for (std::size_t p = 0; p < 4; ++p)
      for (std::size_t q = p + 1; q < 4; ++q) {
        if (K[p][q] == 0.0) continue;
        const double theta = 0.5 * (K[q][q] - K[p][p]) / K[p][q];
        const double t =
            (theta < 0.0 ? -1.0 : 1.0) / (__builtin_fabs(theta) + __builtin_sqrt(1.0 + theta * theta));
        const double c = 1.0 / __builtin_sqrt(1.0 + t * t), s = t * c;
        const auto turn = [&](double& x, double& y) {
          const double before = x;
          x = c * before - s * y;
          y = s * before + c * y;
        };
        for (std::size_t k = 0; k < 4; ++k) turn(K[k][p], K[k][q]);
        for (std::size_t k = 0; k < 4; ++k) turn(K[p][k], K[q][k]);
        for (std::size_t k = 0; k < 4; ++k) turn(V[k][p], V[k][q]);
      }
  std::size_t best = 0;
  for (std::size_t k = 1; k < 4; ++k)
    if (K[k][k] > K[best][best]) best = k;
  return {V[0][best], V[1][best], V[2][best], V[3][best]};
}

bool is_positive_definite(const Mat3& A) noexcept {
  const double minor = A[0] * A[4] - A[1] * A[3];
  return A[0] > 0.0 && minor > 0.0 &&
         dot(Vec3{A[0], A[1], A[2]}, cross(Vec3{A[3], A[4], A[5]}, Vec3{A[6], A[7], A[8]})) > 0.0;
}

}  // namespace

Quat attitude_of_points(const StepPlan& plan, const double* x, const Quat& near) noexcept {
  constexpr int kMostSteps = 20;
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
    const bool is_near = square <= kFar && is_positive_definite(slope);
    if (is_near) q = multiply(q, rotation_of(delta).q);
    if (is_near && square <= kFound) break;
    if (is_near && step + 1 < kMostSteps) continue;
    q = best_rotation(A);
    break;
  }
  double norm = 0.0, side = 0.0;
  for (std::size_t k = 0; k < q.size(); ++k) norm += q[k] * q[k], side += q[k] * near[k];
  norm = (side < 0.0 ? -1.0 : 1.0) / __builtin_sqrt(norm);
  for (double& each : q) each *= norm;
  return q;
}

}  // namespace freeflex
