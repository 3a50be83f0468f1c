// Motion of the error of the lowest modes, integrated in parallel with the motion of the rung.
#pragma once

#include <array>
#include <vector>

#include "core/error/command_loads.hpp"
#include "core/step/state.hpp"

namespace freeflex {

/// Integrates the errors delta_c of the lowest modes, caused by terms that the rung neglects
/// (THEORY X142, X146 to X148): delta'' + 2 decay delta' + omega^2 delta = F / M. The solution is exact over
/// each tick if F stays at its value halfway through the tick. Allocates nothing after construction.
class ErrorShadow {
 public:
  ErrorShadow(const StepPlan& plan, const PlanUnmodelled& unmodelled);

  /// Returns the number of modes on which a force F acts. If dashpots or feedback couple the modes, the
  /// errors of all modes are advanced.
  std::size_t size() const noexcept { return ticks_.size(); }
  void clear() noexcept;
  /// Sets the part of the stiffness between two modes that the rung neglects [N/m], except for what depends
  /// on the displacements of the integrated modes.
  void set_stiffness(std::size_t l, std::size_t u, double E) noexcept;
  /// \param w  [rad/s] body axes  \param products  [1/s^2] products of the components of w, in the order of
  /// PlanUnmodelled
  /// \param wheels  [N m s] (num_wheels) momenta of the wheels
  void set_spin(const Vec3& w, const std::array<double, 6>& products,
                std::span<const double> wheels) noexcept;
  /// Advances the errors by one tick that starts at `state`.
  /// \pre commands.update(state) was called
  void advance(const State& state, const CommandLoads& commands) noexcept;
  /// Sets the errors to their quasi-static values, for a motion that does not change.
  void settle(const MotionState& state) noexcept;
  /// Limits the amplitude of each error to `most` [m].
  void limit(double most) noexcept;
  /// Takes over the errors of another plan.  \param modes  index in this plan of each mode of the other plan
  void join(const ErrorShadow& other, const std::vector<std::int32_t>& modes) noexcept;
  /// Returns the sum of the squares of the amplitudes of the errors [m^2].
  double square() const noexcept;
  /// Returns the square of the amplitude of the error of one mode [m^2].
  double square_of(std::size_t mode) const noexcept;
  /// Returns the error of the attitude [rad] if there are loads fixed in the world, otherwise 0.
  double attitude_error() const noexcept;

 private:
  struct Free {  // coefficients of the exact motion without force
    double from_delta, from_rate, rate_from_delta, rate_from_rate;
  };
  struct Tick {
    Free whole, half;
    double by_force, rate_by_force;
  };
  static Free free_over(double omega, double decay, double h) noexcept;
  void move_halfway(const MotionState& state) noexcept;
  void compute_forces(const MotionState& state) noexcept;
  void add_fourth_order() noexcept;
  void add_fourth_order_bound() noexcept;
  void add_coriolis() noexcept;
  void add_torque(const State& state, const CommandLoads& commands, const Mat3& R_WB) noexcept;
  void advance_attitude(const State& state, const CommandLoads& commands) noexcept;
  void advance_coupled() noexcept;
  void add_half_impulse(const Array& delta, bool is_second, Array& rate) noexcept;
  Vec3 vibration_momentum(const MotionState& state) const noexcept;
  Vec3 neglected_rotation(const double* rows, const MotionState& state, const Array& delta) const noexcept;
  void add_wheel_torque(const PlanWheel& wheel, const MotionState& state) noexcept;

  struct Pair {
    std::size_t pair, l, u;  // index in PlanUnmodelled::pairs; the two modes
    Vec3 s;                  // [-] sum m b_l x b_u / M
  };
  const StepPlan& plan_;
  const PlanUnmodelled& unmodelled_;
  std::vector<Pair> pairs_;           // l < u
  std::vector<Tick> ticks_;           // coefficients of each mode
  Array delta_, rate_;                // [m], [m/s] errors (n; num_padded if modes are coupled)
  std::vector<double> E_;             // [N/m] (n x n)
  std::vector<double> coriolis_;      // [kg/s] (n x n)
  std::vector<double> spin_force_;    // [N] centrifugal load that the rung neglects
  Array half_delta_;                  // [m] errors halfway through the tick
  std::vector<double> x_, v_;         // [m], [m/s] q + delta and its rate, halfway through the tick
  std::vector<double> product_;       // products of a matrix with x_ or v_
  std::vector<double> missing_q_;     // [m] displacement whose effect on torque and inertia is neglected
  std::vector<double> world_forces_;  // [N] loads fixed in the world on a body rotated by phi_
  Array force_;                       // [N] F
  // results and scratch of a step, if modes are coupled
  Array next_delta_, next_rate_, zero_, low_, rate_low_, rate_after_impulse_, scratch_;
  bool has_coriolis_ = false, has_world_loads_ = false;
  Vec3 H_W_{};      // [N m s] momentum due to torques that the rung neglects
  Vec3 phi_{};      // [rad] error of the attitude, body axes
  Vec3 w_{};        // [rad/s] angular velocity of the rung, body axes
  Vec3 w_error_{};  // [rad/s] error of the angular velocity, dw, body axes
};

}  // namespace freeflex
