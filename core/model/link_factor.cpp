#include "core/model/link_factor.hpp"

#include <Eigen/QR>
#include <algorithm>
#include <limits>

#include "core/model/faults.hpp"
#include "core/model/graded_svd.hpp"

namespace freeflex {
namespace {

constexpr double kEpsilon = std::numeric_limits<double>::epsilon();

// rows that involve no rotation, and the rows of all beams, whose rotations are freedoms after the
// displacements
struct AllRows {
  std::vector<DeformationRow> direct;
  std::vector<DeformationRow> beams;
};

std::vector<int> find_joints(const Scene& scene) {
  std::vector<int> joints;
  for (const Link& link : scene.links)
    if (std::holds_alternative<Beam>(link.kind))
      joints.insert(joints.end(), link.points.begin(), link.points.end());
  std::sort(joints.begin(), joints.end());
  joints.erase(std::unique(joints.begin(), joints.end()), joints.end());
  return joints;
}

// first rotation freedom of a joint, counted after the 3N displacements
int rotation_freedom(const std::vector<int>& joints, int num_points, int point) {
  const auto place = std::lower_bound(joints.begin(), joints.end(), point) - joints.begin();
  return 3 * num_points + 3 * static_cast<int>(place);
}

AllRows collect_rows(const Scene& scene, LinkFactor& factor, Faults& faults) {
  AllRows all;
  const int num_points = static_cast<int>(scene.points.size());
  for (std::size_t i = 0; i < scene.links.size(); ++i) {
    const Link& link = scene.links[i];
    if (std::holds_alternative<Spring>(link.kind) || std::holds_alternative<Bar>(link.kind)) {
      all.direct.push_back(axial_row(scene, link, axial_stiffness(scene, link)));
    } else if (std::holds_alternative<Beam>(link.kind)) {
      const auto rows = beam_rows(scene, link,
                                  {rotation_freedom(factor.joint_points, num_points, link.points[0]),
                                   rotation_freedom(factor.joint_points, num_points, link.points[1])});
      all.beams.insert(all.beams.end(), rows.begin(), rows.end());
    } else {
      auto rows = matrix_rows(scene, link, static_cast<int>(i), factor.matrix_accuracy, faults);
      std::move(rows.begin(), rows.end(), std::back_inserter(all.direct));
    }
  }
  return all;
}

Eigen::MatrixXd dense_rows(const std::vector<DeformationRow>& rows, Eigen::Index num_columns, bool unit) {
  Eigen::MatrixXd dense = Eigen::MatrixXd::Zero(static_cast<Eigen::Index>(rows.size()), num_columns);
  for (std::size_t i = 0; i < rows.size(); ++i)
    for (const auto& [freedom, coefficient] : rows[i].coefficients)
      dense(static_cast<Eigen::Index>(i), freedom) +=
          coefficient * (unit ? rows[i].unit_scale : rows[i].root_stiffness);
  return dense;
}

struct Condensed {
  Eigen::MatrixXd rows;      // (num_rows - rank x 3N)
  Eigen::MatrixXd recovery;  // (num_rotations x 3N), empty unless asked for
  Eigen::Index rank = 0;
};

// X47: [A_theta A_V] = Q [R *; 0 A]; the rows below the rank of A_theta are those of K condensed, and
// theta = -R^+ (Q' A_V) V. known_rank < 0: found here, from columns scaled to one.
Condensed condense(Eigen::MatrixXd rows, Eigen::Index num_displacements, Eigen::Index known_rank,
                   bool with_recovery) {
  sort_rows(rows);
  const Eigen::Index num_rotations = rows.cols() - num_displacements;
  Eigen::MatrixXd rotation_columns = rows.rightCols(num_rotations);
  const Eigen::RowVectorXd scale = rotation_columns.colwise().norm().cwiseInverse();
  rotation_columns *= scale.asDiagonal();
  Eigen::ColPivHouseholderQR<Eigen::MatrixXd> qr(rotation_columns);
  // pivots of free rotations are some roundings of one; those of a chain of n beams fall like 1/n
  qr.setThreshold(8.0 * static_cast<double>(rows.rows()) * kEpsilon);
  Condensed condensed;
  condensed.rank = known_rank < 0 ? qr.rank() : known_rank;
  Eigen::MatrixXd turned = rows.leftCols(num_displacements);
  turned.applyOnTheLeft(qr.householderQ().adjoint());
  condensed.rows = turned.bottomRows(rows.rows() - condensed.rank);
  if (with_recovery) {
    // rotations that nothing determines stay zero
    Eigen::MatrixXd solution = Eigen::MatrixXd::Zero(num_rotations, num_displacements);
    solution.topRows(condensed.rank) = -qr.matrixR()
                                            .topLeftCorner(condensed.rank, condensed.rank)
                                            .triangularView<Eigen::Upper>()
                                            .solve(turned.topRows(condensed.rank));
    condensed.recovery = scale.asDiagonal() * (qr.colsPermutation() * solution);
  }
  return condensed;
}

Eigen::MatrixXd stack(const Eigen::MatrixXd& upper, const Eigen::MatrixXd& lower) {
  Eigen::MatrixXd both(upper.rows() + lower.rows(), upper.cols());
  both << upper, lower;
  return both;
}

}  // namespace

LinkFactor factor_links(const Scene& scene, bool with_recovery, Faults& faults) {
  LinkFactor factor;
  factor.joint_points = find_joints(scene);
  const AllRows all = collect_rows(scene, factor, faults);
  const auto num_displacements = 3 * static_cast<Eigen::Index>(scene.points.size());
  const Eigen::Index num_freedoms =
      num_displacements + 3 * static_cast<Eigen::Index>(factor.joint_points.size());
  factor.rows = dense_rows(all.direct, num_displacements, false);
  factor.unit_rows = dense_rows(all.direct, num_displacements, true);
  if (all.beams.empty()) return factor;

  // the rank of the rotations is a matter of geometry, so it is found on the unit rows
  const Condensed unit = condense(dense_rows(all.beams, num_freedoms, true), num_displacements, -1, false);
  Condensed beams =
      condense(dense_rows(all.beams, num_freedoms, false), num_displacements, unit.rank, with_recovery);
  factor.rows = stack(factor.rows, beams.rows);
  factor.unit_rows = stack(factor.unit_rows, unit.rows);
  factor.recovery = std::move(beams.recovery);
  return factor;
}

}  // namespace freeflex
