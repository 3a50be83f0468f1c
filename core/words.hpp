// Enumerations that scenes, plans and messages share: rungs, types of link, features, what happens if a
// command needs an omitted feature, and axes of loads.
#pragma once

#include <array>
#include <cassert>
#include <cstddef>
#include <cstdint>
#include <string_view>

namespace freeflex {

/// Lists the rungs of the fidelity ladder, cheapest first   (THEORY section 12). Each rung has all terms of
/// the rung before it; RungTraits lists the properties of each rung.
enum class Fidelity : std::int32_t {
  kRigid = 0,
  kSeparated = 1,
  kSpinLoaded = 2,
  kCoupled = 3,
  kCorotational = 4,
  kFull = 5,
};
/// The cheapest rung on which links have their true geometry.
inline constexpr Fidelity kTrueGeometry = Fidelity::kCorotational;

/// Holds the properties of a rung. Code that needs a property reads it here and does not rely on the order of
/// the rungs.
struct RungTraits {
  Fidelity rung;
  const char* name;      // name in scenes, plans and reports
  bool has_modes;        // has elastic coordinates
  bool takes_spin_load;  // the centrifugal load of the spin acts on the modes   (THEORY 8.16)
  // elastic motion acts back on the body; the step needs the rows of every point
  // (THEORY 12.5 to 12.12, 12.33 to 12.55)
  bool couples;
  // springs, bars and dashpots have their true length and direction   (THEORY 12.17 to 12.19)
  bool has_true_geometry;
  bool divides_tick;  // divides the tick into substeps that resolve the fastest motion   (THEORY 12.29)
  bool is_tried;      // true: `fidelity: auto` tries this rung; it tries the rungs in this order
                      //   (THEORY 12.28)
};
inline constexpr std::array<RungTraits, 6> kRungs{{
    // no elastic coordinate
    {Fidelity::kRigid, "rigid", false, false, false, false, false, true},
    // the rigid body, and elastic coordinates that do not act on it (Alekseev 1970)
    {Fidelity::kSeparated, "separated", true, false, false, false, false, true},
    // Adds the centrifugal load to `separated`. The remaining error comes from the neglected Coriolis forces.
    // It is at most a tenth of the error without the centrifugal load.
    {Fidelity::kSpinLoaded, "spin-loaded", true, true, false, false, false, true},
    // every term in the elastic displacements, linear elasticity
    {Fidelity::kCoupled, "coupled", true, false, true, false, false, true},
    // adds bars at true length and direction; the floating frame fails when the elastic displacements V reach
    // a tenth of the size of the structure
    {Fidelity::kCorotational, "corotational", true, false, true, true, false, true},
    {Fidelity::kFull, "full", true, false, true, true, true, false},
}};

/// Lists the rungs on which a motion without true geometry is judged, best first   (THEORY 15.1).
inline constexpr std::array kBetterRungs{Fidelity::kCorotational, Fidelity::kFull, Fidelity::kCoupled};

/// Returns true for the number of a rung. Plan files hold these numbers.
constexpr bool is_rung(Fidelity rung) noexcept {
  return static_cast<std::int32_t>(rung) >= 0 && static_cast<std::size_t>(rung) < kRungs.size();
}
/// \pre is_rung(rung)
constexpr const RungTraits& traits_of(Fidelity rung) noexcept {
  assert(is_rung(rung));
  return kRungs[static_cast<std::size_t>(rung)];
}
constexpr const char* name_of(Fidelity rung) noexcept { return traits_of(rung).name; }

/// Lists the features that a plan may omit (THEORY section 14). Plan files hold the numbers of the features.
enum class Feature : std::int32_t {
  kDamping = 0,         // decay of the modes
  kGravity = 1,         // uniform field
  kRotation = 2,        // rotation of the body
  kOutOfPlane = 3,      // modes that move a planar shape along its normal
  kUnreachedModes = 4,  // other modes that neither loads nor the initial state excite
  kSmallModes = 5,      // modes whose contribution is below the tolerance
  kPointRows = 6,       // mode-shape rows of points that are neither read nor loaded
};
inline constexpr std::array kFeatureNames{"damping",         "gravity",     "rotation",  "out_of_plane",
                                          "unreached_modes", "small_modes", "point_rows"};
inline constexpr int kNumFeatures = static_cast<int>(kFeatureNames.size());
constexpr const char* name_of(Feature feature) noexcept {
  return kFeatureNames[static_cast<std::size_t>(feature)];
}

/// Specifies what the plan does with a feature that the scene does not need but a command could need
/// (THEORY 14.16).
enum class OnNeed : std::int32_t {
  kKeep = 0,    // the plan keeps the feature
  kRefuse = 1,  // the plan omits it; a command that needs it is refused
  kReplan = 2,  // the plan omits it until a command needs it; from that tick on, the fallback plan is stepped
};

/// Lists the types of link. Plan files hold the numbers.
enum class LinkType : std::int32_t {
  kSpring = 0,
  kBar = 1,
  kBeam = 2,
  kMatrix = 3,
  kBending = 4,
  kTorsion = 5,
  kPlate = 6,
  kRigid = 7,
  kDashpot = 8,
};

/// Specifies how a picture shows a link.
enum class LinkDrawing {
  kLines,     // lines from the first point to all other points
  kTriangle,  // the triangle of its points
  kHull,      // the convex hull of its points; lines if the points have no hull
  kNothing,   // springs on angles, because other links lie along the same lines; the inside of matrices is
              // unknown
};
/// Specifies the one number that stands for the published forces of a link.
enum class LinkFigure {
  kLargest,   // the largest force on a point, or the only number
  kTension,   // the tension of a beam
  kMembrane,  // the von Mises sum of the membrane forces of a plate
};

/// Holds the properties of a type of link. Code that needs a property reads it here and does not compare
/// types.
struct LinkTypeTraits {
  LinkType type;
  const char* name;  // in scenes, plans and messages
  const char* noun;  // in texts
  // The link exerts one force along the line of its two points. The rungs with true geometry use its true
  // length   (THEORY 12.17)
  bool is_axial;
  bool is_angular;  // the link resists an angle, so its force is a moment
  LinkDrawing drawing;
  LinkFigure figure;
  const char* figure_unit;
};
inline constexpr std::array<LinkTypeTraits, 9> kLinkTypes{{
    {LinkType::kSpring, "spring", "spring", true, false, LinkDrawing::kLines, LinkFigure::kLargest, "N"},
    {LinkType::kBar, "bar", "bar", true, false, LinkDrawing::kLines, LinkFigure::kLargest, "N"},
    {LinkType::kBeam, "beam", "beam", false, false, LinkDrawing::kLines, LinkFigure::kTension, "N"},
    {LinkType::kMatrix, "matrix", "matrix link", false, false, LinkDrawing::kNothing, LinkFigure::kLargest,
     "N"},
    {LinkType::kBending, "bending", "bending spring", false, true, LinkDrawing::kNothing,
     LinkFigure::kLargest, "N m"},
    {LinkType::kTorsion, "torsion", "torsion spring", false, true, LinkDrawing::kNothing,
     LinkFigure::kLargest, "N m"},
    {LinkType::kPlate, "plate", "plate", false, false, LinkDrawing::kTriangle, LinkFigure::kMembrane, "N/m"},
    {LinkType::kRigid, "rigid", "rigid link", false, false, LinkDrawing::kHull, LinkFigure::kLargest, "N"},
    {LinkType::kDashpot, "dashpot", "dashpot", true, false, LinkDrawing::kLines, LinkFigure::kLargest, "N"},
}};
constexpr bool is_link_type(LinkType type) noexcept {
  return static_cast<std::int32_t>(type) >= 0 && static_cast<std::size_t>(type) < kLinkTypes.size();
}
/// \pre is_link_type(type)
constexpr const LinkTypeTraits& traits_of(LinkType type) noexcept {
  assert(is_link_type(type));
  return kLinkTypes[static_cast<std::size_t>(type)];
}

/// Returns the traits of the type of link with a name, or nullptr if there is no such type.
constexpr const LinkTypeTraits* find_link_type(std::string_view name) noexcept {
  for (const LinkTypeTraits& each : kLinkTypes)
    if (name == each.name) return &each;
  return nullptr;
}

/// Holds the properties of a channel that publishes the motion at a rate of the scene. The scene names the
/// channel by its key under `publish`.
struct ChannelTraits {
  const char* key;
  const char* about;    // description for authors of scenes
  double default_rate;  // [Hz]
  bool lists_items;     // the scene may choose the published items, so the key has a mapping
};
inline constexpr std::array<ChannelTraits, 3> kMotionChannels{{
    {"state", "Rate of the state; default 50, 0 switches it off.", 50.0, false},
    {"points", "Positions, velocities and accelerations of points.", 50.0, true},
    {"loads", "Forces of links.", 50.0, true},
}};
inline constexpr std::size_t kNumMotionChannels = kMotionChannels.size();
inline constexpr std::size_t kStateChannel = 0, kPointsChannel = 1, kLoadsChannel = 2;
/// Holds a rate [Hz] for each channel. A rate of 0 switches the channel off.
using ChannelRates = std::array<double, kNumMotionChannels>;
constexpr ChannelRates default_rates() noexcept {
  ChannelRates rates{};
  for (std::size_t i = 0; i < rates.size(); ++i) rates[i] = kMotionChannels[i].default_rate;
  return rates;
}

/// Lists the axes of a load: world axes, body axes, or body axes rotated by the local elastic rotation
/// (follower forces, THEORY 8.24).
enum class Axes : std::int32_t { kWorld = 0, kBody = 1, kLocal = 2 };

// The functions above use enumerators as indices, so the rows of the tables must have the order of the
// enumerators.
namespace words_check {
constexpr bool rows_are_in_order() {
  for (std::size_t k = 0; k < kRungs.size(); ++k)
    if (kRungs[k].rung != static_cast<Fidelity>(k)) return false;
  for (std::size_t k = 0; k < kLinkTypes.size(); ++k)
    if (kLinkTypes[k].type != static_cast<LinkType>(k)) return false;
  return true;
}
static_assert(rows_are_in_order());
static_assert(static_cast<std::size_t>(Fidelity::kFull) + 1 == kRungs.size());
static_assert(static_cast<std::size_t>(LinkType::kDashpot) + 1 == kLinkTypes.size());
static_assert(static_cast<int>(Feature::kPointRows) + 1 == kNumFeatures);
}  // namespace words_check

}  // namespace freeflex
