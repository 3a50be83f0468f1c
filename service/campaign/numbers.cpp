#include "service/campaign/numbers.hpp"

#include <Random123/philox.h>

#include <bit>
#include <cmath>
#include <limits>

namespace freeflex::campaign {
namespace {

constexpr double kLog2High = 0x1.62e42fee00000p-1;  // ln 2 to 32 bits, so that its multiples are exact
constexpr double kLog2Low = 0x1.a39ef35793c76p-33;  // the rest

template <std::size_t n>
double polynomial(const std::array<double, n>& coefficients, double x) noexcept {
  double sum = 0.0;
  for (std::size_t k = n; k-- > 0;) sum = sum * x + coefficients[k];
  return sum;
}

// Coefficients of AS 241, constant term first: numerators and denominators near the middle, in the tails, and
// far in the tails.
constexpr std::array kMiddleTop{3.3871328727963666080e0, 1.3314166789178437745e2, 1.9715909503065514427e3,
                                1.3731693765509461125e4, 4.5921953931549871457e4, 6.7265770927008700853e4,
                                3.3430575583588128105e4, 2.5090809287301226727e3};
constexpr std::array kMiddleBottom{1.0,
                                   4.2313330701600911252e1,
                                   6.8718700749205790830e2,
                                   5.3941960214247511077e3,
                                   2.1213794301586595867e4,
                                   3.9307895800092710610e4,
                                   2.8729085735721942674e4,
                                   5.2264952788528545610e3};
constexpr std::array kTailTop{1.42343711074968357734e0,  4.63033784615654529590e0, 5.76949722146069140550e0,
                              3.64784832476320460504e0,  1.27045825245236838258e0, 2.41780725177450611770e-1,
                              2.27238449892691845833e-2, 7.74545014278341407640e-4};
constexpr std::array kTailBottom{1.0,
                                 2.05319162663775882187e0,
                                 1.67638483018380384940e0,
                                 6.89767334985100004550e-1,
                                 1.48103976427480074590e-1,
                                 1.51986665636164571966e-2,
                                 5.47593808499534494600e-4,
                                 1.05075007164441684324e-9};
constexpr std::array kFarTop{6.65790464350110377720e0,  5.46378491116411436990e0,  1.78482653991729133580e0,
                             2.96560571828504891230e-1, 2.65321895265761230930e-2, 1.24266094738807843860e-3,
                             2.71155556874348757815e-5, 2.01033439929228813265e-7};
constexpr std::array kFarBottom{1.0,
                                5.99832206555887937690e-1,
                                1.36929880922735805310e-1,
                                1.48753612908506148525e-2,
                                7.86869131145613259100e-4,
                                1.84631831751005468180e-5,
                                1.42151175831644588870e-7,
                                2.04426310338993978564e-15};

/// Returns the probability above x > 0, by a series below 1.5 and by Laplace's continued fraction beyond.
double upper_probability(double x) noexcept {
  constexpr double kDensity = 0.398942280401432677939946;  // 1 / sqrt(2 pi)
  const double density = kDensity * exponential(-0.5 * x * x);
  if (x < 1.5) {
    double term = x, sum = x;
    for (int k = 3; term > 1e-17 * sum; k += 2) sum += term *= x * x / k;
    return 0.5 - density * sum;
  }
  double fraction = x;
  for (int k = 150; k > 0; --k) fraction = x + k / fraction;
  return density / fraction;
}

}  // namespace

std::array<std::uint64_t, 4> random_bits(const std::array<std::uint64_t, 4>& counter,
                                         const std::array<std::uint64_t, 2>& key) noexcept {
  const philox4x64_ctr_t at{{counter[0], counter[1], counter[2], counter[3]}};
  const philox4x64_key_t with{{key[0], key[1]}};
  const philox4x64_ctr_t result = philox4x64_R(10, at, with);
  return {result[0], result[1], result[2], result[3]};
}

double to_unit(std::uint64_t bits) noexcept { return (static_cast<double>(bits >> 12) + 0.5) * 0x1p-52; }

double natural_log(double x) noexcept {
  int exponent = 0;
  double m = std::frexp(x, &exponent);  // exact
  if (m < 0.70710678118654752440) m *= 2.0, --exponent;
  // ln(1 + f) = f - f^2/2 + s (f^2/2 + R), s = f / (2 + f), R = 2 (s^2/3 + s^4/5 + ...)
  const double f = m - 1.0, s = f / (2.0 + f), z = s * s, half_square = 0.5 * f * f;
  double sum = 0.0;
  for (int k = 25; k >= 3; k -= 2) sum = (sum + 2.0 / k) * z;
  return exponent * kLog2High - ((half_square - (s * (half_square + sum) + exponent * kLog2Low)) - f);
}

double exponential(double x) noexcept {
  if (x > 709.79) return std::numeric_limits<double>::infinity();
  if (x < -745.2) return 0.0;
  const double k = std::floor(x * 1.4426950408889634074 + 0.5);
  const double high = x - k * kLog2High, low = k * kLog2Low, r = high - low;
  double sum = 0.0;  // (e^r - 1) / r - 1
  for (int n = 15; n >= 2; --n) sum = (sum + 1.0) * (r / n);
  return std::ldexp(1.0 + (high + (r * sum - low)), static_cast<int>(k));
}

double normal_probability(double x) noexcept {
  return x > 0.0 ? 1.0 - upper_probability(x) : upper_probability(-x);
}

double normal_quantile(double u) noexcept {
  const double q = u - 0.5;
  if (std::fabs(q) <= 0.425) {
    const double r = 0.180625 - q * q;
    return q * polynomial(kMiddleTop, r) / polynomial(kMiddleBottom, r);
  }
  const double r = std::sqrt(-natural_log(q < 0.0 ? u : 1.0 - u));
  const double x = r <= 5.0 ? polynomial(kTailTop, r - 1.6) / polynomial(kTailBottom, r - 1.6)
                            : polynomial(kFarTop, r - 5.0) / polynomial(kFarBottom, r - 5.0);
  return q < 0.0 ? -x : x;
}

double arc_tangent(double y, double x) noexcept {
  constexpr double kRight = 1.57079632679489661923;  // pi / 2
  if (y == 0.0) return 0.0;
  if (y > x) return kRight - arc_tangent(x, y);
  // tan(a / 2) = tan a / (1 + sqrt(1 + tan^2 a)), twice, so that the tangent is below 0.2
  double t = y / x;
  for (int halving = 0; halving < 2; ++halving) t /= 1.0 + std::sqrt(1.0 + t * t);
  // t - t^3 / 3 + t^5 / 5 - ...; the first term that is left out is below 2e-17 of the sum
  double sum = 0.0;
  for (int k = 21; k >= 3; k -= 2) sum = (1.0 / k - sum) * (t * t);
  return 4.0 * (t - t * sum);
}

}  // namespace freeflex::campaign
