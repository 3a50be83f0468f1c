// Scenes and frequencies that several tests of the true-geometry reference use.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <stdexcept>
#include <string>
#include <vector>

#include "tests/setup/make_scene.hpp"
#include "tools/verification/reference/steady_motion.hpp"

namespace freeflex::testing {

inline CartesianSystem true_geometry_of(const Scene& scene) {
  std::string error;
  auto system = make_true_geometry(scene, error);
  EXPECT_TRUE(system.has_value()) << error;
  return *system;
}

inline SteadyMotion steady_motion_of(const Scene& scene) {
  const SteadyMotion motion = steady_motion(true_geometry_of(scene));
  if (!motion.error.empty()) throw std::runtime_error(motion.error);
  return motion;
}

/// Returns the zero of a nearly linear function between `low` and `high`, by two secant steps and a last
/// secant interpolation.
template <typename Function>
double secant_root(double low, double high, const Function& function) {
  double at_low = function(low), at_high = function(high);
  for (int step = 0; step < 2; ++step) {
    const double next = low - at_low * (high - low) / (at_high - at_low);
    low = high;
    at_low = at_high;
    high = next;
    at_high = function(high);
  }
  return high - at_high * (high - low) / (at_high - at_low);
}

/// Returns the frequencies above `least` [rad/s], ascending, of the motions that have more than 0.9 of their
/// squared displacement along `axis`.
inline std::vector<double> frequencies_along(const SteadyMotion& motion, int axis, double least) {
  std::vector<double> found;
  for (Eigen::Index k = 0; k < motion.rates.size(); ++k) {
    const Eigen::VectorXcd shape = motion.shapes.col(k);
    double along = 0.0;
    for (Eigen::Index i = axis; i < shape.size(); i += 3) along += std::norm(shape[i]);
    if (motion.rates[k].imag() > least && along > 0.9 * shape.squaredNorm())
      found.push_back(motion.rates[k].imag());
  }
  std::sort(found.begin(), found.end());
  return found;
}

constexpr double kAxial = 1e6;  // [-] EA divided by EI / L^2, for a beam that hardly stretches

/// Returns a lumped_beam of `elements` elements with the axial stiffness EA in units of EI / L^2.
inline Scene beam_of(int elements, double EA) {
  Scene scene = lumped_beam(elements + 1);
  for (Link& link : scene.links) {
    std::get<Beam>(link.kind).EA = EA;
    std::get<Beam>(link.kind).GJ = 1.0;
  }
  return scene;
}

inline void push(Scene& scene, int point, Axes axes, const Eigen::Vector3d& force) {
  Load load;
  load.name = "push " + std::to_string(scene.loads.size());
  load.axes = axes;
  load.forces.push_back({point, force});
  scene.loads.push_back(load);
}

/// Adds a plate between three points.
inline void add_plate(Scene& scene, const std::array<int, 3>& corners, const Plate& plate) {
  Link link;
  link.name = std::to_string(scene.links.size());
  link.points = {corners.begin(), corners.end()};
  link.kind = plate;
  scene.links.push_back(link);
}

/// Lumps a third of each plate's mass at each of its corners.  \param density_thickness [kg/m^2]
inline void set_masses(Scene& scene, double density_thickness) {
  for (PointMass& point : scene.points) point.mass = 0.0;
  for (const Link& link : scene.links) {
    const auto at = [&](std::size_t k) {
      return scene.points[static_cast<std::size_t>(link.points[k])].position;
    };
    const double area = 0.5 * (at(1) - at(0)).cross(at(2) - at(0)).norm();
    for (const int point : link.points)
      scene.points[static_cast<std::size_t>(point)].mass += density_thickness * area / 3.0;
  }
}

}  // namespace freeflex::testing
