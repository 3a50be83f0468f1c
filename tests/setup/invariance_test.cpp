// If a scene is translated, rotated or renumbered, only its description changes.
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <iostream>
#include <numeric>

#include "core/rounding.hpp"
#include "tests/setup/make_scene.hpp"
#include "tests/support/structures.hpp"

namespace freeflex::testing {
namespace {

// Returns the displacements under self-equilibrated static loads: V = sum b (b.F) / (M omega^2).
Eigen::VectorXd static_displacement(const Structure& structure, const Eigen::VectorXd& F) {
  const Eigen::VectorXd Q = structure.shapes.transpose() * F;
  return structure.shapes *
         (Q.array() / (structure.mass_properties.mass * structure.omega.array().square())).matrix();
}

struct Placing {
  Eigen::Matrix3d R = Eigen::Matrix3d::Identity();
  Eigen::Vector3d shift = Eigen::Vector3d::Zero();
  std::vector<int> order;  // new point k is old point order[k]
};

Scene changed(const Scene& scene, const Placing& change) {
  Scene other = scene;
  std::vector<int> new_index(scene.points.size());
  for (std::size_t k = 0; k < new_index.size(); ++k) {
    const auto old = static_cast<std::size_t>(change.order[k]);
    other.points[k] = scene.points[old];
    other.points[k].position = change.R * scene.points[old].position + change.shift;
    new_index[old] = static_cast<int>(k);
  }
  for (Link& link : other.links)
    for (int& point : link.points) point = new_index[static_cast<std::size_t>(point)];
  std::reverse(other.links.begin(), other.links.end());
  return other;
}

void expect_same(const Scene& scene, const Placing& change) {
  std::mt19937_64 engine(17);
  std::normal_distribution<double> normal;
  Eigen::VectorXd F(3 * static_cast<Eigen::Index>(scene.points.size()));
  for (double& each : F) each = normal(engine);
  Eigen::VectorXd F_other(F.size());
  for (std::size_t k = 0; k < change.order.size(); ++k)
    F_other.segment<3>(3 * static_cast<Eigen::Index>(k)) = change.R * F.segment<3>(3 * change.order[k]);

  const Structure one = build(scene), other = build(changed(scene, change));
  ASSERT_EQ(one.omega.size(), other.omega.size());
  // coordinates are rounded again, with errors of up to eps times the shift, and the condition number of K,
  // conditioning^2, amplifies these errors
  const double rounding = kEpsilon * (1.0 + change.shift.norm());
  const double condition = one.conditioning * one.conditioning;
  const double frequency_error = ((other.omega - one.omega).array() / one.omega.array()).abs().maxCoeff();
  const Eigen::VectorXd V = static_displacement(one, F), V_other = static_displacement(other, F_other);
  double displacement_error = 0.0;
  for (std::size_t k = 0; k < change.order.size(); ++k)
    displacement_error = std::max(displacement_error, (V_other.segment<3>(3 * static_cast<Eigen::Index>(k)) -
                                                       change.R * V.segment<3>(3 * change.order[k]))
                                                              .norm() /
                                                          V.norm());
  std::cout << "conditioning " << one.conditioning << ", frequencies differ by " << frequency_error
            << ", static displacements by " << displacement_error << '\n';
  EXPECT_LT(frequency_error, 10.0 * condition * rounding);
  EXPECT_LT(displacement_error, 10.0 * condition * rounding);
}

void expect_invariant(const Scene& scene) {
  std::vector<int> same(scene.points.size()), mixed(scene.points.size());
  std::iota(same.begin(), same.end(), 0);
  mixed = same;
  std::shuffle(mixed.begin(), mixed.end(), std::mt19937_64(23));
  const Eigen::Matrix3d R(Eigen::Quaterniond(0.3, -0.5, 0.7, 0.4).normalized());
  expect_same(scene, {Eigen::Matrix3d::Identity(), {3.0, -50.0, 70.0}, same});
  expect_same(scene, {R, Eigen::Vector3d::Zero(), same});
  expect_same(scene, {Eigen::Matrix3d::Identity(), Eigen::Vector3d::Zero(), mixed});
  expect_same(scene, {R, {3.0, -50.0, 70.0}, mixed});
}

TEST(Invariance, FrequenciesOfATrussDoNotDependOnPoseAndNumbering) { expect_invariant(square_truss(5)); }

TEST(Invariance, FrequenciesOfRandomStructuresDoNotDependOnPoseAndNumbering) {
  for (std::uint64_t seed = 1; seed <= 3; ++seed) expect_invariant(random_structure(seed, 8));
}

}  // namespace
}  // namespace freeflex::testing
