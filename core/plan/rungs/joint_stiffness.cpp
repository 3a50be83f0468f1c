#include "core/plan/rungs/joint_stiffness.hpp"

#include <Eigen/SparseCholesky>
#include <map>

#include "core/index.hpp"

namespace freeflex {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;
using Sparse = Eigen::SparseMatrix<double>;

// [-] A pivot below this share of its diagonal entry belongs to a rotation that strains no link.
constexpr double kIdle = 1e-10;

// Writes the factor of K_tt to the plan. Returns the number of rotations that strain no link; the inverses of
// their pivots are zero.
int write_factor(const Sparse& K, PlanJoints& joints) {
  // the order of least fill
  Eigen::PermutationMatrix<Eigen::Dynamic, Eigen::Dynamic, int> permutation;
  Eigen::AMDOrdering<int>()(K, permutation);
  const auto n = static_cast<int>(K.cols());
  Eigen::PermutationMatrix<Eigen::Dynamic, Eigen::Dynamic, int> order = permutation;  // order(k) = unknown
  std::vector<int> place(index(n));
  for (int k = 0; k < n; ++k) {
    joints.order.push_back(order.indices()[k]);
    place[index(order.indices()[k])] = k;
  }
  // right-looking factorisation over columns, ordered maps keep it short; set-up only
  std::vector<std::map<int, double>> columns(index(n));
  for (int c = 0; c < n; ++c)
    for (Sparse::InnerIterator it(K, c); it; ++it)
      if (const int row = place[index(static_cast<int>(it.row()))], column = place[index(c)]; row >= column)
        columns[index(column)][row] += it.value();
  std::vector<double> diagonal(index(n));
  for (int k = 0; k < n; ++k) diagonal[index(k)] = columns[index(k)][k];
  int num_idle = 0;
  joints.starts.push_back(0);
  for (int k = 0; k < n; ++k) {
    std::map<int, double>& column = columns[index(k)];
    const double pivot = column[k];
    const bool is_idle = !(pivot > kIdle * diagonal[index(k)]);
    num_idle += is_idle ? 1 : 0;
    joints.inverse_pivots.push_back(is_idle ? 0.0 : 1.0 / pivot);
    for (auto at = column.upper_bound(k); !is_idle && at != column.end(); ++at) {
      const double factor = at->second / pivot;
      joints.below.push_back(joints.order[index(at->first)]);
      joints.lower.push_back(factor);
      for (auto other = at; other != column.end(); ++other)
        columns[index(at->first)][other->first] -= factor * other->second;
    }
    joints.starts.push_back(static_cast<std::int32_t>(joints.below.size()));
  }
  return num_idle;
}

// Returns K_tt^-1 sides with the factor of the plan, as the step solves it.
MatrixXd solve(const PlanJoints& joints, MatrixXd sides) {
  const auto n = static_cast<int>(sides.rows());
  for (int k = 0; k < n; ++k)
    for (int e = joints.starts[index(k)]; e < joints.starts[index(k + 1)]; ++e)
      sides.row(joints.below[index(e)]) -= joints.lower[index(e)] * sides.row(joints.order[index(k)]);
  for (int k = n - 1; k >= 0; --k) {
    Eigen::RowVectorXd value = joints.inverse_pivots[index(k)] * sides.row(joints.order[index(k)]);
    for (int e = joints.starts[index(k)]; e < joints.starts[index(k + 1)]; ++e)
      value -= joints.lower[index(e)] * sides.row(joints.below[index(e)]);
    sides.row(joints.order[index(k)]) = value;
  }
  return sides;
}

// Returns an orthonormal basis of the rotations that strain no link: each idle pivot k gives the null vector
// with a one at k, found by back substitution.
MatrixXd idle_basis(const PlanJoints& joints, int num_idle) {
  const auto n = static_cast<int>(joints.order.size());
  MatrixXd basis = MatrixXd::Zero(n, num_idle);
  int column = 0;
  for (int k = 0; k < n; ++k) {
    if (joints.inverse_pivots[index(k)] != 0.0) continue;
    VectorXd z = VectorXd::Zero(n);
    z[joints.order[index(k)]] = 1.0;
    for (int i = n - 1; i >= 0; --i) {
      if (joints.inverse_pivots[index(i)] == 0.0) continue;
      double value = 0.0;
      for (int e = joints.starts[index(i)]; e < joints.starts[index(i + 1)]; ++e)
        value -= joints.lower[index(e)] * z[joints.below[index(e)]];
      z[joints.order[index(i)]] = value;
    }
    for (int other = 0; other < column; ++other) z -= basis.col(other).dot(z) * basis.col(other);
    basis.col(column++) = z.normalized();
  }
  return basis;
}

}  // namespace

MatrixXd factor_joints(const Sparse& K, const MatrixXd& sides, PlanJoints& joints) {
  const MatrixXd idle = idle_basis(joints, write_factor(K, joints));
  joints.idle.assign(idle.data(), idle.data() + idle.size());
  MatrixXd x = solve(joints, sides);
  x -= idle * (idle.transpose() * x).eval();
  return x;
}

}  // namespace freeflex
