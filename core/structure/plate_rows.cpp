// Triangular plate (THEORY X62): constant-strain membrane, discrete Kirchhoff bending.
#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>

#include "core/structure/link_factor.hpp"

namespace freeflex {
namespace {

using Vectors = std::array<Eigen::Vector3d, 3>;

struct Triangle {
  Eigen::Vector3d x, y, z;  // [-] local axes: x along the first side, z the normal
  Vectors side;             // [m] the side opposite to each point, all the same way round
  Vectors gradient;         // [1/m] of each point's barycentric coordinate
  double area = 0.0;        // [m^2]
};

// [-] stiffness of a corner's turn about the normal, over E thickness^3 / 12: enough to hold it where
// neighbours are folded by less than some 1/30 rad, too little to stiffen a plate of thickness side / 10 by
// 1e-5
constexpr double kNormalTurn = 1e-3;

constexpr std::array<std::size_t, 3> kNext{1, 2, 0}, kAfterNext{2, 0, 1};

Triangle triangle_of(const Scene& scene, const Link& link) {
  const auto position = [&](std::size_t i) -> const Eigen::Vector3d& {
    return scene.points[static_cast<std::size_t>(link.points[i])].position;
  };
  Triangle triangle;
  std::size_t longest = 0;
  for (std::size_t i = 0; i < 3; ++i) {
    triangle.side[i] = position(kAfterNext[i]) - position(kNext[i]);
    if (triangle.side[i].squaredNorm() > triangle.side[longest].squaredNorm()) longest = i;
  }
  // the two short sides: their product keeps the digits of a needle's height
  const Eigen::Vector3d twice_area = triangle.side[kNext[longest]].cross(triangle.side[kAfterNext[longest]]);
  triangle.area = 0.5 * twice_area.stableNorm();
  triangle.x = triangle.side[2].stableNormalized();
  triangle.y = twice_area.cross(triangle.x).stableNormalized();
  triangle.z = triangle.x.cross(triangle.y);
  for (std::size_t i = 0; i < 3; ++i)
    triangle.gradient[i] = triangle.z.cross(triangle.side[i]) / (2.0 * triangle.area);
  return triangle;
}

// P of (X62): exx + eyy, exx - eyy and gxy of a displacement field with gradient G are the sums over P_ab
// G_ab
std::array<Eigen::Matrix3d, 3> strain_measures(const Triangle& triangle) {
  const Eigen::Matrix3d xx = triangle.x * triangle.x.transpose(), yy = triangle.y * triangle.y.transpose(),
                        xy = triangle.x * triangle.y.transpose();
  return {xx + yy, xx - yy, xy + xy.transpose()};
}

// one measure of the curvature at the middle of the side opposite to point `middle`
DeformationRow curvature_row(const Triangle& triangle, const Eigen::Matrix3d& measure, std::size_t middle,
                             const Link& link, const Freedoms& freedoms) {
  DeformationRow row;
  // adds beta_i . v, where the normal at point i leans by beta_i = theta_i cross z
  const auto add_lean = [&](std::size_t i, const Eigen::Vector3d& v) {
    add_vector(row, freedoms.rotation(link.points[i]), 1.0, triangle.z.cross(v));
  };
  for (std::size_t i = 0; i < 3; ++i) add_lean(i, measure * triangle.gradient[i]);
  for (std::size_t k = 0; k < 3; ++k) {
    const std::size_t i = kNext[k], j = kAfterNext[k];
    const Eigen::Vector3d& side = triangle.side[k];
    const double weight =
        (k == middle ? 3.0 : -3.0) * side.dot(measure * triangle.gradient[middle]) / side.squaredNorm();
    add_vector(row, 3 * link.points[i], -weight, triangle.z);
    add_vector(row, 3 * link.points[j], weight, triangle.z);
    add_lean(i, 0.5 * weight * side);
    add_lean(j, 0.5 * weight * side);
  }
  return row;
}

// turn of corner `corner` about the normal against half the curl of the membrane's displacement
DeformationRow normal_turn_row(const Triangle& triangle, std::size_t corner, const Link& link,
                               const Freedoms& freedoms) {
  DeformationRow row;
  add_vector(row, freedoms.rotation(link.points[corner]), 1.0, triangle.z);
  for (std::size_t j = 0; j < 3; ++j)
    add_vector(row, 3 * link.points[j], -0.5, triangle.z.cross(triangle.gradient[j]));
  return row;
}

// one scale for rows of one kind: their largest coefficient of a displacement becomes one
void set_unit_scale(DeformationRows& rows, std::size_t first, int num_displacements) {
  double largest = 0.0;
  for (std::size_t i = first; i < rows.size(); ++i)
    for (const auto& [freedom, coefficient] : rows[i].coefficients)
      if (freedom < num_displacements) largest = std::max(largest, std::abs(coefficient));
  for (std::size_t i = first; i < rows.size(); ++i) rows[i].unit_scale = 1.0 / largest;
}

}  // namespace

DeformationRows plate_rows(const Scene& scene, const Link& link, const Freedoms& freedoms) {
  const auto& plate = std::get<Plate>(link.kind);
  const Triangle triangle = triangle_of(scene, link);
  const auto measures = strain_measures(triangle);
  const double membrane = plate.E * plate.thickness;                           // [N/m]
  const double bending = membrane * plate.thickness * plate.thickness / 12.0;  // [N m]
  // (1 + nu) / 2, (1 - nu) / 2 and (1 - nu) / 2 over 1 - nu^2
  const std::array<double, 3> share{0.5 / (1.0 - plate.nu), 0.5 / (1.0 + plate.nu), 0.5 / (1.0 + plate.nu)};

  DeformationRows rows;
  for (std::size_t m = 0; m < 3; ++m) {
    DeformationRow row;
    for (std::size_t i = 0; i < 3; ++i)
      add_vector(row, 3 * link.points[i], 1.0, measures[m] * triangle.gradient[i]);
    row.root_stiffness = std::sqrt(triangle.area * membrane * share[m]);
    rows.push_back(std::move(row));
  }
  set_unit_scale(rows, 0, freedoms.num_displacements());
  for (std::size_t middle = 0; middle < 3; ++middle)
    for (std::size_t m = 0; m < 3; ++m) {
      rows.push_back(curvature_row(triangle, measures[m], middle, link, freedoms));
      rows.back().root_stiffness = std::sqrt(triangle.area / 3.0 * bending * share[m]);
    }
  set_unit_scale(rows, 3, freedoms.num_displacements());
  for (std::size_t corner = 0; corner < 3; ++corner) {
    rows.push_back(normal_turn_row(triangle, corner, link, freedoms));
    rows.back().root_stiffness = std::sqrt(kNormalTurn * bending);
  }
  set_unit_scale(rows, 12, freedoms.num_displacements());
  return rows;
}

Eigen::MatrixXd plate_resultants(const Scene& scene, const Link& link) {
  const double area = triangle_of(scene, link).area;
  Eigen::Matrix3d resultant;  // xx, yy, xy from the forces of xx + yy, xx - yy, xy
  resultant << 1.0, 1.0, 0.0, 1.0, -1.0, 0.0, 0.0, 0.0, 1.0;
  resultant /= area;
  Eigen::MatrixXd resultants = Eigen::MatrixXd::Zero(6, 15);
  resultants.topLeftCorner<3, 3>() = resultant;
  for (Eigen::Index middle = 0; middle < 3; ++middle) resultants.block<3, 3>(3, 3 + 3 * middle) = resultant;
  return resultants;
}

}  // namespace freeflex
