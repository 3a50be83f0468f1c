// Accuracy of the sparse set-up on masts, for the quick and the long tests.
#pragma once

#include <gtest/gtest.h>

#include <cstdio>
#include <numeric>
#include <random>

#include "tests/setup/make_scene.hpp"
#include "tests/setup/wide_mast.hpp"
#include "tests/support/structures.hpp"

namespace freeflex::testing {

inline Scene mast(int sections, int count) {
  Scene scene = square_truss(sections);
  scene.publication = {};
  scene.pushable.clear();
  scene.modes.count = count;
  return scene;
}

/// Computes 20 frequencies and compares the lowest `checked` of them with a solution in many digits.  \return
/// the lowest frequency [rad/s]
inline double expect_accurate(int sections, int checked) {
  const Scene scene = mast(sections, 20);
  const Structure structure = build(scene);
  EXPECT_GE(structure.omega.size(), 20);
  if (structure.omega.size() < 20) return 0.0;
  const WideMast wide(scene);
  double worst = 0.0;
  for (Eigen::Index k = 0; k < checked; ++k) {
    const double exact = wide.omega(structure.omega[k], structure.shapes.col(k), 2);
    worst = std::max(worst, std::abs(structure.omega[k] / exact - 1.0));
    if (k == 0) {
      EXPECT_LE(std::abs(structure.omega[k] / exact - 1.0), structure.frequency_accuracy + 4e-16);
    }
  }
  EXPECT_LT(worst, 1e-9);
  ::testing::Test::RecordProperty("worst", std::to_string(worst));
  // a square mast has equal bending frequencies in both planes, so the first four frequencies are two pairs
  EXPECT_NEAR(structure.omega[1] / structure.omega[0], 1.0, 1e-10);
  EXPECT_NEAR(structure.omega[3] / structure.omega[2], 1.0, 1e-10);
  std::printf("%d bays: worst of %d frequencies %.1e, stated %.1e\n", sections - 1, checked, worst,
              structure.frequency_accuracy);
  return structure.omega[0];
}

/// Expects the same frequencies for two numberings of the points, with a stiffness ratio of 1e12 and a mass
/// ratio of 1e4.
inline void expect_same_of_any_numbering(int sections) {
  Scene scene = mast(sections, 20);
  for (std::size_t i = 0; i < scene.links.size(); ++i)
    if (i % 2 == 1) scene.links[i].kind = Spring{1e12};
  for (auto& link : scene.links)
    if (auto* spring = std::get_if<Spring>(&link.kind); spring->stiffness < 1e12) spring->stiffness = 1.0;
  for (std::size_t i = 0; i < scene.points.size(); ++i) scene.points[i].mass = i % 3 == 0 ? 100.0 : 0.01;
  std::vector<int> order(scene.points.size());
  std::iota(order.begin(), order.end(), 0);
  std::mt19937_64 engine(3);
  std::shuffle(order.begin(), order.end(), engine);
  Scene other = scene;
  for (std::size_t i = 0; i < order.size(); ++i)
    other.points[static_cast<std::size_t>(order[i])] = scene.points[i];
  for (Link& link : other.links)
    for (int& point : link.points) point = order[static_cast<std::size_t>(point)];
  const Structure one = build(scene), two = build(other);
  ASSERT_EQ(one.omega.size(), two.omega.size());
  for (Eigen::Index k = 0; k < one.omega.size(); ++k)
    EXPECT_NEAR(two.omega[k] / one.omega[k], 1.0, 1e-8) << "mode " << k;
}

}  // namespace freeflex::testing
