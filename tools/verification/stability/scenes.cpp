#include "tools/verification/stability/scenes.hpp"

#include <cmath>
#include <string>
#include <utility>

namespace freeflex::tools {
namespace {

// rotates by an orthonormal triad of decimal numbers. The rotation need not be exact, because the rounded
// positions themselves are the rest shape
Eigen::Vector3d tilted(const Eigen::Vector3d& p) {
  return p[0] * Eigen::Vector3d(0.36, 0.48, 0.8) + p[1] * Eigen::Vector3d(-0.8, 0.6, 0.0) +
         p[2] * Eigen::Vector3d(-0.48, -0.64, 0.6);
}

void join_every_pair(Scene& scene, double stiffness) {
  const int count = static_cast<int>(scene.points.size());
  for (int a = 0; a < count; ++a)
    for (int b = a + 1; b < count; ++b) add_link(scene, {a, b}, Spring{stiffness * (1.0 + 0.1 * (b - a))});
}

}  // namespace

void add_point(Scene& scene, double mass, const Eigen::Vector3d& position) {
  const int index = static_cast<int>(scene.points.size());
  PointMass point;
  point.name = "p" + std::to_string(index);
  point.mass = mass;
  point.position = position;
  scene.points.push_back(std::move(point));
  scene.publication.points.push_back(index);
  scene.pushable.push_back(index);
}

void add_link(Scene& scene, std::vector<int> points, LinkKind kind) {
  Link link;
  link.name = "l" + std::to_string(scene.links.size());
  link.points = std::move(points);
  link.kind = std::move(kind);
  scene.links.push_back(std::move(link));
}

void add_force(Scene& scene, int point, const Eigen::Vector3d& force, History history) {
  Load load;
  load.name = "push " + std::to_string(scene.loads.size());
  load.forces.push_back({point, force});
  load.history = std::move(history);
  scene.loads.push_back(std::move(load));
}

void use(const Solver& solver, Scene& scene) {
  scene.fidelity = solver.rung;
  scene.integration.by = solver.by;
}

Scene stiff_truss(double stiffness_ratio, double mass_ratio) {
  constexpr std::array<double, 4> kY{-0.5, 0.5, 0.5, -0.5}, kZ{-0.5, -0.5, 0.5, 0.5};
  Scene scene;
  scene.name = "truss, stiff and soft alternately";
  // displacements of at most 0.1 m, distributed by multiples of 37 modulo 101
  int drawn = 0;
  const auto shift = [&drawn] { return 0.1 * ((37 * ++drawn % 101) / 50.0 - 1.0); };
  for (int i = 0; i < 3; ++i)
    for (std::size_t c = 0; c < 4; ++c) {
      const double x = i - 1.0 + shift(), y = kY[c] + shift(), z = kZ[c] + shift();
      add_point(scene, (static_cast<std::size_t>(i) + c) % 2 == 0 ? mass_ratio : 1.0, {x, y, z});
    }
  const auto join = [&](int a, int b) {
    add_link(scene, {a, b}, Spring{scene.links.size() % 2 == 1 ? 1e3 * stiffness_ratio : 1e3});
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

Scene nearly_collinear(double width, bool is_tilted) {
  Scene scene;
  scene.name = "nearly collinear";
  const std::array<Eigen::Vector3d, 4> points{Eigen::Vector3d{0.0, 0.0, 0.0},
                                              {1.0, width, -0.3 * width},
                                              {2.25, -0.7 * width, 0.8 * width},
                                              {3.0, 0.4 * width, 0.2 * width}};
  const std::array<double, 4> masses{1.0, 2.0, 1.5, 0.75};
  for (std::size_t i = 0; i < points.size(); ++i)
    add_point(scene, masses[i], is_tilted ? tilted(points[i]) : points[i]);
  join_every_pair(scene, 1e3);
  return scene;
}

Scene nearly_planar(double height, bool is_tilted) {
  Scene scene;
  scene.name = "nearly planar";
  const std::array<Eigen::Vector3d, 5> points{Eigen::Vector3d{0.0, 0.0, 0.0},
                                              {1.0, 0.125, height},
                                              {1.25, 1.0, -0.6 * height},
                                              {0.25, 1.125, 0.3 * height},
                                              {0.625, 0.5, -0.9 * height}};
  const std::array<double, 5> masses{1.0, 2.0, 1.5, 0.75, 1.25};
  for (std::size_t i = 0; i < points.size(); ++i)
    add_point(scene, masses[i], is_tilted ? tilted(points[i]) : points[i]);
  join_every_pair(scene, 1e3);
  return scene;
}

Scene oscillating_pair(double omega, double rate) {
  constexpr double kReducedMass = 0.75, kStretch = 1e-3;  // [kg], [m]
  Scene scene;
  scene.name = "pair";
  scene.rate = rate;
  add_point(scene, 1.0, {0.0, 0.0, 0.0});
  add_point(scene, 3.0, {1.0, 0.0, 0.0});
  add_link(scene, {0, 1}, Spring{kReducedMass * omega * omega});
  // the two displacements keep the centre of mass in place
  scene.initial.points.push_back({0, {-0.75 * kStretch, 0.0, 0.0}, {0.0, 0.0, 0.0}});
  scene.initial.points.push_back({1, {0.25 * kStretch, 0.0, 0.0}, {0.0, 0.0, 0.0}});
  return scene;
}

Scene octahedron(double stiffness) {
  // 2 m (b^2 + c^2) = 2, 2 m (a^2 + c^2) = 3, 2 m (a^2 + b^2) = 4
  const std::array<double, 3> arms{std::sqrt(1.25), std::sqrt(0.75), std::sqrt(0.25)};
  Scene scene;
  scene.name = "octahedron";
  for (std::size_t axis = 0; axis < 3; ++axis)
    for (const double sign : {-1.0, 1.0}) {
      Eigen::Vector3d position = Eigen::Vector3d::Zero();
      position[static_cast<Eigen::Index>(axis)] = sign * arms[axis];
      add_point(scene, 1.0, position);
    }
  for (int a = 0; a < 6; ++a)
    for (int b = a + 1; b < 6; ++b) add_link(scene, {a, b}, Spring{stiffness});
  return scene;
}

Scene square_truss(int sections, double stiffness, double size) {
  constexpr std::array<double, 4> kY{-0.5, 0.5, 0.5, -0.5}, kZ{-0.5, -0.5, 0.5, 0.5};
  Scene scene;
  scene.name = "square truss";
  for (int i = 0; i < sections; ++i)
    for (std::size_t c = 0; c < 4; ++c)
      add_point(scene, 1.0, size * Eigen::Vector3d(i - 0.5 * (sections - 1), kY[c], kZ[c]));
  for (int i = 0; i < sections; ++i) {
    const auto join = [&](int a, int b) { add_link(scene, {4 * i + a, 4 * i + b}, Spring{stiffness}); };
    for (int c = 0; c < 4; ++c) join(c, (c + 1) % 4);
    join(0, 2);
    join(1, 3);
    if (i + 1 == sections) break;
    for (int c = 0; c < 4; ++c) {
      join(c, 4 + c);
      join(c, 4 + (c + 1) % 4);
      join((c + 1) % 4, 4 + c);
    }
  }
  return scene;
}

}  // namespace freeflex::tools
