// Factors of sparse symmetric indefinite matrices by MUMPS, with pivoting and the number of negative
// eigenvalues.
#pragma once

#include <Eigen/Core>
#include <memory>
#include <string>
#include <vector>

namespace freeflex {

/// The lower triangle of a symmetric matrix. Entries with the same row and column are added.
struct SymmetricEntries {
  int size = 0;
  std::vector<int> rows, columns;  // numbered from 1, as MUMPS requires
  std::vector<double> values;

  void add(int row, int column, double value) {
    rows.push_back(std::max(row, column) + 1);
    columns.push_back(std::min(row, column) + 1);
    values.push_back(value);
  }
};

/// The factorization L D L^T with pivoting (P. R. Amestoy, I. S. Duff, J. Koster, J.-Y. L'Excellent, SIAM J.
/// Matrix Anal. Appl. 23, 2001, 15-41; MUMPS 5.5 users' guide). MUMPS runs in one thread, with one instance
/// for each matrix.
class Mumps {
 public:
  /// Takes the matrix and computes an ordering.
  /// \param order  ordering of a matrix with the same sparsity; empty: an ordering is computed
  explicit Mumps(SymmetricEntries entries, const std::vector<int>& order = {});
  ~Mumps();
  Mumps(const Mumps&) = delete;
  Mumps& operator=(const Mumps&) = delete;

  /// Returns the ordering, for matrices with the same sparsity.
  std::vector<int> order() const;
  /// Returns the memory [MB] that the ordering predicts for the factorization.
  double expected_MB() const;
  /// Replaces the values of the entries, for another matrix with the same entries in the same order. The
  /// ordering is kept.
  void change_values(const std::vector<double>& values);
  /// Factors the matrix, with more memory if the first estimate was too small. Returns false on failure.
  /// \param null_threshold  > 0: pivots below null_threshold times the norm of the matrix are treated as zero
  /// and removed
  bool factor(double null_threshold = 0.0);
  /// Overwrites right-hand sides, one in each column, with the solutions. Returns false on failure.  \pre
  /// factor()
  bool solve(Eigen::Ref<Eigen::MatrixXd> sides);
  /// Returns the number of negative eigenvalues, by Sylvester's law of inertia.  \pre factor()
  int num_negative() const;
  /// Returns the number of pivots that factor() removed.  \pre factor(threshold > 0)
  int num_null() const;
  /// Returns the description of a failure. The text is empty if nothing failed.
  const std::string& problem() const { return problem_; }

 private:
  bool call(int job);
  void report_lack_of_memory(const char* what);
  struct Instance;
  std::unique_ptr<Instance> instance_;
  SymmetricEntries entries_;
  std::vector<int> given_order_;
  std::string problem_;
  bool is_started_ = false;
};

}  // namespace freeflex
