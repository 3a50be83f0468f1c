#include "core/structure/reduce.hpp"

#include <algorithm>
#include <cmath>

#include "core/limits.hpp"
#include "core/structure/modes/dense/decompositions.hpp"

namespace freeflex {
namespace {

// [-] fraction of the largest singular value. Smaller singular values belong to dependent loads
// (THEORY 14.12)
constexpr double kDependent = 1e-12;

Eigen::MatrixXd columns(const Eigen::MatrixXd& rows, const std::vector<int>& kept) {
  if (rows.rows() == 0) return Eigen::MatrixXd(0, static_cast<Eigen::Index>(kept.size()));
  return rows(Eigen::all, kept);
}

}  // namespace

Structure reduce(const Structure& structure, const std::vector<int>& modes) {
  Structure few;
  few.resolved = structure.resolved;
  few.mass_properties = structure.mass_properties;
  few.frequency_accuracy = structure.frequency_accuracy;
  few.conditioning = structure.conditioning;
  few.kept = structure.kept;
  few.num_constraints = structure.num_constraints;
  few.constraint_shapes = structure.constraint_shapes;
  few.omega = structure.omega(modes);
  if (structure.structural_ratio.size() > 0) few.structural_ratio = structure.structural_ratio(modes);
  few.shapes = columns(structure.shapes, modes);
  few.damping_rows = columns(structure.damping_rows, modes);
  for (const auto& [point, rotation] : structure.local_rotations)
    few.local_rotations[point] = columns(rotation, modes);
  few.rotations = columns(structure.rotations, modes);
  few.particles = {structure.particles.mass, structure.particles.r,
                   columns(structure.particles.shapes, modes)};
  few.matrix_sums = {columns(structure.matrix_sums.momenta, modes),
                     columns(structure.matrix_sums.field, modes)};
  for (const LinkForceRows& force : structure.link_forces)
    few.link_forces.push_back(
        {force.link, columns(force.rows, modes), columns(force.rate_rows, modes), force.load_rows});
  few.load_stiffness = structure.load_stiffness;
  for (LoadStiffness& stiffness : few.load_stiffness) reduce_load_stiffness(modes, stiffness);
  // mechanisms are the first modes
  for (const int mode : modes)
    if (const auto k = index(mode); k < structure.mechanisms.size())
      few.mechanisms.push_back(structure.mechanisms[k]);
  return few;
}

std::shared_ptr<const Structure> share(const Structure& structure) {
  return {std::shared_ptr<const Structure>(), &structure};
}

std::shared_ptr<const Structure> share_reduced(const Structure& structure, const std::vector<int>& modes) {
  if (static_cast<Eigen::Index>(modes.size()) == structure.omega.size()) return share(structure);
  return std::make_shared<const Structure>(reduce(structure, modes));
}

Eigen::MatrixXd on_modes(const Eigen::SparseMatrix<double>& loads, const Eigen::MatrixXd& shapes) {
  if (loads.rows() > 3 * Eigen::Index{kMostByDefault}) return loads.transpose() * shapes;
  return Eigen::MatrixXd(loads).transpose() * shapes;
}

void keep_static_link_forces(const Structure& whole, const std::vector<int>& left_out,
                             const Eigen::SparseMatrix<double>& loads, Structure& structure) {
  if (structure.link_forces.empty() || left_out.empty() || loads.cols() == 0) return;
  // quasi-static response of the omitted modes: ds = sum_l ds/dq_l Q_l / (M omega_l^2)   (THEORY 14.11). Each
  // of two factors gets the root of 1 / (M omega_l^2): with diag(1 / (omega_l sqrt(M))) b^T f = U Sigma Y^T,
  // the shapes are b diag(1 / (omega_l sqrt(M))) U, and the link rows ds/dq diag(1 / (omega_l sqrt(M))) U
  // (THEORY 14.12). In the code U is `rotation`.
  Eigen::VectorXd root_flexibility = whole.omega(left_out).cwiseInverse();
  root_flexibility /= std::sqrt(whole.mass_properties.mass);
  const Eigen::MatrixXd shapes = whole.shapes(Eigen::all, left_out) * root_flexibility.asDiagonal();
  Eigen::MatrixXd rotation = Eigen::MatrixXd::Identity(shapes.cols(), shapes.cols());
  if (loads.cols() < shapes.cols()) {
    const Eigen::BDCSVD<Eigen::MatrixXd> svd(on_modes(loads, shapes).transpose(), Eigen::ComputeThinU);
    const Eigen::VectorXd& values = svd.singularValues();
    const Eigen::Index rank = (values.array() > kDependent * values[0]).count();
    rotation = svd.matrixU().leftCols(rank);
  }
  const Eigen::Index known = structure.constraint_shapes.cols();
  Eigen::MatrixXd all(shapes.rows(), known + rotation.cols());
  all << structure.constraint_shapes, shapes * rotation;
  structure.constraint_shapes = std::move(all);
  for (std::size_t k = 0; k < structure.link_forces.size(); ++k) {
    LinkForceRows& force = structure.link_forces[k];
    if (force.rows.rows() == 0) continue;
    Eigen::MatrixXd load_rows = Eigen::MatrixXd::Zero(force.rows.rows(), known + rotation.cols());
    if (force.load_rows.rows() > 0) load_rows.leftCols(known) = force.load_rows;
    load_rows.rightCols(rotation.cols()) =
        whole.link_forces[k].rows(Eigen::all, left_out) * root_flexibility.asDiagonal() * rotation;
    force.load_rows = std::move(load_rows);
  }
}

}  // namespace freeflex
