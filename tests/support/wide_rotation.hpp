// Computes the free rotation of a body in fifty-digit arithmetic, by Taylor series of Euler's equations and
// of the attitude. Header only.
#pragma once

#include <array>
#include <boost/multiprecision/cpp_bin_float.hpp>
#include <cmath>
#include <vector>

namespace freeflex::testing {

using Wide = boost::multiprecision::cpp_bin_float_50;

struct WideRotation {
  std::array<Wide, 3> moment;         // [kg m^2] principal moments about the body axes
  std::array<Wide, 3> w;              // [rad/s] body axes
  std::array<Wide, 4> q{1, 0, 0, 0};  // body to world
};

/// Returns sum_j a_j b_(k-j).
inline Wide convolution(const std::vector<Wide>& a, const std::vector<Wide>& b, std::size_t k) {
  Wide sum = 0;
  for (std::size_t j = 0; j <= k; ++j) sum += a[j] * b[k - j];
  return sum;
}

/// Advances the body by one Taylor step of order 48. The nearest pole of the elliptic functions is at a
/// distance of about 1.5 / |w| in time, so a step of 0.1 / |w| has an error of 1e-56.
inline void taylor_step(WideRotation& body, const Wide& h) {
  constexpr std::size_t kOrder = 48;
  std::array<std::vector<Wide>, 3> w;
  std::array<std::vector<Wide>, 4> q;
  for (std::size_t a = 0; a < 3; ++a) w[a].assign(kOrder + 1, 0), w[a][0] = body.w[a];
  for (std::size_t a = 0; a < 4; ++a) q[a].assign(kOrder + 1, 0), q[a][0] = body.q[a];
  const auto& I = body.moment;
  for (std::size_t k = 0; k < kOrder; ++k) {
    const Wide n = k + 1;
    // I_1 w_1' = (I_2 - I_3) w_2 w_3 and cyclic;  q' = q (0, w) / 2
    for (std::size_t a = 0; a < 3; ++a) {
      const std::size_t b = (a + 1) % 3, c = (a + 2) % 3;
      w[a][k + 1] = (I[b] - I[c]) / I[a] * convolution(w[b], w[c], k) / n;
      q[a + 1][k + 1] =
          (convolution(q[0], w[a], k) + convolution(q[b + 1], w[c], k) - convolution(q[c + 1], w[b], k)) /
          (2 * n);
    }
    q[0][k + 1] =
        -(convolution(q[1], w[0], k) + convolution(q[2], w[1], k) + convolution(q[3], w[2], k)) / (2 * n);
  }
  const auto sum = [&h](const std::vector<Wide>& series) {
    Wide value = 0;
    for (std::size_t k = series.size(); k-- > 0;) value = value * h + series[k];
    return value;
  };
  for (std::size_t a = 0; a < 3; ++a) body.w[a] = sum(w[a]);
  for (std::size_t a = 0; a < 4; ++a) body.q[a] = sum(q[a]);
}

/// Returns the body `time` [s] after it starts from the identity attitude with angular velocity w [rad/s].
inline WideRotation rotate_freely(const std::array<double, 3>& moment, const std::array<double, 3>& w,
                                  double time) {
  WideRotation body;
  double spin = 0.0;
  for (std::size_t a = 0; a < 3; ++a) {
    body.moment[a] = moment[a];
    body.w[a] = w[a];
    spin += w[a] * w[a];
  }
  const int steps = static_cast<int>(std::ceil(10.0 * time * std::sqrt(spin)));
  for (int k = 0; k < steps; ++k) taylor_step(body, Wide(time) / steps);
  return body;
}

}  // namespace freeflex::testing
