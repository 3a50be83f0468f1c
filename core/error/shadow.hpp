// The shadow: a motion on a better plan that is stepped beside the state, and the distance of the state from
// it. The verdict and `fidelity: auto` are read from this distance   (THEORY section 15).
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/error/shadow_loads.hpp"
#include "core/error/verdict.hpp"

namespace freeflex {

/// Returns the rotation in world axes [rad] that takes the attitude `from` to `to`, with twice the sine of
/// half of its angle as its length   (THEORY 15.5).
Vec3 rotation_between(const Quat& from, const Quat& to) noexcept;

/// Steps one shadow. If every horizon is judged, the shadow runs from the start of the epoch on. Otherwise it
/// pauses, and starts again from the state plus the error that is expected by then   (THEORY 15.6). Allocates
/// nothing after construction, does not call libm, and gives the same bits everywhere.
class Shadow {
 public:
  /// \param plan  must outlive this object, and so must `shadow`
  /// \param takes_scene_loads  the loads as the scene gives them, not as the plan of the shadow samples them
  ///   \pre false, or freeflex::takes_scene_loads(shadow)
  Shadow(const StepPlan& plan, const PlanShadow& shadow, bool takes_scene_loads);

  /// Notes the commands of a tick. Call this function before take() of the next tick.
  void command(std::int64_t tick, std::span<const ForceCommand> commands) noexcept {
    loads_.command(tick, commands);
  }
  /// Returns whether take() reads more than the number of the tick.
  bool needs(const MotionState& state) const noexcept;
  /// Advances the shadow to a tick. Call this function at the start of an epoch and after every tick. Returns
  /// true if a new distance was computed.
  bool take(const MotionState& state) noexcept;

  /// Returns the distance of the state from the true motion at the last step of the shadow.
  const MotionError& error() const noexcept { return error_; }
  /// Returns the estimated error of the shadow [m], rms over the mass, from its own steps (THEORY 12.95,
  /// 12.97).
  double own_error() const noexcept { return own_error_; }
  /// Returns the estimated error of the attitude of the shadow since the epoch began [rad]: the sum of
  /// (w H)^5 / 120 over its steps, with the rate of the nutation by wheels if that is faster (THEORY 15.14).
  double own_attitude_error() const noexcept { return own_attitude_; }
  /// Return the sizes of the elastic displacements of the state, and of the shadow [m],
  /// rms over the mass.
  double displacement_of_state() const noexcept { return displacement_of_state_; }
  double displacement() const noexcept { return displacement_; }
  /// Returns the motion of the shadow.
  const MotionState& state() const noexcept { return state_; }
  /// Returns the sum of the sizes of the forces that act [N].
  double load_size() const noexcept { return loads_.size(); }
  /// Returns whether loads act in a horizon that is not judged, and are larger than any in the horizons that
  /// were judged in this epoch   (THEORY 15.6).
  bool misses_loads() const noexcept { return misses_loads_; }
  /// Returns why the shadow has stopped, or kOk if it runs. It starts again with the next horizon that is
  /// judged.
  StepStatus status() const noexcept { return report_.status; }
  /// Returns why the shadow stopped last in this epoch, or kOk. The error from then on is not known.
  StepStatus last_stop() const noexcept { return stop_; }

 private:
  /// How far the shadow is from the state, in the coordinates of the shadow   (THEORY 15.6).
  struct Apart {
    Array q, q_dot;                                           // [m], [m/s]
    Vec3 position_W{}, velocity_W{}, rotation_W{}, spin_W{};  // [m], [m/s], [rad], [rad/s]
  };
  static void clear(Apart& apart) noexcept;

  void begin_epoch(const MotionState& state) noexcept;
  void begin_horizon(const MotionState& state) noexcept;
  void pause(const MotionState& state) noexcept;
  void put(const MotionState& state, const Apart* apart) noexcept;
  void to_shadow(const MotionState& state, Array& q, Array& q_dot) const noexcept;
  bool step_once(std::int64_t age) noexcept;
  void advance_step(const LoadsOverStep* over) noexcept;
  void find_missed_loads(double size) noexcept;
  void move_on(Apart& apart, std::int64_t num_steps) const noexcept;
  void add_attitude_error() noexcept;
  void add_integration_error() noexcept;
  void compare(const MotionState& state) noexcept;
  double size_of(const Array& q) const noexcept;
  double square_of_rigid_links() const noexcept;

  const StepPlan& plan_;
  const PlanShadow& shadow_;
  State state_;
  Workspace workspace_;
  StepReport report_;
  ShadowLoads loads_;
  // while the shadow pauses: the distance of the expected true motion from the state; while it runs: what the
  // distance with which it started would be without any further error
  Apart apart_;
  Array q_, q_dot_;  // (num_padded of the shadow) coordinates of the state
  Array q_before_, q_dot_before_;
  std::int64_t epoch_ = -1, start_tick_ = 0;
  bool is_judged_ = false;  // the present horizon is judged, and the shadow has not stopped
  StepStatus stop_ = StepStatus::kOk;
  bool takes_scene_loads_;
  bool misses_loads_ = false;
  double largest_load_ = 0.0;  // [N] in horizons that were judged
  MotionError error_;
  double fade_ = 1.0;  // [-] decay of the slowest mode over a step
  // [m] sum of the estimates of steps, decaying, and coupled.integration_error after the last step
  double integration_error_ = 0.0, sum_before_ = 0.0;
  double own_attitude_ = 0.0, own_error_ = 0.0, displacement_ = 0.0, displacement_of_state_ = 0.0;
};

}  // namespace freeflex
