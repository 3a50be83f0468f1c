// The mass metric: y = L^T x with M = L L^T, so that a motion's kinetic energy is that of a unit mass in y.
#pragma once

#include <vector>

#include "core/scene/scene.hpp"
#include "core/structure/decompositions.hpp"

namespace freeflex {

/// A factor of the mass matrix, heavy freedoms first   (THEORY X51, X163).
class RootMass {
 public:
  /// M = diag(m): L = sqrt(m).
  explicit RootMass(const std::vector<PointMass>& points);
  /// M = N^T N, N P = O R with columns pivoted, L^T = R P^T.
  /// \param rows  [sqrt(kg)] (num_rows x n) N, of full column rank
  explicit RootMass(Eigen::MatrixXd rows);

  Eigen::Index size() const { return static_cast<Eigen::Index>(order_.size()); }
  /// y of motions, a column each [sqrt(kg)] (n x count).
  Eigen::MatrixXd weigh(const Eigen::MatrixXd& motions) const;
  /// Rows over y of rows over motions, rows L^-T (num_rows x n).
  Eigen::MatrixXd weigh_rows(const Eigen::MatrixXd& rows) const;
  /// Motions of y, L^-T y (n x count).
  Eigen::MatrixXd motions(const Eigen::MatrixXd& y) const;

 private:
  std::vector<int> order_;     // of y: which freedom
  Eigen::VectorXd root_mass_;  // [sqrt(kg)] (n) in that order; empty where R is not
  Eigen::MatrixXd R_;          // [sqrt(kg)] (n x n) upper triangular, over freedoms in that order
};

}  // namespace freeflex
