// Meshes of triangular plates. Header only.
#pragma once

#include <Eigen/Geometry>
#include <functional>

#include "core/structure/links/link_factor.hpp"
#include "tests/setup/make_scene.hpp"

namespace freeflex::testing {

inline void add_plate(Scene& scene, int first, int second, int third, const Plate& plate) {
  const int link = add_link(scene, first, second, plate);
  scene.links[static_cast<std::size_t>(link)].points.push_back(third);
}

/// Returns a plate with sides a [m] along x and b [m] along y and a surface density of 1 kg/m^2. The plate
/// has cells_x by cells_y rectangles, each divided by a diagonal. The diagonals alternate. Each cell gives a
/// quarter of its mass to each corner.
inline Scene plate_mesh(double a, double b, int cells_x, int cells_y, const Plate& plate) {
  Scene scene;
  const double quarter = 0.25 * a * b / (cells_x * cells_y);
  for (int j = 0; j <= cells_y; ++j)
    for (int i = 0; i <= cells_x; ++i) {
      const int cells = (i > 0 && i < cells_x ? 2 : 1) * (j > 0 && j < cells_y ? 2 : 1);
      add_point(scene, quarter * cells, {a * i / cells_x, b * j / cells_y, 0.0});
    }
  for (int j = 0; j < cells_y; ++j)
    for (int i = 0; i < cells_x; ++i) {
      const int p = j * (cells_x + 1) + i, q = p + cells_x + 1;
      if ((i + j) % 2 == 0) {
        add_plate(scene, p, p + 1, q + 1, plate);
        add_plate(scene, p, q + 1, q, plate);
      } else {
        add_plate(scene, p, p + 1, q, plate);
        add_plate(scene, p + 1, q + 1, q, plate);
      }
    }
  return scene;
}

/// Returns the scene with every point moved.
inline Scene moved(Scene scene, const std::function<Eigen::Vector3d(const Eigen::Vector3d&)>& to) {
  for (PointMass& point : scene.points) point.position = to(point.position);
  return scene;
}

/// Returns a plate of unit bending rigidity, D = E t^3 / 12 (1 - nu^2) = 1 N m.
inline Plate unit_plate(double nu, double thickness) {
  return {12.0 * (1.0 - nu * nu) / (thickness * thickness * thickness), nu, thickness};
}

}  // namespace freeflex::testing
