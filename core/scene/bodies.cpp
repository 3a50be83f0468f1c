#include "core/scene/bodies.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <cmath>
#include <span>

#include "core/scene/faults.hpp"
#include "core/scene/link_kinds.hpp"

namespace freeflex {

bool has_attitude(const PointMass& point) { return !point.inertia.isZero(0.0) || !point.offset.isZero(0.0); }

bool are_point_masses(const Scene& scene) {
  return std::all_of(scene.points.begin(), scene.points.end(),
                     [](const PointMass& point) { return point.mass > 0.0 && !has_attitude(point); }) &&
         std::none_of(scene.links.begin(), scene.links.end(),
                      [](const Link& link) { return has_mass(link); });
}

bool has_mass(const Link& link) {
  const auto* bar = std::get_if<Bar>(&link.kind);
  const auto* beam = std::get_if<Beam>(&link.kind);
  const auto* plate = std::get_if<Plate>(&link.kind);
  return (bar != nullptr && bar->mass_per_length > 0.0) || (beam != nullptr && beam->mass_per_length > 0.0) ||
         (plate != nullptr && plate->density > 0.0);
}

double mass_of(const Scene& scene, const Link& link) {
  if (!has_mass(link)) return 0.0;
  if (const auto* bar = std::get_if<Bar>(&link.kind))
    return bar->mass_per_length * span_of(scene, link).stableNorm();
  if (const auto* beam = std::get_if<Beam>(&link.kind))
    return beam->mass_per_length * span_of(scene, link).stableNorm();
  const auto& plate = std::get<Plate>(link.kind);
  const auto at = [&](std::size_t k) {
    return scene.points[static_cast<std::size_t>(link.points[k])].position;
  };
  return plate.density * plate.thickness * 0.5 * (at(1) - at(0)).cross(at(2) - at(0)).stableNorm();
}

MassSpread spread_of(const Link& link) {
  if (const auto* bar = std::get_if<Bar>(&link.kind)) return bar->spread;
  if (const auto* beam = std::get_if<Beam>(&link.kind)) return beam->spread;
  if (const auto* plate = std::get_if<Plate>(&link.kind)) return plate->spread;
  return MassSpread::kConsistent;
}

namespace {

// Gauss's rule on 0 to 1: two points for shapes that are linear, four for cubic ones
struct GaussPoint {
  double place, weight;  // [-]
};
std::span<const GaussPoint> gauss_points(bool is_cubic) {
  static constexpr std::array<GaussPoint, 2> kTwo{{{0.21132486540518712, 0.5}, {0.78867513459481288, 0.5}}};
  static constexpr std::array<GaussPoint, 4> kFour{{{0.069431844202973712, 0.17392742256872693},
                                                    {0.33000947820757187, 0.32607257743127307},
                                                    {0.66999052179242813, 0.32607257743127307},
                                                    {0.93056815579702629, 0.17392742256872693}}};
  if (is_cubic) return kFour;
  return kTwo;
}

// Dunavant's rule of degree 6 on a triangle (1985, Int. J. Numer. Meth. Eng. 21, 1129-1148): the square of a
// cubic is exact. Two classes of three points, one of six; the last weight closes the sum.
struct TrianglePoint {
  std::array<double, 3> share;  // [-] of the corners
  double weight;                // [-]
};
std::vector<TrianglePoint> triangle_points() {
  constexpr double kFirst = 0.116786275726379, kSecond = 0.050844906370207;
  std::vector<TrianglePoint> points;
  const auto add_three = [&](double away, double weight) {
    const double near = 1.0 - 2.0 * away;
    points.insert(points.end(),
                  {{{near, away, away}, weight}, {{away, near, away}, weight}, {{away, away, near}, weight}});
  };
  add_three(0.249286745170910, kFirst);
  add_three(0.063089014491502, kSecond);
  constexpr double a = 0.053145049844817, b = 0.310352451033784, c = 1.0 - a - b;
  for (const std::array<double, 3>& each :
       {std::array<double, 3>{a, b, c}, {a, c, b}, {b, a, c}, {b, c, a}, {c, a, b}, {c, b, a}})
    points.push_back({each, (1.0 - 3.0 * (kFirst + kSecond)) / 6.0});
  return points;
}

}  // namespace

std::vector<SpreadMass> spread_masses(const Scene& scene, int index) {
  const Link& link = scene.links[static_cast<std::size_t>(index)];
  if (!has_mass(link)) return {};
  const double mass = mass_of(scene, link);
  std::vector<SpreadMass> all;
  if (spread_of(link) == MassSpread::kLumped) {
    for (const int point : link.points)
      all.push_back({index, mass / static_cast<double>(link.points.size()), {{point, 1.0}}});
  } else if (std::holds_alternative<Plate>(link.kind)) {
    static const std::vector<TrianglePoint> kPoints = triangle_points();
    for (const TrianglePoint& each : kPoints)
      all.push_back({index,
                     mass * each.weight,
                     {{link.points[0], each.share[0]},
                      {link.points[1], each.share[1]},
                      {link.points[2], each.share[2]}}});
  } else {
    for (const GaussPoint& each : gauss_points(std::holds_alternative<Beam>(link.kind)))
      all.push_back(
          {index, mass * each.weight, {{link.points[0], 1.0 - each.place}, {link.points[1], each.place}}});
  }
  return all;
}

std::vector<SpreadMass> spread_masses(const Scene& scene) {
  std::vector<SpreadMass> all;
  for (int i = 0; i < static_cast<int>(scene.links.size()); ++i)
    for (SpreadMass& each : spread_masses(scene, i)) all.push_back(std::move(each));
  return all;
}

Eigen::Matrix3d second_moment(const PointMass& point) {
  return 0.5 * point.inertia.trace() * Eigen::Matrix3d::Identity() - point.inertia;
}

std::string inertia_problem(const Eigen::Matrix3d& inertia) {
  // [-] of the largest moment: what printed tables of seven digits leave open
  constexpr double kRounding = 1e-6;
  if (!inertia.allFinite()) return "inertia is not finite";
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen(inertia, Eigen::EigenvaluesOnly);
  const Eigen::Vector3d moments = eigen.eigenvalues();  // ascending
  const double least = -kRounding * moments[2];
  if (moments[0] < least)
    return join_text("inertia has the principal moment ", moments[0],
                     " kg m^2, must be >= 0; the entries of the matrix are wanted, products of inertia as "
                     "-sum m x y");
  if (moments[0] + moments[1] - moments[2] < least)
    return join_text("inertia has the principal moments ", moments.transpose(),
                     " kg m^2: no mass has one above the sum of the two others; check the order and that "
                     "they are about the centre of mass");
  return {};
}

}  // namespace freeflex
