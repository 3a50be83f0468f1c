// Error of the elastic motion due to the terms that the rung of a plan neglects, mode by mode.
#pragma once

#include <complex>
#include <vector>

#include "core/error/error_shadow.hpp"
#include "core/step/state.hpp"

namespace freeflex {

/// Holds rms values over all points, weighted by mass: |V|^2 = sum m V.V / M = sum q_l^2 [m^2].
struct ModalErrorSize {
  double displacement = 0.0;  // [m] |V|
  double envelope = 0.0;      // [m] |V| with the amplitudes of the vibration instead of its present values
  double error = 0.0;         // [m] estimated error
  double unquantified = 0.0;  // [m] order of magnitude of the unquantified error
  double second_order = 0.0;  // [m] part of `error` due to terms of second order in the displacements
  double softening = 0.0;     // [-] largest relative stiffness that a mode loses; 1: the mode buckles
  double spin = 0.0;          // [m] part of `error` due to the centrifugal load that the rung neglects
};

/// Holds the modes with the largest values in a round of mode updates, as indices in the plan. The index -1
/// means that there is no such mode. Only messages use these indices.
struct ModalLeaders {
  std::int32_t error = -1;         // the largest error
  std::int32_t displaced = -1;     // the largest displacement
  std::int32_t softest = -1;       // the largest relative loss of stiffness
  bool is_left_out = false;        // true: softest is an index among the omitted modes
  std::int32_t unquantified = -1;  // the largest unquantified error
  std::int32_t wheel = -1;         // index of the wheel, if its unquantified error exceeds the unquantified
                                   // error of the links; -1: no wheel
};

/// Names a mode. `mode` is its index in the plan or, if is_left_out is true, its index among the lowest
/// omitted modes. The value -1 means that no mode is named.
struct JudgedMode {
  std::int32_t mode = -1;
  bool is_left_out = false;
};

/// Holds the changes of the stiffness of a mode due to causes other than loads [N/m]. Effects other than
/// stiffness are converted to the stiffness change that would affect the motion equally. For an omitted mode
/// the changes are relative [-].
struct StiffnessChanges {
  double spin = 0.0, vibration = 0.0, wheel = 0.0;
  std::int32_t largest_wheel = -1;  // wheel that causes `wheel`; -1: no wheel
};

/// Estimates the errors of free vibration, which grow with time, the quasi-static errors, and the errors of
/// second order   (THEORY X142, X143). The 16 lowest modes are integrated at every tick, with some 6,000
/// multiplications and 430 more per load. Higher modes are advanced at every tick or every few ticks, with
/// some 2,000 multiplications. A part of the pairs of modes is updated at every tick, with some 600
/// multiplications. Allocates nothing after construction.
class ModalErrors {
 public:
  ModalErrors(const StepPlan& plan, const PlanUnmodelled& unmodelled);

  /// Evaluates the state after a tick of this plan. Call this function for every tick, in order.
  void take(const State& state) noexcept;
  /// Evaluates a state that stays the same until free vibration has decayed.
  void settle(const State& state) noexcept;
  /// Returns true after the tick that ends a round of mode updates. In a round every mode is updated once,
  /// and size() changes at the end of the round.
  bool is_round_over() const noexcept { return chunk_ == 0; }
  double round() const noexcept { return round_; }  // [s] duration of a round of mode updates
  const ModalErrorSize& size() const noexcept { return size_; }
  const ModalLeaders& leaders() const noexcept { return leaders_; }
  /// Returns the changes of the stiffness of a mode due to causes other than loads. For a mode that is not
  /// judged, the changes are zero.
  StiffnessChanges stiffness_changes(const JudgedMode& named, const MotionState& state) const noexcept;
  /// Returns the geometric stiffness of a mode [N/m] due to the quasi-static response to generalized forces.
  /// The stiffness is relative [-] for an omitted mode, and 0 for a mode that is not judged. \param Q  [N]
  /// (num_elastic)
  double stiffness_by(const JudgedMode& named, const double* Q) const noexcept;
  /// Returns the part of the geometric stiffness by a load at amplitude 1 that the plan includes
  /// (THEORY X145).
  double stiffened_by(const JudgedMode& named, const PlanHistory& history) const noexcept;
  /// Returns the part of the geometric stiffness by the commands that act that the plan includes.
  double stiffened_by_commands(const JudgedMode& named) const noexcept;
  /// Returns 1 / (M omega^2) of each mode [m/N], 0 for mechanisms.
  const std::vector<double>& flexibility() const noexcept { return flexibility_; }

  void clear() noexcept;
  /// Takes over the errors of another plan.  \param modes  index in this plan of each mode of the other plan
  void join(const ModalErrors& other, const std::vector<std::int32_t>& modes) noexcept;

 private:
  struct Mode {
    // [m] error of the modal amplitude in size and phase, q + i q' / omega
    std::complex<double> amplitude_error;
    double peak = 0.0;                // [m] largest amplitude of the mode, decaying with the mode
    double quasi_static_error = 0.0;  // [m] error of the quasi-static part
    double spread = 0.0;              // [m] bound of the motion that the error excites in other modes
    double unquantified = 0.0;        // [m] bound of the unquantified error of the amplitude
    double growing = 0.0;    // [m] bound of the error that grows due to unresolved or unquantified stiffness
    double stiffness = 0.0;  // [N/m] stiffness that the rung neglects, at the last update
    double steady = 0.0;     // [N/m] part of this stiffness that does not depend on displacements
    double fade = 1.0;       // [-] factor of decay over a round of mode updates
    std::complex<double> free_step;  // [-] free motion over a step of this mode, with its decay
  };
  struct Partner {
    std::size_t pair, u;  // index of the pair in the plan, judged mode
  };
  struct Stiffener {
    const PlanHistory* history;
    std::size_t first;  // first entry in PlanUnmodelled::stiffened_rows
    double amplitude;   // [-] amplitude in the present round of mode updates
  };
  double stiffened(const Stiffener& stiffener, std::size_t pair) const noexcept;
  double stiffened_by_commands(std::size_t pair) const noexcept;
  void update_stiffeners(const State& state, std::int64_t age) noexcept;
  std::size_t judged_index(std::int32_t mode) const noexcept;
  const double* load_row(const JudgedMode& named) const noexcept;
  void update_mode(std::size_t l, const MotionState& state) noexcept;
  bool is_resolved(std::size_t l) const noexcept;
  double unquantified_stiffness(std::size_t l, double change) const noexcept;
  double internal_forces(const State& state, std::int64_t age) const noexcept;
  void advance_higher_modes(const MotionState& state) noexcept;
  void apply_stiffness(std::size_t l, double stiffness) noexcept;
  void apply_coupling(std::size_t l, std::size_t u, double stiffness, double coriolis) noexcept;
  void update_integrated(std::size_t l, const MotionState& state) noexcept;
  double coriolis_transfer(std::size_t l) const noexcept;
  void bound_wheel_phases();
  double wheel_phase(std::size_t l, const MotionState& state) const noexcept;
  void update_unquantified(std::size_t l, double pulse, const MotionState& state) noexcept;
  void update_mechanism(std::size_t l, double stiffness, const MotionState& state) noexcept;
  double stiffness_of(std::size_t pair) const noexcept;
  double coriolis_stiffness(std::size_t l) const noexcept;
  void find_wheel(std::size_t l, const MotionState& state, StiffnessChanges& changes) const noexcept;
  void soften(double change, std::int32_t mode, bool is_left_out) noexcept;
  void find_leaders(const MotionState& state) noexcept;
  double wheel_error(const MotionState& state, std::int32_t& wheel) const noexcept;
  void update_left_out() noexcept;
  void finish_round(const MotionState& state) noexcept;

  const StepPlan& plan_;
  const PlanUnmodelled& unmodelled_;
  CommandLoads commands_;
  ErrorShadow shadow_;  // errors of the lowest modes
  std::int64_t num_chunks_ = 1, chunk_ = 0;
  double round_ = 0.0;  // [s] duration of a round of mode updates
  // The number of ticks in a step of the higher modes, and the number of ticks since the last such step.
  std::int64_t step_ticks_ = 1, ticks_since_step_ = 0;
  double step_ = 0.0;          // [s] duration of a step of the higher modes
  double omega_1_ = 0.0;       // [rad/s] lowest nonzero frequency; 0: no such mode
  double size_of_body_ = 0.0;  // [m] max |r|
  std::vector<Mode> modes_;    // judged modes
  // (judged + 1) for each judged mode l, the index in partners_ of the first pair (l, u) with u > l
  std::vector<std::size_t> first_pair_;
  std::vector<Partner> partners_;
  std::vector<double> flexibility_;  // [m/N] 1 / (M omega^2), 0 for mechanisms
  // [m/s] The mean rate of q over a round of mode updates, and [m] q at the start of the round. Both arrays
  // are empty without damping.
  std::vector<double> mean_rate_, q_before_;
  bool is_first_ = true;
  std::vector<double> quasi_static_;  // [m] quasi-static response to the loads that the rung includes
  std::vector<double> second_;        // [N] generalized forces of second order
  // [m] modal amplitudes of the judged modes, q - q_s + i q' / omega
  std::vector<std::complex<double>> amplitudes_;
  std::vector<Stiffener> stiffeners_;
  struct CommandStiffener {
    std::size_t first;   // first entry in PlanUnmodelled::stiffened_rows
    double coefficient;  // [N], [N m] in the present round of mode updates
  };
  std::vector<CommandStiffener> command_stiffeners_;  // of the components that act
  Mat3 R_WB_{};                                       // attitude in the present round
  std::array<double, 6> products_{};                  // [1/s^2] products of the components of w_
  Vec3 w_{};                                          // [rad/s] angular velocity, body axes
  Vec3 acceleration_{}, w_dot_{};  // [m/s^2], [rad/s^2] accelerations of the frame due to loads, body axes
  // [1/s per N m s] bounds of the phase rate per momentum of a wheel. Each wheel has (judged + 1) bounds, one
  // for each judged mode, then the largest bound of the modes that are not judged. The array is empty on
  // coupled rungs.
  std::vector<double> wheel_phases_;
  double rest_unquantified_ = 0.0;  // [m] unquantified error due to wheels of the modes that are not judged
  // [1/s^2] unquantified stiffness over M, relative to omega_1 omega_l, in the present round and in the
  // previous round
  double unquantified_scale_ = 0.0, unquantified_before_ = 0.0;
  double quartic_ = 0.0, next_quartic_ = 0.0;  // [sqrt(N m)] root_quartic times squares of amplitudes
  double softest_ = 0.0;                       // [-] largest relative stiffness that a judged mode loses
  double fastest_ = 0.0;                       // [1/s] largest rate of phase error of a judged mode
  double rest_ = 0.0;                          // [m] error of the modes that are not judged
  ModalErrorSize size_;
  ModalLeaders leaders_, next_leaders_;  // leaders of the last round of mode updates; in next_leaders_, those
                                         // of the present round, only the softest mode
};

}  // namespace freeflex
