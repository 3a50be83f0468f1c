// The rows of a triangular plate, which has a constant-strain membrane and discrete Kirchhoff bending.
#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>

#include "core/structure/links/link_factor.hpp"

namespace freeflex {
namespace {

using Vectors = std::array<Eigen::Vector3d, 3>;

struct Triangle {
  Eigen::Vector3d x, y, z;  // [-] local axes: x along the first side, z the normal
  Vectors side;             // [m] side opposite to each point, all in one sense of rotation
  Vectors gradient;         // [1/m] gradient of the barycentric coordinate of each point
  double area = 0.0;        // [m^2]
};

// [-] stiffness of the rotation of a corner about the normal, divided by E thickness^3 / 12   (THEORY 3.36).
// It is large enough to hold a corner whose plates are folded by less than about 1/30 rad, but it increases
// the stiffness of a plate of thickness side / 10 by a fraction of less than 1e-5
constexpr double kNormalRotation = 1e-3;

constexpr std::array<std::size_t, 3> kNext{1, 2, 0}, kAfterNext{2, 0, 1};

Triangle triangle_of(const Scene& scene, const Link& link) {
  const auto position = [&](std::size_t i) -> const Eigen::Vector3d& {
    return scene.points[index(link.points[i])].position;
  };
  Triangle triangle;
  std::size_t longest = 0;
  for (std::size_t i = 0; i < 3; ++i) {
    triangle.side[i] = position(kAfterNext[i]) - position(kNext[i]);
    if (triangle.side[i].squaredNorm() > triangle.side[longest].squaredNorm()) longest = i;
  }
  // the cross product of the two shorter sides keeps the digits of the height of a slender triangle
  const Eigen::Vector3d twice_area = triangle.side[kNext[longest]].cross(triangle.side[kAfterNext[longest]]);
  triangle.area = 0.5 * twice_area.stableNorm();
  triangle.x = triangle.side[2].stableNormalized();
  triangle.y = twice_area.cross(triangle.x).stableNormalized();
  triangle.z = triangle.x.cross(triangle.y);
  for (std::size_t i = 0; i < 3; ++i)
    // grad_k = z x side_k / (2 area)   (THEORY 3.28)
    triangle.gradient[i] = triangle.z.cross(triangle.side[i]) / (2.0 * triangle.area);
  return triangle;
}

// Returns P_1 = x x^T + y y^T, P_2 = x x^T - y y^T, P_3 = x y^T + y x^T   (THEORY 3.29). For a displacement
// field with gradient G, the sums of P_ab G_ab over the axes a and b are exx + eyy, exx - eyy and gxy.
std::array<Eigen::Matrix3d, 3> strain_measures(const Triangle& triangle) {
  const Eigen::Matrix3d xx = triangle.x * triangle.x.transpose(), yy = triangle.y * triangle.y.transpose(),
                        xy = triangle.x * triangle.y.transpose();
  return {xx + yy, xx - yy, xy + xy.transpose()};
}

// Returns one measure of the curvature at the middle of the side opposite to point `middle`   (THEORY 3.33):
// e = sum_i beta_i . P grad_i + sum_k mu_kj (z . (V_to - V_from) + side_k . (beta_from + beta_to) / 2), with
// the weights mu_kj = (1 - 2 [k = j]) (-3 side_k . P grad_j) / |side_k|^2   (THEORY 3.34) and the inclination
// of the normal beta_i = theta_i x z   (THEORY 3.32)
DeformationRow curvature_row(const Triangle& triangle, const Eigen::Matrix3d& measure, std::size_t middle,
                             const Link& link, const Freedoms& freedoms) {
  DeformationRow row;
  // adds beta_i . v
  const auto add_inclination = [&](std::size_t i, const Eigen::Vector3d& v) {
    add_vector(row, freedoms.rotation(link.points[i]), 1.0, triangle.z.cross(v));
  };
  for (std::size_t i = 0; i < 3; ++i) add_inclination(i, measure * triangle.gradient[i]);
  for (std::size_t k = 0; k < 3; ++k) {
    const std::size_t i = kNext[k], j = kAfterNext[k];
    const Eigen::Vector3d& side = triangle.side[k];
    const double weight =
        (k == middle ? 3.0 : -3.0) * side.dot(measure * triangle.gradient[middle]) / side.squaredNorm();
    add_vector(row, 3 * link.points[i], -weight, triangle.z);
    add_vector(row, 3 * link.points[j], weight, triangle.z);
    add_inclination(i, 0.5 * weight * side);
    add_inclination(j, 0.5 * weight * side);
  }
  return row;
}

// Returns the rotation of a corner about the normal minus the rotation of the membrane: e = z . theta_i - z .
// sum_j grad_j x V_j / 2   (THEORY 3.36)
DeformationRow normal_rotation_row(const Triangle& triangle, std::size_t corner, const Link& link,
                                   const Freedoms& freedoms) {
  DeformationRow row;
  add_vector(row, freedoms.rotation(link.points[corner]), 1.0, triangle.z);
  for (std::size_t j = 0; j < 3; ++j)
    add_vector(row, 3 * link.points[j], -0.5, triangle.z.cross(triangle.gradient[j]));
  return row;
}

// sets one scale for rows of one kind, so that their largest displacement coefficient becomes one
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
  // D divided by area and E t: 1 / (2 (1 - nu)), 1 / (2 (1 + nu)), 1 / (2 (1 + nu))   (THEORY 3.31); bending
  // has t^2 / 36 of the membrane stiffness in each of its nine rows   (THEORY 3.35)
  const std::array<double, 3> share{0.5 / (1.0 - plate.nu), 0.5 / (1.0 + plate.nu), 0.5 / (1.0 + plate.nu)};

  DeformationRows rows;
  // e = sum_i V_i . P grad_i   (THEORY 3.30)
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
    rows.push_back(normal_rotation_row(triangle, corner, link, freedoms));
    rows.back().root_stiffness = std::sqrt(kNormalRotation * bending);
  }
  set_unit_scale(rows, 12, freedoms.num_displacements());
  return rows;
}

Eigen::MatrixXd plate_resultants(const Scene& scene, const Link& link) {
  const double area = triangle_of(scene, link).area;
  // area Nxx = s_1 + s_2, area Nyy = s_1 - s_2, area Nxy = s_3   (THEORY 3.37)
  Eigen::Matrix3d resultant;
  resultant << 1.0, 1.0, 0.0, 1.0, -1.0, 0.0, 0.0, 0.0, 1.0;
  resultant /= area;
  Eigen::MatrixXd resultants = Eigen::MatrixXd::Zero(6, 15);
  resultants.topLeftCorner<3, 3>() = resultant;
  for (Eigen::Index middle = 0; middle < 3; ++middle) resultants.block<3, 3>(3, 3 + 3 * middle) = resultant;
  return resultants;
}

}  // namespace freeflex
