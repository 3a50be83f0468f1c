// Checks of single links.
#include <Eigen/Geometry>
#include <algorithm>
#include <limits>
#include <set>

#include "core/rounding.hpp"
#include "core/scene/bodies.hpp"
#include "core/scene/check/checker.hpp"
#include "core/scene/link_kinds.hpp"

namespace freeflex {
namespace {

// [-] smallest sine of the angle between a beam and its y_axis for which the local axes are determined
constexpr double kParallel = 1e-6;

// [-] smallest ratio of the length of a link to the spacing of doubles at its points. At this ratio the
// direction of the link is accurate to 1e-3 rad
constexpr double kLeastSteps = 1000.0;

// [-] smallest sine of the angle between the lines that join three points for which a dihedral angle or a
// plate is determined
constexpr double kDegenerate = 1e-9;

}  // namespace

void Checker::check_link_points(const Link& link, const std::string& who) {
  const LinkTraits kind = traits_of(link);
  if (link.points.size() < kind.least || link.points.size() > kind.most)
    error(link.origin, join_text(who, " names ", link.points.size(), " points, but a ", kind.noun, " joins ",
                                 kind.most == kind.least ? "" : "at least ", kind.least));
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
  // The points of a matrix may have any positions. The points of a rigid body may not all coincide. In every
  // other link, each point and the next must be at different positions
  if (!known || !kind.follows_points) return;
  if (is_body(link)) {
    const Eigen::Vector3d first = point(link.points[0]).position;
    if (std::all_of(link.points.begin(), link.points.end(),
                    [&](int index) { return (point(index).position - first).isZero(0.0); }))
      error(link.origin,
            who +
                " has all its points in one place, but a rigid body needs a size > 0; move a point or "
                "remove the link");
    return;
  }
  for (std::size_t k = 1; k < link.points.size(); ++k) {
    const Eigen::Vector3d a = point(link.points[k - 1]).position, b = point(link.points[k]).position;
    if (a.allFinite() && b.allFinite() && (b - a).isZero(0.0))
      error(link.origin,
            who + " joins " + point_names(scene, {link.points[k - 1], link.points[k]}, 2) +
                ", which are in one place, but a link needs a length > 0; move a point or remove the link");
  }
}

void Checker::check_beam(const Link& link, const Beam& beam, const std::string& who) {
  finite(link.origin, who + ": y_axis", beam.y_axis);
  if (link.points.size() != 2 || !is_point(link.points[0]) || !is_point(link.points[1]) ||
      beam.y_axis.isZero(0.0))
    return;
  const Eigen::Vector3d x =
      (point(link.points[1]).position - point(link.points[0]).position).stableNormalized();
  if (x.cross(beam.y_axis.stableNormalized()).norm() < kParallel)
    error(link.origin,
          join_text(who, ": y_axis (", beam.y_axis.transpose(),
                    ") is parallel to the beam; give a direction across it, or omit y_axis to have one "
                    "chosen"));
}

void Checker::check_plate(const Link& link, const Plate& plate, const std::string& who) {
  if (!(plate.nu > -1.0 && plate.nu < 0.5))
    error(link.origin, join_text(who, ": nu is ", plate.nu, ", but must be > -1 and < 0.5"));
  if (link.points.size() != 3 || !is_point(link.points[0]) || !is_point(link.points[1]) ||
      !is_point(link.points[2]))
    return;
  const Eigen::Vector3d a = point(link.points[1]).position - point(link.points[0]).position,
                        b = point(link.points[2]).position - point(link.points[0]).position;
  if (a.stableNormalized().cross(b.stableNormalized()).norm() < kDegenerate)
    error(link.origin, who + " has three points on a line, but a plate needs a triangle; move a point");
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
                             " lie on a line, so the dihedral angle is undefined; the chain of a torsion "
                             "spring must bend at both of its middle points");
  }
}

void Checker::check_matrix_link(const Link& link, const MatrixLink& matrix, const std::string& who) {
  const Eigen::Index size = num_rows(matrix, link.points.size());
  bool is_sized = true;
  const auto check_size = [&](const char* what, const Eigen::SparseMatrix<double>& given) {
    if (given.rows() == size && given.cols() == size) return;
    is_sized = false;
    error(link.origin,
          join_text(who, ": the ", what, " is ", given.rows(), " x ", given.cols(), ", but must be ", size,
                    " x ", size, " for ", link.points.size(), " points"));
  };
  check_size(matrix.mass.size() > 0 ? "stiffness matrix" : "matrix", matrix.matrix);
  if (matrix.is_flexibility && is_superelement(matrix))
    error(link.origin,
          who + " is a flexibility, which can have neither rotations nor mass; give the stiffness matrix");
  if (matrix.num_inner > 0 && matrix.mass.size() == 0)
    error(link.origin,
          who + ": inner coordinates need a mass matrix, which determines their motion; give a mass matrix");
  if (is_superelement(matrix) && !Eigen::MatrixXd(matrix.matrix).allFinite())
    error(link.origin, who + ": the stiffness matrix has an entry that is not finite; give finite entries");
  if (matrix.mass.size() > 0) check_size("mass matrix", matrix.mass);
  const bool has_points = std::all_of(link.points.begin(), link.points.end(), [&](int each) {
    return is_point(each) && point(each).position.allFinite();
  });
  if (matrix.mass.size() == 0 || !is_sized || !has_points || link.points.empty()) return;
  if (const std::string problem = mass_matrix_problem(scene, link); !problem.empty())
    error(link.origin, who + ": " + problem);
}

void Checker::check_dissipation(const Link& link, const std::string& who) {
  not_negative(link.origin, who + ": viscous", link.viscous, "s");
  not_negative(link.origin, who + ": loss_factor", link.loss_factor, "");
  const LinkTraits kind = traits_of(link);
  if ((link.viscous != 0.0 || link.loss_factor != 0.0) && kind.effect != LinkEffect::kStrains)
    error(link.origin, who + (kind.effect == LinkEffect::kForbids ? " is rigid" : " is a dashpot") +
                           ", so it cannot have the keys viscous or loss_factor; remove them");
  if (link.viscous != 0.0 && kind.has_joint_rotations)
    error(link.origin,
          who +
              ": viscous is only for links without rotations, because rotations carry no mass, and a moment "
              "that depends on their rate would make them states of their own; use loss_factor, or damping: "
              "rayleigh");
}

void Checker::check_link(const Link& link, int index) {
  const std::string who = "link " + called(link, index);
  check_link_points(link, who);
  check_dissipation(link, who);
  for (const LinkValue& each : values_of(link)) {
    const std::string what = join_text(who, ": ", each.what);
    each.may_be_zero ? not_negative(link.origin, what, each.value, each.unit)
                     : positive(link.origin, what, each.value, each.unit);
  }
  std::visit(Cases{
                 [](const Spring&) {},
                 [](const Bar&) {},
                 [&](const Beam& beam) { check_beam(link, beam, who); },
                 [&](const MatrixLink& matrix) { check_matrix_link(link, matrix, who); },
                 [](const BendingSpring&) {},
                 [&](const TorsionSpring&) { check_torsion(link, who); },
                 [&](const Plate& plate) { check_plate(link, plate, who); },
                 [](const Rigid&) {},
                 [](const Dashpot&) {},
             },
             link.kind);
}

// Checks whether links are so far from the origin that doubles do not resolve them. Reports the first such
// link, and the number of other such links.
void Checker::check_resolution() {
  const Link* first = nullptr;
  std::string message;
  int num_others = -1;
  for (std::size_t k = 0; k < scene.links.size(); ++k) {
    const Link& link = scene.links[k];
    if (!std::all_of(link.points.begin(), link.points.end(),
                     [&](int each) { return is_point(each) && point(each).position.allFinite(); }))
      continue;
    // for a matrix or a rigid body, `length` is the largest distance from its first point; for other links it
    // is the shortest distance from one point to the next
    const bool is_chain = traits_of(link).follows_points && !is_body(link);
    double length = is_chain ? std::numeric_limits<double>::infinity() : 0.0, farthest = 0.0;
    for (std::size_t i = 0; i < link.points.size(); ++i) {
      farthest = std::max(farthest, point(link.points[i]).position.cwiseAbs().maxCoeff());
      if (i == 0) continue;
      const Eigen::Vector3d& from = point(link.points[is_chain ? i - 1 : 0]).position;
      const double span = (point(link.points[i]).position - from).stableNorm();
      length = is_chain ? std::min(length, span) : std::max(length, span);
    }
    const double step = kEpsilon * farthest;
    // a length of 0 is reported by check_link_points()
    if (link.points.size() < 2 || length == 0.0 || length >= kLeastSteps * step) continue;
    ++num_others;
    if (first) continue;
    first = &link;
    message =
        join_text("link ", called(link, static_cast<int>(k)), " of ", length, " m has points ", farthest,
                  " m from the origin, where numbers of 64 bits are ", step,
                  " m apart and do not resolve the link; give coordinates from an origin in the structure, "
                  "and the position of that origin by initial: position");
  }
  if (!first) return;
  if (num_others > 0)
    message +=
        join_text("; the same holds for ", num_others, num_others == 1 ? " other link" : " other links");
  error(first->origin, message);
}

}  // namespace freeflex
