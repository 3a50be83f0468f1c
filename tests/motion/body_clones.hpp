// This file makes random structures with bodies, and copies of these structures in which rigid bodies hold
// point masses. It is header only.
#pragma once

#include <Eigen/Geometry>
#include <random>

#include "core/scene/bodies.hpp"
#include "core/structure/masses/particles.hpp"
#include "tests/setup/make_scene.hpp"

namespace freeflex::testing {

inline constexpr double kJoint =
    1e-6;  // [kg] mass of a joint in the copy; the joint of a body itself has no mass

/// Returns the scene with each body replaced by particles that a rigid body holds at the body's joint.
inline Scene as_point_masses(const Scene& scene) {
  Scene points = scene;
  for (const CarriedMass& each : carried_masses(scene, Freedoms(scene))) {
    PointMass& joint = points.points[static_cast<std::size_t>(each.point)];
    if (!has_attitude(joint) && joint.mass != kJoint) continue;
    joint.inertia.setZero();
    joint.offset.setZero();
    joint.mass = kJoint;
    const int particle =
        add_point(points, each.mass, scene.points[static_cast<std::size_t>(each.point)].position + each.arm);
    if (!points.links.empty() && std::holds_alternative<Rigid>(points.links.back().kind) &&
        points.links.back().points.front() == each.point)
      points.links.back().points.push_back(particle);
    else
      add_link(points, {each.point, particle}, Rigid{});
  }
  return points;
}

class RandomBodies {
 public:
  explicit RandomBodies(std::uint64_t seed) : engine_(seed) {
    const int count = integer(3, 5);
    Eigen::Vector3d at = Eigen::Vector3d::Zero();
    for (int k = 0; k < count; ++k) {
      add_point(scene_, decade(0.5, 2.0), at);
      at += Eigen::Vector3d(1.0, uniform(-0.4, 0.4), uniform(-0.4, 0.4));
    }
    const double EI = decade(200.0, 2000.0);
    const Beam beam{EI * 100.0, 0.5 * EI, EI, 1.2 * EI, {0.1, 0.2, 1.0}};
    for (int k = 0; k + 1 < count; ++k) add_link(scene_, k, k + 1, beam);
    make_body(scene_.points.front());
    if (integer(0, 1) == 0) make_body(scene_.points.back());
    Faults faults;
    const auto structure = build_structure(scene_, faults);
    EXPECT_FALSE(has_error(faults));
    const double lowest = structure->omega[0], size = 0.5 * count;
    end_ = decade(2.0, 10.0) * 2.0 * M_PI / lowest;
    scene_.rate = std::clamp(structure->omega.maxCoeff() / 0.5, 20.0 * lowest / 6.28, 5000.0);
    if (integer(0, 2) > 0) scene_.initial.angular_velocity = decade(1e-3, 0.3) * lowest * direction();
    Load load;
    load.axes = integer(0, 1) == 0 ? Axes::kWorld : Axes::kBody;
    load.forces = {{integer(0, count - 1), structure->mass_properties.mass * lowest * lowest * size *
                                               decade(1e-5, 1e-2) * direction()}};
    scene_.loads = {load};
    for (int i = 0; i < count; ++i) scene_.publication.points.push_back(i);
  }
  const Scene& scene() const { return scene_; }
  double end() const { return std::round(end_ * scene_.rate) / scene_.rate; }

 private:
  double uniform(double a, double b) { return std::uniform_real_distribution<double>(a, b)(engine_); }
  double decade(double a, double b) { return std::exp(uniform(std::log(a), std::log(b))); }
  int integer(int a, int b) { return std::uniform_int_distribution<int>(a, b)(engine_); }
  Eigen::Vector3d direction() {
    std::normal_distribution<double> normal;
    return Eigen::Vector3d(normal(engine_), normal(engine_), normal(engine_)).normalized();
  }
  void make_body(PointMass& point) {
    point.mass *= decade(1.0, 20.0);
    const Eigen::Matrix3d axes =
        Eigen::Quaterniond::FromTwoVectors(Eigen::Vector3d::UnitX(), direction()).matrix();
    const Eigen::Vector3d arms(uniform(0.05, 0.4), uniform(0.05, 0.4), uniform(0.05, 0.4));
    const Eigen::Vector3d S = point.mass * arms.cwiseAbs2();
    const Eigen::Vector3d J(S[1] + S[2], S[0] + S[2], S[0] + S[1]);
    point.inertia = axes * J.asDiagonal() * axes.transpose();
    point.inertia = 0.5 * (point.inertia + point.inertia.transpose()).eval();
    if (integer(0, 1) == 0) point.offset = uniform(0.0, 0.3) * direction();
  }
  std::mt19937_64 engine_;
  Scene scene_;
  double end_ = 0.0;
};

}  // namespace freeflex::testing
