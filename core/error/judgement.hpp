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

namespace freeflex {

/// States how far a motion can be trusted, with the values that decide it   (THEORY X144).
///   The verdict is `good` up to the first limit and `watch` up to the second: 0.02 and 0.2 for error /
///   scale, 1e-3 and 1e-2 for position error / size, 0.01 and 0.1 for |V| / size.
struct Verdict {
  enum class Level : std::int32_t { kGood = 0, kWatch = 1, kOutside = 2 };
  /// Specifies the main reason why the verdict is not better.
  enum class Cause : std::int32_t {
    kNone,
    kStiffness,     // geometric stiffness due to internal forces and spin, or Coriolis forces, is neglected
    kBuckling,      // geometric stiffness takes away half of a mode's stiffness or more
    kSpinLoad,      // the centrifugal load is neglected
    kDeformation,   // terms of second order in the displacements are neglected
    kSize,          // displacements are not small compared with the size of the body
    kLost,          // the reference solution diverged
    kIntegration,   // the reference solution shows an integration error
    kStep,          // a tick is too long for the rotation, the orbit or the vibration of the body
    kUnresolved,    // the reference solution does not resolve the fastest vibration
    kTruncation,    // omitted modes move
    kModel,         // the reference solution shows a model error of the rung
    kPosition,      // the reference solution shows a position error of points in space
    kUnquantified,  // an unquantified error, due to forces inside links, wheels or omitted small modes
    kNotKept,       // only the lowest modes were found, so the motion of the others is unknown
    kFastLoad,      // a load changes faster than the ticks resolve
    kAttractor,     // the attractor is so near that the gradient of its field does not suffice
    kRigid,         // the rung is rigid, and loads or spin deform the body
    kUnknown,       // the plan file has no tables for the verdict
  };
  Level level = Level::kGood;
  Cause cause = Cause::kNone;
  std::int64_t tick = 0;
  // [m] rms over all points, weighted by mass
  double error = 0.0;             // estimated error of the elastic displacement
  double unquantified = 0.0;      // order of magnitude of the unquantified error
  double displacement_now = 0.0;  // displacement at the present tick
  // [m] Displacement by which the error is divided. It is the tolerance or, without a tolerance, the decaying
  // peak, but at least the present displacement.
  double scale = 0.0;
  double position = 0.0;    // [m] rms position error that the reference solution shows; 0: no budget
  double rate = 0.0;        // [Hz] rate that resolves the body's rotation; 0: the present rate resolves it
  Responsible responsible;  // item that is responsible for the cause; empty if the verdict is `good`
};

/// Returns "good", "watch" or "outside".
const char* name_of(Verdict::Level level);
/// Returns the text of the cause, with the name of the responsible item and the remedy. If the verdict is
/// `good`, the text is empty.
std::string text_of(const Plan& plan, const Verdict& verdict);
/// Returns "good", or the level of the verdict and the text of the cause.
std::string describe(const Plan& plan, const Verdict& verdict);
/// Returns the estimated error of the displacements as text, for example "0.12 % of the tolerance, 1e-05 m".
std::string error_text(const Plan& plan, const Verdict& verdict);
/// Returns the ratio of an error to `scale`, both [m], as text, for example "0.12 % of" or "more than 10
/// times".
std::string share_text(double error, double scale);

/// Returns the verdict on a quasi-static response (THEORY 5.8). Such a response has no free vibration and no
/// loads of the scene.  \pre quasi_static() returned the state
Verdict judge_steady(const Plan& plan, const State& state);

/// Judges one motion from its first tick on. Allocates nothing after construction.
class Judgement {
 public:
  explicit Judgement(const Plan& plan);

  /// Evaluates the state. Call this function at the start of an epoch and then after every tick.
  void take(const State& state, Budget& budget) noexcept;
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
