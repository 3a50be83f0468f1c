// Random structures of every class of shape. Header only.
#pragma once

#include <Eigen/Geometry>
#include <cmath>
#include <initializer_list>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "tests/setup/make_scene.hpp"
#include "tests/support/structures.hpp"

namespace freeflex::testing {

using Engine = std::mt19937_64;

inline double uniform(Engine& engine, double low, double high) {
  return std::uniform_real_distribution<double>(low, high)(engine);
}

inline Eigen::Vector3d random_vector(Engine& engine) {
  const double x = uniform(engine, -1.0, 1.0), y = uniform(engine, -1.0, 1.0);
  return {x, y, uniform(engine, -1.0, 1.0)};
}

template <typename Kind>
int add_angle(Scene& scene, std::initializer_list<int> points, const Kind& kind) {
  const int link = add_link(scene, 0, 0, kind);
  scene.links.back().points = points;
  return link;
}

/// Ranges of random scenes: masses and stiffnesses are log-uniform over these decades.
struct Spread {
  double masses = 1.0;       // decades between the smallest and the largest mass
  double stiffnesses = 1.0;  // decades between the smallest and the largest stiffness
};

inline double draw(Engine& engine, double middle, double decades) {
  return middle * std::pow(10.0, uniform(engine, -0.5, 0.5) * decades);
}

/// Replaces the masses of a scene. The first and the last mass are the extremes, and the others lie in
/// between.
inline void spread_masses(Scene& scene, Engine& engine, double decades) {
  for (PointMass& point : scene.points) point.mass = draw(engine, 1.0, decades);
  scene.points.front().mass = std::pow(10.0, -0.5 * decades);
  scene.points.back().mass = std::pow(10.0, 0.5 * decades);
}

inline double stiffness(Engine& engine, const Spread& spread) {
  return draw(engine, 1e4, spread.stiffnesses);
}

/// Returns a chain of springs and bending springs. Its points have random positions on a random line, at
/// least 0.2 m apart.
inline Scene chain(std::uint64_t seed, int num_points, const Spread& spread) {
  Engine engine(seed);
  Scene scene;
  const Eigen::Vector3d start = random_vector(engine), along = random_vector(engine).normalized();
  double s = 0.0;
  for (int i = 0; i < num_points; ++i, s += uniform(engine, 0.2, 1.0))
    add_point(scene, 1.0, start + s * along);
  spread_masses(scene, engine, spread.masses);
  for (int i = 0; i + 1 < num_points; ++i) add_link(scene, i, i + 1, Spring{stiffness(engine, spread)});
  for (int i = 0; i + 2 < num_points; ++i)
    add_angle(scene, {i, i + 1, i + 2}, BendingSpring{stiffness(engine, spread)});
  return scene;
}

/// Returns points in a random plane around a centre. Successive points are 1.1 to 1.9 rad apart, so that no
/// three of them are nearly on a line. Springs join every pair, and torsion springs hold every four
/// successive points.
inline Scene sheet(std::uint64_t seed, int num_points, const Spread& spread) {
  Engine engine(seed);
  Scene scene;
  const Eigen::Vector3d start = random_vector(engine), normal = random_vector(engine).normalized();
  const Eigen::Vector3d first = normal.unitOrthogonal(), second = normal.cross(first);
  double angle = 0.0;
  for (int i = 0; i < num_points; ++i, angle += uniform(engine, 1.1, 1.9)) {
    const double radius = uniform(engine, 0.8, 1.2);
    add_point(scene, 1.0, start + radius * (std::cos(angle) * first + std::sin(angle) * second));
  }
  spread_masses(scene, engine, spread.masses);
  for (int i = 0; i < num_points; ++i)
    for (int j = 0; j < i; ++j) add_link(scene, i, j, Spring{stiffness(engine, spread)});
  for (int i = 0; i + 3 < num_points; ++i)
    add_angle(scene, {i, i + 1, i + 2, i + 3}, TorsionSpring{stiffness(engine, spread)});
  return scene;
}

/// Returns points in general position. Springs join every pair.
inline Scene cloud(std::uint64_t seed, int num_points, const Spread& spread) {
  Engine engine(seed);
  Scene scene;
  for (int i = 0; i < num_points; ++i) add_point(scene, 1.0, random_vector(engine));
  spread_masses(scene, engine, spread.masses);
  for (int i = 0; i < num_points; ++i)
    for (int j = 0; j < i; ++j) add_link(scene, i, j, Spring{stiffness(engine, spread)});
  return scene;
}

/// Returns the corners of a unit cube in lexicographic order. Springs join every pair.
inline Scene cube(std::uint64_t seed, const Spread& spread) {
  Engine engine(seed);
  Scene scene;
  for (int i = 0; i < 8; ++i) add_point(scene, 1.0, {(i / 4) * 1.0, (i / 2 % 2) * 1.0, (i % 2) * 1.0});
  spread_masses(scene, engine, spread.masses);
  for (int i = 0; i < 8; ++i)
    for (int j = 0; j < i; ++j) add_link(scene, i, j, Spring{stiffness(engine, spread)});
  return scene;
}

/// Returns a square_truss with random masses and stiffnesses.
inline Scene truss(std::uint64_t seed, int sections, const Spread& spread) {
  Engine engine(seed);
  Scene scene = square_truss(sections);
  spread_masses(scene, engine, spread.masses);
  for (Link& link : scene.links) link.kind = Spring{stiffness(engine, spread)};
  return scene;
}

/// Returns hydrogen peroxide: two bonds O-H, one bond O-O, two angles and one dihedral angle of 112 degrees.
/// All values are of order one in SI units.
inline Scene peroxide(std::uint64_t seed, const Spread& spread) {
  Engine engine(seed);
  Scene scene;
  const double bend = 1.65, twist = 1.95;  // [rad]
  const Eigen::Vector3d arm(std::cos(bend) * 0.97, std::sin(bend) * 0.97, 0.0);
  add_point(scene, 1.0, arm);
  add_point(scene, 16.0, {0.0, 0.0, 0.0});
  add_point(scene, 16.0, {1.45, 0.0, 0.0});
  add_point(scene, 1.0, {1.45 - arm.x(), std::cos(twist) * arm.y(), std::sin(twist) * arm.y()});
  if (spread.masses > 2.0) spread_masses(scene, engine, spread.masses);
  for (int i = 0; i < 3; ++i) add_link(scene, i, i + 1, Spring{stiffness(engine, spread)});
  for (int i = 0; i < 2; ++i) add_angle(scene, {i, i + 1, i + 2}, BendingSpring{stiffness(engine, spread)});
  add_angle(scene, {0, 1, 2, 3}, TorsionSpring{stiffness(engine, spread)});
  return scene;
}

/// Returns a cloud with a rigid link between points 0 and 1 and a rigid body of points 2 to 4.
inline Scene partly_rigid(std::uint64_t seed, int num_points, const Spread& spread) {
  Scene scene = cloud(seed, num_points, spread);
  std::vector<Link> elastic;
  for (const Link& link : scene.links) {
    const int i = std::min(link.points[0], link.points[1]), j = std::max(link.points[0], link.points[1]);
    if (!((i == 0 && j == 1) || (i >= 2 && j <= 4))) elastic.push_back(link);
  }
  scene.links = elastic;
  add_link(scene, 0, 1, Rigid{});
  add_angle(scene, {2, 3, 4}, Rigid{});
  return scene;
}

/// Returns a free space frame of beams along the edges of a tetrahedron. One beam is shear-flexible, and one
/// is released at one end.
inline Scene frame(std::uint64_t seed, const Spread& spread) {
  Engine engine(seed);
  Scene scene;
  add_point(scene, 1.0, {0.0, 0.0, 0.0});
  add_point(scene, 1.0, {1.0, 0.1, 0.0});
  add_point(scene, 1.0, {0.2, 0.9, 0.1});
  add_point(scene, 1.0, {0.3, 0.2, 1.1});
  spread_masses(scene, engine, spread.masses);
  for (int i = 0; i < 4; ++i)
    for (int j = 0; j < i; ++j) {
      Beam beam{stiffness(engine, spread), stiffness(engine, spread), stiffness(engine, spread),
                stiffness(engine, spread)};
      if (i == 3 && j == 0) beam.GA_y = stiffness(engine, spread);
      if (i == 3 && j == 1) beam.released[0] = {false, true, true};
      add_link(scene, i, j, beam);
    }
  return scene;
}

struct NamedScene {
  std::string name;
  int num_elastic;  // n, counted by hand
  Scene scene;
};

/// Returns one scene of each class for a seed. In the partly rigid scene the body of three points removes 3
/// freedoms and the rigid link removes 1.
inline std::vector<NamedScene> every_class(std::uint64_t seed, const Spread& spread) {
  return {{"pair", 6 - 5, chain(seed, 2, spread)},
          {"chain of 3", 9 - 5, chain(seed, 3, spread)},
          {"chain of 9", 27 - 5, chain(seed, 9, spread)},
          {"triangle", 9 - 6, sheet(seed, 3, spread)},
          {"sheet of 8", 24 - 6, sheet(seed, 8, spread)},
          {"cloud of 4", 12 - 6, cloud(seed, 4, spread)},
          {"cloud of 10", 30 - 6, cloud(seed, 10, spread)},
          {"cube", 24 - 6, cube(seed, spread)},
          {"truss of 6 sections", 72 - 6, truss(seed, 6, spread)},
          {"peroxide", 12 - 6, peroxide(seed, spread)},
          {"partly rigid", 24 - 6 - 4, partly_rigid(seed, 8, spread)},
          {"frame", 12 - 6, frame(seed, spread)}};
}

}  // namespace freeflex::testing
