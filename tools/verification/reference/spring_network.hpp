// The full system of a scene as plain arrays, in axes that do not rotate. The methods with which freeflex is
// compared run on these arrays. The equations are those of CartesianSystem, but the data are arranged for
// speed (THEORY 13.1, 13.7).
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
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
/// They are in world axes, relative to an origin that falls freely. At the start this origin has the position
/// and the velocity of the centre of mass.
class SpringNetwork {
 public:
  /// Makes the arrays of a system. Returns nullopt and sets `error` for an attractor and for links that
  /// dissipate, because the methods that run on these arrays do not support them.
  static std::optional<SpringNetwork> make(const CartesianSystem& system, std::string& error);

  /// Chooses the loads of a smooth piece [start, end] [s]. This function must be called before the first
  /// `forces`.
  void begin_piece(double start, double end);

  /// Computes the forces [N] on the points at time t [s] of the piece, in one pass over the springs
  /// (THEORY 13.1):
  ///   F_i += (D - D L / l) d,   F_j -= (D - D L / l) d,   d = x_j - x_i,   l = |d|
  /// \param f (3N), overwritten
  void forces(double t, const double* x, double* f) const;

  /// Computes the forces of two motions at once, each motion at its own time. The pass costs little more than
  /// a pass for one motion.
  void forces(Pair t, const Pair* x, Pair* f);

  /// Makes the pattern of the Jacobian of (v, M^-1 forces).
  SparsePattern make_pattern();
  /// Computes the values of the Jacobian at x, with loads taken as independent of x. The tangent of a spring
  /// is (THEORY 13.7):
  ///   d((D - D L / l) d) / dd = D (1 - L / l) 1 + (D L / l^3) d d^T
  void jacobian(const double* x, std::span<double> values) const;

  /// Writes the positions and velocities at the start (3N each).
  void initial(std::span<double> x, std::span<double> v) const;
  /// Writes the world state into `state`, which keeps its storage.
  void to_world(double t, std::span<const double> x, std::span<const double> v, CartesianState& state) const;

  const CartesianSystem& system() const { return *system_; }
  std::size_t size() const { return inverse_mass_.size(); }  // 3N
  // [1/kg] (3N), three equal values for a point
  const std::vector<double>& inverse_mass() const { return inverse_mass_; }
  std::size_t memory() const;  // [bytes] memory that `forces` reads

 private:
  struct End {
    std::int32_t first, second;  // index of the x component
  };
  template <typename Number>
  void add_springs(const Number* x, Number* f) const;
  void add_varying(double t, const double* x, double* f) const;

  const CartesianSystem* system_ = nullptr;
  std::vector<End> ends_;
  std::vector<double> stiffness_, stiffness_length_;  // [N/m], [N] stiffness times rest length
  std::vector<double> inverse_mass_;
  std::vector<double> constant_;               // [N] (3N) loads that are constant over the piece
  std::vector<const CartesianLoad*> varying_;  // the other loads
  double piece_time_ = 0.0;                    // [s] a time inside the piece
  std::vector<double> x_one_, f_one_;          // one motion of a pair, for varying loads
  // for each spring, the index in the values of the Jacobian of the first entry of its four 3 x 3 blocks. The
  // blocks (row point, column point) are (first, first), (second, first), (first, second), (second, second).
  // The next column of a block begins column_sizes_ entries later
  std::vector<std::array<std::int64_t, 4>> blocks_;
  std::vector<std::int64_t> column_sizes_;  // entries in each of the three columns of a point
  std::int64_t velocity_columns_ = 0;       // index of the first value in the columns of velocities
};

}  // namespace freeflex
