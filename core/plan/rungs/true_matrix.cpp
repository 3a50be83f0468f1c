// Matrix links that turn as one piece   (THEORY 12.102), and angle springs at their true angle
// (THEORY 12.69).
#include <map>

#include "core/plan/arrays.hpp"
#include "core/plan/rungs/true_links.hpp"
#include "core/structure/links/superelement.hpp"
#include "core/structure/modes/dense/decompositions.hpp"

namespace freeflex {
namespace {

using Eigen::Matrix3d;
using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;

// [-] points whose second moment across a line is below this share of that along it are on the line
constexpr double kLine = 1e-12;
// [-] Below this share, displacements of points turn a link about the line more than its ends do
constexpr double kNarrow = 1e-3;

// Returns whether a stiffness over displacements of points on a line is the same in all directions across it.
bool is_round(const MatrixXd& K, const Vector3d& line) {
  constexpr double kRound = 1e-6;  // [-] of the largest entry, as for asymmetry (THEORY 3.11)
  const Matrix3d along = line * line.transpose(), across = Matrix3d::Identity() - along;
  for (Eigen::Index i = 0; i < K.rows(); i += 3)
    for (Eigen::Index j = 0; j < K.cols(); j += 3) {
      const Matrix3d block = K.block<3, 3>(i, j);
      const double of_line = line.dot(block * line), mean = 0.5 * (block.trace() - of_line);
      if ((block - of_line * along - mean * across).cwiseAbs().maxCoeff() > kRound * K.cwiseAbs().maxCoeff())
        return false;
    }
  return true;
}

// Returns the stiffness of n coordinates while the inner ones after them are in equilibrium. The inner
// coordinates are measured from there, so their own forces stay linear   (THEORY 12.122).
MatrixXd without_inner(const MatrixXd& K, Eigen::Index n) {
  const Eigen::Index inner = K.rows() - n;
  const MatrixXd cross = K.bottomLeftCorner(inner, n);
  const MatrixXd recovery =
      Eigen::ColPivHouseholderQR<MatrixXd>(K.bottomRightCorner(inner, inner)).solve(cross);
  return K.topLeftCorner(n, n) - cross.transpose() * recovery;
}

void refuse_line(const Scene& scene, int number, Faults& faults) {
  const Link& link = scene.links[index(number)];
  add_error(faults, link.origin,
            join_text("link ", called(link, number),
                      ": its points are on a line or nearly so, so that their displacements do not tell how "
                      "the link turns about this line, which this fidelity needs; give a matrix with "
                      "rotations: true or one that is the same in all directions across the line, or set "
                      "fidelity: coupled or a lower rung"));
}

void refuse_size(const Scene& scene, int number, Faults& faults) {
  const Link& link = scene.links[index(number)];
  add_error(faults, link.origin,
            join_text("link ", called(link, number), " has ", link.points.size(),
                      " points, but on this fidelity a matrix has at most ", kMostMatrixPoints,
                      "; divide it, or set fidelity: coupled or a lower rung"));
}

}  // namespace

PlanTrueMatrix true_matrix(const Scene& scene, const LinkFactor& factor, const Freedoms& freedoms, int number,
                           bool has_rotations, Faults& faults) {
  const Link& link = scene.links[index(number)];
  if (link.points.size() > kMostMatrixPoints) {
    refuse_size(scene, number, faults);
    return {};
  }
  PlanTrueMatrix result;
  result.link = number;
  const auto count = static_cast<Eigen::Index>(link.points.size());
  const Eigen::Index per_point = has_rotations ? 6 : 3, n = per_point * count;
  std::map<int, Eigen::Index> column_of;  // freedom -> row and column of the stiffness
  Eigen::Matrix3Xd d(3, count);
  for (Eigen::Index k = 0; k < count; ++k) {
    const int point = link.points[index(k)];
    result.points.push_back(point);
    d.col(k) = scene.points[index(point)].position;
    for (int axis = 0; axis < 3; ++axis) {
      column_of[3 * point + axis] = per_point * k + axis;
      if (has_rotations) column_of[freedoms.rotation(point) + axis] = per_point * k + 3 + axis;
    }
  }
  const Eigen::Index num_inner = freeflex::num_inner(link), all = n + num_inner;
  for (int k = 0; k < num_inner; ++k) column_of[freedoms.inner(number) + k] = n + k;
  MatrixXd K = MatrixXd::Zero(all, all);
  DeformationRows rows;
  if (has_rotations) {
    // In the rows of the factor, displacements of a rigid body replace the rotations of ends on it.
    MatrixLimits limits;
    Faults reported_before;
    rows = superelement_rows(scene, number, freedoms, limits, reported_before);
  } else {
    const RowRange range = factor.natural_of[index(number)];
    for (int row = 0; row < range.count; ++row) rows.push_back(natural_row(factor, range, row));
  }
  for (const DeformationRow& natural : rows) {
    VectorXd e = VectorXd::Zero(all);
    for (const auto& [freedom, coefficient] : natural.coefficients)
      e[column_of.at(freedom)] += natural.root_stiffness * coefficient;
    K += e * e.transpose();
  }
  if (num_inner > 0) K = without_inner(K, n);
  MatrixConstants& constants = result.constants;
  constants.has_rotations = has_rotations;
  for (Eigen::Index row = 0; row < n; ++row) {
    constants.stiffness.insert(constants.stiffness.end(), K.row(row).begin(), K.row(row).end());
    constants.stiffness.resize(index(row + 1) * pad(index(n)), 0.0);
  }
  d.colwise() -= Vector3d(d.rowwise().mean());
  for (Eigen::Index k = 0; k < count; ++k) constants.arms.push_back(to_array(Vector3d(d.col(k))));
  const Matrix3d square = d * d.transpose();
  const Eigen::SelfAdjointEigenSolver<Matrix3d> eigen(square);
  const double along = eigen.eigenvalues()[2];
  const double width = eigen.eigenvalues()[1];
  const Vector3d line = eigen.eigenvectors().col(2);
  if (has_rotations) {
    // about the line the ends count as much as points at the distance of the ends
    constants.line = to_array(line);
    constants.turn_weight = along / static_cast<double>(count);
  } else if (width < kNarrow * along) {
    if (width > kLine * along || !is_round(K, line)) refuse_line(scene, number, faults);
    constants.line = to_array(line);
  }
  const Matrix3d of_line = line * line.transpose(), inertia = square.trace() * Matrix3d::Identity() - square;
  constants.inverse = has_rotations           ? to_array(Matrix3d((inertia + along * of_line).inverse()))
                      : width < kLine * along ? to_array(Matrix3d((Matrix3d::Identity() - of_line) / along))
                                              : to_array(Matrix3d(inertia.inverse()));
  return result;
}

static double root_of_sum(const std::array<Vec3, 4>& row) {
  double sum = 0.0;
  for (const Vec3& each : row) sum += dot(each, each);
  return std::sqrt(sum);
}

PlanTrueAngle true_angle(const Scene& scene, const LinkFactor& factor, int number, double stiffness) {
  const Link& link = scene.links[index(number)];
  PlanTrueAngle result;
  result.link = number;
  const auto at = [&](std::size_t k) -> const Vector3d& {
    return scene.points[index(link.points[k])].position;
  };
  for (std::size_t k = 0; k < link.points.size(); ++k) result.points[k] = link.points[k];
  const RowRange range = factor.natural_of[index(number)];
  result.num_rows = range.count;
  for (int row = 0; row < range.count; ++row)
    for (const auto& [freedom, coefficient] : natural_row(factor, range, row).coefficients)
      for (std::size_t k = 0; k < link.points.size(); ++k)
        if (freedom / 3 == link.points[k])
          result.rows[index(row)][k][index(freedom % 3)] +=
              natural_row(factor, range, row).root_stiffness * coefficient;
  AngleConstants& constants = result.constants;
  constants.stiffness = stiffness;
  if (link.points.size() == 4) {
    const Vector3d a1 = at(1) - at(0), a2 = at(2) - at(1), a3 = at(3) - at(2);
    const Vector3d m = a1.cross(a2), n = a2.cross(a3);
    const double size = m.stableNorm() * n.stableNorm();
    constants.form = AngleConstants::Form::kDihedral;
    constants.rest_sine = a2.stableNorm() * a1.dot(n) / size;
    constants.rest_cosine = m.dot(n) / size;
  } else {
    const Vector3d a = (at(0) - at(1)).stableNormalized(), c = (at(2) - at(1)).stableNormalized();
    constants.rest_sine = a.cross(c).norm();
    constants.rest_cosine = a.dot(c);
    constants.form = range.count == 1              ? AngleConstants::Form::kAngle
                     : constants.rest_cosine < 0.0 ? AngleConstants::Form::kStraight
                                                   : AngleConstants::Form::kFolded;
  }
  if (range.count == 1) {
    // the change of the angle grows along the row, or falls
    Vec3 x[4] = {};
    for (std::size_t k = 0; k < link.points.size(); ++k)
      x[k] = add_scaled(to_array(at(k)), 1e-6 * (at(1) - at(0)).stableNorm() / root_of_sum(result.rows[0]),
                        result.rows[0][k]);
    result.sign = change_of(constants, x) < 0.0 ? -1.0 : 1.0;
  }
  return result;
}

}  // namespace freeflex
