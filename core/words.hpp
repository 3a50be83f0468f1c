// The words that a person, a plan and a message share: rungs, parts that may go, what commands may need,
// axes.
#pragma once

#include <array>
#include <cstdint>

namespace freeflex {

/// The rungs of the fidelity ladder, cheapest first   (THEORY section 12). A rung is the sum of those before
/// it.
enum class Fidelity : std::int32_t {
  kRigid = 0,       // no elastic coordinate
  kSeparated = 1,   // the rigid body, and elastic coordinates beside it (Alekseev 1970)
  kSpinLoaded = 2,  // and the centrifugal load of the spin   (X70)
  kCoupled = 3,     // every term in the elastic displacements, linear elasticity   (X92)
  kExactBars = 4,   // and springs, bars and dashpots at true length and direction   (X94)
  kFull = 5,        // and the step divided until its fastest motion is resolved   (X100)
};

/// Parts that a plan may do without   (THEORY section 14). The numbers stand in plan files.
enum class Part : std::int32_t {
  kDamping = 0,         // decay of the modes
  kGravity = 1,         // uniform field
  kRotation = 2,        // turning of the body
  kOutOfPlane = 3,      // modes that move a planar shape along its normal
  kUnreachedModes = 4,  // other modes that nothing can set in motion
  kSmallModes = 5,      // modes whose share of what is asked for is below the tolerance
  kPointRows = 6,       // mode shapes at points that nobody reads or loads
};
inline constexpr int kNumParts = 7;

/// What becomes of a part that only commands could need.
enum class OnNeed : std::int32_t {
  kKeep = 0,    // it stays
  kRefuse = 1,  // left out; a command that needs it is refused
  kReplan = 2,  // left out until a command needs it: from that tick on the wide plan is stepped
};

/// World axes, body axes, or body axes turned by the local elastic rotation (follower forces, THEORY X73).
enum class Axes : std::int32_t { kWorld = 0, kBody = 1, kLocal = 2 };

}  // namespace freeflex
