// This file makes initial states and scenes for tests of dashpots and feedback. It is header only.
#pragma once

#include <Eigen/Geometry>
#include <random>

#include "tests/motion/linear_system.hpp"
#include "tests/support/structures.hpp"

namespace freeflex::testing {

/// Sets initial displacements without rigid motion, by a self-equilibrated pull on each spring.
inline void stretch(Scene& scene, double size, std::uint64_t seed) {
  std::mt19937_64 engine(seed);
  std::normal_distribution<double> normal(0.0, size);
  Eigen::VectorXd V = Eigen::VectorXd::Zero(3 * static_cast<Eigen::Index>(scene.points.size()));
  for (const Link& link : scene.links) {
    const Eigen::Vector3d u = (scene.points[static_cast<std::size_t>(link.points[1])].position -
                               scene.points[static_cast<std::size_t>(link.points[0])].position)
                                  .normalized();
    const double pull = normal(engine);
    V.segment<3>(3 * link.points[0]) -=
        pull / scene.points[static_cast<std::size_t>(link.points[0])].mass * u;
    V.segment<3>(3 * link.points[1]) +=
        pull / scene.points[static_cast<std::size_t>(link.points[1])].mass * u;
  }
  for (std::size_t i = 0; i < scene.points.size(); ++i)
    scene.initial.points.push_back(
        {static_cast<int>(i), V.segment<3>(3 * static_cast<Eigen::Index>(i)), Eigen::Vector3d::Zero()});
}

/// Returns (V, V') at the start.
inline WideVector start_of(const Scene& scene) {
  const auto n = 3 * static_cast<Eigen::Index>(scene.points.size());
  WideVector y = WideVector::Zero(2 * n);
  for (const auto& each : scene.initial.points)
    y.segment<3>(3 * each.point) = each.displacement.cast<long double>();
  return y;
}

/// Returns two adjacent boxes with links between many pairs of points. The 114 elastic freedoms are too many
/// for the exact exponential of coupled modes.
inline Scene two_boxes() {
  Scene scene = random_structure(5, 20);
  const Scene more = random_structure(6, 20);
  for (const PointMass& point : more.points) {
    PointMass moved = point;
    moved.name += "_2";
    moved.position.x() += 6.0;
    scene.points.push_back(moved);
  }
  for (Link link : more.links) {
    for (int& point : link.points) point += 20;
    link.name += "_2";
    scene.links.push_back(link);
  }
  for (int i = 0; i < 20; ++i)
    for (int j = 0; j < 3; ++j) {
      Link link;
      link.name = "j" + std::to_string(3 * i + j);
      link.points = {i, 20 + (i + j) % 20};
      link.kind = Spring{1e4};
      scene.links.push_back(link);
    }
  for (Link& link : scene.links)
    if (const auto* bar = std::get_if<Bar>(&link.kind)) link.kind = Spring{bar->EA};
  return scene;
}

}  // namespace freeflex::testing
