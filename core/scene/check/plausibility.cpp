#include "core/scene/check/plausibility.hpp"

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numeric>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "core/scene/link_kinds.hpp"

namespace freeflex {
namespace {

constexpr double kLeastModulus = 1e6;  // [Pa] about the modulus of rubber
constexpr double kMostModulus = 1e13;  // [Pa] the modulus of diamond is 1.2e12
// [kg/m^3] density of the lightest foams in use. The density of most metals written in g/cm^3 is a number
// below this
constexpr double kLeastDensity = 10.0;
constexpr double kMostDensity = 30000;  // [kg/m^3] the density of osmium is 22,590
constexpr double kMostLengthRatio = 1e12;
constexpr double kLeastThickness = 0.1;  // [m] a larger thickness may have been given in mm
constexpr double kMostGyration = 5.0;    // [-] radius of gyration of a section over length of its beam
constexpr double kMostBodySize = 3.0;    // [-] size of a body over the extent of all points

/// A common unit other than the SI unit, and the exponent of ten that converts it to SI.
struct OtherUnit {
  const char* name;
  int exponent;
};
constexpr OtherUnit kOfModulus[] = {{"GPa", 9}, {"MPa", 6}};
constexpr OtherUnit kOfDensity[] = {{"g/cm^3", 3}, {"g/mm^3", 6}, {"kg/mm^3", 9}, {"t/mm^3", 12}};

// returns advice like "; if it is in GPa, write 70e9" with the first unit in which the value would be
// plausible for a common material, or "; check its unit" if there is no such unit
std::string advise_unit(double value, std::span<const OtherUnit> units, double least, double most) {
  for (const OtherUnit& unit : units) {
    const double in_si = value * std::pow(10.0, unit.exponent);
    if (in_si < least || in_si > most) continue;
    const std::string text = join_text(value);
    const bool has_exponent = text.find('e') != std::string::npos;
    return join_text("; if it is in ", unit.name, ", write ", has_exponent ? join_text(in_si) : text + "e",
                     has_exponent ? "" : std::to_string(unit.exponent));
  }
  return "; check its unit";
}

// One cause of a warning, with the first link that has this cause and the number of other links that have it
struct Cause {
  Origin origin;
  std::string message;
  std::size_t num_others = 0;
};

class Causes {
 public:
  explicit Causes(Faults& faults) : faults_(faults) {}
  ~Causes() {
    for (const auto& [name, cause] : causes_) {
      const std::string others = cause.num_others == 0 ? ""
                                 : cause.num_others == 1
                                     ? "; the same holds for 1 other link"
                                     : join_text("; the same holds for ", cause.num_others, " other links");
      add_warning(faults_, cause.origin, cause.message + others);
    }
  }
  Causes(const Causes&) = delete;
  Causes& operator=(const Causes&) = delete;

  template <typename Words>
  void add(int cause, const Link& link, const Words& words) {
    if (const auto found = causes_.find(cause); found != causes_.end())
      ++found->second.num_others;
    else
      causes_[cause] = {link.origin, words()};
  }

 private:
  Faults& faults_;
  std::map<int, Cause> causes_;
};

enum : int { kSoft, kStiff, kLight, kHeavy, kThick, kDeep };

std::string link_at(const Scene& scene, std::size_t index) {
  return "link " + called(scene.links[index], static_cast<int>(index));
}

void check_material(const Scene& scene, std::size_t index, const Plate& plate, Causes& causes) {
  const Link& link = scene.links[index];
  const auto modulus = [&](const char* what) {
    return join_text(link_at(scene, index), ": E of ", plate.E, " Pa is ", what,
                     advise_unit(plate.E, kOfModulus, 1e9, 2e12));
  };
  const auto density = [&](const char* what) {
    return join_text(link_at(scene, index), ": density of ", plate.density, " kg/m^3 is ", what,
                     advise_unit(plate.density, kOfDensity, 100.0, kMostDensity));
  };
  if (plate.E < kLeastModulus) causes.add(kSoft, link, [&] { return modulus("less than rubber has"); });
  if (plate.E > kMostModulus) causes.add(kStiff, link, [&] { return modulus("more than diamond has"); });
  if (plate.density > 0.0 && plate.density < kLeastDensity)
    causes.add(kLight, link, [&] { return density("less than a light foam has"); });
  if (plate.density > kMostDensity)
    causes.add(kHeavy, link, [&] { return density("more than any metal has"); });
}

void check_section(const Scene& scene, std::size_t index, const Beam& beam, Causes& causes) {
  const Link& link = scene.links[index];
  const double length = (scene.points[static_cast<std::size_t>(link.points[1])].position -
                         scene.points[static_cast<std::size_t>(link.points[0])].position)
                            .stableNorm();
  const double gyration = std::sqrt(std::max(beam.EI_y, beam.EI_z) / beam.EA);
  if (gyration <= kMostGyration * length) return;
  causes.add(kDeep, link, [&] {
    return join_text(link_at(scene, index), ": EI of ", std::max(beam.EI_y, beam.EI_z), " N m^2 and EA of ",
                     beam.EA, " N are those of a section with a radius of gyration of ", gyration,
                     " m on a beam of ", length, " m, which is too large; check the units of both");
  });
}

void check_bodies(const Scene& scene, Faults& faults) {
  Eigen::AlignedBox3d box;
  for (const PointMass& point : scene.points) box.extend(point.position);
  const double extent = box.diagonal().stableNorm();
  if (extent == 0.0) return;
  for (const PointMass& point : scene.points) {
    const double offset = point.offset.stableNorm();
    const double gyration = point.mass > 0.0 ? std::sqrt(point.inertia.trace() / 2.0 / point.mass) : 0.0;
    if (offset > kMostBodySize * extent)
      add_warning(faults, point.origin,
                  join_text("point '", point.name, "': the offset is ", offset,
                            " m in a structure that spans ", extent, " m; check that it is in m"));
    if (gyration > kMostBodySize * extent)
      add_warning(
          faults, point.origin,
          join_text("point '", point.name, "': inertia and mass give a radius of gyration of ", gyration,
                    " m in a structure that spans ", extent, " m; check that inertia is in kg m^2"));
  }
}

void check_ratios(const Scene& scene, Faults& faults) {
  double most = scene.damping.modal_ratio;
  for (const auto& [mode, ratio] : scene.damping.mode_ratios) most = std::max(most, ratio);
  if (most <= 1.0) return;
  add_warning(faults, scene.damping.origin,
              join_text("damping: a ratio of ", most,
                        " is above 1, which is critical damping; if it is in per cent, write ", 0.01 * most));
}

// groups of plates that share points (union-find over points)
class PlateGroups {
 public:
  explicit PlateGroups(const Scene& scene) : parents_(scene.points.size()) {
    std::iota(parents_.begin(), parents_.end(), 0);
    for (const Link& link : scene.links)
      if (std::holds_alternative<Plate>(link.kind))
        for (const int point : link.points) parents_[root(point)] = static_cast<int>(root(link.points[0]));
  }
  std::size_t root(int point) {
    auto at = static_cast<std::size_t>(point);
    while (static_cast<std::size_t>(parents_[at]) != at) {
      parents_[at] = parents_[static_cast<std::size_t>(parents_[at])];
      at = static_cast<std::size_t>(parents_[at]);
    }
    return at;
  }

 private:
  std::vector<int> parents_;
};

// returns the width of a plate [m], which is the extent of the positions along their second principal
// direction
double width_of(const std::vector<Eigen::Vector3d>& positions) {
  Eigen::Matrix3Xd r(3, static_cast<Eigen::Index>(positions.size()));
  for (std::size_t k = 0; k < positions.size(); ++k)
    r.col(static_cast<Eigen::Index>(k)) = positions[k] - positions[0];
  r.colwise() -= Eigen::Vector3d(r.rowwise().mean());
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen(r * r.transpose());
  const Eigen::RowVectorXd across = eigen.eigenvectors().col(1).transpose() * r;
  return across.maxCoeff() - across.minCoeff();
}

void check_thickness(const Scene& scene, Causes& causes) {
  PlateGroups groups(scene);
  std::map<std::size_t, std::vector<Eigen::Vector3d>> positions;
  for (const Link& link : scene.links)
    if (std::holds_alternative<Plate>(link.kind))
      for (const int point : link.points)
        positions[groups.root(point)].push_back(scene.points[static_cast<std::size_t>(point)].position);
  std::map<std::size_t, double> widths;
  for (const auto& [root, of_group] : positions) widths[root] = width_of(of_group);
  for (std::size_t k = 0; k < scene.links.size(); ++k) {
    const auto* plate = std::get_if<Plate>(&scene.links[k].kind);
    if (!plate) continue;
    const double width = widths[groups.root(scene.links[k].points[0])];
    if (plate->thickness <= width || width == 0.0) continue;  // 0: points on a line; check_scene reports it
    causes.add(kThick, scene.links[k], [&] {
      return join_text(link_at(scene, k), ": the thickness of ", plate->thickness,
                       " m is more than the width of the plate, ", width, " m",
                       plate->thickness < kLeastThickness ? "; check both" : "; if it is in mm, write ",
                       plate->thickness < kLeastThickness ? "" : join_text(1e-3 * plate->thickness));
    });
  }
}

void check_lengths(const Scene& scene, Faults& faults) {
  double shortest = std::numeric_limits<double>::infinity(), longest = 0.0;
  std::size_t short_link = 0, long_link = 0;
  for (std::size_t k = 0; k < scene.links.size(); ++k) {
    const Link& link = scene.links[k];
    if (!traits_of(link).follows_points) continue;
    for (std::size_t i = 1; i < link.points.size(); ++i) {
      const double length = (scene.points[static_cast<std::size_t>(link.points[i])].position -
                             scene.points[static_cast<std::size_t>(link.points[i - 1])].position)
                                .stableNorm();
      if (length == 0.0) continue;  // coincident points of a rigid body
      if (length < shortest) shortest = length, short_link = k;
      if (length > longest) longest = length, long_link = k;
    }
  }
  // 0.999 allows for rounding of the coordinates
  if (longest < 0.999 * kMostLengthRatio * shortest) return;
  add_warning(
      faults, scene.links[short_link].origin,
      join_text("lengths of links range from ", shortest, " m (", link_at(scene, short_link), ") to ",
                longest, " m (", link_at(scene, long_link), "); check that all coordinates are in m"));
}

}  // namespace

void warn_of_implausible(const Scene& scene, Faults& faults) {
  {
    Causes causes(faults);
    for (std::size_t k = 0; k < scene.links.size(); ++k) {
      if (const auto* plate = std::get_if<Plate>(&scene.links[k].kind))
        check_material(scene, k, *plate, causes);
      if (const auto* beam = std::get_if<Beam>(&scene.links[k].kind)) check_section(scene, k, *beam, causes);
    }
    check_thickness(scene, causes);
  }
  check_bodies(scene, faults);
  check_ratios(scene, faults);
  check_lengths(scene, faults);
}

}  // namespace freeflex
