// The verdict on a motion. It is based on an estimate of the error that neglected terms of the rung cause,
// over all points and at every tick.
#pragma once

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "core/error/budget.hpp"
#include "core/error/modal_errors.hpp"
#include "core/error/responsible.hpp"
#include "core/error/verdict.hpp"

namespace freeflex {

/// Judges one motion from its first tick on. Allocates nothing after construction.
class Judgement {
 public:
  explicit Judgement(const Plan& plan);

  /// Evaluates the state. Call one of these functions at the start of an epoch and then after every tick.
  void take(const State& state, Budget& budget) noexcept { evaluate(state, &budget); }
  /// The same without an error budget.
  void take(const State& state) noexcept { evaluate(state, nullptr); }
  /// Evaluates a state that does not change.
  void take_steady(const State& state) noexcept;
  const Verdict& now() const noexcept { return now_; }
  /// Returns the worst verdict since the epoch began, or the first of several equally bad ones. If every
  /// verdict was `good`, the tick of the returned verdict is -1.
  const Verdict& worst() const noexcept { return worst_; }
  double size() const noexcept { return size_; }  // [m] max |r|

 private:
  struct ReferenceError {
    double elastic = 0.0, position = 0.0;  // [m] errors that the reference solution shows
  };
  void evaluate(const State& state, Budget* budget) noexcept;
  void begin(const State& state) noexcept;
  void read_error_budget(const State& state, Budget& budget) noexcept;
  void integrate_position_error(const State& state) noexcept;
  void check_rotation(const State& state) noexcept;
  void check_coupled_rotation(const State& state) noexcept;
  void estimate_spin_curvature(const Vec3& w) noexcept;
  void add_rotating_loads(const State& state, double rotation) noexcept;
  void take_commands(const State& state) noexcept;
  void judge(const State& state) noexcept;
  void name_responsible(const State& state, double by_commands) noexcept;

  const Plan& plan_;
  std::vector<ModalErrors> errors_;  // errors of the plan, and of its fallback plan if there is one
  bool uses_fallback_ = false, is_steady_ = false;
  // values for commands that excite omitted modes   (THEORY 14.9)
  double error_per_force_ = 0.0;  // [m/N]
  double command_fade_ = 1.0;     // [-] factor of decay over a tick
  double commanded_ = 0.0;        // [N] largest sum of commanded forces in the epoch, decaying
  std::int64_t epoch_ = -1, read_every_ = 1;
  double size_ = 0.0;                       // [m] max |r|
  double mass_extent_ = 0.0;                // [m] size of the mass, including the inertia of points
  double uneven_inertia_ = 0.0;             // [kg m^2] largest minus smallest principal moment
  double displacement_room_ = 1.0;          // [-] factor on the allowed ratio of displacement to size
  double peak_ = 0.0;                       // [m] peak of the displacement, decaying
  double fade_ = 1.0, horizon_fade_ = 1.0;  // [-] factors of decay over a round of mode updates and over a
                                            // horizon
  ReferenceError past_, current_;           // errors of past horizons and of the present horizon
  BudgetReading reading_;
  // [m/s], [m] errors of velocity and position due to the first neglected term of the attractor's field
  double velocity_error_ = 0.0, position_error_ = 0.0;
  double attractor_ratio_ = 0.0;  // [-] size of the body over its distance from the attractor
  double attitude_error_ = 0.0;   // [rad] error of the attitude due to steps that are too long
  // [-] largest ratio, since the epoch began, of the rotation in a tick to the rotation that the largest
  // number of substeps resolves, and [Hz] the rate that resolves the rotation
  double rotation_ratio_ = 0.0, rate_for_rotation_ = 0.0;
  struct SpinCurvature {
    std::array<Vec3, 2> before{};    // [rad/s] spin at the last two ticks
    std::array<double, 3> second{};  // [-] relative second differences of the spin at the last three ticks
    int num_ticks = 0;
    double angle = 0.0;  // [rad] angle by which the curve of the spin bends in a tick, decaying
  };
  SpinCurvature spin_curvature_;
  // [m] sum of the estimates of steps, which decays like free vibration, and the sum of the state at the last
  // tick
  double integration_error_ = 0.0, steps_before_ = 0.0, filter_error_ = 0.0;
  // [m] error due to loads that rotate within a tick and that the step takes as linear
  double rotating_load_error_ = 0.0;
  // [m] The amplitude that steps do not resolve, and [rad] the rotation of the body while there is such an
  // amplitude.
  double unresolved_ = 0.0, unresolved_rotation_ = 0.0;
  std::int32_t unresolved_mode_ = -1;  // mode with the largest unresolved amplitude
  ResponsibleFinder responsible_;
  Verdict now_, worst_;
};

}  // namespace freeflex
