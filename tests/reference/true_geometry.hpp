// Scenes and frequencies that several tests of the true-geometry reference use.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
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

/// Returns a strip of length 1 along x, one pair of plates wide, with Poisson's ratio zero, so that it is a
/// beam.
inline Scene strip_of_plates(int elements, double thickness) {
  constexpr double kWidth = 0.04;
  Scene scene;
  for (int i = 0; i <= elements; ++i)
    for (const double side : {-0.5, 0.5})
      add_point(scene, 1.0, {static_cast<double>(i) / elements, side * kWidth, 0.0});
  // EI = 1
  const Plate plate{12.0 / (kWidth * std::pow(thickness, 3)), 0.0, thickness};
  for (int i = 0; i < elements; ++i) {
    const int k = 2 * i;
    // the diagonals alternate
    if (i % 2 == 0) {
      add_plate(scene, {k, k + 2, k + 3}, plate);
      add_plate(scene, {k, k + 3, k + 1}, plate);
    } else {
      add_plate(scene, {k, k + 2, k + 1}, plate);
      add_plate(scene, {k + 2, k + 3, k + 1}, plate);
    }
  }
  set_masses(scene, 1.0 / kWidth);
  return scene;
}

/// Returns a disc of radius 1 and of 1 kg/m^2, of plates between concentric rings of points. It has next to
/// no bending stiffness.
inline Scene disc_of_plates(int rings, double nu) {
  Scene scene;
  add_point(scene, 1.0, Eigen::Vector3d::Zero());
  // ring j has 6 j points, which begin at index 1 + 3 j (j - 1)
  for (int j = 1; j <= rings; ++j)
    for (int i = 0; i < 6 * j; ++i) {
      const double angle = M_PI / 3.0 * i / j, radius = static_cast<double>(j) / rings;
      add_point(scene, 1.0, {radius * std::cos(angle), radius * std::sin(angle), 0.0});
    }
  const Plate plate{1e4 / 1e-4, nu, 1e-4};  // E h is 1e4 times the density per area times Omega^2 a^2
  const auto at = [](int j, int i) { return j == 0 ? 0 : 1 + 3 * j * (j - 1) + (i + 6 * j) % (6 * j); };
  for (int j = 1; j <= rings; ++j)
    for (int sector = 0; sector < 6; ++sector)
      for (int i = 0; i < j; ++i) {
        const int outer = sector * j + i, inner = sector * (j - 1) + i;
        add_plate(scene, {at(j - 1, inner), at(j, outer), at(j, outer + 1)}, plate);
        if (i > 0) add_plate(scene, {at(j - 1, inner - 1), at(j, outer), at(j - 1, inner)}, plate);
      }
  set_masses(scene, 1.0);
  return scene;
}

/// Expects that the frequencies of three meshes of a spinning disc, extrapolated, are those of Lamb and
/// Southwell (1921, Proc. R. Soc. A 99, 272-280) for transverse motions of a free disc whose only stiffness
/// comes from its spin. With s nodal circles, n nodal diameters and k = n + 2 s, in rotating axes,
///   8 omega^2 / Omega^2 = (3 + nu) k (k + 2) - (1 + 3 nu) n^2
/// \param rings  of each mesh of disc_of_plates
/// \param found  [rad/s] frequencies of each mesh, ascending: 2 nodal diameters (a pair), 1 nodal circle, 3
///               nodal diameters
/// \param share  [-] largest error of the limits
inline void expect_lamb_and_southwell(const std::array<int, 3>& rings,
                                      const std::array<std::vector<double>, 3>& found, double spin, double nu,
                                      double share) {
  const auto expected = [&](int n, int s) {
    const double k = n + 2.0 * s;
    return spin * std::sqrt(((3.0 + nu) * k * (k + 2.0) - (1.0 + 3.0 * nu) * n * n) / 8.0);
  };
  // the inscribed polygon, lumped masses and flat plates cause errors of order h^2 and h^4, which the
  // extrapolation from three meshes eliminates
  std::array<double, 3> weight{1.0, 1.0, 1.0};
  for (std::size_t k = 0; k < 3; ++k)
    for (std::size_t other = 0; other < 3; ++other)
      if (other != k) {
        const double here = std::pow(rings[k], 2), there = std::pow(rings[other], 2);
        weight[k] *= here / (here - there);
      }
  const std::pair<std::size_t, double> modes[] = {
      {0, expected(2, 0)}, {2, expected(0, 1)}, {3, expected(3, 0)}};
  for (const auto& [index, frequency] : modes) {
    double limit = 0.0;
    for (std::size_t k = 0; k < 3; ++k) limit += weight[k] * found[k][index];
    std::printf("%.5f %.5f %.5f, limit %.5f for %.5f, off by %.1e\n", found[0][index], found[1][index],
                found[2][index], limit, frequency, limit / frequency - 1.0);
    EXPECT_NEAR(limit, frequency, share * frequency);
  }
}

}  // namespace freeflex::testing
