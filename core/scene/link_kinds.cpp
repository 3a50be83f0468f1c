#include "core/scene/link_kinds.hpp"

#include <Eigen/Geometry>

#include "core/scene/bodies.hpp"

namespace freeflex {

std::vector<LinkValue> values_of(const Link& link) {
  using Values = std::vector<LinkValue>;
  return std::visit(
      Cases{
          [](const Spring& spring) {
            return Values{{"stiffness", spring.stiffness, "N/m"}};
          },
          [](const Bar& bar) {
            return Values{{"EA", bar.EA, "N"}, {"mass_per_length", bar.mass_per_length, "kg/m", true}};
          },
          [](const Beam& beam) {
            return Values{{"EA", beam.EA, "N"},
                          {"GJ", beam.GJ, "N m^2"},
                          {"EI_y", beam.EI_y, "N m^2"},
                          {"EI_z", beam.EI_z, "N m^2"},
                          {"GA_y", beam.GA_y, "N", true},
                          {"GA_z", beam.GA_z, "N", true},
                          {"mass_per_length", beam.mass_per_length, "kg/m", true}};
          },
          [](const MatrixLink&) { return Values{}; },
          [](const BendingSpring& spring) {
            return Values{{"stiffness", spring.stiffness, "N m/rad"}};
          },
          [](const TorsionSpring& spring) {
            return Values{{"stiffness", spring.stiffness, "N m/rad"}};
          },
          [](const Plate& plate) {
            return Values{{"E", plate.E, "Pa"},
                          {"thickness", plate.thickness, "m"},
                          {"density", plate.density, "kg/m^3", true}};
          },
          [](const Rigid&) { return Values{}; },
          [](const Dashpot& dashpot) {
            return Values{{"damping", dashpot.damping, "N s/m", false, false}};
          },
      },
      link.kind);
}

Eigen::Vector3d span_of(const Scene& scene, const Link& link) {
  return scene.points[index(link.points[1])].position - scene.points[index(link.points[0])].position;
}

Axial axial_of(const Scene& scene, const Link& link) {
  return std::visit(
      Cases{
          [](const Spring& spring) { return Axial{.stiffness = spring.stiffness}; },
          [&](const Bar& bar) { return Axial{.stiffness = bar.EA / span_of(scene, link).stableNorm()}; },
          [](const Beam&) { return Axial{}; },
          [](const MatrixLink&) { return Axial{}; },
          [](const BendingSpring&) { return Axial{}; },
          [](const TorsionSpring&) { return Axial{}; },
          [](const Plate&) { return Axial{}; },
          [](const Rigid&) { return Axial{}; },
          [](const Dashpot& dashpot) { return Axial{.damping = dashpot.damping}; },
      },
      link.kind);
}

bool is_body(const Link& link) {
  return traits_of(link).effect == LinkEffect::kForbids && link.points.size() > 2;
}

void remove_mass(Link& link) {
  if (auto* bar = std::get_if<Bar>(&link.kind)) bar->mass_per_length = 0.0;
  if (auto* beam = std::get_if<Beam>(&link.kind)) beam->mass_per_length = 0.0;
  if (auto* plate = std::get_if<Plate>(&link.kind)) plate->density = 0.0;
}

const MatrixLink* matrices_of(const Link& link) { return std::get_if<MatrixLink>(&link.kind); }

int num_inner(const Link& link) {
  const MatrixLink* matrix = matrices_of(link);
  return matrix != nullptr ? matrix->num_inner : 0;
}

Releases releases_of(const Link& link) {
  const auto* beam = std::get_if<Beam>(&link.kind);
  return beam != nullptr ? beam->released : Releases{};
}

std::optional<ShearRatios> shear_ratios_of(const Link& link, double length) {
  const auto* beam = std::get_if<Beam>(&link.kind);
  if (beam == nullptr) return std::nullopt;
  const auto ratio = [&](double EI, double GA) {
    return GA > 0.0 ? 12.0 * EI / (GA * length * length) : 0.0;
  };
  return ShearRatios{ratio(beam->EI_z, beam->GA_y), ratio(beam->EI_y, beam->GA_z)};
}

// z = x cross y, normalised, y = z cross x   (THEORY 3.4)
Eigen::Matrix3d axes_of(const Scene& scene, const Link& link) {
  const Eigen::Vector3d x = span_of(scene, link).stableNormalized();
  const auto* beam = std::get_if<Beam>(&link.kind);
  Eigen::Vector3d y = beam != nullptr ? beam->y_axis : Eigen::Vector3d::Zero();
  if (y.isZero(0.0)) {
    int least = 0;
    x.cwiseAbs().minCoeff(&least);
    y = Eigen::Vector3d::Unit(least);
  }
  const Eigen::Vector3d z = x.cross(y).stableNormalized();
  Eigen::Matrix3d axes;
  axes << x, z.cross(x), z;
  return axes;
}

bool bends_unequally(const Link& link) {
  const auto* beam = std::get_if<Beam>(&link.kind);
  return beam != nullptr && beam->EI_y != beam->EI_z;
}

bool has_point_forces(const Link& link) { return is_body(link) || matrices_of(link) != nullptr; }

bool publishes_forces(const Scene& scene, const Link& link) {
  const MatrixLink* matrix = matrices_of(link);
  if (matrix != nullptr && is_superelement(*matrix)) return false;
  return !is_rigid(link) || are_point_masses(scene);
}

}  // namespace freeflex
