// Low frequencies of stiff structures, compared with sixty-digit arithmetic.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <iomanip>
#include <iostream>

#include "core/structure/modes/dense/decompositions.hpp"
#include "tests/setup/make_scene.hpp"
#include "tests/support/exact_frequencies.hpp"

namespace freeflex::testing {
namespace {

// Returns a square truss of three sections whose points are moved a little, so that no frequency repeats.
// Odd-numbered links are stiffer than the others by the factor stiffness_ratio, and heavy and light points
// alternate.
Scene stiff_truss(double stiffness_ratio, double mass_ratio) {
  std::mt19937_64 engine(7);
  std::uniform_real_distribution<double> shift(-0.1, 0.1);
  Scene scene;
  constexpr std::array<double, 4> kY{-0.5, 0.5, 0.5, -0.5}, kZ{-0.5, -0.5, 0.5, 0.5};
  for (int i = 0; i < 3; ++i)
    for (std::size_t c = 0; c < 4; ++c)
      add_point(scene, (static_cast<std::size_t>(i) + c) % 2 == 0 ? mass_ratio : 1.0,
                {i - 1.0 + shift(engine), kY[c] + shift(engine), kZ[c] + shift(engine)});
  const auto join = [&](int a, int b) {
    add_link(scene, a, b, Spring{scene.links.size() % 2 == 1 ? 1e3 * stiffness_ratio : 1e3});
  };
  for (int i = 0; i < 3; ++i) {
    for (int c = 0; c < 4; ++c) join(4 * i + c, 4 * i + (c + 1) % 4);
    join(4 * i, 4 * i + 2);
    join(4 * i + 1, 4 * i + 3);
    for (int c = 0; c < 4 && i < 2; ++c) {
      join(4 * i + c, 4 * i + 4 + c);
      join(4 * i + c, 4 * i + 4 + (c + 1) % 4);
    }
  }
  return scene;
}

// Returns the lowest frequency that an eigensolver finds from the assembled stiffness in double precision.
double naive_lowest(const Scene& scene) {
  ExactMatrix exact = exact_dynamic_matrix(scene);
  const auto size = static_cast<Eigen::Index>(exact.size);
  Eigen::MatrixXd K(size, size);
  for (Eigen::Index i = 0; i < size; ++i)
    for (Eigen::Index j = 0; j < size; ++j)
      K(i, j) = static_cast<double>(exact(static_cast<std::size_t>(i), static_cast<std::size_t>(j)));
  return std::sqrt(std::abs(Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(K).eigenvalues()[6]));
}

struct Errors {
  double lowest = 0.0;  // [-] error of the lowest frequency
  double worst = 0.0;   // [-] largest error of any frequency
  double naive = 0.0;   // [-] error of the lowest frequency that an eigensolver finds from K
};

Errors errors_of(const Scene& scene, const Structure& structure) {
  const std::vector<Exact> exact = exact_eigenvalues(exact_dynamic_matrix(scene));
  const auto error = [&](double omega, std::size_t mode) {
    const Exact truth = sqrt(exact[mode + 6]);
    return std::abs(static_cast<double>((Exact(omega) - truth) / truth));
  };
  Errors errors;
  errors.lowest = error(structure.omega[0], 0);
  errors.naive = error(naive_lowest(scene), 0);
  for (std::size_t mode = 0; mode < static_cast<std::size_t>(structure.omega.size()); ++mode)
    errors.worst = std::max(errors.worst, error(structure.omega[static_cast<Eigen::Index>(mode)], mode));
  return errors;
}

// Prints a row of the table and checks the errors against the promised bounds.
Errors check(const char* name, double stiffness_ratio, double mass_ratio, const Scene& scene) {
  const Structure structure = build(scene);
  EXPECT_TRUE(structure.mechanisms.empty());
  EXPECT_EQ(structure.omega.size(), 30);
  if (structure.omega.size() != 30) return {};
  const Errors errors = errors_of(scene, structure);
  std::cout << std::setw(8) << name << std::setw(17) << stiffness_ratio << std::setw(12) << mass_ratio
            << std::setw(14) << structure.omega[0] << std::setw(14) << errors.lowest << std::setw(14)
            << errors.worst << std::setw(14) << structure.frequency_accuracy << std::setw(14) << errors.naive
            << '\n';
  EXPECT_LT(errors.lowest, 1e-8);
  EXPECT_LT(errors.worst, 1e-8);
  // the stated accuracy covers the true error
  EXPECT_LT(errors.lowest, structure.frequency_accuracy);
  return errors;
}

void print_head() {
  std::cout
      << "   truss  stiffness ratio  mass ratio   lowest rad/s         error    worst mode        stated"
         "    eigensolver\n";
}

TEST(Stiff, LowestFrequencyOfATrussMatchesASixtyDigitSolution) {
  print_head();
  for (const double mass_ratio : {1.0, 1e4})
    for (const double stiffness_ratio : {1e8, 1e10, 1e12, 1e15}) {
      const Errors errors =
          check("alternating", stiffness_ratio, mass_ratio, stiff_truss(stiffness_ratio, mass_ratio));
      // in this difficult case an eigensolver on the assembled stiffness has no correct digits
      if (stiffness_ratio == 1e15) {
        EXPECT_GT(errors.naive, 1e-3);
      }
    }
}

// Stiffnesses and masses are spread evenly over the decades, so that they do not form two separate groups.
TEST(Stiff, FrequenciesOfAGradedTrussMatchASixtyDigitSolution) {
  print_head();
  for (const double stiffness_ratio : {1e8, 1e12, 1e15})
    for (std::uint64_t seed = 1; seed <= 2; ++seed) {
      std::mt19937_64 engine(seed);
      std::uniform_real_distribution<double> share(0.0, 1.0);
      Scene scene = stiff_truss(1.0, 1.0);
      for (Link& link : scene.links) link.kind = Spring{1e3 * std::pow(stiffness_ratio, share(engine))};
      for (PointMass& point : scene.points) point.mass = std::pow(1e4, share(engine));
      check("graded", stiffness_ratio, 1e4, scene);
    }
}

}  // namespace
}  // namespace freeflex::testing
