#include "core/structure/body_modes.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cassert>
#include <cmath>
#include <numeric>

#include "core/rounding.hpp"
#include "core/scene/bodies.hpp"
#include "core/structure/masses/matrix_mass.hpp"
#include "core/structure/masses/particles.hpp"
#include "core/structure/modes/dense/mechanisms.hpp"
#include "core/structure/modes/dense/normal_modes.hpp"
#include "core/structure/modes/dense/null_space.hpp"

namespace freeflex {
namespace {

constexpr int kNamesInError = 8;
// [-] fraction of the largest displacement in a motion: a point that moves by less than this is at rest
constexpr double kStaysBelow = 1e-6;

// Rows over all freedoms y: displacements, then rotations multiplied by a length   (THEORY 16.6).
struct AllFreedoms {
  double length = 1.0;   // [m]
  Eigen::MatrixXd rows;  // A, [sqrt(N/m)]
  Eigen::MatrixXd unit_rows;
  Eigen::MatrixXd mass_rows;  // A_m, [sqrt(kg)]
  Eigen::MatrixXd unit_mass_rows;
  Eigen::MatrixXd constraints;  // C
  Eigen::MatrixXd rigid;        // rigid motions that move mass, columns of unit length
  Eigen::MatrixXd idle;         // rigid rotations that move no mass, columns of unit length
};

double length_of(const MassProperties& body) {
  const double size =
      std::sqrt(std::max(body.r.colwise().squaredNorm().maxCoeff(), body.principal.maxCoeff() / body.mass));
  return size > 0.0 ? size : 1.0;
}

// returns the values of the rotational freedoms in a unit rigid rotation of the whole structure about an axis
Eigen::VectorXd rigid_rotation(const Scene& scene, const Freedoms& freedoms, const Eigen::Vector3d& axis) {
  const int before = freedoms.num_displacements();
  Eigen::VectorXd rotation = Eigen::VectorXd::Zero(freedoms.num_rotations());
  for (int point = 0; point < static_cast<int>(scene.points.size()); ++point)
    if (freedoms.has_joint(point)) rotation.segment<3>(freedoms.rotation(point) - before) = axis;
  for (int index = 0; index < static_cast<int>(scene.links.size()); ++index) {
    const Link& link = scene.links[static_cast<std::size_t>(index)];
    if (const int about = freedoms.about_line(index); about >= 0)
      rotation[about - before] = axis.dot(line_of(scene, link.points));
    if (releases_of(link) == Releases{}) continue;
    const Eigen::Matrix3d axes = axes_of(scene, link);
    for (int end = 0; end < 2; ++end)
      for (int k = 0; k < 3; ++k)
        if (const int freedom = freedoms.released(index, end, k); freedom >= 0)
          rotation[freedom - before] = axes.col(k).dot(axis);
  }
  return rotation;
}

// sets the rigid motions over all freedoms
void set_rigid_motions(const Scene& scene, const Freedoms& freedoms, const MassProperties& body,
                       AllFreedoms& all) {
  Eigen::MatrixXd motions = rigid_motions_of(scene, freedoms, body, all.length);
  const double least = kEpsilon * all.length;
  std::vector<int> massive, idle;
  for (int k = 0; k < 6; ++k)
    if (k < body.rigid_freedoms)
      massive.push_back(k);
    else if (motions.col(k).cwiseAbs().maxCoeff() > 64.0 * least)
      idle.push_back(k);
  motions.colwise().normalize();
  all.rigid = motions(Eigen::all, massive);
  all.idle = motions(Eigen::all, idle);
}

Eigen::MatrixXd stack_rows(const Eigen::MatrixXd& upper, const Eigen::MatrixXd& lower) {
  Eigen::MatrixXd both(upper.rows() + lower.rows(), upper.cols());
  both << upper, lower;
  return both;
}

AllFreedoms all_freedoms(const Scene& scene, const Freedoms& freedoms, const LinkFactor& factor,
                         const MassProperties& body) {
  AllFreedoms all;
  all.length = length_of(body);
  const auto scaled = [&](Eigen::MatrixXd rows) {
    rows.rightCols(freedoms.num_rotations()) /= all.length;
    return rows;
  };
  const DeformationRows mass = mass_rows(scene, freedoms, all.length);
  all.rows = scaled(dense_rows(factor.natural, freedoms.num_all(), false));
  all.unit_rows = scaled(dense_rows(factor.natural, freedoms.num_all(), true));
  all.mass_rows = scaled(dense_rows(mass, freedoms.num_all(), false));
  all.unit_mass_rows = scaled(dense_rows(mass, freedoms.num_all(), true));
  all.constraints = scaled(factor.constraints);
  set_rigid_motions(scene, freedoms, body, all);
  // An idle rotation strains no link, so one additional row for each idle rotation fixes it   (THEORY 16.7)
  const double stiff = all.rows.size() > 0 ? all.rows.cwiseAbs().maxCoeff() : 1.0;
  all.rows = stack_rows(all.rows, stiff * all.idle.transpose());
  all.unit_rows = stack_rows(all.unit_rows, all.idle.transpose());
  return all;
}

// Adds to the null space of joints the motions of its pivots that move no mass: rotations of ends about which
// a mass matrix has no inertia   (THEORY 12.119).
void add_massless(const Eigen::MatrixXd& mass_rows, double rounding, NullSpace& joints) {
  const NullSpace rest = null_space(mass_rows(Eigen::all, joints.pivots), rounding);
  if (rest.free.empty()) return;
  const std::vector<int> moving = joints.pivots;
  const Eigen::Index before = joints.basis.cols();
  joints.basis.conservativeResize(Eigen::NoChange, before + rest.basis.cols());
  joints.basis.rightCols(rest.basis.cols()).setZero();
  for (std::size_t k = 0; k < moving.size(); ++k)
    joints.basis.row(moving[k]).tail(rest.basis.cols()) = rest.basis.row(static_cast<Eigen::Index>(k));
  for (const int each : rest.free) joints.free.push_back(moving[index(each)]);
  joints.pivots.clear();
  for (const int each : rest.pivots) joints.pivots.push_back(moving[index(each)]);
}

// Returns the null space of motions in which only joints without inertia turn   (THEORY 12.107).
// \param freedom_of  the freedom of each coordinate  \param mass_rows  over the coordinates
NullSpace turns_of_joints(const Scene& scene, const Freedoms& freedoms, const std::vector<int>& freedom_of,
                          const Eigen::MatrixXd& mass_rows, double rounding) {
  std::vector<bool> is_joint(index(freedoms.num_all()), false);
  std::fill(is_joint.begin() + freedoms.num_displacements(), is_joint.end(), true);
  std::vector<bool> is_on_body = points_with_rotary_mass(scene);
  for (std::size_t i = 0; i < is_on_body.size(); ++i)
    is_on_body[i] = is_on_body[i] || has_attitude(scene.points[i]);
  for (const Link& link : scene.links)
    for (const int point : link.points) is_on_body[index(point)] = is_on_body[index(point)] || is_rigid(link);
  for (int k = 0; k < static_cast<int>(scene.links.size()); ++k)
    if (const int count = num_inner(scene.links[index(k)]); count > 0)
      std::fill_n(is_joint.begin() + freedoms.inner(k), count, false);
  for (int i = 0; i < static_cast<int>(scene.points.size()); ++i)
    for (int axis = 0; axis < 3 && is_on_body[index(i)] && freedoms.has_joint(i); ++axis)
      is_joint[index(freedoms.rotation(i) + axis)] = false;
  NullSpace joints;
  for (int k = 0; k < static_cast<int>(freedom_of.size()); ++k) {
    const bool turns_nothing = is_joint[index(freedom_of[index(k)])] || mass_rows.col(k).isZero(0.0);
    (turns_nothing ? joints.free : joints.pivots).push_back(k);
  }
  joints.basis = Eigen::MatrixXd::Zero(static_cast<Eigen::Index>(freedom_of.size()),
                                       static_cast<Eigen::Index>(joints.free.size()));
  for (std::size_t k = 0; k < joints.free.size(); ++k)
    joints.basis(joints.free[k], static_cast<Eigen::Index>(k)) = 1.0;
  if (std::ranges::any_of(scene.links, has_mass_matrix)) add_massless(mass_rows, rounding, joints);
  return joints;
}

// The coordinates z_1 of motions that move mass and that rigid links allow: y = Z_C z (THEORY 16.6),
// z = P_1 z_1 + Z_0 z_0 (THEORY 16.7). The massless coordinates z_0 are condensed. In the code z_1 is s, z_0
// is w, Z_C is held_.basis, Z_0 is massless_.basis.
class Coordinates {
 public:
  Coordinates(const Scene& scene, const Freedoms& freedoms, AllFreedoms all, bool has_static_joints,
              Faults& faults) {
    const double rounding = 4.0 * static_cast<double>(freedoms.num_all()) * direction_rounding(scene);
    has_constraints_ = all.constraints.rows() > 0;
    if (has_constraints_) held_ = null_space(all.constraints, rounding);
    if (has_constraints_)
      for (Eigen::MatrixXd* each : {&all.rows, &all.unit_rows, &all.mass_rows, &all.unit_mass_rows})
        *each = (*each * held_.basis).eval();
    std::vector<int> freedom_of = held_.free;
    if (!has_constraints_) {
      freedom_of.resize(index(freedoms.num_all()));
      std::iota(freedom_of.begin(), freedom_of.end(), 0);
    }
    massless_ = has_static_joints ? turns_of_joints(scene, freedoms, freedom_of, all.unit_mass_rows, rounding)
                                  : null_space(all.unit_mass_rows, rounding);
    const Eigen::MatrixXd massless_rows = all.unit_rows * massless_.basis;
    const auto num_kept = static_cast<Eigen::Index>(massless_.pivots.size());
    const auto split = [&](const Eigen::MatrixXd& rows) {
      Eigen::MatrixXd both(rows.rows(), num_kept + massless_.basis.cols());
      both << rows(Eigen::all, massless_.pivots), rows * massless_.basis;
      return both;
    };
    const Condensed unit = condense(split(all.unit_rows), num_kept, -1, false);
    if (unit.rank < massless_rows.cols()) report_unheld_points(scene, massless_rows, faults);
    condensed_ = condense(split(all.rows), num_kept, unit.rank, true);
    unit_rows_ = unit.rows;
    mass_rows_ = all.mass_rows(Eigen::all, massless_.pivots);
    if (has_static_joints) mass_rows_ += all.mass_rows * massless_.basis * condensed_.recovery;
  }

  const Eigen::MatrixXd& rows() const { return condensed_.rows; }
  const Eigen::MatrixXd& unit_rows() const { return unit_rows_; }
  const Eigen::MatrixXd& mass_rows() const { return mass_rows_; }
  // returns the coordinates s of given motions, which rigid links must allow
  Eigen::MatrixXd coordinates_of(const Eigen::MatrixXd& freedoms) const {
    const Eigen::MatrixXd z = has_constraints_ ? Eigen::MatrixXd(freedoms(held_.free, Eigen::all)) : freedoms;
    return z(massless_.pivots, Eigen::all) -
           massless_.basis(massless_.pivots, Eigen::all) * z(massless_.free, Eigen::all);
  }
  Eigen::MatrixXd freedoms_of(const Eigen::MatrixXd& s) const {
    Eigen::MatrixXd z = massless_.basis * (condensed_.recovery * s);
    z(massless_.pivots, Eigen::all) += s;
    return has_constraints_ ? Eigen::MatrixXd(held_.basis * z) : z;
  }

 private:
  // Reports massless points that links do not hold in every direction. A rotation that no link resists is not
  // reported
  void report_unheld_points(const Scene& scene, const Eigen::MatrixXd& massless_rows, Faults& faults) const {
    const double threshold = 8.0 * static_cast<double>(massless_rows.rows()) * direction_rounding(scene);
    const Eigen::MatrixXd w = null_space(massless_rows, threshold).basis;
    Eigen::MatrixXd y = massless_.basis * w;
    if (has_constraints_) y = (held_.basis * y).eval();
    std::vector<int> points;
    for (int i = 0; i < static_cast<int>(scene.points.size()); ++i)
      if (y.middleRows<3>(3 * Eigen::Index{i}).norm() > kStaysBelow * y.cwiseAbs().maxCoeff())
        points.push_back(i);
    if (points.empty()) return;
    add_error(
        faults, scene.points[static_cast<std::size_t>(points.front())].origin,
        join_text(points.size() == 1 ? "point " : "points ", point_names(scene, points, kNamesInError),
                  points.size() == 1 ? " has" : " have", " no mass, and links do not hold ",
                  points.size() == 1 ? "it" : "them", " in every direction; give a mass, or add links"));
  }

  NullSpace held_, massless_;
  Condensed condensed_;
  Eigen::MatrixXd unit_rows_, mass_rows_;
  bool has_constraints_ = false;
};

// Returns whether the rung of the scene needs the rotations of joints as functions of the displacements.
bool wants_static_joints(const Scene& scene) {
  return !scene.automatic && traits_of(scene.fidelity).has_true_geometry &&
         std::ranges::any_of(scene.links, [](const Link& link) { return has_mass(link); }) &&
         std::ranges::all_of(points_that_move_mass(scene), [](bool moves) { return moves; });
}

// returns the points and, for each point with an attitude, three additional sample points on rigid arms
SamplePoints sample_points_of(const Scene& scene, const Freedoms& freedoms, const MassProperties& body,
                              double length, const Coordinates& coordinates) {
  std::vector<int> point_of(scene.points.size());
  std::iota(point_of.begin(), point_of.end(), 0);
  for (int i = 0; i < static_cast<int>(scene.points.size()); ++i)
    if (has_attitude(scene.points[static_cast<std::size_t>(i)])) point_of.insert(point_of.end(), 3, i);
  const Eigen::Index n = coordinates.rows().cols();
  const Eigen::MatrixXd y = coordinates.freedoms_of(Eigen::MatrixXd::Identity(n, n));
  SamplePoints samples;
  samples.r.resize(3, static_cast<Eigen::Index>(point_of.size()));
  samples.rows.resize(3 * samples.r.cols(), n);
  for (Eigen::Index p = 0; p < samples.r.cols(); ++p) {
    const int point = point_of[static_cast<std::size_t>(p)];
    samples.r.col(p) = body.r.col(point);
    samples.rows.middleRows<3>(3 * p) = y.middleRows<3>(3 * Eigen::Index{point});
    if (p < body.r.cols()) continue;
    const Eigen::Vector3d arm = length * Eigen::Vector3d::Unit((p - body.r.cols()) % 3);
    samples.r.col(p) += arm;
    for (Eigen::Index k = 0; k < n; ++k)
      samples.rows.block<3, 1>(3 * p, k) +=
          Eigen::Vector3d(y.block<3, 1>(freedoms.rotation(point), k)).cross(arm) / length;
  }
  samples.point_of = std::move(point_of);
  return samples;
}

}  // namespace

Eigen::MatrixXd rigid_motions_of(const Scene& scene, const Freedoms& freedoms, const MassProperties& body,
                                 double length) {
  Eigen::MatrixXd motions = Eigen::MatrixXd::Zero(freedoms.num_all(), 6);
  for (Eigen::Index i = 0; i < body.r.cols(); ++i) {
    motions.block<3, 3>(3 * i, 0).setIdentity();
    for (int k = 0; k < 3; ++k)
      motions.block<3, 1>(3 * i, 3 + k) =
          Eigen::Vector3d(body.principal_axes.col(2 - k)).cross(Eigen::Vector3d(body.r.col(i)));
  }
  for (int k = 0; k < 3; ++k)
    motions.col(3 + k).tail(freedoms.num_rotations()) =
        length * rigid_rotation(scene, freedoms, body.principal_axes.col(2 - k));
  return motions;
}

// the modes are normalised to b^T m b = M   (THEORY 16.9)
void find_body_modes(const Scene& scene, const LinkFactor& factor, Structure& structure, Faults& faults) {
  assert(structure.mass_properties.mass > 0.0 && !factor.is_sparse);
  const Freedoms freedoms(scene);
  const MassProperties& body = structure.mass_properties;
  const AllFreedoms all = all_freedoms(scene, freedoms, factor, body);
  structure.has_static_joints = wants_static_joints(scene);
  const Coordinates coordinates(scene, freedoms, all, structure.has_static_joints, faults);
  if (has_error(faults)) return;
  const Eigen::MatrixXd rigid = coordinates.coordinates_of(all.rigid);
  Mechanisms mechanisms = find_mechanisms(coordinates.unit_rows(), rigid,
                                          sample_points_of(scene, freedoms, body, all.length, coordinates),
                                          direction_rounding(scene));
  structure.mechanisms = std::move(mechanisms.names);
  const EckartComplement complement(RootMass(coordinates.mass_rows()), body.mass, rigid,
                                    Eigen::MatrixXd(0, rigid.rows()), mechanisms.motions);
  NormalModes modes = normal_modes(coordinates.rows(), complement);
  const Eigen::MatrixXd y = coordinates.freedoms_of(modes.motions);
  structure.omega = std::move(modes.omega);
  structure.shapes = y.topRows(freedoms.num_displacements());
  const Eigen::VectorXd signs = fix_signs(structure.shapes);
  structure.rotations = scaled_rotations(y, freedoms.num_rotations(), signs / all.length);
  rotate_with_bodies(scene, freedoms, structure.shapes, structure.rotations);
  structure.frequency_accuracy = std::max(modes.accuracy, factor.matrices.accuracy);
  structure.conditioning = modes.conditioning;
  structure.particles = find_particles(scene, freedoms, structure);
  structure.matrix_sums = matrix_sums(scene, freedoms, structure);
}

}  // namespace freeflex
