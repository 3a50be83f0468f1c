// A large structure over all its freedoms, sparse: rows of strain, of mass and of what rigid links forbid.
#pragma once

#include <Eigen/SparseCore>

#include "core/structure/link_factor.hpp"
#include "core/structure/mumps.hpp"

namespace freeflex {

using SparseRows = Eigen::SparseMatrix<double, Eigen::RowMajor>;

/// Displacements of all points and rotations of joints, y = (V, length * theta)   (THEORY X162, X170).
struct SparseSystem {
  int num_displacements = 0;
  double length = 1.0;       // [m] that rotations are multiplied by
  SparseRows rows;           // A, [sqrt(N/m)] (num_rows x num_all)
  SparseRows unit_rows;      // B, [-]
  SparseRows constraints;    // C, [-] independent unit rows
  SparseRows mass;           // M, [kg] (num_all x num_all), semidefinite
  Eigen::MatrixXd rigid;     // rigid motions that have mass, M-orthonormal (num_all x 3..6)
  std::vector<char> pinned;  // (num_all) freedoms that nothing acts on, taken as zero

  int num_all() const { return static_cast<int>(rows.cols()); }
};

/// Errors: massless points that links do not hold, points beside a line of mass that turn without inertia.
SparseSystem sparse_system(const Scene& scene, const Freedoms& freedoms, const LinkFactor& factor,
                           const MassProperties& body, Faults& faults);

/// How K + shift M is laid out for a factorization   (THEORY X170).
enum class SystemForm {
  kAssembled,  // [K + shift M, C^T; C 0] over freedoms, multipliers: small, and K is rounded
  kAugmented,  // [-1 A 0; A^T shift M C^T; 0 C 0] over strains, freedoms, multipliers: no K is formed
};

/// \param shift  [rad^2/s^2] of either sign
SymmetricEntries entries_of(const SparseSystem& system, double shift, SystemForm form);

/// Negative eigenvalues of it that are not those of any positive shift.
int num_negative_rows(const SparseSystem& system, SystemForm form);

/// y = (K + shift M)^-1 M x within what rigid links allow   (THEORY X171).
class ShiftedInverse {
 public:
  ShiftedInverse(const SparseSystem& system, double shift, SystemForm form,
                 const std::vector<int>& order = {});
  std::vector<int> order() const { return factor_.order(); }
  /// [MB] that factoring takes.
  double expected_MB() const { return factor_.expected_MB(); }
  bool factor();
  /// Modes below the root of -shift, rigid motions among them   (THEORY X174).
  int num_below() const { return factor_.num_negative() - num_negative_rows(system_, form_); }
  /// A column each, refined by residuals of the rows A until the next correction would be below kSolved [-],
  /// at most so many times.
  Eigen::MatrixXd apply(const Eigen::MatrixXd& mass_times_x, int most_refinements = 3);
  /// [-] of the solution: what one refinement changes of random columns.
  double first_change();
  double shift() const { return shift_; }
  const std::string& problem() const { return factor_.problem(); }

 private:
  // right side less the matrix times a solution, sums in long double
  Eigen::MatrixXd residual(const Eigen::MatrixXd& sides, const Eigen::MatrixXd& solution) const;
  // [-] largest of columns' changes over sizes, of the freedoms
  double relative(const Eigen::MatrixXd& change, const Eigen::MatrixXd& solution) const;
  const SparseSystem& system_;
  double shift_;
  SystemForm form_;
  Eigen::Index first_;  // row of the first freedom: strains are before
  Mumps factor_;
  SparseRows rows_by_freedom_, constraints_by_freedom_;  // A^T, C^T
};

/// M-inner products x^T M y of columns, by blas.
Eigen::MatrixXd products(const Eigen::MatrixXd& x, Eigen::Index count, const Eigen::MatrixXd& y);
/// y -= x(:, first count) h.
void subtract(const Eigen::MatrixXd& x, Eigen::Index count, const Eigen::MatrixXd& h, Eigen::MatrixXd& y);

/// Rows times columns, each sum in long double and rounded once.
Eigen::MatrixXd exact_product(const SparseRows& rows, const Eigen::MatrixXd& columns);
/// `count` rows from `begin` on, times some of the columns.
Eigen::MatrixXd exact_product(const SparseRows& rows, Eigen::Index begin, Eigen::Index count,
                              const Eigen::MatrixXd& columns, const std::vector<Eigen::Index>& some);

}  // namespace freeflex
