#include "core/step/links/matrix_link.hpp"

#include <algorithm>
#include <limits>

#include "core/step/linear/kernels.hpp"
#include "core/step/links/rotations.hpp"

namespace freeflex {
namespace {

// The rotation is found in steps with the inertia at rest, which lead from any start to the nearest shape,
// and then by Newton's method.
constexpr int kMostTurns = 24;
constexpr double kNear = 0.1;        // [rad] shorter steps are Newton's
constexpr double kTurnFound = 1e-8;  // [rad] Newton's method squares the error, so such a step is the last

using Deformation = std::array<double, pad(6 * kMostMatrixPoints)>;

Vec3 axial_of(const Mat3& Q) noexcept {
  return {0.5 * (Q[7] - Q[5]), 0.5 * (Q[2] - Q[6]), 0.5 * (Q[3] - Q[1])};
}
/// Returns the rotation vector of a rotation by less than pi.
Vec3 vector_of(const Mat3& Q) noexcept {
  const Vec3 sine = axial_of(Q);
  return scale(angle_per_sine(length(sine), 0.5 * (Q[0] + Q[4] + Q[8] - 1.0)), sine);
}

/// Returns whether the symmetric part of A is positive definite, so that Newton's method leads to the best
/// fit and not to the worst.
bool is_definite(const Mat3& A) noexcept {
  const double xy = 0.5 * (A[1] + A[3]), xz = 0.5 * (A[2] + A[6]), yz = 0.5 * (A[5] + A[7]);
  const double minor = A[0] * A[4] - xy * xy;
  return A[0] > 0.0 && minor > 0.0 &&
         minor * A[8] + xz * (xy * yz - A[4] * xz) - yz * (A[0] * yz - xy * xz) > 0.0;
}

/// The condition F(R) = 0 for the rotation of a link and its derivative A by rotations of the link
/// (THEORY 12.102, 12.104).
class Fit {
 public:
  Fit(const MatrixConstants& matrix, std::span<const Vec3> x, std::span<const Mat3> rotations) noexcept
      : matrix_(matrix), rotations_(rotations) {
    Vec3 mean{};
    for (const Vec3& each : x) mean = add_scaled(mean, 1.0 / static_cast<double>(x.size()), each);
    for (std::size_t i = 0; i < x.size(); ++i) y_[i] = sub(x[i], mean);
  }

  /// Returns the identity or a half turn about an axis, whichever fits best. Every rotation is within 120
  /// degrees of one of them.
  Mat3 start() const noexcept {
    Vec3 along{};  // diagonal of sum y d^T
    for (std::size_t i = 0; i < matrix_.arms.size(); ++i)
      for (std::size_t a = 0; a < 3; ++a) along[a] += y_[i][a] * matrix_.arms[i][a];
    const double all = along[0] + along[1] + along[2];
    Mat3 best{1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0};
    double most = all;
    for (std::size_t a = 0; a < 3; ++a) {
      const double fit = 2.0 * along[a] - all;
      if (!(fit > most)) continue;
      most = fit;
      best = {-1.0, 0.0, 0.0, 0.0, -1.0, 0.0, 0.0, 0.0, -1.0};
      best[4 * a] = 1.0;
    }
    return best;
  }

  void set(const Mat3& R) noexcept {
    const std::size_t count = matrix_.arms.size();
    const Vec3& line = matrix_.line;
    const bool has_line = dot(line, line) > 0.0;
    F = {}, A = {};
    double along = 0.0;
    for (std::size_t i = 0; i < count; ++i) {
      const Vec3& d = matrix_.arms[i];
      z[i] = multiply_transposed(R, y_[i]);
      F = add(F, cross(d, z[i]));
      const double both = dot(d, z[i]);
      along += dot(d, d);
      for (std::size_t a = 0; a < 3; ++a)
        for (std::size_t b = 0; b < 3; ++b) A[3 * a + b] += (a == b ? both : 0.0) - z[i][a] * d[b];
      if (rotations_.empty()) continue;
      own[i] = multiply_transposed(R, rotations_[i]);
      if (!has_line) continue;
      F = add_scaled(F, matrix_.turn_weight * dot(line, axial_of(own[i])), line);
      const Vec3 slope = turn_slope(i);
      for (std::size_t a = 0; a < 3; ++a)
        for (std::size_t b = 0; b < 3; ++b) A[3 * a + b] += matrix_.turn_weight * (line[a] * slope[b]);
    }
    if (!has_line || !rotations_.empty()) return;
    for (std::size_t a = 0; a < 3; ++a)
      for (std::size_t b = 0; b < 3; ++b) A[3 * a + b] += along * line[a] * line[b];
  }

  /// Returns B^T line, where the axial vector of exp(b) R^T R_i has the derivative B = (tr Q 1 - Q) / 2.
  Vec3 turn_slope(std::size_t i) const noexcept {
    const Mat3& Q = own[i];
    return scale(0.5, sub(scale(Q[0] + Q[4] + Q[8], matrix_.line), multiply_transposed(Q, matrix_.line)));
  }

  Vec3 F{};
  Mat3 A{};
  std::array<Vec3, kMostMatrixPoints> z;    // [m] R^T y
  std::array<Mat3, kMostMatrixPoints> own;  // R^T R_i

 private:
  const MatrixConstants& matrix_;
  std::span<const Mat3> rotations_;
  std::array<Vec3, kMostMatrixPoints> y_;  // [m] from the mean of the points
};

/// Sets forces and moments to K u. Returns the energy.
double multiply_stiffness(const MatrixConstants& matrix, const Deformation& u,
                          MatrixGradient& result) noexcept {
  const std::size_t per_point = matrix.has_rotations ? 6 : 3, n = per_point * matrix.arms.size();
  double energy = 0.0;
  for (std::size_t i = 0; i < n; ++i) {
    const double f = dot_lanes(matrix.stiffness.data() + i * pad(n), u.data(), pad(n));
    const std::size_t point = i / per_point, axis = i % per_point;
    (axis < 3 ? result.force[point][axis] : result.moment[point][axis - 3]) = f;
    energy += 0.5 * f * u[i];
  }
  return energy;
}

}  // namespace

void set_gradient(const MatrixConstants& matrix, std::span<const Vec3> x, std::span<const Mat3> rotations,
                  MatrixGradient& result) noexcept {
  const std::size_t per_point = matrix.has_rotations ? 6 : 3;
  Fit fit(matrix, x, rotations);
  Mat3& R = result.R;
  R = rotations.empty() ? fit.start() : rotations.front();
  bool is_found = false;
  for (int k = 0; k < kMostTurns && !is_found; ++k) {
    fit.set(R);
    Vec3 turn = multiply(matrix.inverse, fit.F);
    const bool is_near = dot(turn, turn) < kNear * kNear && is_definite(fit.A);
    if (is_near) turn = solve_by_adjugate(fit.A, fit.F);
    R = multiply(R, matrix_of(rotation_of(turn).q));
    is_found = is_near && dot(turn, turn) < kTurnFound * kTurnFound;
  }
  if (!is_found) R.fill(std::numeric_limits<double>::quiet_NaN());  // the rates of the step are not finite
  fit.set(R);
  alignas(64) Deformation u;
  std::fill_n(u.begin(), pad(per_point * x.size()), 0.0);
  std::array<Vec3, kMostMatrixPoints> phi;
  for (std::size_t i = 0; i < x.size(); ++i) {
    const Vec3 stretch = sub(fit.z[i], matrix.arms[i]);
    for (std::size_t a = 0; a < 3; ++a) u[per_point * i + a] = stretch[a];
    if (rotations.empty()) continue;
    phi[i] = vector_of(fit.own[i]);
    for (std::size_t a = 0; a < 3; ++a) u[6 * i + 3 + a] = phi[i][a];
  }
  result.energy = multiply_stiffness(matrix, u, result);  // (THEORY 12.103)
  Vec3 rest{};                                            // minus the moment of all forces about the mean
  for (std::size_t i = 0; i < x.size(); ++i) {
    rest = sub(rest, cross(fit.z[i], result.force[i]));
    if (rotations.empty()) continue;
    // m <- T(phi)^-T m   (THEORY 12.105)
    const double c = inverse_tangent_coefficient(phi[i], rotation_of(phi[i]));
    Vec3& m = result.moment[i];
    const Vec3 once = cross(phi[i], m);
    m = add_scaled(add_scaled(m, 0.5, once), c, cross(phi[i], once));
    rest = sub(rest, m);
  }
  // (THEORY 12.105, 12.106)
  const Vec3 lambda = solve_by_adjugate(transpose(fit.A), rest);
  for (std::size_t i = 0; i < x.size(); ++i) {
    result.force[i] = multiply(R, add(result.force[i], cross(lambda, matrix.arms[i])));
    if (rotations.empty()) continue;
    if (dot(matrix.line, matrix.line) > 0.0)
      result.moment[i] =
          add_scaled(result.moment[i], matrix.turn_weight * dot(matrix.line, lambda), fit.turn_slope(i));
    result.moment[i] = multiply(R, result.moment[i]);
  }
}

void set_linear_gradient(const MatrixConstants& matrix, std::span<const Vec3> V, std::span<const Vec3> theta,
                         MatrixGradient& result) noexcept {
  const std::size_t per_point = matrix.has_rotations ? 6 : 3;
  alignas(64) Deformation u;
  std::fill_n(u.begin(), pad(per_point * V.size()), 0.0);
  for (std::size_t i = 0; i < V.size(); ++i)
    for (std::size_t a = 0; a < 3; ++a) {
      u[per_point * i + a] = V[i][a];
      if (!theta.empty()) u[6 * i + 3 + a] = theta[i][a];
    }
  result.energy = multiply_stiffness(matrix, u, result);
}

}  // namespace freeflex
