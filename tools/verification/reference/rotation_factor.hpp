// The sparse factor of the joints' stiffness, with which Newton's method finds the rotations of joints
// (THEORY 13.19).
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <memory>
#include <span>
#include <utility>
#include <vector>

namespace freeflex {

/// Factors the stiffness of rotations, bordered by the rotations that strain no link   (THEORY 13.19):
///   [K N; N^T 0] [x; lambda] = [right; wanted]
/// Every column of K contains only rotations that share a link.
class RotationFactor {
 public:
  RotationFactor();
  /// \param pairs  (row, column) of each entry of K that may be nonzero; may repeat
  /// \param idle  N (num_rotations x k)
  RotationFactor(std::vector<std::pair<int, int>> pairs, const Eigen::MatrixXd& idle);
  // a copy has the same matrix and a factor of its own
  RotationFactor(const RotationFactor& other);
  RotationFactor& operator=(const RotationFactor& other);
  RotationFactor(RotationFactor&&) noexcept;
  RotationFactor& operator=(RotationFactor&&) noexcept;
  ~RotationFactor();

  /// Factors diag(scale)^-1 K diag(scale)^-1 with its border. If the matrix is singular, the solutions are
  /// not finite.
  void compute(const Eigen::MatrixXd& K, const Eigen::VectorXd& scale);
  /// Replaces the right side (num_rotations + k) by the solution. Allocates nothing.
  void solve(std::span<double> right) const;

 private:
  struct Klu;
  void factor();

  int size_ = 0, num_rotations_ = 0;
  std::vector<std::int32_t> column_starts_, rows_;
  std::vector<double> values_;
  std::unique_ptr<Klu> klu_;  // null until compute() is called
};

}  // namespace freeflex
