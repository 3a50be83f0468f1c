// The motion of the error: what the lowest modes do otherwise than the rung says, integrated beside it.
#pragma once

#include <array>
#include <vector>

#include "core/step/state.hpp"

namespace freeflex {

/// Errors delta_c of the lowest modes, driven by what the rung neglects   (THEORY X142, X146-X148):
/// delta'' + 2 decay delta' + omega^2 delta = F / M, exact over each tick with F held as it is halfway.
/// Allocates nothing after construction.
class ErrorShadow {
 public:
  explicit ErrorShadow(const Plan& plan);

  /// Modes whose forces are integrated; where dashpots or feedback mix modes, all move.
  std::size_t size() const noexcept { return ticks_.size(); }
  void clear() noexcept;
  /// Stiffness that the rung neglects between two modes, [N/m], but for what shadowed modes strain.
  void set_stiffness(std::size_t l, std::size_t u, double E) noexcept;
  /// \param w  [rad/s] body axes  \param products  [1/s^2] of it, in the order of PlanNeglect
  /// \param wheels  [N m s] (num_wheels) their momentum
  void set_spin(const Vec3& w, const std::array<double, 6>& products,
                std::span<const double> wheels) noexcept;
  /// One tick, at whose start the motion is this.
  void advance(const State& state) noexcept;
  /// What the motion settles to where it is held as it is.
  void settle(const MotionState& state) noexcept;
  /// No amplitude is beyond `most` [m].
  void limit(double most) noexcept;
  /// Joins one of another plan.  \param modes  of this plan, by those of the other
  void join(const ErrorShadow& other, const std::vector<std::int32_t>& modes) noexcept;
  /// [m^2] sum of squares of the amplitudes.
  double square() const noexcept;
  /// [m^2] square of the amplitude of one mode.
  double square_of(std::size_t mode) const noexcept;
  /// [rad] error of the attitude where loads are fixed in the world, else 0.
  double turn() const noexcept;

 private:
  struct Free {  // exact motion without force
    double from_delta, from_rate, rate_from_delta, rate_from_rate;
  };
  struct Tick {
    Free whole, half;
    double by_force, rate_by_force;
  };
  static Free free_over(double omega, double decay, double h) noexcept;
  void go_halfway(const MotionState& state) noexcept;
  void find_forces(const MotionState& state) noexcept;
  void stretch() noexcept;
  void stretch_alike() noexcept;
  void add_coriolis() noexcept;
  void take_torque(const State& state, const Mat3& R_WB) noexcept;
  void turn_body(const State& state) noexcept;
  void advance_all() noexcept;
  void kick_half(const Array& delta, bool is_second, Array& rate) noexcept;
  Vec3 ring_momentum(const MotionState& state) const noexcept;
  Vec3 turn_at(const double* rows, const MotionState& state, const Array& delta) const noexcept;
  void push_by_wheel(const PlanWheel& wheel, const MotionState& state) noexcept;

  struct Pair {
    std::size_t pair, l, u;  // index into PlanNeglect::pairs, modes
    Vec3 s;                  // [-] sum m b_l x b_u / M
  };
  const Plan& plan_;
  std::vector<Pair> pairs_;         // l < u
  std::vector<Tick> ticks_;         // of each mode
  Array delta_, rate_;              // [m], [m/s] (n, or num_padded where modes are mixed)
  std::vector<double> E_;           // [N/m] (n x n)
  std::vector<double> coriolis_;    // [kg/s] (n x n)
  std::vector<double> spin_force_;  // [N] centrifugal load that the rung lacks
  Array half_delta_;                // [m] halfway through the tick
  std::vector<double> x_, v_;       // [m], [m/s] q + delta and its rate there
  std::vector<double> bent_;        // products of a matrix with x_ or v_
  std::vector<double> missing_;     // [m] displacement whose torque and inertia the rung lacks
  std::vector<double> turned_;      // [N] what loads fixed in the world do to a body that has turned
  Array force_;                     // [N]
  Array next_delta_, next_rate_, zero_, low_, rate_low_, kicked_, scratch_;  // where modes are mixed
  bool spins_ = false, has_world_loads_ = false;
  Vec3 H_W_{};    // [N m s] momentum that torques give and the rung lacks
  Vec3 phi_{};    // [rad] body axes, error of the attitude
  Vec3 w_{};      // [rad/s] spin of the rung
  Vec3 error_{};  // [rad/s] what the spin is off by
};

}  // namespace freeflex
