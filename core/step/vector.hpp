// Three-vectors, 3 x 3 matrices and quaternions for the step. The operations have a fixed order, and libm is
// not used.
#pragma once

#include <array>
#include <cstddef>

namespace freeflex {

using Vec3 = std::array<double, 3>;
using Mat3 = std::array<double, 9>;  // row-major
using Quat = std::array<double, 4>;  // w x y z, unit norm

constexpr Vec3 add(const Vec3& a, const Vec3& b) noexcept { return {a[0] + b[0], a[1] + b[1], a[2] + b[2]}; }
constexpr Vec3 sub(const Vec3& a, const Vec3& b) noexcept { return {a[0] - b[0], a[1] - b[1], a[2] - b[2]}; }
constexpr Vec3 scale(double s, const Vec3& a) noexcept { return {s * a[0], s * a[1], s * a[2]}; }
/// Returns a + s b.
constexpr Vec3 add_scaled(const Vec3& a, double s, const Vec3& b) noexcept {
  return {a[0] + s * b[0], a[1] + s * b[1], a[2] + s * b[2]};
}
constexpr double dot(const Vec3& a, const Vec3& b) noexcept {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}
constexpr Vec3 cross(const Vec3& a, const Vec3& b) noexcept {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}
inline double length(const Vec3& a) noexcept { return __builtin_sqrt(dot(a, a)); }
constexpr double magnitude(double x) noexcept { return x < 0.0 ? -x : x; }
constexpr bool is_zero(const Vec3& a) noexcept { return a[0] == 0.0 && a[1] == 0.0 && a[2] == 0.0; }

/// Returns A x.
constexpr Vec3 multiply(const Mat3& A, const Vec3& x) noexcept {
  return {A[0] * x[0] + A[1] * x[1] + A[2] * x[2], A[3] * x[0] + A[4] * x[1] + A[5] * x[2],
          A[6] * x[0] + A[7] * x[1] + A[8] * x[2]};
}
/// Returns A^T x.
constexpr Vec3 multiply_transposed(const Mat3& A, const Vec3& x) noexcept {
  return {A[0] * x[0] + A[3] * x[1] + A[6] * x[2], A[1] * x[0] + A[4] * x[1] + A[7] * x[2],
          A[2] * x[0] + A[5] * x[1] + A[8] * x[2]};
}
/// Returns A B.
constexpr Mat3 multiply(const Mat3& A, const Mat3& B) noexcept {
  Mat3 C{};
  for (std::size_t i = 0; i < 3; ++i)
    for (std::size_t j = 0; j < 3; ++j)
      C[3 * i + j] = A[3 * i] * B[j] + A[3 * i + 1] * B[3 + j] + A[3 * i + 2] * B[6 + j];
  return C;
}

/// Returns A^T.
constexpr Mat3 transpose(const Mat3& A) noexcept {
  return {A[0], A[3], A[6], A[1], A[4], A[7], A[2], A[5], A[8]};
}
/// Returns A^T B.
constexpr Mat3 multiply_transposed(const Mat3& A, const Mat3& B) noexcept {
  Mat3 C{};
  for (std::size_t i = 0; i < 3; ++i)
    for (std::size_t j = 0; j < 3; ++j)
      C[3 * i + j] = A[i] * B[j] + A[3 + i] * B[3 + j] + A[6 + i] * B[6 + j];
  return C;
}
/// Solves A x = b by the adjugate of A.
constexpr Vec3 solve_by_adjugate(const Mat3& A, const Vec3& b) noexcept {
  const Vec3 x{A[0], A[1], A[2]}, y{A[3], A[4], A[5]}, z{A[6], A[7], A[8]};
  const Vec3 yz = cross(y, z), zx = cross(z, x), xy = cross(x, y);
  const double determinant = dot(x, yz);
  return scale(1.0 / determinant, add_scaled(add_scaled(scale(b[0], yz), b[1], zx), b[2], xy));
}

/// Returns the Hamilton product of two quaternions, scalar first.
constexpr Quat multiply(const Quat& a, const Quat& b) noexcept {
  return {a[0] * b[0] - a[1] * b[1] - a[2] * b[2] - a[3] * b[3],
          a[0] * b[1] + a[1] * b[0] + a[2] * b[3] - a[3] * b[2],
          a[0] * b[2] - a[1] * b[3] + a[2] * b[0] + a[3] * b[1],
          a[0] * b[3] + a[1] * b[2] - a[2] * b[1] + a[3] * b[0]};
}

/// Adds increment to value + low. The rounding error of value goes into low (Kahan 1965).
constexpr void add_compensated(double& value, double& low, double increment) noexcept {
  const double corrected = low + increment;
  const double sum = value + corrected;
  low = corrected - (sum - value);
  value = sum;
}

}  // namespace freeflex
