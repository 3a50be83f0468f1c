#include "core/scene/link_kinds.hpp"

#include "core/scene/bodies.hpp"

namespace freeflex {

std::vector<LinkValue> values_of(const Link& link) {
  using Values = std::vector<LinkValue>;
  return std::visit(
      LinkCases{
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
      LinkCases{
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

bool has_point_forces(const Link& link) {
  return is_body(link) || std::holds_alternative<MatrixLink>(link.kind);
}

bool publishes_forces(const Scene& scene, const Link& link) {
  const auto* matrix = std::get_if<MatrixLink>(&link.kind);
  if (matrix != nullptr && is_superelement(*matrix)) return false;
  return traits_of(link).effect != LinkEffect::kForbids || are_point_masses(scene);
}

}  // namespace freeflex
