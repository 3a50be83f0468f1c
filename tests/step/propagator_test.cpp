// The coefficients of the exact propagator, compared with the exponential of the state matrix, which is
// computed by scaling and squaring.
#include "core/plan/modes/propagator.hpp"

#include <gtest/gtest.h>

#include <array>
#include <boost/multiprecision/cpp_bin_float.hpp>
#include <cmath>
#include <random>
#include <vector>

namespace freeflex {
namespace {

// enough digits for 50 squarings of matrices whose entries differ by factors of up to 1e22
using Real =
    boost::multiprecision::number<boost::multiprecision::cpp_bin_float<250>, boost::multiprecision::et_off>;
using Matrix = std::array<std::array<Real, 4>, 4>;

Matrix multiply(const Matrix& a, const Matrix& b) {
  Matrix c;
  for (std::size_t i = 0; i < 4; ++i)
    for (std::size_t j = 0; j < 4; ++j) {
      c[i][j] = 0;
      for (std::size_t k = 0; k < 4; ++k) c[i][j] += a[i][k] * b[k][j];
    }
  return c;
}

/// Returns the matrix exponential that advances (q, h q_dot, f, change of f over the step) by one step, with
/// f = h^2 Q / M. W is omega h, and a is decay h.
Matrix exponential(const Real& W, const Real& a) {
  Matrix A{};
  A[0][1] = A[1][2] = A[2][3] = 1;
  A[1][0] = -W * W;
  A[1][1] = -2 * a;
  int squarings = 0;
  Real size = 1 + W * W + 2 * a, scale = 1;
  for (; size > 1; size /= 2, scale /= 2) ++squarings;
  Matrix sum{}, term{};
  for (std::size_t i = 0; i < 4; ++i) sum[i][i] = term[i][i] = 1;
  for (int j = 1; j < 160; ++j) {
    term = multiply(term, A);
    for (std::size_t i = 0; i < 4; ++i)
      for (std::size_t k = 0; k < 4; ++k) {
        term[i][k] *= scale / j;
        sum[i][k] += term[i][k];
      }
  }
  for (int k = 0; k < squarings; ++k) sum = multiply(sum, sum);
  return sum;
}

/// Returns |found - exact| / |exact|. If |exact| is below the cancellation error of 250 digits, returns 0 if
/// |found| is as small, otherwise 1.
double relative_error(const Real& found, const Real& exact) {
  if (abs(exact) < Real("1e-180")) return abs(found) < Real("1e-179") ? 0.0 : 1.0;
  return (abs(found - exact) / abs(exact)).convert_to<double>();
}

struct Errors {
  double coefficients, weights;  // largest relative errors
};

Errors errors_of(double omega, double decay, double period, double mass) {
  Propagator p;
  p.lanes.resize(1);
  set_mode(p, 0, omega, decay, period, mass);
  const Propagator::Lanes& lanes = p.lanes.front();
  const Real h(period), M(mass);
  const Matrix E = exponential(Real(omega) * h, Real(decay) * h);
  const auto sum = [](const auto& c, const auto& l) { return Real(c[0]) + Real(l[0]); };
  const auto largest = [](std::initializer_list<double> list) { return std::max(list); };
  return {largest({relative_error(sum(lanes.c_qq, lanes.l_qq), E[0][0]),
                   relative_error(sum(lanes.c_qv, lanes.l_qv), h * E[0][1]),
                   relative_error(sum(lanes.c_vq, lanes.l_vq), E[1][0] / h),
                   relative_error(sum(lanes.c_vv, lanes.l_vv), E[1][1])}),
          largest({relative_error(Real(lanes.w_q0[0]), h * h / M * E[0][2]),
                   relative_error(Real(lanes.w_q1[0]), h * h / M * E[0][3]),
                   relative_error(Real(lanes.w_v0[0]), h / M * E[1][2]),
                   relative_error(Real(lanes.w_v1[0]), h / M * E[1][3])})};
}

// a coefficient is the sum of a leading part of 26 bits and a rest of 53 bits, which is rounded once
constexpr double kCoefficientError = 0x1p-78;
constexpr double kWeightError = 0x1p-53;

void expect_exact(double omega, double decay, double period, double mass) {
  const Errors errors = errors_of(omega, decay, period, mass);
  EXPECT_LE(errors.coefficients, kCoefficientError)
      << "omega " << omega << " decay " << decay << " period " << period;
  EXPECT_LE(errors.weights, kWeightError) << "omega " << omega << " decay " << decay << " period " << period;
}

TEST(Propagator, EqualsTheMatrixExponentialOverSixteenDecades) {
  constexpr double kPeriod = 1e-3, kMass = 3.7;
  for (int decade = -8; decade <= 8; ++decade)
    for (const double ratio : {0.0, 1e-9, 0.02, 1.0, 1e3}) {
      const double omega = std::pow(10.0, decade) / kPeriod;
      expect_exact(omega, ratio * omega, kPeriod, kMass);
    }
}

TEST(Propagator, EqualsTheMatrixExponentialNearCriticalDampingAndHalfCycles) {
  constexpr double kPeriod = 1e-3, kMass = 0.1, kPi = 3.141592653589793;
  for (const double W : {1e-6, 0.3, 0.999999999, 1.0, 2.5, 40.0})
    for (const double ratio : {1.0 - 1e-15, 1.0 - 1e-9, 1.0, 1.0 + 1e-15, 1.0 + 1e-9, 1.01})
      expect_exact(W / kPeriod, ratio * (W / kPeriod), kPeriod, kMass);
  for (const double cycles : {1.0 / 6, 0.25, 1.0 / 3, 0.5, 1.0, 1000.0})
    for (const double ratio : {0.0, 1e-9, 0.02})
      expect_exact(2 * kPi * cycles / kPeriod, ratio * 2 * kPi * cycles / kPeriod, kPeriod, kMass);
}

TEST(Propagator, EqualsTheMatrixExponentialWithoutStiffness) {
  constexpr double kMass = 12.0;
  for (const double period : {1e-4, 1.0 / 3.0})
    for (const double omega : {0.0, 1e-160, 1e-30})
      for (const double decay : {0.0, 1e-9, 1.0, 1e5}) expect_exact(omega, decay, period, kMass);
}

TEST(Propagator, EqualsTheMatrixExponentialForRandomModes) {
  std::mt19937_64 engine(7);
  std::uniform_real_distribution<double> decade(-8.0, 8.0), log_ratio(-10.0, 3.0), log_period(-5.0, 0.0);
  for (int k = 0; k < 100; ++k) {
    const double period = std::pow(10.0, log_period(engine)), omega = std::pow(10.0, decade(engine)) / period;
    expect_exact(omega, omega * std::pow(10.0, log_ratio(engine)), period, 1.0);
  }
}

TEST(Propagator, TheLeadingPartOfEachCoefficientHasTwentySixBits) {
  Propagator p;
  p.lanes.resize(1);
  set_mode(p, 0, 314.159, 2.0, 1e-3, 1.0);
  const Propagator::Lanes& lanes = p.lanes.front();
  for (const auto* c : {&lanes.c_qq, &lanes.c_qv, &lanes.c_vq, &lanes.c_vv}) {
    const double product = 67108863.0 * c->front();  // 2^26 - 1
    EXPECT_EQ(Real(67108863.0) * Real(c->front()), Real(product));
  }
}

}  // namespace
}  // namespace freeflex
