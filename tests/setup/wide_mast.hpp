// Computes frequencies of masts of unit masses in 113 bits from approximate mode shapes.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <variant>
#include <vector>

#include "core/structure/structure.hpp"

namespace freeflex::testing {

using Wide = __float128;

/// A symmetric matrix of small bandwidth in 113 bits. The matrix is factored as L D L^T without pivoting. The
/// shifted matrix is indefinite, but with so many digits the factor is accurate enough.
class Banded {
 public:
  Banded(int size, int width)
      : size_(size), width_(width), entries_(static_cast<std::size_t>(size) * (width + 1)) {}
  // \pre row >= column >= row - width
  Wide& at(int row, int column) {
    return entries_[static_cast<std::size_t>(row) * (width_ + 1) + static_cast<std::size_t>(row - column)];
  }
  void add(int a, int b, Wide value) {
    if (a >= b) at(a, b) += value;
  }
  void factor() {
    for (int i = 0; i < size_; ++i)
      for (int j = std::max(0, i - width_); j <= i; ++j) {
        Wide sum = at(i, j);
        for (int k = std::max(0, i - width_); k < j; ++k) sum -= at(i, k) * at(j, k) * at(k, k);
        at(i, j) = i == j ? sum : sum / at(j, j);
      }
  }
  void solve(std::vector<Wide>& x) {
    for (int i = 0; i < size_; ++i)
      for (int k = std::max(0, i - width_); k < i; ++k)
        x[static_cast<std::size_t>(i)] -= at(i, k) * x[static_cast<std::size_t>(k)];
    for (int i = 0; i < size_; ++i) x[static_cast<std::size_t>(i)] /= at(i, i);
    for (int i = size_ - 1; i >= 0; --i)
      for (int k = std::max(0, i - width_); k < i; ++k)
        x[static_cast<std::size_t>(k)] -= at(i, k) * x[static_cast<std::size_t>(i)];
  }

 private:
  int size_, width_;
  std::vector<Wide> entries_;
};

/// Computes frequencies of a mast of unit masses by inverse iteration in 113 bits from approximate mode
/// shapes. The result does not depend on how the shapes were found.
class WideMast {
 public:
  explicit WideMast(const Scene& scene) : scene_(scene), size_(3 * static_cast<int>(scene.points.size())) {}

  // \return omega after `steps` steps of inverse iteration with (K - near^2)^-1, which start from the vector
  double omega(double near, const Eigen::VectorXd& vector, int steps) const {
    // the shift is slightly off the frequency, so that the matrix is not singular, and a pair of equal
    // frequencies is treated as one
    const Wide shift = Wide(near) * near * (1.0 + 1e-7);
    Banded K(size_, 3 * 8 - 1);
    for (const Link& link : scene_.links) add(link, K);
    for (int i = 0; i < size_; ++i) K.at(i, i) -= shift;
    K.factor();
    std::vector<Wide> x(vector.data(), vector.data() + vector.size());
    for (int step = 0; step < steps; ++step) {
      K.solve(x);
      Wide largest = 0;
      for (const Wide each : x) largest = std::max(largest, each < 0 ? Wide(-each) : each);
      for (Wide& each : x) each /= largest;
    }
    Wide energy = 0, mass = 0;
    for (const Link& link : scene_.links) energy += strain(link, x);
    for (const Wide each : x) mass += each * each;
    return std::sqrt(static_cast<double>(energy / mass));
  }

 private:
  // Returns the vector between the ends of the link, and in `square` the square of its length.
  std::array<Wide, 3> span(const Link& link, Wide& square) const {
    std::array<Wide, 3> d{};
    square = 0;
    for (std::size_t a = 0; a < 3; ++a) {
      const auto axis = static_cast<Eigen::Index>(a);
      d[a] = Wide(scene_.points[static_cast<std::size_t>(link.points[1])].position[axis]) -
             Wide(scene_.points[static_cast<std::size_t>(link.points[0])].position[axis]);
      square += d[a] * d[a];
    }
    return d;
  }
  void add(const Link& link, Banded& K) const {
    Wide square = 0;
    const std::array<Wide, 3> d = span(link, square);
    const Wide stiffness = Wide(std::get<Spring>(link.kind).stiffness) / square;
    for (int p = 0; p < 2; ++p)
      for (int q = 0; q < 2; ++q)
        for (int a = 0; a < 3; ++a)
          for (int b = 0; b < 3; ++b)
            K.add(3 * link.points[static_cast<std::size_t>(p)] + a,
                  3 * link.points[static_cast<std::size_t>(q)] + b,
                  (p == q ? stiffness : Wide(-stiffness)) * d[static_cast<std::size_t>(a)] *
                      d[static_cast<std::size_t>(b)]);
  }
  Wide strain(const Link& link, const std::vector<Wide>& x) const {
    Wide square = 0, along = 0;
    const std::array<Wide, 3> d = span(link, square);
    for (std::size_t a = 0; a < 3; ++a)
      along += d[a] * (x[3 * static_cast<std::size_t>(link.points[1]) + a] -
                       x[3 * static_cast<std::size_t>(link.points[0]) + a]);
    return Wide(std::get<Spring>(link.kind).stiffness) * along * along / square;
  }
  const Scene& scene_;
  int size_;
};

}  // namespace freeflex::testing
