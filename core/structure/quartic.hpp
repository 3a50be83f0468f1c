// Fourth order of the strain energy among the modes whose error is integrated.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "core/structure/prestress.hpp"

namespace freeflex {

struct Structure;

/// sum_k D_k h_k h_k^T over deformations, h_k of X140 along pairs of modes, many at once.
class SquareSums {
 public:
  /// \param columns  of h, the pairs wanted; none: nothing is summed
  explicit SquareSums(std::vector<int> columns);
  /// \param h  (deformations x pairs)  \param D  their stiffness
  void add(const Eigen::MatrixXd& h, const Eigen::VectorXd& D);
  /// (columns x columns), both triangles.
  Eigen::MatrixXd finish();

 private:
  static constexpr Eigen::Index kAtOnce = 512;
  void flush();
  std::vector<int> columns_;
  Eigen::MatrixXd scaled_, sum_;  // (columns x up to kAtOnce), lower triangle
  Eigen::Index count_ = 0;
};

/// Places of the pairs of the modes whose error is integrated.
std::vector<int> shadowed_pairs(const Prestress& prestress);

/// H_r of X146, one below the other: V_4 = 1/8 sum_r (x^T H_r x)^2, [sqrt(N)/m^2] ((forms s) x s), s modes
/// whose error is integrated. Forms below a hundredth of the sum are left out, and all beyond the twelfth.
/// \param squares  of SquareSums over shadowed_pairs  \param rows  of Prestress
Eigen::MatrixXd quartic_forms(const Structure& structure, const Prestress& prestress, Eigen::MatrixXd squares,
                              const Eigen::MatrixXd& rows);

/// The same when the modes from `first` on are replaced by others of their space, b <- b turn.
void turn_quartic_forms(const Eigen::MatrixXd& turn, int first, Eigen::MatrixXd& forms);

}  // namespace freeflex
