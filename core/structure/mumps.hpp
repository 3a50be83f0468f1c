// Sparse symmetric indefinite matrices factored by MUMPS, which pivots and counts negative eigenvalues.
#pragma once

#include <Eigen/Core>
#include <memory>
#include <string>
#include <vector>

namespace freeflex {

/// The lower triangle of a symmetric matrix; entries in one place add up.
struct SymmetricEntries {
  int size = 0;
  std::vector<int> rows, columns;  // from 1, as MUMPS counts
  std::vector<double> values;

  void add(int row, int column, double value) {
    rows.push_back(std::max(row, column) + 1);
    columns.push_back(std::min(row, column) + 1);
    values.push_back(value);
  }
};

/// L D L^T with pivoting (P. R. Amestoy, I. S. Duff, J. Koster, J.-Y. L'Excellent, SIAM J. Matrix Anal. Appl.
/// 23, 2001, 15-41; MUMPS 5.5 users' guide). One thread, one instance a matrix.
class Mumps {
 public:
  /// Takes the matrix over and orders it.
  /// \param order  of another matrix with entries in the same places; empty: found here
  explicit Mumps(SymmetricEntries entries, const std::vector<int>& order = {});
  ~Mumps();
  Mumps(const Mumps&) = delete;
  Mumps& operator=(const Mumps&) = delete;

  /// The order that was found, for others.
  std::vector<int> order() const;
  /// [MB] that the factorization is expected to take, of the ordering.
  double expected_MB() const;
  /// Factors the matrix, with more room where the first estimate was short.
  /// \param null_threshold  > 0: pivots below this times the norm are counted as zero and taken out
  bool factor(double null_threshold = 0.0);
  /// Overwrites right sides, a column each, with solutions.  \pre factor()
  bool solve(Eigen::Ref<Eigen::MatrixXd> sides);
  /// Negative eigenvalues, by Sylvester's law of inertia.  \pre factor()
  int num_negative() const;
  /// Pivots that factor() took out.  \pre factor(threshold > 0)
  int num_null() const;
  /// What went wrong, by MUMPS' own number; empty: nothing.
  const std::string& problem() const { return problem_; }

 private:
  bool call(int job);
  void say_lack(const char* what);
  struct Instance;
  std::unique_ptr<Instance> instance_;
  SymmetricEntries entries_;
  std::vector<int> given_order_;
  std::string problem_;
  bool is_started_ = false;
};

}  // namespace freeflex
