// Natural deformations of springs, bars and beams.
#include <Eigen/Geometry>
#include <cmath>

#include "core/structure/links/link_factor.hpp"

namespace freeflex {

void add_vector(DeformationRow& row, int first, double scale, const Eigen::Vector3d& direction) {
  for (int axis = 0; axis < 3; ++axis) row.coefficients.emplace_back(first + axis, scale * direction[axis]);
}

// e = u . (V_2 - V_1); D = EA / L of a bar   (THEORY 3.3)
DeformationRow axial_row(const Scene& scene, const Link& link, double stiffness) {
  const Eigen::Vector3d direction = span_of(scene, link).stableNormalized();
  DeformationRow row;
  add_vector(row, 3 * link.points[0], -1.0, direction);
  add_vector(row, 3 * link.points[1], 1.0, direction);
  row.root_stiffness = std::sqrt(stiffness);
  return row;
}

DeformationRows beam_rows(const Scene& scene, int link_index, const Freedoms& freedoms) {
  const Link& link = scene.links[index(link_index)];
  const Beam& beam = std::get<Beam>(link.kind);
  const Eigen::Vector3d span = span_of(scene, link);
  const double length = span.stableNorm();
  const Eigen::Matrix3d axes = axes_of(scene, link);
  // adds the rotation of an end about a local axis: a freedom of the end if the end releases this rotation,
  // else the rotation of the joint
  const auto add_rotation = [&](DeformationRow& row, int end, int axis, double scale) {
    const int released = freedoms.released(link_index, end, axis);
    if (released >= 0)
      row.coefficients.emplace_back(released, scale);
    else
      add_vector(row, freedoms.rotation(link.points[index(end)]), scale, axes.col(axis));
  };

  DeformationRows rows;
  rows.push_back(axial_row(scene, link, beam.EA / length));  // D = EA / L   (THEORY 3.6)

  DeformationRow torsion;  // e = x . (theta_2 - theta_1), D = GJ / L   (THEORY 3.7)
  add_rotation(torsion, 0, 0, -1.0);
  add_rotation(torsion, 1, 0, 1.0);
  torsion.root_stiffness = std::sqrt(beam.GJ / length);
  torsion.unit_scale = 0.5 * length;
  rows.push_back(torsion);

  // bending about `about` with deflection along `along`
  // chord:         psi = sign * along . (V_2 - V_1) / L   (THEORY 3.5)
  // symmetric:     e = about . (theta_2 - theta_1), D = EI / L   (THEORY 3.8)
  // antisymmetric: e = about . (theta_1 + theta_2) - 2 psi, D = 3 EI / (L (1 + phi))   (THEORY 3.9)
  // shear:         phi = 12 EI / (GA L^2), 0 if GA is not given   (THEORY 3.10)
  const auto add_bending = [&](int about, int along, double sign, double EI, double GA) {
    DeformationRow symmetric;
    add_rotation(symmetric, 0, about, -1.0);
    add_rotation(symmetric, 1, about, 1.0);
    symmetric.root_stiffness = std::sqrt(EI / length);
    symmetric.unit_scale = 0.5 * length;
    rows.push_back(symmetric);

    DeformationRow antisymmetric;
    add_rotation(antisymmetric, 0, about, 1.0);
    add_rotation(antisymmetric, 1, about, 1.0);
    add_vector(antisymmetric, 3 * link.points[0], 2.0 * sign / length, axes.col(along));
    add_vector(antisymmetric, 3 * link.points[1], -2.0 * sign / length, axes.col(along));
    const double shear = GA > 0.0 ? 12.0 * EI / (GA * length * length) : 0.0;
    antisymmetric.root_stiffness = std::sqrt(3.0 * EI / (length * (1.0 + shear)));
    antisymmetric.unit_scale = 0.5 * length;
    rows.push_back(antisymmetric);
  };
  add_bending(2, 1, 1.0, beam.EI_z, beam.GA_y);
  add_bending(1, 2, -1.0, beam.EI_y, beam.GA_z);
  return rows;
}

}  // namespace freeflex
