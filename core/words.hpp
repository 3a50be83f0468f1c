// The words that a person, a plan and a message share: rungs, parts that may go, what commands may need,
// axes.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

namespace freeflex {

/// The rungs of the fidelity ladder, cheapest first   (THEORY section 12). Each keeps what the one before it
/// keeps, as its traits say.
enum class Fidelity : std::int32_t {
  kRigid = 0,
  kSeparated = 1,
  kSpinLoaded = 2,
  kCoupled = 3,
  kExactBars = 4,
  kFull = 5,
};

/// What a rung does. Code asks for a property, never for the order of the rungs: a new rung is a row here.
struct RungTraits {
  Fidelity rung;
  const char* name;      // in scenes, plans and reports
  bool has_modes;        // elastic coordinates at all
  bool takes_spin_load;  // centrifugal load of the spin as a load on the modes   (X70)
  bool couples;          // elastic motion acts back on the body; every mode and every point is needed   (X92)
  bool has_true_geometry;    // springs, bars and dashpots at true length and direction   (X94)
  bool divides_tick;         // into parts that resolve its fastest motion   (X100)
  bool is_tried;             // by `fidelity: auto`, in this order   (X99)
  double displacement_room;  // [-] times kMaxDisplacementRatio before a motion is outside
  double spin_room;          // [-] times kMaxSpinRatio; kNoLimit: the rung has every term of the spin
};
inline constexpr double kNoLimit = 1e300;
inline constexpr std::array<RungTraits, 6> kRungs{{
    // no elastic coordinate
    {Fidelity::kRigid, "rigid", false, false, false, false, false, true, 1.0, 1.0},
    // the rigid body, and elastic coordinates beside it (Alekseev 1970)
    {Fidelity::kSeparated, "separated", true, false, false, false, false, true, 1.0, 1.0},
    // and the centrifugal load; its error in the ratio is that of Coriolis forces, a tenth of the whole and
    // less
    {Fidelity::kSpinLoaded, "spin-loaded", true, true, false, false, false, true, 1.0, 10.0},
    // every term in the elastic displacements, linear elasticity
    {Fidelity::kCoupled, "coupled", true, false, true, false, false, true, 10.0, kNoLimit},
    // and true bars; the frame is lost when V reaches a tenth of the size
    {Fidelity::kExactBars, "exact-bars", true, false, true, true, false, true, 100.0, kNoLimit},
    {Fidelity::kFull, "full", true, false, true, true, true, false, 100.0, kNoLimit},
}};

/// True for the number of a rung, as plan files hold it.
constexpr bool is_rung(Fidelity rung) noexcept {
  return static_cast<std::int32_t>(rung) >= 0 && static_cast<std::size_t>(rung) < kRungs.size();
}
/// \pre is_rung(rung)
constexpr const RungTraits& traits_of(Fidelity rung) noexcept {
  return kRungs[static_cast<std::size_t>(rung)];
}
constexpr const char* name_of(Fidelity rung) noexcept { return traits_of(rung).name; }

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
inline constexpr std::array kPartNames{"damping",         "gravity",     "rotation",  "out_of_plane",
                                       "unreached_modes", "small_modes", "point_rows"};
inline constexpr int kNumParts = static_cast<int>(kPartNames.size());
constexpr const char* name_of(Part part) noexcept { return kPartNames[static_cast<std::size_t>(part)]; }

/// What becomes of a part that only commands could need.
enum class OnNeed : std::int32_t {
  kKeep = 0,    // it stays
  kRefuse = 1,  // left out; a command that needs it is refused
  kReplan = 2,  // left out until a command needs it: from that tick on the wide plan is stepped
};

/// World axes, body axes, or body axes turned by the local elastic rotation (follower forces, THEORY X73).
enum class Axes : std::int32_t { kWorld = 0, kBody = 1, kLocal = 2 };

// a row a number, in the order of the numbers
namespace words_check {
constexpr bool rows_stand_in_order() {
  for (std::size_t k = 0; k < kRungs.size(); ++k)
    if (kRungs[k].rung != static_cast<Fidelity>(k)) return false;
  return true;
}
static_assert(rows_stand_in_order());
static_assert(static_cast<std::size_t>(Fidelity::kFull) + 1 == kRungs.size());
static_assert(static_cast<int>(Part::kPointRows) + 1 == kNumParts);
}  // namespace words_check

}  // namespace freeflex
