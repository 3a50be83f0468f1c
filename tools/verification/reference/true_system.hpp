// A system at true geometry as the equations on which the methods run with which freeflex is compared
// (THEORY 13.20, 13.21).
#pragma once

#include "tools/verification/reference/second_order_system.hpp"

namespace freeflex {

/// Positions x are the displacements e (10.1) in a carrier that does not rotate, and velocities v are their
/// rates. The accelerations are those of `accelerations`, so they share no code with the step.
class TrueSystem : public SecondOrderSystem {
 public:
  explicit TrueSystem(const CartesianSystem& system);

  void begin_piece(double start, double end) override;
  void set_accuracy(double displacement) override;
  bool depends_on_velocities() const override { return depends_on_velocities_; }
  void forces(double t, const double* x, const double* v, double* f) override;
  void forces(Pair t, const Pair* x, Pair* f) override;

  /// The rotations of joints couple all points, so the blocks of forces are full.
  SparsePattern make_pattern() override;
  /// Differences of forces   (THEORY 13.21).
  void jacobian(const double* x, const double* v, std::span<double> values) override;

  void initial(std::span<double> x, std::span<double> v) const override;
  void to_world(double t, std::span<const double> x, std::span<const double> v,
                CartesianState& state) const override;

  const CartesianSystem& system() const override { return systems_[0]; }
  std::size_t memory() const override;

 private:
  void forces_of(CartesianSystem& system, double t, const double* x, const double* v, double* f) const;

  // one system for each motion of a pair, because Newton's method starts from the rotations of joints that it
  // found last
  std::array<CartesianSystem, 2> systems_;
  bool depends_on_velocities_ = false;
  double piece_time_ = 0.0;             // [s] a time inside the piece
  double size_ = 0.0, velocity_ = 0.0;  // [m] largest distance from the centre; [m/s] scale of velocities
  std::vector<double> x_one_, v_one_, f_one_, f_before_;  // one motion
};

}  // namespace freeflex
