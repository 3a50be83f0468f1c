// Natural deformations of springs, bars and beams.
#include <Eigen/Geometry>
#include <cmath>

#include "core/model/link_factor.hpp"

namespace freeflex {
namespace {

Eigen::Vector3d span_of(const Scene& scene, const Link& link) {
  return scene.points[static_cast<std::size_t>(link.points[1])].position -
         scene.points[static_cast<std::size_t>(link.points[0])].position;
}

// adds scale * direction . u of the three freedoms that start at first
void add_vector(DeformationRow& row, int first, double scale, const Eigen::Vector3d& direction) {
  for (int axis = 0; axis < 3; ++axis) row.coefficients.emplace_back(first + axis, scale * direction[axis]);
}

}  // namespace

double axial_stiffness(const Scene& scene, const Link& link) {
  if (const auto* spring = std::get_if<Spring>(&link.kind)) return spring->stiffness;
  return std::get<Bar>(link.kind).EA / span_of(scene, link).stableNorm();
}

DeformationRow axial_row(const Scene& scene, const Link& link, double stiffness) {
  const Eigen::Vector3d direction = span_of(scene, link).stableNormalized();
  DeformationRow row;
  add_vector(row, 3 * link.points[0], -1.0, direction);
  add_vector(row, 3 * link.points[1], 1.0, direction);
  row.root_stiffness = std::sqrt(stiffness);
  return row;
}

Eigen::Matrix3d beam_axes(const Eigen::Vector3d& span, const Eigen::Vector3d& y_axis) {
  const Eigen::Vector3d x = span.stableNormalized();
  Eigen::Vector3d y = y_axis;
  if (y.isZero(0.0)) {
    // no direction given: the scene axis that the beam is least along
    int least = 0;
    x.cwiseAbs().minCoeff(&least);
    y = Eigen::Vector3d::Unit(least);
  }
  const Eigen::Vector3d z = x.cross(y).stableNormalized();
  Eigen::Matrix3d axes;
  axes << x, z.cross(x), z;
  return axes;
}

std::vector<DeformationRow> beam_rows(const Scene& scene, const Link& link,
                                      const std::array<int, 2>& first_rotation) {
  const Beam& beam = std::get<Beam>(link.kind);
  const Eigen::Vector3d span = span_of(scene, link);
  const double length = span.stableNorm();
  const Eigen::Matrix3d axes = beam_axes(span, beam.y_axis);

  std::vector<DeformationRow> rows;
  rows.push_back(axial_row(scene, link, beam.EA / length));

  DeformationRow torsion;
  add_vector(torsion, first_rotation[0], -1.0, axes.col(0));
  add_vector(torsion, first_rotation[1], 1.0, axes.col(0));
  torsion.root_stiffness = std::sqrt(beam.GJ / length);
  torsion.unit_scale = 0.5 * length;
  rows.push_back(torsion);

  // bending about `about` with deflection along `along`; the chord turns by turn * (along . (V2 - V1)) /
  // length
  const auto add_bending = [&](const Eigen::Vector3d& about, const Eigen::Vector3d& along, double turn,
                               double EI) {
    DeformationRow symmetric;
    add_vector(symmetric, first_rotation[0], -1.0, about);
    add_vector(symmetric, first_rotation[1], 1.0, about);
    symmetric.root_stiffness = std::sqrt(EI / length);
    symmetric.unit_scale = 0.5 * length;
    rows.push_back(symmetric);

    DeformationRow antisymmetric;
    add_vector(antisymmetric, first_rotation[0], 1.0, about);
    add_vector(antisymmetric, first_rotation[1], 1.0, about);
    add_vector(antisymmetric, 3 * link.points[0], 2.0 * turn / length, along);
    add_vector(antisymmetric, 3 * link.points[1], -2.0 * turn / length, along);
    antisymmetric.root_stiffness = std::sqrt(3.0 * EI / length);
    antisymmetric.unit_scale = 0.5 * length;
    rows.push_back(antisymmetric);
  };
  add_bending(axes.col(2), axes.col(1), 1.0, beam.EI_z);
  add_bending(axes.col(1), axes.col(2), -1.0, beam.EI_y);
  return rows;
}

}  // namespace freeflex
