// The fourth-order terms of the strain energy, for the modes whose error is integrated   (THEORY X146).
#pragma once

#include <Eigen/Core>
#include <vector>

#include "core/structure/prestress/prestress.hpp"

namespace freeflex {

struct Structure;

/// The sum of D_k h_k h_k^T over deformations k. The vector h_k contains the second derivatives of
/// deformation k along pairs of modes (THEORY X140).
class SquareSums {
 public:
  /// \param columns  columns of h to use; empty: no sum
  explicit SquareSums(std::vector<int> columns);
  /// Adds some deformations.  \param h  (deformations x pairs)  \param D  (deformations) stiffness
  void add(const Eigen::MatrixXd& h, const Eigen::VectorXd& D);
  /// Returns the sum (columns x columns), both triangles.
  Eigen::MatrixXd finish();

 private:
  static constexpr Eigen::Index kAtOnce = 512;
  void flush();
  std::vector<int> columns_;
  Eigen::MatrixXd scaled_, sum_;  // (columns x kAtOnce), (columns x columns) lower triangle
  Eigen::Index count_ = 0;
};

/// Returns the indices into Prestress::pairs of those pairs for which the errors of both modes are
/// integrated.
std::vector<int> shadowed_pairs(const Prestress& prestress);

/// Returns the matrices H_r of the forms, stacked in rows: V_4 = 1/8 sum_r (x^T H_r x)^2   (THEORY X146)
/// [sqrt(N)/m^2] ((forms s) x s), where s is the number of modes whose error is integrated. At most twelve
/// forms are kept. The smallest forms are omitted as long as their sum is at most a hundredth of the total.
/// \param squares  sum from SquareSums over shadowed_pairs()  \param rows  Prestress::rows or bent_rows
Eigen::MatrixXd quartic_forms(const Structure& structure, const Prestress& prestress, Eigen::MatrixXd squares,
                              const Eigen::MatrixXd& rows);

/// Transforms the forms for new modes b <- b rotation, which replace the modes from `first` on.
void rotate_quartic_forms(const Eigen::MatrixXd& rotation, int first, Eigen::MatrixXd& forms);

}  // namespace freeflex
