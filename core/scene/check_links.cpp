// Physics of single links.
#include <Eigen/Geometry>
#include <algorithm>
#include <limits>
#include <set>

#include "core/scene/checker.hpp"

namespace freeflex {
namespace {

// [-] sine of the angle between a beam and its y_axis below which the local axes are not determined
constexpr double kParallel = 1e-6;

// sine of the angle of three points below which a dihedral angle or a plate is not determined [-]
constexpr double kDegenerate = 1e-9;

struct Arity {
  const char* kind;
  std::size_t least, most;
};

Arity arity_of(const Link& link) {
  constexpr std::size_t kAny = std::numeric_limits<std::size_t>::max();
  static constexpr std::array<Arity, std::variant_size_v<decltype(Link::kind)>> kArities{
      {{"spring", 2, 2},
       {"bar", 2, 2},
       {"beam", 2, 2},
       {"matrix link", 2, kAny},
       {"bending spring", 3, 3},
       {"torsion spring", 4, 4},
       {"plate", 3, 3},
       {"rigid link", 2, kAny},
       {"dashpot", 2, 2}}};
  return kArities.at(link.kind.index());
}

}  // namespace

void Checker::check_link_points(const Link& link, const std::string& who) {
  const Arity arity = arity_of(link);
  if (link.points.size() < arity.least || link.points.size() > arity.most)
    error(link.origin, join_text(who, " names ", link.points.size(), " points; a ", arity.kind, " joins ",
                                 arity.most == arity.least ? "" : "at least ", arity.least));
  bool known = true;
  std::set<int> seen;
  for (const int index : link.points) {
    if (!known_point(link.origin, who, index)) {
      known = false;
    } else if (!seen.insert(index).second) {
      known = false;
      if (link.points.size() == 2)
        error(link.origin, who + " joins point " + quoted(point(index).name, index) +
                               " to itself; give two different points");
      else
        error(link.origin,
              who + " names point " + quoted(point(index).name, index) + " twice; name each once");
    }
  }
  // a matrix takes any places and a rigid body any but one; every other link has a direction from each point
  // to the next
  if (!known || std::holds_alternative<MatrixLink>(link.kind)) return;
  if (std::holds_alternative<Rigid>(link.kind) && link.points.size() > 2) {
    const Eigen::Vector3d first = point(link.points[0]).position;
    if (std::all_of(link.points.begin(), link.points.end(),
                    [&](int index) { return (point(index).position - first).isZero(0.0); }))
      error(link.origin,
            who +
                ": all its points are in one place; a rigid body needs a size > 0: move a point or "
                "remove the link");
    return;
  }
  for (std::size_t k = 1; k < link.points.size(); ++k) {
    const Eigen::Vector3d a = point(link.points[k - 1]).position, b = point(link.points[k]).position;
    if (a.allFinite() && b.allFinite() && (b - a).isZero(0.0))
      error(link.origin,
            who + " joins " + point_names(scene, {link.points[k - 1], link.points[k]}, 2) +
                ", which are in one place; a link needs a length > 0: move a point or remove the link");
  }
}

void Checker::check_beam(const Link& link, const Beam& beam, const std::string& who) {
  positive(link.origin, who + ": EA", beam.EA, "N");
  positive(link.origin, who + ": GJ", beam.GJ, "N m^2");
  positive(link.origin, who + ": EI_y", beam.EI_y, "N m^2");
  positive(link.origin, who + ": EI_z", beam.EI_z, "N m^2");
  not_negative(link.origin, who + ": GA_y", beam.GA_y, "N");
  not_negative(link.origin, who + ": GA_z", beam.GA_z, "N");
  finite(link.origin, who + ": y_axis", beam.y_axis);
  if (link.points.size() != 2 || !is_point(link.points[0]) || !is_point(link.points[1]) ||
      beam.y_axis.isZero(0.0))
    return;
  const Eigen::Vector3d x =
      (point(link.points[1]).position - point(link.points[0]).position).stableNormalized();
  if (x.cross(beam.y_axis.stableNormalized()).norm() < kParallel)
    error(link.origin,
          join_text(who, ": y_axis (", beam.y_axis.transpose(),
                    ") is parallel to the beam; give a direction across it, or none to have one chosen"));
}

void Checker::check_plate(const Link& link, const Plate& plate, const std::string& who) {
  positive(link.origin, who + ": E", plate.E, "Pa");
  positive(link.origin, who + ": thickness", plate.thickness, "m");
  if (!(plate.nu > -1.0 && plate.nu < 0.5))
    error(link.origin, join_text(who, ": nu is ", plate.nu, ", must be > -1 and < 0.5"));
  if (link.points.size() != 3 || !is_point(link.points[0]) || !is_point(link.points[1]) ||
      !is_point(link.points[2]))
    return;
  const Eigen::Vector3d a = point(link.points[1]).position - point(link.points[0]).position,
                        b = point(link.points[2]).position - point(link.points[0]).position;
  if (a.stableNormalized().cross(b.stableNormalized()).norm() < kDegenerate)
    error(link.origin, who + ": its three points lie on a line; a plate needs a triangle");
}

void Checker::check_torsion(const Link& link, const std::string& who) {
  if (link.points.size() != 4) return;
  for (std::size_t k = 0; k + 2 < 4; ++k) {
    if (!is_point(link.points[k]) || !is_point(link.points[k + 1]) || !is_point(link.points[k + 2])) return;
    const Eigen::Vector3d a = point(link.points[k + 1]).position - point(link.points[k]).position,
                          b = point(link.points[k + 2]).position - point(link.points[k + 1]).position;
    if (a.stableNormalized().cross(b.stableNormalized()).norm() < kDegenerate)
      error(link.origin, who + ": " +
                             point_names(scene, {link.points[k], link.points[k + 1], link.points[k + 2]}, 3) +
                             " lie on a line, about which nothing turns; a torsion spring needs a bend on "
                             "either side of its middle");
  }
}

void Checker::check_matrix_link(const Link& link, const MatrixLink& matrix, const std::string& who) {
  const auto size = 3 * static_cast<Eigen::Index>(link.points.size());
  if (matrix.matrix.rows() != size || matrix.matrix.cols() != size)
    error(link.origin, join_text(who, ": the matrix is ", matrix.matrix.rows(), " x ", matrix.matrix.cols(),
                                 ", must be ", size, " x ", size, " for ", link.points.size(), " points"));
}

void Checker::check_dissipation(const Link& link, const std::string& who) {
  not_negative(link.origin, who + ": viscous", link.viscous, "s");
  not_negative(link.origin, who + ": loss_factor", link.loss_factor, "");
  const bool is_rigid = std::holds_alternative<Rigid>(link.kind);
  if ((link.viscous != 0.0 || link.loss_factor != 0.0) &&
      (is_rigid || std::holds_alternative<Dashpot>(link.kind)))
    error(link.origin,
          who + (is_rigid ? " is rigid" : " is a dashpot") + ": it has no viscous or loss_factor of its own");
  if (link.viscous != 0.0 &&
      (std::holds_alternative<Beam>(link.kind) || std::holds_alternative<Plate>(link.kind)))
    error(link.origin, who +
                           ": viscous is for links without rotations: those of beams and plates carry no "
                           "mass, and a moment that "
                           "depends on their rate would make them states of their own; use rayleigh damping "
                           "or a loss_factor");
}

void Checker::check_link(const Link& link, int index) {
  const std::string who = "link " + quoted(link.name, index);
  check_link_points(link, who);
  check_dissipation(link, who);
  if (const auto* spring = std::get_if<Spring>(&link.kind))
    positive(link.origin, who + ": stiffness", spring->stiffness, "N/m");
  else if (const auto* bar = std::get_if<Bar>(&link.kind))
    positive(link.origin, who + ": EA", bar->EA, "N");
  else if (const auto* bending = std::get_if<BendingSpring>(&link.kind))
    positive(link.origin, who + ": stiffness", bending->stiffness, "N m/rad");
  else if (const auto* torsion = std::get_if<TorsionSpring>(&link.kind))
    positive(link.origin, who + ": stiffness", torsion->stiffness, "N m/rad"), check_torsion(link, who);
  else if (const auto* plate = std::get_if<Plate>(&link.kind))
    check_plate(link, *plate, who);
  else if (const auto* dashpot = std::get_if<Dashpot>(&link.kind))
    positive(link.origin, who + ": damping", dashpot->damping, "N s/m");
  else if (const auto* beam = std::get_if<Beam>(&link.kind))
    check_beam(link, *beam, who);
  else if (const auto* matrix = std::get_if<MatrixLink>(&link.kind))
    check_matrix_link(link, *matrix, who);
}

}  // namespace freeflex
