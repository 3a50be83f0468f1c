// Computes the squared frequencies of scenes of springs in sixty-digit arithmetic, from the exact values of
// the doubles in the scene. Header only.
#pragma once

#include <algorithm>
#include <array>
#include <boost/multiprecision/cpp_bin_float.hpp>
#include <vector>

#include "core/scene/scene.hpp"

namespace freeflex::testing {

using Exact =
    boost::multiprecision::number<boost::multiprecision::cpp_bin_float<60>, boost::multiprecision::et_off>;
struct ExactMatrix {
  std::size_t size = 0;
  std::vector<Exact> entries;
  Exact& operator()(std::size_t i, std::size_t j) { return entries[i * size + j]; }
};

/// Returns M^-1/2 K M^-1/2.  \pre every link is a spring
inline ExactMatrix exact_dynamic_matrix(const Scene& scene) {
  const std::size_t size = 3 * scene.points.size();
  ExactMatrix K{size, std::vector<Exact>(size * size)};
  for (const Link& link : scene.links) {
    const std::array<std::size_t, 2> ends{static_cast<std::size_t>(link.points[0]),
                                          static_cast<std::size_t>(link.points[1])};
    std::array<Exact, 3> d;
    Exact length2 = 0;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const auto at = static_cast<Eigen::Index>(axis);
      d[axis] = Exact(scene.points[ends[1]].position[at]) - Exact(scene.points[ends[0]].position[at]);
      length2 += d[axis] * d[axis];
    }
    const Exact factor = Exact(std::get<Spring>(link.kind).stiffness) / length2;
    for (const std::size_t a : ends)
      for (const std::size_t b : ends) {
        const Exact scale = (a == b ? factor : Exact(-factor)) /
                            sqrt(Exact(scene.points[a].mass) * Exact(scene.points[b].mass));
        for (std::size_t i = 0; i < 3; ++i)
          for (std::size_t j = 0; j < 3; ++j) K(3 * a + i, 3 * b + j) += scale * d[i] * d[j];
      }
  }
  return K;
}

/// Returns the eigenvalues, ascending, by cyclic Jacobi rotations. They have sixty digits relative to the
/// largest eigenvalue, so the smallest eigenvalue has 30 digits if it is 1e30 times smaller.
inline std::vector<Exact> exact_eigenvalues(ExactMatrix K) {
  const std::size_t n = K.size;
  for (int sweep = 0; sweep < 60; ++sweep) {
    Exact off = 0, all = 0;
    for (std::size_t i = 0; i < n; ++i)
      for (std::size_t j = 0; j < n; ++j) (i == j ? all : off) += K(i, j) * K(i, j);
    if (off <= all * Exact("1e-116")) break;
    for (std::size_t p = 0; p < n; ++p)
      for (std::size_t q = p + 1; q < n; ++q) {
        if (K(p, q) == 0) continue;
        const Exact zeta = (K(q, q) - K(p, p)) / (2 * K(p, q));
        const Exact t = (zeta >= 0 ? 1 : -1) / (abs(zeta) + sqrt(1 + zeta * zeta));
        const Exact c = 1 / sqrt(1 + t * t), s = c * t;
        for (std::size_t k = 0; k < n; ++k) {
          const Exact a = K(k, p), b = K(k, q);
          K(k, p) = c * a - s * b;
          K(k, q) = s * a + c * b;
        }
        for (std::size_t k = 0; k < n; ++k) {
          const Exact a = K(p, k), b = K(q, k);
          K(p, k) = c * a - s * b;
          K(q, k) = s * a + c * b;
        }
      }
  }
  std::vector<Exact> values;
  for (std::size_t i = 0; i < n; ++i) values.push_back(K(i, i));
  std::sort(values.begin(), values.end());
  return values;
}

}  // namespace freeflex::testing
