// This file makes scenes with a single source of error. Tests compare the verdicts on these scenes with the
// true error.
#pragma once

#include "tests/motion/verdict_truth.hpp"

namespace freeflex::testing {

/// Displaces the scene along elastic modes, numbered from 1, without velocity.
inline void displace_modes(Scene &scene, const std::vector<std::pair<int, double>> &modes) {
  Faults faults;
  const auto structure = build_structure(scene, faults);
  scene.initial.points.clear();
  for (int i = 0; i < static_cast<int>(scene.points.size()); ++i) {
    Eigen::Vector3d V = Eigen::Vector3d::Zero();
    for (const auto &[mode, q] : modes)
      V += q * structure->shapes.block<3, 1>(
                   3 * i, static_cast<Eigen::Index>(structure->mechanisms.size()) + mode - 1);
    scene.initial.points.push_back({i, V, Eigen::Vector3d::Zero()});
  }
}

inline JudgedError judged_error(Scene scene, Fidelity rung, double end) {
  publish_everything(scene);
  end = std::round(end * scene.rate) / scene.rate;
  const auto truth = true_displacements(scene, end);
  EXPECT_TRUE(truth);
  return compare_verdict(scene, rung, end, truth);
}
inline void expect_estimated(const JudgedError &judged) {
  // measured 0.97 to 1.09 on the motions of verdict_physics_test and verdict_attitude_test
  EXPECT_GT(judged.estimate, 0.85 * judged.error);
  EXPECT_LT(judged.estimate, 1.15 * judged.error);
}

/// Returns two tetrahedra hinged along a common edge and joined by a soft spring, so that the hinge is by far
/// the lowest mode.
inline Scene hinged_tetrahedra(double hinge) {
  Scene scene;
  const int a = add_point(scene, 1.0, {0.0, -0.5, 0.0}), b = add_point(scene, 1.0, {0.0, 0.5, 0.0});
  std::array<int, 2> tops{};
  for (const int side : {0, 1}) {
    const double x = side == 0 ? -1.0 : 1.0;
    const int end = add_point(scene, 1.0, {x, 0.1, 0.1 * x}),
              top = add_point(scene, 1.0, {0.6 * x, 0.0, 0.8});
    for (const int corner : {a, b}) {
      add_link(scene, {corner, end}, Spring{400.0});
      add_link(scene, {corner, top}, Spring{500.0});
    }
    add_link(scene, {end, top}, Spring{300.0});
    tops[static_cast<std::size_t>(side)] = top;
  }
  add_link(scene, {a, b}, Spring{600.0});
  add_link(scene, {tops[0], tops[1]}, Spring{hinge});
  scene.rate = 500.0;
  return scene;
}

}  // namespace freeflex::testing
