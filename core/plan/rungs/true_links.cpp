#include "core/plan/rungs/true_links.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cassert>
#include <cmath>
#include <map>
#include <variant>

#include "core/plan/arrays.hpp"
#include "core/plan/rungs/joint_stiffness.hpp"
#include "core/step/links/joint_factor.hpp"
#include "core/step/massless/massless.hpp"
#include "core/step/turning/turning.hpp"
#include "core/structure/links/link_factor.hpp"

namespace freeflex {
namespace {

using Eigen::Matrix3d;
using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;

// K_tt and -K_tx b: the stiffness over the unknown rotations, and the moments of the unit displacements of
// the modes.
struct RotationStiffness {
  Eigen::SparseMatrix<double> own;
  MatrixXd moments;
};

// Returns the body that turns the joint of a point, or -1. A rod turns none (THEORY 12.118). In scenes with
// spread mass there are no rods, and the inertia of an end of a mass matrix is in the matrix (THEORY 12.119).
std::int32_t turned_by(const Scene& scene, const Structure& structure, const PlanTurning& turning,
                       int point) {
  const std::int32_t body = turning.bodies.empty() ? -1 : turning.of_points[index(point)];
  if (body < 0 || structure.resolved.have_links_mass()) return body;
  const auto position = [&](std::int32_t k) -> const Vector3d& {
    return scene.points[index(turning.points[index(k)])].position;
  };
  const PlanTurningBody& given = turning.bodies[index(body)];
  const Vector3d along = position(given.first + given.count - 1) - position(given.first);
  return is_rod(given, to_array(along)) ? -1 : body;
}

// Numbers the joints without inertia, then the bodies, and the unknowns: three rotations of each joint, those
// of releases, then three displacements of each massless point.
class Numbering {
 public:
  Numbering(const Scene& scene, const Structure& structure, const Freedoms& freedoms,
            const PlanTurning& turning)
      : unknown_(index(freedoms.num_all()), -1) {
    const auto body_of = [&](int point) { return turned_by(scene, structure, turning, point); };
    for (int point = 0; point < static_cast<int>(scene.points.size()); ++point) {
      joint_.push_back(-1);
      if (!freedoms.has_joint(point) || body_of(point) >= 0) continue;
      joint_.back() = num_joints_++;
      for (int axis = 0; axis < 3; ++axis) unknown_[index(freedoms.rotation(point) + axis)] = num_unknowns_++;
    }
    for (int point = 0; point < static_cast<int>(scene.points.size()); ++point)
      if (body_of(point) >= 0) joint_[index(point)] = num_joints_ + body_of(point);
    for (int k = 0; k < static_cast<int>(scene.links.size()); ++k)
      for (int end = 0; end < 2; ++end)
        for (int axis = 0; axis < 3; ++axis)
          if (const int freedom = freedoms.released(k, end, axis); freedom >= 0)
            unknown_[index(freedom)] = num_unknowns_++;
    for (int point = 0; point < static_cast<int>(scene.points.size()); ++point) {
      if (structure.resolved.moves_mass[index(point)]) continue;
      massless_.push_back(point);
      for (int axis = 0; axis < 3; ++axis) unknown_[index(3 * point + axis)] = num_unknowns_++;
    }
  }
  int num_joints() const { return num_joints_; }
  int num_unknowns() const { return num_unknowns_; }
  /// Returns the joint or body of a point, or -1.
  int joint(int point) const { return joint_[index(point)]; }
  /// Returns the number of the unknown of a freedom, or -1.
  int unknown(int freedom) const { return unknown_[index(freedom)]; }
  const std::vector<int>& massless() const { return massless_; }

 private:
  std::vector<int> joint_;     // (num_points)
  std::vector<int> unknown_;   // (num_all freedoms)
  std::vector<int> massless_;  // points
  int num_joints_ = 0, num_unknowns_ = 0;
};

// Returns the unit motions of the modes over all freedoms. Unknowns are zero.
MatrixXd known_motions(const Scene& scene, const Structure& structure, const Freedoms& freedoms,
                       const Numbering& numbering, const PlanTurning& turning) {
  MatrixXd known = MatrixXd::Zero(freedoms.num_all(), structure.shapes.cols());
  known.topRows(structure.shapes.rows()) = structure.shapes;
  for (const int point : numbering.massless()) known.middleRows<3>(3 * Eigen::Index{point}).setZero();
  for (int point = 0; point < static_cast<int>(scene.points.size()) && !turning.bodies.empty(); ++point) {
    const std::int32_t body = turned_by(scene, structure, turning, point);
    if (body < 0 || !freedoms.has_joint(point)) continue;
    const Array& rows = turning.bodies[index(body)].rows;
    const auto stride = static_cast<Eigen::Index>(rows.size()) / 6;
    for (Eigen::Index axis = 0; axis < 3; ++axis)
      known.row(freedoms.rotation(point) + axis) =
          Eigen::Map<const Eigen::RowVectorXd>(rows.data() + (3 + axis) * stride, structure.shapes.cols());
  }
  return known;
}

// In the rows of the structure a released rotation replaces that of the joint about the axis. The step
// measures it from the joint instead, so the rotation of the joint is added: rho = rho_relative + axis .
// theta.
void measure_releases_from_joints(const Scene& scene, const Freedoms& freedoms, DeformationRows& rows) {
  std::map<int, std::pair<int, Vector3d>> axis_of;  // released freedom -> first rotation of the joint, axis
  for (int k = 0; k < static_cast<int>(scene.links.size()); ++k)
    for (int end = 0; end < 2; ++end)
      for (int axis = 0; axis < 3; ++axis)
        if (const int freedom = freedoms.released(k, end, axis); freedom >= 0)
          axis_of[freedom] = {freedoms.rotation(scene.links[index(k)].points[index(end)]),
                              axes_of(scene, scene.links[index(k)]).col(axis)};
  if (axis_of.empty()) return;
  for (DeformationRow& row : rows) {
    const auto given = row.coefficients;
    for (const auto& [freedom, coefficient] : given)
      if (const auto found = axis_of.find(freedom); found != axis_of.end())
        add_vector(row, found->second.first, coefficient, found->second.second);
  }
}

// \param unit  (num_unknowns) 1 for a rotation [rad], the length [m] of a massless point for a displacement
RotationStiffness rotation_stiffness(const LinkFactor& factor, const PlanTrueLinks& links,
                                     const std::vector<PlanBar>& bars, const Numbering& numbering,
                                     const VectorXd& unit, const MatrixXd& known) {
  const int count = numbering.num_unknowns();
  std::vector<Eigen::Triplet<double>> entries;
  RotationStiffness result{Eigen::SparseMatrix<double>(count, count), MatrixXd::Zero(count, known.cols())};
  for (const DeformationRow& row : factor.natural) {
    const double square = row.root_stiffness * row.root_stiffness;
    Eigen::RowVectorXd strain = Eigen::RowVectorXd::Zero(known.cols());
    bool has_unknown = false;
    for (const auto& [freedom, coefficient] : row.coefficients) {
      has_unknown = has_unknown || numbering.unknown(freedom) >= 0;
      strain += coefficient * known.row(freedom);
    }
    if (!has_unknown) continue;
    for (const auto& [a, of_a] : row.coefficients) {
      const int at = numbering.unknown(a);
      if (at < 0) continue;
      result.moments.row(at) -= unit[at] * square * of_a * strain;
      for (const auto& [b, of_b] : row.coefficients)
        if (const int other = numbering.unknown(b); other >= 0)
          entries.emplace_back(at, other, unit[at] * unit[other] * square * of_a * of_b);
    }
  }
  // Zeros where a link couples two rotations only once it is deformed, so that the factor can be renewed
  const auto add_zeros = [&](const auto& rotations, const auto& points) {
    std::vector<std::int32_t> unknowns(rotations.begin(), rotations.end());
    for (const std::int32_t point : points)
      for (int axis = 0; axis < 3 && point >= 0; ++axis)
        unknowns.push_back(numbering.unknown(3 * point + axis));
    for (const std::int32_t a : unknowns)
      for (const std::int32_t b : unknowns)
        if (a >= 0 && b >= 0) entries.emplace_back(a, b, 0.0);
  };
  const std::array<std::int32_t, 0> none{};
  const int num_joints = numbering.num_joints();
  for (const PlanBar& bar : bars) add_zeros(none, std::array{bar.first, bar.second});
  for (const PlanTrueAngle& angle : links.angles) add_zeros(none, angle.points);
  for (const PlanTrueBeam& beam : links.beams) add_zeros(unknowns_of(beam, num_joints), beam.points);
  for (const PlanTruePlate& plate : links.plates) add_zeros(unknowns_of(plate, num_joints), plate.points);
  for (const PlanTrueMatrix& matrix : links.matrices)
    add_zeros(unknowns_of(matrix, num_joints), matrix.points);
  result.own.setFromTriplets(entries.begin(), entries.end());
  return result;
}

// Returns the units of the unknowns   (THEORY 12.115).
VectorXd units_of(const Numbering& numbering, const StepPlan& plan) {
  VectorXd unit = VectorXd::Ones(numbering.num_unknowns());
  if (numbering.massless().empty()) return unit;
  for (const MasslessPoint& each : find_massless_points(plan))
    for (int axis = 0; axis < 3; ++axis) unit[numbering.unknown(3 * each.point + axis)] = each.length;
  return unit;
}

// Adds an error if massless points can move without strain of a link. Links hold them in every direction,
// except that all of them may turn about a line of points with mass.
void refuse_idle_points(const Scene& scene, const Numbering& numbering, const PlanJoints& joints,
                        Faults& faults) {
  constexpr double kMoves = 1e-6;  // [-] of a unit vector
  const auto n = index(joints.num_rotations);
  for (std::size_t first = 0; first < joints.idle.size(); first += n)
    for (const int point : numbering.massless())
      for (int axis = 0; axis < 3; ++axis) {
        if (std::abs(joints.idle[first + index(numbering.unknown(3 * point + axis))]) < kMoves) continue;
        return add_error(
            faults, scene.points[index(point)].origin,
            join_text("point ", quoted(scene.points[index(point)].name, point),
                      " has no mass, and it can turn about the line of the points with mass without strain "
                      "of a link, so no equation determines its position; give it some mass, or set "
                      "fidelity: coupled or a lower rung"));
      }
}

PlanLinkEnd end_of(const Freedoms& freedoms, const Numbering& numbering, int link, int end, int point) {
  PlanLinkEnd result;
  result.joint = numbering.joint(point);
  for (int axis = 0; axis < 3; ++axis)
    if (const int released = end < 2 ? freedoms.released(link, end, axis) : -1; released >= 0)
      result.released[index(axis)] = numbering.unknown(released);
  return result;
}

PlanTrueBeam true_beam(const Scene& scene, const Freedoms& freedoms, const Numbering& numbering, int number,
                       const Beam& beam) {
  const Link& link = scene.links[index(number)];
  PlanTrueBeam result;
  result.link = number;
  const Vector3d span = span_of(scene, link);
  const double L = span.stableNorm();
  result.span = to_array(span);
  result.axes = to_array(axes_of(scene, link));
  result.constants.length = L;
  result.constants.axial = beam.EA / L;
  result.constants.torsion = beam.GJ / L;
  const ShearRatios phi = shear_ratios_of(link, L).value_or(ShearRatios{});
  // rotation about y deflects along z, rotation about z along y   (THEORY 3.7, 3.8)
  const std::array<double, 2> EI{beam.EI_y, beam.EI_z}, ratio{phi.along_z, phi.along_y};
  for (std::size_t p = 0; p < 2; ++p) {
    result.constants.symmetric[p] = EI[p] / L;
    result.constants.antisymmetric[p] = 3.0 * EI[p] / (L * (1.0 + ratio[p]));
    const double bending = 1.0 / (1.0 + ratio[p]), shear = ratio[p] / (1.0 + ratio[p]);
    result.constants.shear[p] = shear;
    result.constants.skew_bow[p] = bending * bending / 40.0 - shear * shear / 8.0;
  }
  for (int k = 0; k < 2; ++k) {
    result.points[index(k)] = link.points[index(k)];
    result.ends[index(k)] = end_of(freedoms, numbering, number, k, link.points[index(k)]);
  }
  return result;
}

PlanTruePlate true_plate(const Scene& scene, const Freedoms& freedoms, const Numbering& numbering,
                         int number) {
  const Link& link = scene.links[index(number)];
  const auto at = [&](int k) -> const Vector3d& {
    return scene.points[index(link.points[index(k)])].position;
  };
  PlanTruePlate result;
  result.link = number;
  const Vector3d first = at(1) - at(0), second = at(2) - at(0), normal = first.cross(second);
  Matrix3d axes;
  axes.col(0) = first.stableNormalized();
  axes.col(2) = normal.stableNormalized();
  axes.col(1) = axes.col(2).cross(axes.col(0));
  result.axes = to_array(axes);
  PlateConstants& constants = result.constants;
  constants.axis_x = to_array(Vector3d(axes.col(0)));
  constants.axis_y = to_array(Vector3d(axes.col(1)));
  constants.first = to_array(first);
  constants.second = to_array(second);
  for (int k = 0; k < 3; ++k) {
    result.points[index(k)] = link.points[index(k)];
    result.ends[index(k)] = end_of(freedoms, numbering, number, k, link.points[index(k)]);
    const Vector3d gradient = axes.col(2).cross(Vector3d(at((k + 2) % 3) - at((k + 1) % 3))) /
                              normal.stableNorm();  // (THEORY 3.28)
    for (int a = 0; a < 2; ++a) constants.gradients[index(k)][index(a)] = axes.col(a).dot(gradient);
  }
  // In the rows of the factor, displacements of a rigid body replace the rotations of corners on it.
  const DeformationRows rows = plate_rows(scene, link, freedoms);
  Eigen::Matrix<double, 9, 9> bending = Eigen::Matrix<double, 9, 9>::Zero();
  for (int row = 0; row < static_cast<int>(rows.size()); ++row) {
    const DeformationRow& natural = rows[index(row)];
    if (row < 3) {
      constants.membrane[index(row)] = natural.root_stiffness * natural.root_stiffness;
      continue;
    }
    // In the axes of the plate its corners have no deflections, so the rotations alone bend it.
    Eigen::Matrix<double, 1, 9> local = Eigen::Matrix<double, 1, 9>::Zero();
    for (const auto& [freedom, coefficient] : natural.coefficients)
      for (int k = 0; k < 3; ++k)
        if (const int component = freedom - freedoms.rotation(link.points[index(k)]);
            freedom >= freedoms.num_displacements() && component >= 0 && component < 3)
          local.segment<3>(Eigen::Index{3} * k) += coefficient * axes.row(component);
    const Eigen::Matrix<double, 1, 9> force = natural.root_stiffness * natural.root_stiffness * local;
    bending += local.transpose() * force;
    for (Eigen::Index k = 0; k < 9 && row < 12; ++k)
      constants.curvature[index(Eigen::Index{9} * ((row - 3) % 3) + k)] += force[k];
  }
  for (Eigen::Index a = 0; a < 9; ++a)
    for (Eigen::Index b = 0; b < 9; ++b) constants.bending[index(9 * a + b)] = bending(a, b);
  return result;
}

// Marks the modes with most of their strain energy in axial forces and membranes, and lists the shortening of
// each strain that drives a mode   (THEORY 12.77, 12.78).
void compile_curve(const Scene& scene, const Structure& structure, const LinkFactor& factor, StepPlan& plan) {
  PlanCurve& curve = plan.coupled.curve;
  const PlanTrueLinks& links = plan.coupled.links;
  const MatrixXd& b = structure.shapes;
  std::vector<Eigen::RowVectorXd> strains;
  std::vector<double> stiffness;
  const auto add_strain = [&](const DeformationRow& row) {
    Eigen::RowVectorXd strain = Eigen::RowVectorXd::Zero(b.cols());
    for (const auto& [freedom, coefficient] : row.coefficients) strain += coefficient * b.row(freedom);
    strains.push_back(std::move(strain));
    stiffness.push_back(row.root_stiffness * row.root_stiffness);
  };
  std::size_t next_beam = 0;
  for (std::size_t k = 0; k < scene.links.size(); ++k) {
    const Link& link = scene.links[k];
    const bool is_beam = next_beam < links.beams.size() && links.beams[next_beam].link == static_cast<int>(k);
    const double axial = structure.resolved.links[k].axial.stiffness;
    if (!is_beam && axial == 0.0) continue;
    const Vector3d span = span_of(scene, link);
    PlanCurveLink each{{link.points[0], link.points[1]},
                       {-1, -1},
                       to_array(Vector3d(span.stableNormalized())),
                       span.stableNorm()};
    if (is_beam) {
      const PlanTrueBeam& beam = links.beams[next_beam];
      each.joints = {beam.ends[0].joint, beam.ends[1].joint};
      each.skew_bow = 0.5 * (beam.constants.skew_bow[0] + beam.constants.skew_bow[1]);
      ++next_beam;
    }
    add_strain(natural_row(factor, factor.natural_of[k], 0));
    curve.links.push_back(each);
  }
  for (const PlanTruePlate& plate : links.plates) {
    for (int row = 0; row < 3; ++row)
      add_strain(natural_row(factor, factor.natural_of[index(plate.link)], row));
    curve.plates.push_back({plate.points, plate.constants.gradients});
  }
  const double M = structure.mass_properties.mass;
  for (int mode = 0; mode < plan.num_elastic; ++mode) {
    const double omega = structure.omega[mode];
    double axial = 0.0;
    for (std::size_t k = 0; k < strains.size(); ++k)
      axial += stiffness[k] * strains[k][mode] * strains[k][mode];
    if (omega == 0.0) continue;
    curve.modes.push_back(mode);
    curve.is_axial.push_back(axial > 0.5 * M * omega * omega ? 1 : 0);
    Array weights(pad(strains.size()), 0.0);
    for (std::size_t k = 0; k < strains.size(); ++k)
      weights[k] = -stiffness[k] * strains[k][mode] / (M * omega * omega);
    curve.weights.insert(curve.weights.end(), weights.begin(), weights.end());
  }
}

}  // namespace

void compile_true_links(const Scene& scene, const Structure& structure, StepPlan& plan, Faults& faults) {
  PlanTrueLinks& links = plan.coupled.links;
  const PlanTurning& turning = plan.coupled.turning;
  const Freedoms freedoms(scene);
  const Numbering numbering(scene, structure, freedoms, turning);
  Faults none;  // build_structure() has reported them
  LinkFactor factor = factor_links_sparse(scene, none);
  measure_releases_from_joints(scene, freedoms, factor.natural);
  for (int k = 0; k < static_cast<int>(scene.links.size()); ++k)
    std::visit(
        Cases{
            [](const Spring&) {}, [](const Bar&) {}, [](const Dashpot&) {}, [](const Rigid&) {},
            [&](const MatrixLink& matrix) {
              if (scene.links[index(k)].points.size() == 1) return;  // only its inner coordinates strain it
              links.matrices.push_back(true_matrix(scene, factor, freedoms, k, matrix.has_rotations, faults));
              if (!matrix.has_rotations) return;
              for (const int point : scene.links[index(k)].points)
                links.matrices.back().ends.push_back(end_of(freedoms, numbering, k, 2, point));
            },
            [&](const Beam& beam) { links.beams.push_back(true_beam(scene, freedoms, numbering, k, beam)); },
            [&](const Plate&) { links.plates.push_back(true_plate(scene, freedoms, numbering, k)); },
            [&](const BendingSpring& spring) {
              links.angles.push_back(true_angle(scene, factor, k, spring.stiffness));
            },
            [&](const TorsionSpring& spring) {
              links.angles.push_back(true_angle(scene, factor, k, spring.stiffness));
            }},
        scene.links[index(k)].kind);
  if (has_error(faults)) return;
  PlanJoints& joints = links.joints;
  joints.num_joints = numbering.num_joints();
  joints.num_rotations = numbering.num_unknowns();
  if (links.has_joints() || !turning.bodies.empty())
    for (int point = 0; point < static_cast<int>(scene.points.size()); ++point)
      joints.of_points.push_back(numbering.joint(point));
  if (joints.num_rotations > 0) {
    const RotationStiffness stiffness =
        rotation_stiffness(factor, links, plan.coupled.bars, numbering, units_of(numbering, plan),
                           known_motions(scene, structure, freedoms, numbering, turning));
    const MatrixXd rows = factor_joints(stiffness.own, stiffness.moments, joints);
    refuse_idle_points(scene, numbering, joints, faults);
    for (Eigen::Index k = 0; k < rows.rows(); ++k) append_row(plan, row_of(rows, k), joints.rows);
  }
  // a truss has no bending that would shorten links between its points
  if (links.has_joints() || !links.angles.empty()) compile_curve(scene, structure, factor, plan);
}

}  // namespace freeflex
