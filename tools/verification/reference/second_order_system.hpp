// The equations x'' = M^-1 F(t, x, x') on which the hand-written and the packaged methods run, in axes that
// do not rotate.
#pragma once

#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "tools/verification/reference/cartesian.hpp"

namespace freeflex {

/// Two numbers that the processor handles in one instruction.
using Pair = double __attribute__((vector_size(16)));

/// The pattern of nonzero entries of the Jacobian of (x, v)', stored by columns. Every diagonal entry is
/// present.
struct SparsePattern {
  std::vector<std::int64_t> column_starts;  // (6N + 1)
  std::vector<std::int64_t> rows;           // row of each stored entry, ascending in a column
};

/// Positions x [m] and velocities v [m/s] are stored in one array each, with three numbers for each point.
class SecondOrderSystem {
 public:
  virtual ~SecondOrderSystem() = default;

  /// Chooses the loads of a smooth piece [start, end] [s]. This function must be called before the first
  /// `forces`.
  virtual void begin_piece(double start, double end) = 0;
  /// Sets the error of displacements [m] that iterations within the forces may cause.
  virtual void set_accuracy(double) {}

  /// Returns whether the forces depend on v.
  virtual bool depends_on_velocities() const = 0;
  /// Computes the forces [N] on the points at time t [s] of the piece.  \param f (3N), overwritten
  virtual void forces(double t, const double* x, const double* v, double* f) = 0;
  /// Computes the forces of two motions at once, each motion at its own time.
  /// \pre the forces do not depend on v
  virtual void forces(Pair t, const Pair* x, Pair* f) = 0;

  /// Makes the pattern of the Jacobian of (v, M^-1 forces).
  virtual SparsePattern make_pattern() = 0;
  /// Computes the values of the Jacobian, with loads taken as independent of x.
  virtual void jacobian(const double* x, const double* v, std::span<double> values) = 0;

  /// Writes the positions and velocities at the start (3N each).
  virtual void initial(std::span<double> x, std::span<double> v) const = 0;
  /// Writes the world state into `state`, which keeps its storage.
  virtual void to_world(double t, std::span<const double> x, std::span<const double> v,
                        CartesianState& state) const = 0;

  virtual const CartesianSystem& system() const = 0;
  virtual std::size_t memory() const = 0;  // [bytes] memory that `forces` reads

  std::size_t size() const { return inverse_mass_.size(); }  // 3N
  // [1/kg] (3N), three equal values for a point
  const std::vector<double>& inverse_mass() const { return inverse_mass_; }

 protected:
  explicit SecondOrderSystem(const CartesianSystem& system) {
    for (const double mass : system.mass) inverse_mass_.insert(inverse_mass_.end(), 3, 1.0 / mass);
  }
  explicit SecondOrderSystem(std::vector<double> inverse_mass) : inverse_mass_(std::move(inverse_mass)) {}

 private:
  std::vector<double> inverse_mass_;
};

}  // namespace freeflex
