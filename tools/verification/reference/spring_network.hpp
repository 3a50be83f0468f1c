// The full system of a scene as plain arrays, in axes that do not rotate. The methods with which freeflex is
// compared run on these arrays. The equations are those of CartesianSystem, but the data are arranged for
// speed (THEORY 13.1, 13.7).
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "tools/verification/reference/second_order_system.hpp"

namespace freeflex {

/// Positions and velocities are in world axes, relative to an origin that falls freely. At the start this
/// origin has the position and the velocity of the centre of mass.
class SpringNetwork : public SecondOrderSystem {
 public:
  /// Makes the arrays of a system. Returns nullptr and sets `error` for an attractor and for links that
  /// dissipate, because the methods that run on these arrays do not support them.
  static std::unique_ptr<SpringNetwork> make(const CartesianSystem& system, std::string& error);

  void begin_piece(double start, double end) override;
  bool depends_on_velocities() const override { return false; }

  /// Computes the forces in one pass over the springs   (THEORY 13.1):
  ///   F_i += (D - D L / l) d,   F_j -= (D - D L / l) d,   d = x_j - x_i,   l = |d|
  void forces(double t, const double* x, const double* v, double* f) override;
  /// The pass costs little more than a pass for one motion.
  void forces(Pair t, const Pair* x, Pair* f) override;

  SparsePattern make_pattern() override;
  /// The tangent of a spring is (THEORY 13.7):
  ///   d((D - D L / l) d) / dd = D (1 - L / l) 1 + (D L / l^3) d d^T
  void jacobian(const double* x, const double* v, std::span<double> values) override;

  void initial(std::span<double> x, std::span<double> v) const override;
  void to_world(double t, std::span<const double> x, std::span<const double> v,
                CartesianState& state) const override;

  const CartesianSystem& system() const override { return *system_; }
  std::size_t memory() const override;

 private:
  explicit SpringNetwork(const CartesianSystem& system) : SecondOrderSystem(system), system_(&system) {}
  struct End {
    std::int32_t first, second;  // index of the x component
  };
  template <typename Number>
  void add_springs(const Number* x, Number* f) const;
  void add_varying(double t, const double* x, double* f) const;

  const CartesianSystem* system_;
  std::vector<End> ends_;
  std::vector<double> stiffness_, stiffness_length_;  // [N/m], [N] stiffness times rest length
  std::vector<double> constant_;                      // [N] (3N) loads that are constant over the piece
  std::vector<const CartesianLoad*> varying_;         // the other loads
  double piece_time_ = 0.0;                           // [s] a time inside the piece
  std::vector<double> x_one_, f_one_;                 // one motion of a pair, for varying loads
  // for each spring, the index in the values of the Jacobian of the first entry of its four 3 x 3 blocks. The
  // blocks (row point, column point) are (first, first), (second, first), (first, second), (second, second).
  // The next column of a block begins column_sizes_ entries later
  std::vector<std::array<std::int64_t, 4>> blocks_;
  std::vector<std::int64_t> column_sizes_;  // entries in each of the three columns of a point
  std::int64_t velocity_columns_ = 0;       // index of the first value in the columns of velocities
};

}  // namespace freeflex
