// A large structure in sparse form. The rows of links and constraints and the mass matrix are over all
// freedoms.
#pragma once

#include <Eigen/SparseCore>

#include "core/structure/links/link_factor.hpp"
#include "core/structure/modes/sparse/mumps.hpp"
#include "core/structure/modes/sparse/narrow_products.hpp"

namespace freeflex {

using SparseRows = Eigen::SparseMatrix<double, Eigen::RowMajor>;

/// The sparse rows of a structure. Their unknowns are the displacements of all points and the rotations of
/// joints, y = (V, length * theta) (THEORY 16.6).
struct SparseSystem {
  int num_displacements = 0;
  double length = 1.0;     // [m] factor of rotations
  SparseRows rows;         // A, [sqrt(N/m)] (num_rows x num_all)
  SparseRows unit_rows;    // B, [-]
  SparseRows constraints;  // C, [-] independent unit rows
  SparseRows mass;         // m, [kg] (num_all x num_all), semidefinite
  Eigen::MatrixXd rigid;   // rigid motions with mass, m-orthonormal (num_all x 3..6)
  // (num_all) 1: the freedom is fixed at zero, because neither mass nor a link acts on it   (THEORY 16.45)
  std::vector<char> pinned;

  int num_all() const { return static_cast<int>(rows.cols()); }
};

/// Returns the sparse form of a structure. The function adds an error if links do not hold a massless point
/// in every direction. It also adds an error if all mass is on one line and points outside this line can
/// rotate freely about it.
SparseSystem sparse_system(const Scene& scene, const Freedoms& freedoms, const LinkFactor& factor,
                           const MassProperties& body, Faults& faults);

/// The layout in which K + shift m is factorized.
enum class SystemForm {
  // (K + shift m, C^T; C, 0) over freedoms and multipliers. This matrix is small, but K is rounded
  // (THEORY 16.34)
  kAssembled,
  // (-1, A, 0; A^T, shift m, C^T; 0, C, 0) over strains, freedoms and multipliers. This matrix is larger, but
  // K is not formed (THEORY 16.33)
  kAugmented,
};

/// Returns the entries of the matrix.  \param shift  [rad^2/s^2] of either sign
SymmetricEntries entries_of(const SparseSystem& system, double shift, SystemForm form);

/// Returns the number of negative eigenvalues at a positive shift, n_c + n_A   (THEORY 16.40).
int num_negative_rows(const SparseSystem& system, SystemForm form);

/// The shifted inverse y = (K + shift m)^-1 m x, restricted to the motions that rigid links allow
/// (THEORY 16.33 to 16.35).
class ShiftedInverse {
 public:
  ShiftedInverse(const SparseSystem& system, double shift, SystemForm form,
                 const std::vector<int>& order = {}, const ShareWork& share = {});
  std::vector<int> order() const { return factor_.order(); }
  /// Changes the shift [rad^2/s^2]; factor() must follow.
  void set_shift(double shift);
  /// Returns the expected memory of the factor [MB].
  double expected_MB() const { return factor_.expected_MB(); }
  bool factor();
  /// Returns the number of modes below sqrt(-shift), including rigid motions   (THEORY 16.40).
  int num_below() const { return factor_.num_negative() - num_negative_rows(system_, form_); }
  /// Returns the solutions, one in each column, after at most `most_refinements` refinements. On failure the
  /// result has no columns (THEORY 16.35).
  Eigen::MatrixXd apply(const Eigen::MatrixXd& mass_times_x, int most_refinements = 3);
  /// Returns the relative size [-] of the first correction in the refinement, for random columns; 1 on
  /// failure (THEORY 16.36).
  double first_change();
  double shift() const { return shift_; }
  SystemForm form() const { return form_; }
  const std::string& problem() const { return factor_.problem(); }

 private:
  // returns the right-hand sides minus the matrix times a solution, with sums in long double
  Eigen::MatrixXd residual(const Eigen::MatrixXd& sides, const Eigen::MatrixXd& solution) const;
  // returns the largest ratio [-] of the norm of a column of `change` to the norm of the same column of
  // `solution`, over freedoms only
  double relative(const Eigen::MatrixXd& change, const Eigen::MatrixXd& solution) const;
  const SparseSystem& system_;
  double shift_;
  SystemForm form_;
  Eigen::Index first_;  // row of the first freedom, after the strains
  Mumps factor_;
  ShareWork share_;
  SparseRows rows_by_freedom_, constraints_by_freedom_;  // A^T, C^T
};

/// Returns x^T y of the first `count` columns of x, by BLAS.
Eigen::MatrixXd products(const Eigen::MatrixXd& x, Eigen::Index count, const Eigen::MatrixXd& y);
/// Subtracts the first `count` columns of x times h from y, by BLAS.
void subtract(const Eigen::MatrixXd& x, Eigen::Index count, const Eigen::MatrixXd& h, Eigen::MatrixXd& y);

/// Returns rows times columns. Each sum is computed in long double and rounded once.
Eigen::MatrixXd exact_product(const SparseRows& rows, const Eigen::MatrixXd& columns);
/// Returns the product of `count` rows, from `begin` on, and some of the columns. Each sum is computed in
/// long double and rounded once.
Eigen::MatrixXd exact_product(const SparseRows& rows, Eigen::Index begin, Eigen::Index count,
                              const Eigen::MatrixXd& columns, const std::vector<Eigen::Index>& some);

}  // namespace freeflex
