#include "core/paper/maxwell.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <set>

#include "core/structure/modes/dense/decompositions.hpp"

namespace freeflex {
namespace {

constexpr int kNamesInReason = 8;

// [-] the stretch of a rigid link is treated as a rounding error if it is at most this fraction of the
// largest stretch due to any displacements with sum m b.b = M
constexpr double kRigidRounding = 1e-9;

// Returns the matrix sqrt(D) B, whose columns are displacements and rotations of joints. Its transpose maps
// t = s / sqrt(D), where s are the natural forces, to the loads that t balances (THEORY 11.22)
Eigen::MatrixXd weighted_rows(const LinkFactor& factor) {
  Eigen::MatrixXd rows =
      Eigen::MatrixXd::Zero(static_cast<Eigen::Index>(factor.natural.size()), factor.num_freedoms);
  for (std::size_t k = 0; k < factor.natural.size(); ++k)
    for (const auto& [freedom, coefficient] : factor.natural[k].coefficients)
      rows(static_cast<Eigen::Index>(k), freedom) += coefficient * factor.natural[k].root_stiffness;
  return rows;
}

// Returns the solution t of Y t = f with the smallest t.t, by the force method. Here Y is the matrix
// `balance`, and f are the loads   (THEORY 11.23, 11.24):
//   Y = O (Z_11 Z_12),   t = [Z_11^-1 O^T f; 0] + [-Z_11^-1 Z_12; 1] x
// The pivoting chooses stiff links as the primary structure, which first carries all loads. Then the
// self-stresses x are added that minimise the energy t.t / 2.
Eigen::MatrixXd least_energy(const Eigen::MatrixXd& balance, const Eigen::MatrixXd& loads,
                             Eigen::Index rank) {
  Eigen::MatrixXd t = Eigen::MatrixXd::Zero(balance.cols(), loads.cols());
  if (t.size() == 0) return t;
  const Eigen::ColPivHouseholderQR<Eigen::MatrixXd> qr(balance);
  const auto R11 = qr.matrixR().topLeftCorner(rank, rank).triangularView<Eigen::Upper>();
  Eigen::MatrixXd rotated_loads = loads;
  rotated_loads.applyOnTheLeft(qr.householderQ().adjoint());
  if (rank > 0) t.topRows(rank) = R11.solve(rotated_loads.topRows(rank));
  const Eigen::Index num_redundant = balance.cols() - rank;
  if (num_redundant > 0) {
    // The self-stresses [-Z_11^-1 Z_12; 1] are in equilibrium without loads (in the code Z_11 is R11). Adding
    // them to t does not change the loads that t balances, so t.t is smallest if t is orthogonal to all of
    // them.
    Eigen::MatrixXd self_stress(balance.cols(), num_redundant);
    if (rank > 0) self_stress.topRows(rank) = -R11.solve(qr.matrixR().topRightCorner(rank, num_redundant));
    self_stress.bottomRows(num_redundant).setIdentity();
    const Eigen::HouseholderQR<Eigen::MatrixXd> stress(self_stress);
    t.applyOnTheLeft(stress.householderQ().adjoint());
    t.topRows(num_redundant).setZero();
    t.applyOnTheLeft(stress.householderQ());
  }
  return qr.colsPermutation() * t;
}

// returns the names of the rigid links whose constraints the displacements b violate
std::string stretched_links(const Scene& scene, const LinkFactor& factor, const Eigen::MatrixXd& shapes) {
  std::set<int> links;
  if (shapes.cols() == 0) return "";
  Eigen::VectorXd mass(shapes.rows());
  for (Eigen::Index i = 0; i < mass.size(); ++i) mass[i] = scene.points[index(i / 3)].mass;
  const Eigen::MatrixXd weighted = factor.constraints * mass.cwiseSqrt().cwiseInverse().asDiagonal();
  const Eigen::VectorXd largest_stretch = std::sqrt(mass.sum() / 3.0) * weighted.rowwise().norm();
  const Eigen::VectorXd stretch = (factor.constraints * shapes).cwiseAbs().rowwise().maxCoeff();
  for (Eigen::Index row = 0; row < factor.constraints.rows(); ++row)
    if (stretch[row] > kRigidRounding * largest_stretch[row])
      links.insert(factor.constraint_link[index(row)]);
  std::string names;
  for (const int link : links) names += (names.empty() ? "" : ", ") + called(scene.links[index(link)], link);
  return names;
}

Eigen::VectorXd root_stiffnesses(const LinkFactor& factor) {
  Eigen::VectorXd roots(static_cast<Eigen::Index>(factor.natural.size()));
  for (std::size_t k = 0; k < factor.natural.size(); ++k)
    roots[static_cast<Eigen::Index>(k)] = factor.natural[k].root_stiffness;
  return roots;
}

}  // namespace

Eigen::MatrixXd unit_forces(const std::vector<PointMass>& points, const Eigen::MatrixXd& shapes) {
  double total = 0.0;
  for (const PointMass& point : points) total += point.mass;
  Eigen::VectorXd fraction(shapes.rows());
  for (Eigen::Index i = 0; i < fraction.size(); ++i) fraction[i] = points[index(i / 3)].mass / total;
  return fraction.asDiagonal() * shapes;
}

LinkStates link_states(const LinkFactor& factor, int rigid_freedoms, const Eigen::MatrixXd& loads) {
  const Eigen::Index num_displacements = factor.constraints.cols();
  const Eigen::Index num_constraints = factor.constraints.rows();
  const auto num_natural = static_cast<Eigen::Index>(factor.natural.size());
  // If the structure has no mechanism, the rank of Y follows from the numbers of freedoms. Condensation
  // removed one row for each rotation that links hold, and this number of rows is added here
  const Eigen::Index num_held = num_natural - factor.rows.rows();
  const Eigen::Index rank =
      std::min(num_displacements - rigid_freedoms - num_constraints + num_held, num_natural);
  LinkStates states;
  states.num_redundant = static_cast<int>(num_natural - rank);
  states.multipliers.resize(num_constraints, loads.cols());
  states.natural.resize(num_natural, loads.cols());
  if (loads.cols() == 0) return states;
  // Equilibrium is B^T s + C^T lambda = f (THEORY 11.21). Reflectors make all but the leading rows of C^T
  // zero, so the remaining rows are Y t = O_2^T f, with Y = O_2^T B^T sqrt(D)   (THEORY 11.22)
  Eigen::MatrixXd balance = weighted_rows(factor).transpose();
  Eigen::MatrixXd right = Eigen::MatrixXd::Zero(factor.num_freedoms, loads.cols());
  right.topRows(num_displacements) = loads;
  Eigen::MatrixXd rigid = Eigen::MatrixXd::Zero(factor.num_freedoms, num_constraints);
  rigid.topRows(num_displacements) = factor.constraints.transpose();
  const Eigen::HouseholderQR<Eigen::MatrixXd> front(rigid);
  if (num_constraints > 0) {
    if (num_natural > 0) balance.applyOnTheLeft(front.householderQ().adjoint());
    right.applyOnTheLeft(front.householderQ().adjoint());
  }
  const Eigen::Index num_left = factor.num_freedoms - num_constraints;
  const Eigen::MatrixXd t = least_energy(balance.bottomRows(num_left), right.bottomRows(num_left), rank);
  if (states.multipliers.size() > 0) {
    const Eigen::MatrixXd left = right.topRows(num_constraints) - balance.topRows(num_constraints) * t;
    states.multipliers = front.matrixQR().topRows(num_constraints).triangularView<Eigen::Upper>().solve(left);
  }
  states.natural = root_stiffnesses(factor).asDiagonal() * t;
  return states;
}

Maxwell find_maxwell(const Scene& scene, const Structure& structure, const LinkFactor& factor,
                     const Eigen::MatrixXd& shapes) {
  Maxwell maxwell;
  if (!structure.mechanisms.empty()) {
    maxwell.delta_absence = join_text(
        "no link resists the motion of ",
        point_names(scene, structure.mechanisms.front().moved_points, kNamesInReason),
        structure.mechanisms.size() == 1
            ? ""
            : join_text(" and ", structure.mechanisms.size() - 1,
                        structure.mechanisms.size() == 2 ? " other mechanism" : " other mechanisms"),
        ", so forces that do work on it cannot be balanced");
  } else {
    LinkStates states =
        link_states(factor, structure.mass_properties.rigid_freedoms, unit_forces(scene.points, shapes));
    states.natural.array().colwise() /= root_stiffnesses(factor).array();
    // Mohr's integral: delta_lu = t_l.t_u with t = s / sqrt(D)   (THEORY 11.25)
    maxwell.delta = states.natural.transpose() * states.natural;
    maxwell.num_redundant = states.num_redundant;
  }
  const std::string stretched = stretched_links(scene, factor, shapes);
  if (stretched.empty()) {
    const Eigen::MatrixXd deformations = factor.rows * shapes;
    maxwell.c = deformations.transpose() * deformations;
  } else {
    maxwell.c_absence =
        join_text("no force stretches rigid ", stretched, ", so its influence coefficients are infinite");
  }
  return maxwell;
}

Eigen::MatrixXd influence_of(const Eigen::MatrixXd& delta) {
  const Eigen::VectorXd scale = delta.diagonal().cwiseSqrt().cwiseInverse();
  const Eigen::MatrixXd scaled = scale.asDiagonal() * delta * scale.asDiagonal();
  const Eigen::MatrixXd inverse = scaled.llt().solve(Eigen::MatrixXd::Identity(delta.rows(), delta.cols()));
  return scale.asDiagonal() * inverse * scale.asDiagonal();
}

}  // namespace freeflex
