// The error of the elastic motion by what a plan's rung neglects, mode by mode.
#pragma once

#include <complex>
#include <vector>

#include "core/step/state.hpp"
#include "core/validity/error_shadow.hpp"

namespace freeflex {

/// Sizes over all points, weighted with their masses: |V|^2 = sum m V.V / M = sum q_l^2 [m].
struct ModalErrorSize {
  double displacement = 0.0;  // [m] |V|
  double envelope = 0.0;      // [m] the same of the amplitudes of what rings
  double seen = 0.0;          // [m] error by what is known of the links: estimate
  double unseen = 0.0;     // [m] error that links, modes or loads could hide: a bound by order of magnitude
  double amplitude = 0.0;  // [m] of `seen`, by second order of the displacements alone
  double softening = 0.0;  // [-] largest share of its stiffness that a mode loses; 1: it buckles
  double spin = 0.0;       // [m] of `seen`, the displacement by centrifugal forces that the rung leaves out
};

/// Modes that stand out in a round, by their place in the plan; -1: none. They are for messages alone.
struct ModalLeaders {
  std::int32_t error = -1;      // the largest error
  std::int32_t displaced = -1;  // the largest displacement
  std::int32_t softest = -1;    // loses the largest share of its stiffness
  bool is_left_out = false;     // true: softest is an index among the modes left out
  std::int32_t hidden = -1;     // the largest error that could be hidden
  std::int32_t wheel = -1;      // the wheel that could hide more than links do; -1: none
};

/// Names a mode. `mode` is its index in the plan, or, where is_left_out is true, its index among the lowest
/// modes that the plan leaves out; -1: no mode.
struct JudgedMode {
  std::int32_t mode = -1;
  bool is_left_out = false;
};

/// What changes the stiffness of a mode beside loads [N/m], or its motion as much; [-] of one that is left
/// out.
struct StiffnessShares {
  double spin = 0.0, vibration = 0.0, wheel = 0.0;
  std::int32_t largest_wheel = -1;  // the wheel whose share it is; -1: none
};

/// Ringing errors that grow while modes ring, static ones, those of second order   (THEORY X142, X143).
/// The lowest modes are integrated at every tick, some 6,000 multiplications of 16 and 430 a load; higher
/// ones at every tick or every few, some 2,000, their partners in turn, some 600. Allocates nothing after
/// construction.
class ModalErrors {
 public:
  explicit ModalErrors(const Plan& plan);

  /// The state after a tick of this plan, ticks in order.
  void take(const State& state) noexcept;
  /// A state that is held until nothing rings any more.
  void settle(const State& state) noexcept;
  /// True after the tick at which every mode was looked at once more; then size() is new.
  bool is_round_over() const noexcept { return chunk_ == 0; }
  double round() const noexcept { return round_; }  // [s] between two looks at a mode
  const ModalErrorSize& size() const noexcept { return size_; }
  const ModalLeaders& leaders() const noexcept { return leaders_; }
  /// Returns what changes the stiffness of a mode beside loads; zero where it is not judged.
  StiffnessShares shares_of(const JudgedMode& named, const MotionState& state) const noexcept;
  /// Returns the stiffness [N/m] that the static answer to generalized forces gives a mode, [-] of one that
  /// is left out; 0 where it is not judged.  \param Q  [N] (num_elastic)
  double stiffness_by(const JudgedMode& named, const double* Q) const noexcept;
  /// Returns what of it the plan has where the forces follow their points   (THEORY X145).
  double followed_by(const JudgedMode& named, const PlanHistory& history) const noexcept;
  /// [m/N] 1 / (M omega^2) of each mode, 0 of mechanisms.
  const std::vector<double>& flexibility() const noexcept { return flexibility_; }

  void clear() noexcept;
  /// Goes on where another left off.  \param modes  of this plan, by those of the other
  void join(const ModalErrors& other, const std::vector<std::int32_t>& modes) noexcept;

 private:
  struct Mode {
    std::complex<double> ring;  // [m] error of the ringing: amplitude and phase, q + i q' / omega
    double most = 0.0;          // [m] largest amplitude of the mode itself, fading with its decay
    double still = 0.0;         // [m] error of the static part
    double spread = 0.0;        // [m] bound on what of the ringing and the static part other modes take
    double unseen = 0.0;        // [m] bound on the ringing's error by what is not known
    double pumped =
        0.0;  // [m] the same on what grows: by stiffness that pulsates unresolved, or that nothing tells
    double stiffness = 0.0;     // [N/m] that the rung neglects, at the last look
    double steady = 0.0;        // [N/m] of it, what no displacement strains
    double fade = 1.0;          // decay over a round
    std::complex<double> turn;  // of free motion over a step of its own, with its decay
  };
  struct Partner {
    std::size_t pair, u;  // of the plan's pairs; judged mode
  };
  struct Follower {
    const PlanHistory* history;
    double amplitude;  // of the round
  };
  std::size_t judged_place(std::int32_t mode) const noexcept;
  const double* load_row(const JudgedMode& named) const noexcept;
  void look_at(std::size_t l, const MotionState& state) noexcept;
  bool is_resolved(std::size_t l) const noexcept;
  double unseen_stiffness(std::size_t l, double share) const noexcept;
  double squeeze(const State& state, std::int64_t age) const noexcept;
  void go_on(const MotionState& state) noexcept;
  void turn_by(std::size_t l, double stiffness) noexcept;
  void turn_each_other(std::size_t l, std::size_t u, double stiffness, double coriolis) noexcept;
  void look_at_shadowed(std::size_t l, const MotionState& state) noexcept;
  double coriolis_reach(std::size_t l) const noexcept;
  void weigh_wheels();
  double wheel_phase(std::size_t l, const MotionState& state) const noexcept;
  void hide(std::size_t l, double pulse, const MotionState& state) noexcept;
  void look_at_mechanism(std::size_t l, double stiffness, const MotionState& state) noexcept;
  double stiffness_of(std::size_t pair) const noexcept;
  double coriolis_stiffness(std::size_t l) const noexcept;
  void find_wheel(std::size_t l, const MotionState& state, StiffnessShares& shares) const noexcept;
  void soften(double share, std::int32_t mode, bool is_left_out) noexcept;
  void find_leaders(const MotionState& state) noexcept;
  double wheel_error(const MotionState& state, std::int32_t& wheel) const noexcept;
  void look_at_left_out() noexcept;
  void finish_round(const MotionState& state) noexcept;

  const Plan& plan_;
  ErrorShadow shadow_;  // of the lowest modes
  std::int64_t num_chunks_ = 1, chunk_ = 0;
  double round_ = 0.0;                  // [s]
  std::int64_t every_ = 1, since_ = 0;  // ticks of a step of the modes beyond the integrated, ticks since
  double step_ = 0.0;                   // [s] of it
  double omega_1_ = 0.0;                // [rad/s] lowest that is not zero; 0: none
  double size_of_body_ = 0.0;
  std::vector<Mode> modes_;              // judged ones
  std::vector<std::size_t> first_pair_;  // (judged + 1) pairs (l, u) of mode l, u > l, in partners_
  std::vector<Partner> partners_;
  std::vector<double> flexibility_;  // [m/N] 1 / (M omega^2), 0 of mechanisms
  // [m/s] mean rate over a round, [m] at its start; empty where nothing damps
  std::vector<double> creep_, q_before_;
  bool is_first_ = true;
  std::vector<double> still_;                // [m] static answer to the loads that the rung has
  std::vector<double> second_;               // [N] generalized forces of second order
  std::vector<std::complex<double>> swing_;  // [m] ringing of the judged modes, as `ring`
  std::vector<Follower> followers_;
  std::array<double, 6> products_{};  // [1/s^2] of the spin
  Vec3 w_{};                          // [rad/s]
  Vec3 push_{}, w_dot_{};             // [m/s^2], [rad/s^2] accelerations of the frame by loads
  // [1/s per N m s] phase that the momentum of a wheel may give: (num_wheels) for each judged mode, then the
  // most for any other mode; empty on coupled rungs
  std::vector<double> wheel_phases_;
  double rest_hidden_ = 0.0;  // [m] ringing error of all other modes by wheels
  // [1/s^2] of omega_1 omega_l: stiffness that could be there, now and the round before
  double unseen_share_ = 0.0, unseen_before_ = 0.0;
  double quartic_ = 0.0, next_quartic_ = 0.0;  // [sqrt(N m)] root_quartic times squares of amplitudes
  double softest_ = 0.0;                       // [-] largest share of its stiffness that a judged mode loses
  double fastest_ = 0.0;                       // [1/s] phase error of any judged mode
  double rest_ = 0.0;                          // [m] ringing error of all other modes
  ModalErrorSize size_;
  ModalLeaders leaders_, next_leaders_;  // of the last round; the softest of the running one
};

}  // namespace freeflex
