#include "core/plan/omit/excitability.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "core/plan/modes/modal_coupling.hpp"
#include "core/step/array.hpp"
#include "core/structure/modes/dense/decompositions.hpp"
#include "core/structure/reduce.hpp"

namespace freeflex {
namespace {

// [-] Relative difference below which frequencies are equal. This difference is the stated accuracy of the
// frequencies, but at least kEqual, the rounding error that splits a pair of equal frequencies, and at most
// kMostEqual, a difference that changes the phase by 1 rad after 1e9 rad.
constexpr double kEqual = 1e-12, kMostEqual = 1e-9;

// Returns the two axes in the plane to which commands are bound, or all three axes if commands are not bound
// to a plane.
std::vector<Eigen::Vector3d> command_axes(const MotionScope& scope) {
  if (!scope.binds_plane)
    return {Eigen::Vector3d::UnitX(), Eigen::Vector3d::UnitY(), Eigen::Vector3d::UnitZ()};
  const Eigen::Vector3d first = scope.normal.unitOrthogonal();
  return {first, scope.normal.cross(first)};
}

// Returns matrices that span all rotations of the vectors of a load into body axes. There is one matrix if
// the load is in body axes or the body does not rotate, two if the body rotates only about the normal, and
// nine otherwise (THEORY 14.1).
std::vector<Eigen::Matrix3d> load_rotations(const Load& load, const MotionScope& scope) {
  if (load.axes == Axes::kBody) return {Eigen::Matrix3d::Identity()};
  const Eigen::Matrix3d start = scope.R_WB.transpose();
  if (!scope.has_rotation) return {start};
  const Eigen::Vector3d& n = scope.normal;
  if (scope.is_planar) {
    Eigen::Matrix3d cross;
    cross << 0.0, -n.z(), n.y(), n.z(), 0.0, -n.x(), -n.y(), n.x(), 0.0;
    return {(Eigen::Matrix3d::Identity() - n * n.transpose()) * start, cross * start};
  }
  std::vector<Eigen::Matrix3d> rotations;
  for (int a = 0; a < 3; ++a)
    for (int b = 0; b < 3; ++b) {
      Eigen::Matrix3d unit = Eigen::Matrix3d::Zero();
      unit(a, b) = 1.0;
      rotations.push_back(unit);
    }
  return rotations;
}

class Directions {
 public:
  Directions(const Scene& scene, const Structure& structure) : scene_(scene), structure_(structure) {}

  void add_point(int point, const Eigen::Vector3d& axis) {
    Eigen::SparseVector<double> forces(size());
    for (int k = 0; k < 3; ++k)
      if (axis[k] != 0.0) forces.insert(3 * Eigen::Index{point} + k) = axis[k];
    columns_.push_back(std::move(forces));
  }
  void add_group(const Group& group, const Eigen::Vector3d& force, const Eigen::Vector3d& torque) {
    Eigen::VectorXd forces = Eigen::VectorXd::Zero(size());
    add_wrench_forces(scene_, structure_, group, force, torque, forces);
    add(forces);
  }
  void add(const Eigen::VectorXd& forces) { columns_.push_back(forces.sparseView()); }

  Eigen::SparseMatrix<double> take() const {
    Eigen::SparseMatrix<double> all(size(), static_cast<Eigen::Index>(columns_.size()));
    for (std::size_t k = 0; k < columns_.size(); ++k) {
      all.startVec(static_cast<Eigen::Index>(k));
      for (Eigen::SparseVector<double>::InnerIterator it(columns_[k]); it; ++it)
        all.insertBack(it.index(), static_cast<Eigen::Index>(k)) = it.value();
    }
    all.finalize();
    return all;
  }

 private:
  Eigen::Index size() const { return 3 * static_cast<Eigen::Index>(scene_.points.size()); }
  const Scene& scene_;
  const Structure& structure_;
  std::vector<Eigen::SparseVector<double>> columns_;
};

void add_commands(const Scene& scene, const MotionScope& scope, Directions& directions) {
  const std::vector<Eigen::Vector3d> axes = command_axes(scope);
  const Eigen::Vector3d none = Eigen::Vector3d::Zero();
  for (const int point : scene.pushable)
    for (const Eigen::Vector3d& axis : axes) directions.add_point(point, axis);
  for (const Group& group : scene.groups) {
    for (const Eigen::Vector3d& axis : axes) directions.add_group(group, axis, none);
    if (scope.binds_plane) {
      directions.add_group(group, none, scope.normal);
    } else {
      for (const Eigen::Vector3d& axis : axes) directions.add_group(group, none, axis);
    }
  }
}

// Adds the forces m_i S r_i, for the one matrix S of a spin about the normal if the motion is planar,
// otherwise for six matrices S that span all fields (THEORY 8.14, 8.16).
void add_fields(const Scene& scene, const Structure& structure, const MotionScope& scope,
                Directions& directions) {
  const bool spins = scope.takes_spin_load && scope.has_rotation;
  if (!spins && scene.attractor.mu == 0.0) return;
  std::vector<Eigen::Matrix3d> fields;
  if (scope.is_planar) {
    fields.push_back(Eigen::Matrix3d::Identity() - scope.normal * scope.normal.transpose());
  } else {
    for (int a = 0; a < 3; ++a)
      for (int b = a; b < 3; ++b) {
        Eigen::Matrix3d field = Eigen::Matrix3d::Zero();
        field(a, b) = field(b, a) = 1.0;
        fields.push_back(field);
      }
  }
  const Eigen::Matrix3Xd& r = structure.mass_properties.r;
  for (const Eigen::Matrix3d& field : fields) {
    Eigen::VectorXd forces(r.size());
    for (Eigen::Index i = 0; i < r.cols(); ++i)
      forces.segment<3>(3 * i) = scene.points[index(i)].mass * field * r.col(i);
    directions.add(forces);
  }
}

template <typename Rows>
void rotate_columns(const Eigen::MatrixXd& rotation, Eigen::Index first, Rows& rows) {
  if (rows.rows() == 0) return;
  rows.middleCols(first, rotation.rows()) = (rows.middleCols(first, rotation.rows()) * rotation).eval();
}

bool may_rotate(const Scene& scene, const Structure& structure, const FrequencyCluster& cluster) {
  if (cluster.count < 2 || structure.omega[cluster.first] == 0.0) return false;
  const auto is_named = [&](int mode) {
    return mode > cluster.first && mode <= cluster.first + cluster.count;
  };
  for (const auto& [mode, ratio] : scene.damping.mode_ratios)
    if (is_named(mode)) return false;
  for (const auto& each : scene.initial.modes)
    if (is_named(each.mode)) return false;
  const auto ratio = structure.structural_ratio.segment(cluster.first, cluster.count);
  return ratio.maxCoeff() - ratio.minCoeff() <= kEqual * ratio.maxCoeff();
}

}  // namespace

Eigen::SparseMatrix<double> command_directions(const Scene& scene, const Structure& structure,
                                               const MotionScope& scope) {
  Directions directions(scene, structure);
  add_commands(scene, scope, directions);
  return directions.take();
}

Eigen::SparseMatrix<double> load_directions(const Scene& scene, const Structure& structure,
                                            const MotionScope& scope) {
  Directions directions(scene, structure);
  add_commands(scene, scope, directions);
  for (const Load& load : scene.loads) {
    if (load.axes == Axes::kLocal) {
      for (const PointLoad& each : load.forces)
        for (int axis = 0; axis < 3; ++axis) directions.add_point(each.point, Eigen::Vector3d::Unit(axis));
      continue;
    }
    for (const Eigen::Matrix3d& rotation : load_rotations(load, scope))
      directions.add(load_forces(scene, structure, load, rotation));
  }
  for (const Feedback& feedback : scene.feedbacks)
    for (int axis = 0; axis < 3; ++axis) directions.add_point(feedback.point, Eigen::Vector3d::Unit(axis));
  add_fields(scene, structure, scope, directions);
  return directions.take();
}

Eigen::MatrixXd excitability_rows(const Scene& scene, const Structure& structure, const MotionScope& scope,
                                  const InitialModes& initial) {
  const Eigen::SparseMatrix<double> forces = load_directions(scene, structure, scope);
  Eigen::MatrixXd rows(forces.cols() + 2, structure.omega.size());
  // If the set of modes is complete, the squares of the components of a load on the modes and on the rigid
  // motions sum to sum_i M f_ki^2 / m_i (THEORY 4.3).
  Eigen::VectorXd inverse_mass(forces.rows());
  for (Eigen::Index i = 0; i < inverse_mass.size(); ++i)
    inverse_mass[i] = 1.0 / scene.points[index(i / 3)].mass;
  rows.topRows(forces.cols()) = on_modes(forces, structure.shapes);
  for (Eigen::Index k = 0; k < forces.cols(); ++k) {
    const Eigen::VectorXd column = forces.col(k);
    const double norm = std::sqrt(structure.mass_properties.mass * column.cwiseAbs2().dot(inverse_mass));
    if (norm > 0.0) rows.row(k) /= norm;
  }
  const auto normalized = [](const Eigen::VectorXd& values) -> Eigen::RowVectorXd {
    const double norm = values.norm();
    return (norm > 0.0 ? values / norm : values).transpose();
  };
  rows.row(forces.cols()) = normalized(initial.q);
  rows.row(forces.cols() + 1) = normalized(initial.q_dot);
  return rows;
}

std::shared_ptr<const Structure> align_modes(const Scene& scene, const Eigen::MatrixXd& excitability,
                                             std::shared_ptr<const Structure> shared, InitialModes& initial) {
  std::shared_ptr<Structure> own;  // a copy, made when the first modes are rotated
  const double gap = std::max(kEqual, std::min(kMostEqual, shared->frequency_accuracy));
  for (const FrequencyCluster& cluster : frequency_clusters(shared->omega, gap)) {
    if (!may_rotate(scene, *shared, cluster)) continue;
    const Eigen::Index first = cluster.first, count = cluster.count;
    const Eigen::JacobiSVD<Eigen::MatrixXd, Eigen::ColPivHouseholderQRPreconditioner> svd(
        excitability.middleCols(first, count), Eigen::ComputeThinU | Eigen::ComputeThinV);
    if (svd.matrixV().cols() == count && svd.singularValues()[count - 1] > kLeastExcitability) continue;
    // combinations that no load excites come last
    Eigen::MatrixXd alignment = svd.matrixV();
    if (alignment.cols() < count) {
      const Eigen::HouseholderQR<Eigen::MatrixXd> complete(alignment);
      const Eigen::Index known = alignment.cols();
      const Eigen::MatrixXd basis = complete.householderQ() * Eigen::MatrixXd::Identity(count, count);
      alignment.conservativeResize(count, count);
      alignment.rightCols(count - known) = basis.rightCols(count - known);
    }
    if (!own) shared = own = std::make_shared<Structure>(*shared);
    Structure& structure = *own;
    rotate_columns(alignment, first, structure.shapes);
    rotate_columns(alignment, first, structure.damping_rows);
    for (auto& [point, rotation] : structure.local_rotations) rotate_columns(alignment, first, rotation);
    for (LinkForceRows& force : structure.link_forces) {
      rotate_columns(alignment, first, force.rows);
      rotate_columns(alignment, first, force.rate_rows);
    }
    for (LoadStiffness& stiffness : structure.load_stiffness)
      rotate_load_stiffness(alignment, cluster.first, stiffness);
    const Eigen::VectorXd squares =
        alignment.cwiseAbs2().transpose() * structure.omega.segment(first, count).cwiseAbs2();
    structure.omega.segment(first, count) = squares.cwiseSqrt();
    for (Eigen::VectorXd* values : {&initial.q, &initial.q_dot})
      values->segment(first, count) = (alignment.transpose() * values->segment(first, count)).eval();
  }
  return shared;
}

std::vector<int> excited_modes(const Eigen::MatrixXd& excitability, const Structure& structure) {
  const Eigen::Index n = structure.omega.size();
  std::vector<char> is_excited(index(n), 0);
  for (Eigen::Index mode = 0; mode < n; ++mode)
    is_excited[index(mode)] =
        excitability.rows() > 0 && excitability.col(mode).cwiseAbs().maxCoeff() > kLeastExcitability;
  if (structure.damping_rows.rows() > 0) {
    // Adds the modes that dashpots couple to excited modes, by D = R^T R   (THEORY 14.2).
    const Eigen::MatrixXd D = structure.damping_rows.transpose() * structure.damping_rows;
    const double least = kUncoupled * D.diagonal().maxCoeff();
    for (bool has_more = true; has_more;) {
      has_more = false;
      for (Eigen::Index mode = 0; mode < n; ++mode) {
        if (is_excited[index(mode)]) continue;
        for (Eigen::Index other = 0; other < n; ++other)
          if (is_excited[index(other)] && std::abs(D(mode, other)) > least) {
            is_excited[index(mode)] = has_more = true;
            break;
          }
      }
    }
  }
  std::vector<int> modes;
  for (Eigen::Index mode = 0; mode < n; ++mode)
    if (is_excited[index(mode)]) modes.push_back(static_cast<int>(mode));
  return modes;
}

}  // namespace freeflex
