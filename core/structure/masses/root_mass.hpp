// The mass metric uses the coordinates y = L^T x, where the mass matrix is m = L L^T. The kinetic energy is
// then |y'|^2 / 2.
#pragma once

#include <vector>

#include "core/scene/scene.hpp"
#include "core/structure/modes/dense/decompositions.hpp"

namespace freeflex {

/// A factor of the mass matrix, with heavy freedoms first   (THEORY 4.7, 16.8).
class RootMass {
 public:
  /// Takes point masses: m = diag(m_i), L = sqrt(m).
  explicit RootMass(const std::vector<PointMass>& points);
  /// Takes mass rows A_m: m = A_m^T A_m, A_m P_m = O R_m with columns pivoted, L^T = R_m P_m^T
  /// (THEORY 16.8).
  /// \param rows  [sqrt(kg)] (num_rows x n) A_m, of full column rank
  explicit RootMass(Eigen::MatrixXd rows);

  Eigen::Index size() const { return static_cast<Eigen::Index>(order_.size()); }
  /// Returns y = L^T x of motions x, one in each column [sqrt(kg)] (n x count).
  Eigen::MatrixXd weigh(const Eigen::MatrixXd& motions) const;
  /// Returns rows L^-T, which act on y, for rows that act on motions (num_rows x n).
  Eigen::MatrixXd weigh_rows(const Eigen::MatrixXd& rows) const;
  /// Returns motions L^-T y (n x count).
  Eigen::MatrixXd motions(const Eigen::MatrixXd& y) const;

 private:
  std::vector<int> order_;     // freedom of each component of y
  Eigen::VectorXd root_mass_;  // [sqrt(kg)] (n) in the order of order_; empty if R_ is used
  Eigen::MatrixXd R_;          // R_m, [sqrt(kg)] (n x n) upper triangular, freedoms in the order of order_
};

}  // namespace freeflex
