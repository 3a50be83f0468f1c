// Random numbers and vectors for the tests of links at true geometry.
#pragma once

#include <Eigen/Core>
#include <random>

namespace freeflex::testing {

class Random {
 public:
  explicit Random(unsigned seed) : engine_(seed) {}
  /// Returns a number in [-1, 1).
  double one() { return std::uniform_real_distribution<double>(-1.0, 1.0)(engine_); }
  Eigen::Vector3d vector() { return {one(), one(), one()}; }

 private:
  std::mt19937_64 engine_;
};

}  // namespace freeflex::testing
