// The full system of a scene as plain arrays in axes that do not turn: what the methods that freeflex is
// compared with run on. Same physics as CartesianSystem, arranged for speed   (THEORY X110).
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "core/reference/cartesian.hpp"

namespace freeflex {

/// Two numbers side by side, on which the processor works at once.
using Pair = double __attribute__((vector_size(16)));

/// Jacobian of (x, v)' by columns; every diagonal entry is present.
struct SparsePattern {
  std::vector<std::int64_t> column_starts;  // (6N + 1)
  std::vector<std::int64_t> rows;           // of each stored entry, ascending in a column
};

/// Positions x [m] and velocities v [m/s], three numbers a point in one array each, in world axes less the
/// fall and the initial velocity of the centre of mass.
class SpringNetwork {
 public:
  /// nullopt and `error` for an attractor or for links that dissipate, which these methods do not have.
  static std::optional<SpringNetwork> make(const CartesianSystem& system, std::string& error);

  /// Chooses the loads of a smooth piece [start, end] [s]. \pre before the first `forces`
  void begin_piece(double start, double end);

  /// Forces [N] on the points at time t [s] of the piece: one pass over the springs.  \param f (3N),
  /// overwritten
  void forces(double t, const double* x, double* f) const;

  /// The same of two motions at once, each at its own time: one pass that costs little more than one
  /// motion's.
  void forces(Pair t, const Pair* x, Pair* f);

  /// Pattern of the Jacobian of (v, M^-1 forces), and its values at x; loads are taken as independent of x.
  SparsePattern make_pattern();
  void jacobian(const double* x, std::span<double> values) const;

  /// Positions and velocities at the start (3N each).
  void initial(std::span<double> x, std::span<double> v) const;
  /// Into `state`, which keeps its storage.
  void to_world(double t, std::span<const double> x, std::span<const double> v, CartesianState& state) const;

  const CartesianSystem& system() const { return *system_; }
  std::size_t size() const { return inverse_mass_.size(); }                  // 3N
  const std::vector<double>& inverse_mass() const { return inverse_mass_; }  // [1/kg] (3N), a point's thrice
  std::size_t memory() const;                                                // [bytes] that `forces` reads

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
  std::vector<double> constant_;               // [N] (3N) loads that stay as they are over the piece
  std::vector<const CartesianLoad*> varying_;  // the others
  double piece_time_ = 0.0;                    // [s] inside the piece
  std::vector<double> x_one_, f_one_;          // one motion of a pair, for loads that vary
  // where in the Jacobian's values the four 3 x 3 blocks of each spring start (row point, column point):
  // first first, second first, first second, second second; the next column of a block stands column_size
  // further
  std::vector<std::array<std::int64_t, 4>> blocks_;
  std::vector<std::int64_t> column_sizes_;  // of each point's three columns
  std::int64_t velocity_columns_ = 0;       // where they start
};

}  // namespace freeflex
