#include "tests/support/structures.hpp"

#include <cmath>
#include <random>
#include <string>

namespace freeflex::testing {
namespace {

void add_point(Scene& scene, double mass, const Eigen::Vector3d& position) {
  PointMass point;
  point.name = std::string("p").append(std::to_string(scene.points.size()));
  point.mass = mass;
  point.position = position;
  scene.points.push_back(point);
}

void add_spring(Scene& scene, int first, int second, double stiffness) {
  Link link;
  link.name = std::string("s").append(std::to_string(scene.links.size()));
  link.points = {first, second};
  link.kind = Spring{stiffness};
  scene.links.push_back(link);
}

}  // namespace

void publish_everything(Scene& scene) {
  scene.publication.points.clear();
  scene.publication.links.clear();
  scene.pushable.clear();
  for (int i = 0; i < static_cast<int>(scene.points.size()); ++i) {
    scene.publication.points.push_back(i);
    scene.pushable.push_back(i);
  }
  for (int i = 0; i < static_cast<int>(scene.links.size()); ++i) {
    if (!std::holds_alternative<MatrixLink>(scene.links[static_cast<std::size_t>(i)].kind)) {
      scene.publication.links.push_back(i);
    }
  }
}

Scene square_truss(int sections) {
  constexpr double kStiffness = 1e5;  // [N/m]
  constexpr double kY[] = {-0.5, 0.5, 0.5, -0.5};
  constexpr double kZ[] = {-0.5, -0.5, 0.5, 0.5};
  Scene scene;
  scene.name = "square truss of " + std::to_string(sections) + " sections";
  for (int i = 0; i < sections; ++i) {
    for (int c = 0; c < 4; ++c) add_point(scene, 1.0, {i - 0.5 * (sections - 1), kY[c], kZ[c]});
  }
  for (int i = 0; i < sections; ++i) {
    const auto corner = [i](int section, int c) { return 4 * (i + section) + c % 4; };
    for (int c = 0; c < 4; ++c) add_spring(scene, corner(0, c), corner(0, c + 1), kStiffness);
    add_spring(scene, corner(0, 0), corner(0, 2), kStiffness);
    add_spring(scene, corner(0, 1), corner(0, 3), kStiffness);
    if (i + 1 == sections) break;
    for (int c = 0; c < 4; ++c) {
      add_spring(scene, corner(0, c), corner(1, c), kStiffness);
      add_spring(scene, corner(0, c), corner(1, c + 1), kStiffness);
      add_spring(scene, corner(0, c + 1), corner(1, c), kStiffness);
    }
  }
  publish_everything(scene);
  return scene;
}

void add_corner_pulse(Scene& scene) {
  Load load;
  load.name = "corner pulse";
  load.axes = Axes::kWorld;
  load.forces.push_back({static_cast<int>(scene.points.size()) - 2, {0.48, 0.6, 0.64}});
  load.history = PulseHistory{0.0, 0.1};
  scene.loads.push_back(load);
}

Scene truss_s1() {
  Scene scene = square_truss(5);
  add_corner_pulse(scene);
  return scene;
}

Scene truss_s2() {
  Scene scene = square_truss(26);
  add_corner_pulse(scene);
  return scene;
}

Scene truss_s3() {
  Scene scene = square_truss(250);
  add_corner_pulse(scene);
  return scene;
}

Scene truss_s4() {
  Scene scene = truss_s1();
  for (std::size_t i = 1; i < scene.links.size(); i += 2) scene.links[i].kind = Spring{1e9};
  for (std::size_t i = 0; i < scene.points.size(); ++i) {
    scene.points[i].mass = (i / 4 + i % 4) % 2 == 1 ? 0.01 : 100.0;
  }
  return scene;
}

Scene truss_s5(double spin) {
  Scene scene = truss_s1();
  scene.initial.angular_velocity = {0.0, 0.0, spin};
  return scene;
}

Scene octahedron(double stiffness) {
  // pairs of m at +-a with 2 m a^2 = 2.5, 1.5, 0.5: I_x = 1.5 + 0.5, I_y = 2.5 + 0.5, I_z = 2.5 + 1.5
  constexpr double kMass[] = {1.25, 0.75, 1.0};
  constexpr double kArm[] = {1.0, 1.0, 0.5};
  Scene scene;
  scene.name = "octahedron";
  for (int axis = 0; axis < 3; ++axis) {
    for (const double sign : {-1.0, 1.0}) {
      add_point(scene, kMass[axis], sign * kArm[axis] * Eigen::Vector3d::Unit(axis));
    }
  }
  for (int i = 0; i < 6; ++i) {
    for (int j = i + 1; j < 6; ++j) add_spring(scene, i, j, stiffness);
  }
  publish_everything(scene);
  return scene;
}

Scene spring_pair(double m0, double m1, double length, double stiffness) {
  Scene scene;
  scene.name = "pair";
  add_point(scene, m0, {-length * m1 / (m0 + m1), 0.0, 0.0});
  add_point(scene, m1, {length * m0 / (m0 + m1), 0.0, 0.0});
  add_spring(scene, 0, 1, stiffness);
  publish_everything(scene);
  return scene;
}

Scene random_structure(std::uint64_t seed, int num_points) {
  constexpr double kCloseness = 0.3;  // [m] keeps every link direction well conditioned
  std::mt19937_64 engine(seed);
  // the C++ standard defines the numbers of the engine, but not those of the library's distributions, so the
  // numbers are scaled here
  const auto uniform = [&engine](double low, double high) {
    return low + (high - low) * static_cast<double>(engine() >> 11) * 0x1p-53;
  };
  Scene scene;
  scene.name = "random structure " + std::to_string(seed);
  while (static_cast<int>(scene.points.size()) < num_points) {
    const Eigen::Vector3d position(uniform(-1.5, 1.5), uniform(-1.0, 1.0), uniform(-0.7, 0.7));
    bool is_free = true;
    for (const PointMass& other : scene.points) {
      is_free = is_free && (other.position - position).norm() > kCloseness;
    }
    if (is_free) add_point(scene, std::pow(10.0, uniform(-1.0, 1.0)), position);
  }
  for (int i = 0; i < num_points; ++i) {
    for (int j = i + 1; j < num_points; ++j) {
      add_spring(scene, i, j, std::pow(10.0, uniform(4.0, 6.0)));
      Link& link = scene.links.back();
      if (scene.links.size() % 3 == 0) link.kind = Bar{std::get<Spring>(link.kind).stiffness};
    }
  }
  publish_everything(scene);
  return scene;
}

}  // namespace freeflex::testing
