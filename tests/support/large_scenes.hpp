// Makes a large structure of springs, a plate of two layers of points, as a Scene or as the files of a scene.
// Header only.
#pragma once

#include <fstream>
#include <string>

#include "core/scene/scene.hpp"

namespace freeflex::testing {

/// Returns side x side x 2 points of 1 kg, one metre apart. Springs of 1e5 N/m join each point to its
/// neighbours along edges and diagonals.
inline Scene two_layer_plate(int side) {
  Scene scene;
  const auto point = [side](int i, int j, int k) { return (i * side + j) * 2 + k; };
  for (int i = 0; i < side; ++i)
    for (int j = 0; j < side; ++j)
      for (int k = 0; k < 2; ++k) {
        PointMass each;
        each.mass = 1.0;
        each.position = {1.0 * i, 1.0 * j, 1.0 * k};
        scene.points.push_back(each);
      }
  const auto join = [&scene](int a, int b) {
    Link link;
    link.points = {a, b};
    link.kind = Spring{1e5};
    scene.links.push_back(link);
  };
  for (int i = 0; i < side; ++i)
    for (int j = 0; j < side; ++j) {
      const bool has_i = i + 1 < side, has_j = j + 1 < side;
      join(point(i, j, 0), point(i, j, 1));
      for (int k = 0; k < 2; ++k) {
        if (has_i) join(point(i, j, k), point(i + 1, j, k));
        if (has_i) join(point(i, j, k), point(i + 1, j, 1 - k));
        if (has_j) join(point(i, j, k), point(i, j + 1, k));
        if (has_j) join(point(i, j, k), point(i, j + 1, 1 - k));
        if (has_i && has_j) join(point(i, j, k), point(i + 1, j + 1, k));
        if (has_i && has_j) join(point(i + 1, j, k), point(i, j + 1, k));
      }
    }
  return scene;
}

/// Writes two_layer_plate(side) with `count` modes as scene.yaml, points.csv and links.csv into a folder.
inline void write_two_layer_plate(const std::string& folder, int side, int count) {
  const Scene scene = two_layer_plate(side);
  std::ofstream points(folder + "/points.csv"), links(folder + "/links.csv");
  points << "mass,x,y,z\n";
  for (const PointMass& each : scene.points)
    points << "1," << each.position.x() << "," << each.position.y() << "," << each.position.z() << "\n";
  links << "from,to,stiffness\n";
  for (const Link& link : scene.links) links << link.points[0] + 1 << "," << link.points[1] + 1 << ",1e5\n";
  std::ofstream(folder + "/scene.yaml")
      << "name: plate\nrate: 1000\nmodes: {count: " << count
      << "}\npublish: {points: {of: [1, 2]}, loads: {rate: 0}}\n"
         "commands: {points: [1, "
      << scene.points.size() << "]}\npoints: [{csv: points.csv}]\nlinks: [{csv: links.csv}]\n";
}

}  // namespace freeflex::testing
