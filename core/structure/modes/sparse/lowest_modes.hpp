// Finds the lowest normal modes of a large structure by slices of the spectrum, with a Sturm count for each
// slice.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "core/structure/modes/sparse/block_lanczos.hpp"
#include "core/structure/modes/sparse/sparse_modes.hpp"
#include "core/structure/modes/sparse/sparse_system.hpp"

namespace freeflex {

/// [-] frequencies within this relative distance are treated as equal, so either all or none of their modes
/// are kept.
inline constexpr double kTogether = 1e-6;

/// Spectral slicing by shift-and-invert with ascending shifts (R. G. Grimes, J. G. Lewis, H. D. Simon, SIAM
/// J. Matrix Anal. Appl. 15, 1994, 228-272). The inertia of each factor verifies the number of modes below
/// its shift (THEORY 16.36 to 16.42).
class LowestModes {
 public:
  LowestModes(const Scene& scene, const SparseSystem& system, const SetupProgress& progress, Faults& faults);
  /// Finds the modes. Returns false if a fault was added.
  bool find(const ModesWanted& wanted);
  /// Returns the natural frequencies, ascending, including mechanisms [rad/s].
  const Eigen::VectorXd& omega() const { return omega_; }
  /// Returns the m-orthonormal modes (num_all x count) and releases their memory in this object.
  Eigen::MatrixXd take_shapes();
  /// Returns the frequency [rad/s] below which a Sturm count verified the number of modes.
  double verified_below() const { return counted_below_; }
  /// Returns the approximate frequency of the first mode that is not kept [rad/s].
  double next_omega() const { return next_; }
  /// Returns the inverse at the lowest shift. Returns nullptr if a fault was added.
  ShiftedInverse* lowest_inverse();

 private:
  bool fail(const std::string& message);
  bool report(const std::string& what, double done);
  bool fits(Eigen::Index columns);
  double num_particles() const;
  bool factor_at(double sigma);
  bool choose_shift();
  bool fail_with_mechanisms();
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
  MassSymmetric op_;  // op_.known contains rigid motions, then the modes found so far
  std::unique_ptr<ShiftedInverse> inverse_;
  bool is_factored_ = false;                            // inverse_ holds a factor for its shift
  std::vector<int> assembled_order_, augmented_order_;  // orderings of the factors, found once
  // [rad^2/s^2] change of omega^2 due to rounding of the entries of an assembled K
  double rounding_ = 0.0;
  double lowest_sigma_ = 0.0;  // [rad^2/s^2]
  double factor_MB_ = 0.0, wanted_MB_ = 0.0;
  double stiffest_ = 0.0;             // [rad^2/s^2] estimate of the highest omega^2
  int refinements_ = 0;               // largest number of refinements of a solution
  int count_ = 0;                     // number of requested modes, before modes of equal frequency are added
  bool is_complete_ = false;          // true: all modes of the structure are found
  Eigen::VectorXd found_omega_;       // [rad/s] frequencies in the order in which modes were found
  std::vector<Eigen::Index> sorted_;  // indices into found_omega_, ascending by frequency
  Eigen::VectorXd omega_;             // [rad/s] ascending
  Eigen::Index keep_ = 0;
  double next_ = 0.0, counted_below_ = 0.0;
  double asked_below_ = 0.0;  // [rad/s] requested frequency limit; 0: no frequency limit
};

}  // namespace freeflex
