#include "core/structure/masses/distributed_mass.hpp"

#include <Eigen/Geometry>
#include <cmath>

namespace freeflex {
namespace {

void add(Displacement& row, int first, double scale, const Eigen::Vector3d& direction) {
  for (int axis = 0; axis < 3; ++axis)
    if (direction[axis] != 0.0) row.emplace_back(first + axis, scale * direction[axis]);
}

// Displacement fields of a bar or beam. `axes` contains the local axes as columns.
struct Line {
  const Scene& scene;
  const Freedoms& freedoms;
  int index;
  const Link& link;
  double length;
  Eigen::Matrix3d axes;

  Line(const Scene& of, const Freedoms& all, int link_index)
      : scene(of),
        freedoms(all),
        index(link_index),
        link(of.links[static_cast<std::size_t>(link_index)]),
        length(span_of(of, link).stableNorm()) {
    axes = axes_of(of, link);
  }

  void add_point(Displacement& row, std::size_t end, double share, int axis) const {
    add(row, 3 * link.points[end], share, axes.col(axis));
  }
  void add_rotation(Displacement& row, std::size_t end, double share, int axis) const {
    const int released = freedoms.released(index, static_cast<int>(end), axis);
    if (released >= 0)
      row.emplace_back(released, share);
    else
      add(row, freedoms.rotation(link.points[end]), share, axes.col(axis));
  }

  Displacement between(double x, int axis) const {
    Displacement row;
    add_point(row, 0, 1.0 - x, axis);
    add_point(row, 1, x, axis);
    return row;
  }

  // Returns the deflection along `axis` of a beam that bends about `about`, at the fraction x of its length.
  // The slope of an end is `lift` times the rotation of the end.
  Displacement bent(double x, int axis, int about, double lift, double shear) const {
    const double c = 1.0 / (1.0 + shear), L = lift * length;
    Displacement row;
    add_point(row, 0, c * (1.0 - 3.0 * x * x + 2.0 * x * x * x + shear * (1.0 - x)), axis);
    add_rotation(row, 0, c * L * x * (1.0 - x) * (1.0 - x + 0.5 * shear), about);
    add_point(row, 1, c * (3.0 * x * x - 2.0 * x * x * x + shear * x), axis);
    add_rotation(row, 1, -c * L * x * (1.0 - x) * (x + 0.5 * shear), about);
    return row;
  }

  // returns the displacement along each local axis, at the fraction x of the length
  std::array<Displacement, 3> at(double x) const {
    const std::optional<ShearRatios> shear = shear_ratios_of(link, length);
    if (!shear) return {between(x, 0), between(x, 1), between(x, 2)};
    return {between(x, 0), bent(x, 1, 2, 1.0, shear->along_y), bent(x, 2, 1, -1.0, shear->along_z)};
  }
};

// The displacement fields of a plate. Displacements in the plane of the plate are linear between its corners.
// The deflection is the cubic of Bazeley and others (1965, Proc. Conf. Matrix Methods Struct. Mech.,
// Wright-Patterson, 547-576), which depends on the deflections and slopes at the corners.
struct Sheet {
  const Scene& scene;
  const Freedoms& freedoms;
  const Link& link;
  Eigen::Matrix3d axes;  // columns: two axes in the plane, then the normal

  Sheet(const Scene& of, const Freedoms& all, int link_index)
      : scene(of), freedoms(all), link(of.links[static_cast<std::size_t>(link_index)]) {
    const Eigen::Vector3d side = to(0, 1), normal = side.cross(to(0, 2)).stableNormalized();
    axes << side.stableNormalized(), normal.cross(side.stableNormalized()), normal;
  }
  Eigen::Vector3d to(std::size_t from, std::size_t corner) const {
    const auto at = [&](std::size_t k) {
      return scene.points[static_cast<std::size_t>(link.points[k])].position;
    };
    return at(corner) - at(from);
  }

  Displacement in_plane(const std::array<double, 3>& L, int axis) const {
    Displacement row;
    for (std::size_t i = 0; i < 3; ++i) add(row, 3 * link.points[i], L[i], axes.col(axis));
    return row;
  }
  // A corner that rotates by theta has the slope vector n x theta, so its slope along d is theta . (d x n)
  Displacement across(const std::array<double, 3>& L) const {
    const Eigen::Vector3d n = axes.col(2);
    const double all = 0.5 * L[0] * L[1] * L[2];
    Displacement row;
    for (std::size_t i = 0; i < 3; ++i) {
      const std::size_t j = (i + 1) % 3, k = (i + 2) % 3;
      const double own = L[i] + L[i] * L[i] * (L[j] + L[k]) - L[i] * (L[j] * L[j] + L[k] * L[k]);
      add(row, 3 * link.points[i], own, n);
      const Eigen::Vector3d lever =
          (L[i] * L[i] * L[j] + all) * to(i, j) + (L[i] * L[i] * L[k] + all) * to(i, k);
      add(row, freedoms.rotation(link.points[i]), 1.0, lever.cross(n));
    }
    return row;
  }

  std::array<Displacement, 3> at(const std::array<double, 3>& L) const {
    return {in_plane(L, 0), in_plane(L, 1), across(L)};
  }
};

std::array<double, 3> corner_weights(const DistributedMass& part) {
  return {part.shares[0].second, part.shares[1].second, part.shares[2].second};
}

// returns displacements along scene axes from displacements along local axes
std::array<Displacement, 3> to_scene_axes(const Eigen::Matrix3d& axes,
                                          const std::array<Displacement, 3>& local) {
  std::array<Displacement, 3> rows;
  for (int axis = 0; axis < 3; ++axis)
    for (int k = 0; k < 3; ++k)
      for (const auto& [freedom, coefficient] : local[static_cast<std::size_t>(k)])
        if (axes(axis, k) != 0.0)
          rows[static_cast<std::size_t>(axis)].emplace_back(freedom, axes(axis, k) * coefficient);
  return rows;
}

DeformationRow mass_row(double mass, Displacement coefficients) {
  DeformationRow row;
  row.coefficients = std::move(coefficients);
  row.root_stiffness = std::sqrt(mass);
  return row;
}

// Adds the two mass rows for displacements along a link. The mass matrix of the two ends is
// m (2, 1; 1, 2) / 6 (THEORY 16.11) or m (5, 1; 1, 5) / 12 (THEORY 16.12). The first row is the sum of the
// end displacements over sqrt(2), with mass m / 2. The second row is their difference over sqrt(2), with mass
// m / 6 or m / 3.
void add_along(const Line& line, double mass, MassDistribution spread, int axis, DeformationRows& rows) {
  Displacement sum, difference;
  for (const std::size_t end : {0, 1}) {
    line.add_point(sum, end, std::sqrt(0.5), axis);
    line.add_point(difference, end, std::sqrt(0.5) * (end == 0 ? -1.0 : 1.0), axis);
  }
  rows.push_back(mass_row(mass / 2.0, std::move(sum)));
  rows.push_back(
      mass_row(spread == MassDistribution::kMeanAxial ? mass / 3.0 : mass / 6.0, std::move(difference)));
}

void add_line_rows(const Scene& scene, const Freedoms& freedoms, int index, DeformationRows& rows) {
  const Line line(scene, freedoms, index);
  for (const DistributedMass& part : distributed_masses(scene, index)) {
    std::array<Displacement, 3> moved = line.at(part.shares[1].second);
    for (const std::size_t axis : {1, 2}) rows.push_back(mass_row(part.mass, std::move(moved[axis])));
  }
  add_along(line, mass_of(scene, line.link), mass_distribution_of(line.link), 0, rows);
}

void add_plate_rows(const Scene& scene, const Freedoms& freedoms, int index, DeformationRows& rows) {
  const Sheet sheet(scene, freedoms, index);
  for (const DistributedMass& part : distributed_masses(scene, index))
    rows.push_back(mass_row(part.mass, sheet.across(corner_weights(part))));
  // quadrature at the middles of the sides integrates the square of a linear function exactly
  for (const std::array<double, 3>& middle :
       {std::array<double, 3>{0.5, 0.5, 0.0}, {0.0, 0.5, 0.5}, {0.5, 0.0, 0.5}})
    for (const int axis : {0, 1})
      rows.push_back(mass_row(mass_of(scene, sheet.link) / 3.0, sheet.in_plane(middle, axis)));
}

}  // namespace

std::array<Displacement, 3> displacement_of(const Scene& scene, const Freedoms& freedoms,
                                            const DistributedMass& part) {
  const Link& link = scene.links[static_cast<std::size_t>(part.link)];
  if (traits_of(link).is_surface) {
    const Sheet sheet(scene, freedoms, part.link);
    return to_scene_axes(sheet.axes, sheet.at(corner_weights(part)));
  }
  const Line line(scene, freedoms, part.link);
  return to_scene_axes(line.axes, line.at(part.shares[1].second));
}

// returns the rows sqrt(m_g) V_g of A_m   (THEORY 16.10)
DeformationRows distributed_mass_rows(const Scene& scene, const Freedoms& freedoms, int index) {
  const Link& link = scene.links[static_cast<std::size_t>(index)];
  DeformationRows rows;
  if (traits_of(link).is_surface)
    add_plate_rows(scene, freedoms, index, rows);
  else
    add_line_rows(scene, freedoms, index, rows);
  return rows;
}

}  // namespace freeflex
