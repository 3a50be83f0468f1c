// The lowest normal modes of a large structure, slice by slice of the spectrum, each counted.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "core/structure/block_lanczos.hpp"
#include "core/structure/sparse_modes.hpp"
#include "core/structure/sparse_system.hpp"

namespace freeflex {

/// [-] frequencies this close are one pair: both are kept, or none.
inline constexpr double kTogether = 1e-6;

/// Spectral slicing by shift and invert (R. G. Grimes, J. G. Lewis, H. D. Simon, SIAM J. Matrix Anal. Appl.
/// 15, 1994, 228-272): shifts rise, and of each factor the inertia tells how many modes are below.
/// (THEORY X171 to X175, X179)
class LowestModes {
 public:
  LowestModes(const Scene& scene, const SparseSystem& system, const SetupProgress& progress, Faults& faults);
  /// false: a fault was added.
  bool find(const ModesWanted& wanted);
  /// [rad/s] rising, mechanisms among the lowest.
  const Eigen::VectorXd& omega() const { return omega_; }
  /// M-orthonormal, a column each (num_all x count); they are given away.
  Eigen::MatrixXd take_shapes();
  /// [rad/s] inertia counted there.
  double counted_below() const { return counted_below_; }
  /// [rad/s] of the first mode that is not kept, about.
  double next_omega() const { return next_; }
  /// The first of the shifts; nullptr: a fault was added.
  ShiftedInverse* lowest_inverse();

 private:
  bool fail(const std::string& message);
  bool say(const std::string& what, double done);
  bool fits(Eigen::Index columns);
  double num_particles() const;
  bool factor_at(double sigma);
  bool choose_shift();
  bool too_loose();
  std::optional<int> count_below(double omega);
  bool choose_count(const ModesWanted& wanted);
  bool find_slices();
  std::optional<int> move_up(double spacing);
  bool run_lanczos(Eigen::Index below, Eigen::Index most);
  std::optional<Eigen::MatrixXd> find_vectors(Eigen::Index below, Eigen::Index most);
  bool take(Eigen::MatrixXd vectors);
  bool smooth(Eigen::MatrixXd& vectors, const std::vector<Eigen::Index>& rough);
  double frequency(const Eigen::MatrixXd& x) const;
  void sort();
  bool cut();
  int count_missing();
  Eigen::Index num_found() const { return op_.known.size() - system_.rigid.cols(); }

  const Scene& scene_;
  const SparseSystem& system_;
  const SetupProgress& progress_;
  Faults& faults_;
  MassSymmetric op_;  // known: rigid motions, then the modes found
  std::unique_ptr<ShiftedInverse> inverse_;
  std::vector<int> assembled_order_, augmented_order_;  // of factors, found once
  double rounding_ = 0.0;      // [rad^2/s^2] of squares of frequencies, by entries of an assembled K
  double lowest_sigma_ = 0.0;  // [rad^2/s^2]
  double factor_MB_ = 0.0, wanted_MB_ = 0.0;
  double stiffest_ = 0.0;             // [rad^2/s^2] about the highest
  int refinements_ = 0;               // at most, of a solution
  int count_ = 0;                     // modes wanted, before pairs are kept whole
  bool is_complete_ = false;          // there are no more
  Eigen::VectorXd found_omega_;       // of the modes in the order in which they were found
  std::vector<Eigen::Index> sorted_;  // of which these rise
  Eigen::VectorXd omega_;             // rising
  Eigen::Index keep_ = 0;
  double next_ = 0.0, counted_below_ = 0.0;
  double asked_below_ = 0.0;  // [rad/s] where modes wanted were counted; 0: by number
};

}  // namespace freeflex
