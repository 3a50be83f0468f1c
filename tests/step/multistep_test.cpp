// The methods that advance points, on vibrations with exact solutions   (THEORY 12.128 to 12.131).
#include "core/step/points/multistep.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <complex>
#include <cstdio>
#include <vector>

namespace freeflex::testing {
namespace {

/// Returns the coefficients of rho / (xi - 1), for the differences of positions e_0 to e_11: the terms of
/// (THEORY 12.128) on one side.
std::array<long double, 12> change_coefficients() {
  std::array<long double, 12> r{};
  r[0] = -1.0L, r[11] = 1.0L;
  for (std::size_t j = 1; j <= 5; ++j) {
    r[j] = -static_cast<long double>(kChangeWeights[j - 1]);
    r[11 - j] = static_cast<long double>(kChangeWeights[j - 1]);
  }
  return r;
}

/// Returns the coefficients of the accelerations f_0 to f_10.
std::array<long double, 11> acceleration_coefficients() {
  std::array<long double, 11> b{};
  for (std::size_t j = 0; j <= 5; ++j) b[j] = b[10 - j] = static_cast<long double>(kAccelerationWeights[j]);
  return b;
}

/// Returns what the method leaves of the polynomial t^q with t = 0 in the middle: sum r_j (y_{j+1} - y_j) -
/// sum b_j y''.
long double residual(int q) {
  const auto power = [](long double t, int n) {
    return n < 0 ? 0.0L : std::pow(t, static_cast<long double>(n));
  };
  long double sum = 0.0L;
  const auto r = change_coefficients();
  const auto b = acceleration_coefficients();
  for (int j = 0; j < 12; ++j)
    sum += r[static_cast<std::size_t>(j)] *
           (power(static_cast<long double>(j - 5), q) - power(static_cast<long double>(j - 6), q));
  for (int j = 0; j < 11; ++j)
    sum -= b[static_cast<std::size_t>(j)] * static_cast<long double>(q) * static_cast<long double>(q - 1) *
           power(static_cast<long double>(j - 5), q - 2);
  return sum;
}

TEST(Multistep, HasOrderTwelveAndTheStatedError) {
  for (int q = 0; q <= 13; ++q) {
    // the coefficients are rounded to doubles, and the largest term of order q is some 100 * 6^q
    EXPECT_LT(std::abs(residual(q)), 1e-13L * std::pow(6.0L, static_cast<long double>(q))) << q;
  }
  // the phase error per rad is C / (2 sum b) with C = residual(14) / 14!
  long double factorial = 1.0L, sum = 0.0L;
  for (int n = 2; n <= 14; ++n) factorial *= n;
  for (const long double b : acceleration_coefficients()) sum += b;
  EXPECT_NEAR(static_cast<double>(std::abs(residual(14)) / factorial / (2.0L * sum)), kPhaseError,
              1e-3 * kPhaseError);
}

/// A vibration y'' = -y that starts from exact values and is advanced with a phase theta in a step.
class Vibration {
 public:
  explicit Vibration(double theta) : theta_(theta) {
    for (std::size_t k = 0; k < kPastSteps; ++k) {
      const double from = (static_cast<double>(k) - 11.0) * theta, to = from + theta;
      changes_.emplace_back(kLanes, -2.0 * std::sin(0.5 * (from + to)) * std::sin(0.5 * theta));
      accelerations_.emplace_back(kLanes, -std::cos(to));
    }
  }
  void step() {
    Past changes, accelerations;
    for (std::size_t k = 0; k < kPastSteps; ++k)
      changes[k] = changes_[k].data(), accelerations[k] = accelerations_[k].data();
    Array change(kLanes), next(kLanes), next_low(kLanes);
    advance_multistep(changes, accelerations, theta_, kLanes, {x_.data(), low_.data()}, change.data(),
                      {next.data(), next_low.data()});
    changes_.erase(changes_.begin());
    changes_.push_back(change);
    accelerations_.erase(accelerations_.begin());
    accelerations_.emplace_back(kLanes, -next[0]);
    x_ = next, low_ = next_low;
    ++count_;
  }
  double x() const { return x_[0]; }
  double size() const { return std::hypot(x_[0], changes_.back()[0] / theta_); }
  double phase() const { return theta_ * static_cast<double>(count_); }

 private:
  double theta_;
  long count_ = 0;
  std::vector<Array> changes_, accelerations_;
  Array x_ = Array(kLanes, 1.0), low_ = Array(kLanes, 0.0);
};

TEST(Multistep, TheErrorOfAVibrationIsThatOfItsPhase) {
  for (const double theta : {0.48, 0.40, 0.32, 0.25}) {
    Vibration vibration(theta);
    double worst = 0.0;
    while (vibration.phase() < 1000.0) {
      vibration.step();
      worst = std::max(worst, std::abs(vibration.x() - std::cos(vibration.phase())));
    }
    const double stated =
        1000.0 * kPhaseError * std::pow(theta, 12.0) * std::exp(kPhaseGrowth * theta * theta);
    std::printf("theta %.2f: error after 1000 rad %.2e, stated %.2e\n", theta, worst, stated);
    EXPECT_NEAR(worst, stated, 0.1 * stated);
  }
}

TEST(Multistep, VibrationsStayBoundedBelowTheUnstablePhase) {
  for (const double theta : {0.05, 0.3, 0.5, 0.64}) {
    Vibration vibration(theta);
    double largest = 0.0;
    for (int k = 0; k < 1'000'000; ++k) {
      vibration.step();
      largest = std::max(largest, vibration.size());
    }
    std::printf("theta %.2f: largest size after 1e6 steps %.6f\n", theta, largest);
    // the size by the difference of two positions is off by theta / 2 at most
    EXPECT_LT(largest, 1.0 + 0.5 * theta + 1e-6);
  }
  Vibration vibration(kUnstablePhase + 0.01);
  for (int k = 0; k < 1000; ++k) vibration.step();
  EXPECT_GT(vibration.size(), 1e3) << "the limit is lower than it must be";
}

TEST(Multistep, ExtrapolatedStepsHaveTheOrderOfTheirColumns) {
  for (int columns = 2; columns <= 6; ++columns) {
    std::array<double, 2> errors{};
    for (std::size_t k = 0; k < 2; ++k) {
      const double h = k == 0 ? 1.2 : 0.9;
      ExtrapolationWorkspace w = make_extrapolation_workspace(kLanes);
      const Array x(kLanes, 0.6), v(kLanes, 0.8), a(kLanes, -0.6);
      const auto accelerate = [](double, const double* at, double* to) {
        for (int i = 0; i < kLanes; ++i) to[i] = -at[i];
      };
      extrapolate(columns, h, x.data(), v.data(), a.data(), accelerate, w);
      errors[k] = std::hypot(0.6 + w.sum_d[0] - (0.6 * std::cos(h) + 0.8 * std::sin(h)),
                             w.sum_u[0] - (0.8 * std::cos(h) - 0.6 * std::sin(h)));
    }
    const double order = std::log(errors[0] / errors[1]) / std::log(1.2 / 0.9);
    std::printf("%d columns: error %.1e at 1.2 rad, local order %.2f\n", columns, errors[0], order);
    EXPECT_NEAR(order, 2.0 * columns + 1.0, 0.4);
  }
}

}  // namespace
}  // namespace freeflex::testing
