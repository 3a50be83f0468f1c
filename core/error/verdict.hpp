// The verdict on a motion and the readings of its error budget. This header and core/error/tables.hpp are all
// that other rooms see of the estimate of the error; class Motion in core/motion.hpp computes it.
#pragma once

#include <cstdint>
#include <string>

#include "core/plan.hpp"
#include "core/step/state.hpp"

namespace freeflex {

/// These are the limits of the verdict, that is, the largest estimate for `good` and the largest estimate for
/// `watch` (THEORY X144; README, "When not to trust it").
inline constexpr double kGoodElastic = 0.02, kMostElastic = 0.2;            // [-] error over scale
inline constexpr double kGoodPosition = 1e-3, kMostPosition = 1e-2;         // [-] position error over size
inline constexpr double kGoodDisplacement = 1e-2, kMostDisplacement = 0.1;  // [-] displacement over size
// [-] largest ratio of displacement to size for the verdict `good` if the second-order terms of some links
// are unquantified
inline constexpr double kGoodUnquantified = 1e-3;

/// Identifies the item that is responsible for a cause. The item is used in messages only and does not affect
/// the verdict.
struct Responsible {
  enum class Agent : std::int32_t {
    kNone,
    kLoad,       // a load of the scene
    kCommands,   // commanded loads
    kSpin,       // the spin of the body
    kOrbit,      // the gravity gradient of the attractor
    kVibration,  // the vibration itself
    kLink,
    kWheel,
    kModes,  // omitted modes
    kRate,   // a mode whose stiffness changes faster than the ticks resolve
  };
  Agent agent = Agent::kNone;
  std::int32_t item = -1;  // index of the load, link or wheel; -1: no item, or unknown
  std::int32_t mode = 0;   // number of the mode in the scene, from 1; 0: no mode
  double frequency = 0.0;  // [Hz] frequency of that mode; 0: a mechanism
};

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
    kAttractor,     // the attractor is so near that its field is not linear over the body
    kRigid,         // the rung is rigid, and loads or spin deform the body
    kUnknown,       // the plan has no tables for the verdict
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

/// Holds the distance between two states, over all points   (THEORY 12.23 to 12.25).
struct ErrorSize {
  double position = 0.0;      // [m] root mean square over the points
  double attitude = 0.0;      // [rad]
  double elastic = 0.0;       // [-] |V - V*| / |V*|, body axes; V* is the elastic displacement of the second
                              // state
  double displacement = 0.0;  // [m] |V - V*|, root mean square over the points
};

/// Holds estimates of the errors that the state has accumulated since the shadows were last set to it. The
/// components `integration`, `truncation` and `model` do not add up exactly to `total`, because each is a
/// distance between a different pair of motions.
struct BudgetReading {
  double age = 0.0;      // [s] time since the shadows were last set to the state, at most PlanBudget::horizon
  bool is_lost = false;  // true: the motion of a shadow became infinite or NaN; there is no estimate until
                         // the shadows restart
  // [rad] bound on the error of the modes that the best shadow does not resolve, which a distance from the
  // shadow cannot show: the rotation of the body times the relative amplitude of these modes   (THEORY 12.27)
  double unresolved = 0.0;
  ErrorSize total;  // the estimate: kCover times the distance from the best shadow   (THEORY 12.26)
  ErrorSize integration, truncation, model;  // distances due to period, omitted modes, rung
};

}  // namespace freeflex
