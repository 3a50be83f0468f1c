// Finite rotations for links at true geometry. All functions use + - * / and square roots only, so that every
// machine computes the same bits. Each is accurate to some units in the last place.
#pragma once

#include <array>
#include <cstddef>

#include "core/step/vector.hpp"
#include "core/widths.hpp"

namespace freeflex {

/// Returns 1 + r_1 y (1 + r_2 y (1 + ...)), all terms if y >= kFewTerms, else the first ones, which give all
/// digits.
template <std::size_t count>
constexpr double nested_series(const std::array<double, count>& ratios, double y) noexcept {
  constexpr double kFewTerms = 1e-3;
  double sum = 1.0;
  for (std::size_t k = y < kFewTerms ? count / 2 : count; k-- > 0;) sum = 1.0 + ratios[k] * y * sum;
  return sum;
}

/// Returns the same from r_(first + 1) on, with all terms and without a branch.
template <std::size_t first, std::size_t count>
FREEFLEX_KERNEL constexpr double all_terms(const std::array<double, count>& ratios, double y) noexcept {
  if constexpr (first == count)
    return 1.0;
  else
    return 1.0 + ratios[first] * y * all_terms<first + 1>(ratios, y);
}

/// The series of an angle over its sine and of its derivative, in the square of the sine, and the largest
/// square for which they are used.
inline constexpr double kSmallSquare = 0.05;
inline constexpr auto kAngleRatios = [] {
  std::array<double, 12> r{};
  for (std::size_t k = 0; k < r.size(); ++k) {
    const auto n = static_cast<double>(k + 1);
    r[k] = (2.0 * n - 1.0) * (2.0 * n - 1.0) / (2.0 * n * (2.0 * n + 1.0));
  }
  return r;
}();
inline constexpr auto kSlopeRatios = [] {
  std::array<double, 14> r{};
  for (std::size_t k = 0; k < r.size(); ++k) {
    const auto n = static_cast<double>(k + 1);
    r[k] = 2.0 * n / (2.0 * n + 3.0);
  }
  return r;
}();

/// Returns whether these series give the angle. \param square  of the sine
inline bool is_small_angle(double square, double cosine) noexcept {
  return cosine > 0.0 && square < kSmallSquare;
}

/// Returns the ratio of an angle in [0, pi) to its sine, from the sine >= 0 and the cosine. The ratio is 1 at
/// angle 0   (THEORY 12.57).
///   angle = 16 atan(t), where t is the tangent of a sixteenth of the angle
inline double angle_per_sine(double sine, double cosine) noexcept {
  if (is_small_angle(sine * sine, cosine)) return nested_series(kAngleRatios, sine * sine);
  // tan(a / 2) = sin a / (1 + cos a), then tan(b / 2) = tan b / (1 + sqrt(1 + tan^2 b)) three times. All are
  // multiples of the sine, so small angles keep their digits.
  double factor = 1.0 / (1.0 + cosine);
  for (int k = 0; k < 3; ++k) {
    const double t = sine * factor;
    factor = factor / (1.0 + __builtin_sqrt(1.0 + t * t));
  }
  // atan(t) / t = 1 - t^2 / 3 + t^4 / 5 - ..., with t^2 <= tan^2(pi / 16) = 0.0396
  const double y = (sine * factor) * (sine * factor);
  double sum = 1.0 / 25.0;
  for (const double coefficient : {1.0 / 23, 1.0 / 21, 1.0 / 19, 1.0 / 17, 1.0 / 15, 1.0 / 13, 1.0 / 11,
                                   1.0 / 9, 1.0 / 7, 1.0 / 5, 1.0 / 3, 1.0})
    sum = coefficient - y * sum;
  return 16.0 * factor * sum;
}

/// Returns the derivative of angle_per_sine with respect to the cosine, (cosine ratio - 1) / sine^2. For
/// small angles the difference would lose digits.
inline double angle_per_sine_slope(double sine, double cosine, double ratio) noexcept {
  const double square = sine * sine;
  if (is_small_angle(square, cosine)) return -nested_series(kSlopeRatios, square) / 3.0;
  return (cosine * ratio - 1.0) / square;
}

/// The ratios of the terms of the sine over the angle, of the cosine, and of (a - sin a) / a^3, in the square
/// of the angle: -1 / (2 k (2 k + 1)), -1 / ((2 k - 1) 2 k) and -1 / ((2 k + 2) (2 k + 3)), k = 1, 2, ...
template <std::size_t count>
constexpr std::array<double, count> ratios_from(int offset) {
  std::array<double, count> r{};
  for (std::size_t k = 0; k < count; ++k) {
    const double n = 2.0 * static_cast<double>(k + 1) + offset;
    r[k] = -1.0 / (n * (n + 1.0));
  }
  return r;
}
inline constexpr auto kSineRatios = ratios_from<7>(0), kCosineRatios = ratios_from<7>(-1);
inline constexpr auto kTangentRatios = ratios_from<9>(2);

/// Holds the rotation about a vector v by the angle a = |v|, which is less than 2 pi.
struct FiniteRotation {
  Quat q{1.0, 0.0, 0.0, 0.0};
  double half_sine = 0.5;  // [-] sin(a / 2) / a
};
/// Returns the quaternion exp(v / 2): a series for an eighth of the half angle, squared three times
/// (THEORY 12.58).
inline FiniteRotation rotation_of(const Vec3& v) noexcept {
  constexpr double kFraction = 1.0 / 16.0;  // of the angle
  const double square = dot(v, v), y = kFraction * kFraction * square;
  const double sine = all_terms<0>(kSineRatios, y), cosine = all_terms<0>(kCosineRatios, y);
  double factor = kFraction * sine, w = cosine;
  // three squares of the quaternion (w, f v), each of which is (w^2 - f^2 a^2, 2 w f v), with w^2 = 1 - f^2
  // a^2
  for (int k = 0; k < 3; ++k) {
    const double doubled = 2.0 * w * factor;
    w = 1.0 - 2.0 * (factor * factor) * square;
    factor = doubled;
  }
  return {{w, factor * v[0], factor * v[1], factor * v[2]}, factor};
}

/// Returns the matrix of a unit quaternion.
inline Mat3 matrix_of(const Quat& q) noexcept {
  const double w = q[0], x = q[1], y = q[2], z = q[3];
  return {1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - w * z),       2.0 * (x * z + w * y),
          2.0 * (x * y + w * z),       1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - w * x),
          2.0 * (x * z - w * y),       2.0 * (y * z + w * x),       1.0 - 2.0 * (x * x + y * y)};
}

/// Returns the coefficients of T(v), which maps the rate v' to the angular velocity of exp(v) in the axes
/// from which v rotates:
///   T(v) = 1 + first [v x] + second [v x]^2,   first = (1 - cos a) / a^2, second = (a - sin a) / a^3
/// (THEORY 12.59)
struct TangentCoefficients {
  double first, second;
};
inline TangentCoefficients tangent_of(const Vec3& v, const FiniteRotation& rotation) noexcept {
  const double square = dot(v, v), f = rotation.half_sine;
  const double first = 2.0 * f * f;
  if (square < 1.0) {
    // (a - sin a) / a^3 = (1 - a^2 / 20 (1 - a^2 / 42 (1 - ...))) / 6
    return {first, all_terms<0>(kTangentRatios, square) / 6.0};
  }
  return {first, (1.0 - 2.0 * f * rotation.q[0]) / square};
}
/// Returns T(v)^T m, the generalized moments on v of a moment m.
inline Vec3 transposed_tangent(const Vec3& v, const TangentCoefficients& c, const Vec3& m) noexcept {
  const Vec3 once = cross(v, m);
  return add_scaled(add_scaled(m, -c.first, once), c.second, cross(v, once));
}

/// Returns the coefficient of [v x]^2 in T(v)^-1 = 1 - [v x] / 2 + coefficient [v x]^2,
///   (1 - (a / 2) cot(a / 2)) / a^2
inline double inverse_tangent_coefficient(const Vec3& v, const FiniteRotation& rotation) noexcept {
  const double square = dot(v, v);
  if (square < 0.25) {  // 1 / 12 + a^2 / 720 + ..., Bernoulli numbers
    double sum = 691.0 / 1307674368000.0;
    for (const double coefficient : {1.0 / 47900160, 1.0 / 1209600, 1.0 / 30240, 1.0 / 720, 1.0 / 12})
      sum = coefficient + square * sum;
    return sum;
  }
  return (1.0 - rotation.q[0] / (2.0 * rotation.half_sine)) / square;
}

}  // namespace freeflex
