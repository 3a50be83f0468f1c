// Table of all keys of a scene and their values. The reader checks scenes against this table, and the schema
// for editors is generated from it.
#pragma once

#include <cassert>
#include <cstddef>
#include <string_view>
#include <vector>

#include "service/io/scene/text.hpp"

namespace freeflex::io::reader {

/// The form of a key's value.
enum class Form {
  kNumber,     // a number of the key's quantity
  kWhole,      // a whole number
  kNumbers,    // a list of numbers whose length is in `counts`
  kGain,       // a number, 3 numbers or 3 lists of 3
  kName,       // the name of an item, which this key defines
  kReference,  // the name of a point
  kSelection,  // all, a name, a range a..b, or a list of names and ranges
  kText,       // the name of a file, or other text
  kWord,       // one of `words`
  kWords,      // one of `words`, or a list of them
  kSection,    // a mapping with the keys of sections[0], or one of `words`, if there are any
  kItems,      // a list of mappings, each with the keys of one of `sections`; or a single such mapping
};

/// How many values a key has: one (kNothing), or a mapping with one value for each existing name (kName),
/// each new name (kNewName) or each mode number (kMode).
enum class Per { kNothing, kName, kNewName, kMode };

struct Section;

struct Key {
  std::string_view name;
  Form form;
  std::string_view about;  // description for authors of scenes, without unit and range
  Quantity quantity{"-"};
  Range range{};  // narrower range, for which the reader has a check and message of its own
  std::vector<std::size_t> counts{};  // allowed lengths of kNumbers, empty for any length
  std::vector<std::string_view> words{};
  std::vector<const Section*> sections{};
  Per per = Per::kNothing;
  bool is_required = false;
  std::string_view example{};  // JSON
};

/// A key that this section refuses because the key is valid only in other sections, and the reason for the
/// message: "is not for beams: ...".
struct RefusedKey {
  std::string_view key, reason;
};

/// The keys of a mapping, in the order in which messages list them.
struct Section {
  std::string_view name;
  std::vector<Key> keys;
  std::string_view number_key{};  // key whose value the author means by a number in place of the mapping
  std::vector<std::string_view> any_of{};  // keys of which at least one is required
  std::vector<RefusedKey> refused{};

  /// Returns the key, or nullptr if it is not in the section.
  const Key* find(std::string_view key) const;
  /// Returns the key. \pre the key is in the section
  const Key& at(std::string_view key) const {
    assert(find(key) != nullptr);
    return *find(key);
  }
  std::vector<std::string_view> names() const;
};

// quantities that the tables of a scene also use
inline constexpr Quantity kMass{"kg", Bound::kNonNegative};  // 0: a massless point, held by links
inline constexpr Quantity kPosition{"m"};
inline constexpr Quantity kStiffness{"N/m", Bound::kPositive};
inline constexpr Quantity kAxialRigidity{"N", Bound::kPositive};  // also for shear rigidity
inline constexpr Quantity kRigidity{"N m^2", Bound::kPositive};
inline constexpr Quantity kModulus{"Pa", Bound::kPositive};
inline constexpr Quantity kPoissonRatio{"-", Bound::kPoissonRatio};
inline constexpr Quantity kThickness{"m", Bound::kPositive};
inline constexpr Quantity kMassPerLength{"kg/m", Bound::kNonNegative};
inline constexpr Quantity kDensity{"kg/m^3", Bound::kNonNegative};
inline constexpr Quantity kDampingCoefficient{"N s/m", Bound::kPositive};
inline constexpr Quantity kViscous{"s", Bound::kNonNegative};
inline constexpr Quantity kLossFactor{"-", Bound::kNonNegative};

/// The reasons why a kind of link refuses viscous or loss_factor. A reason is empty if the kind accepts the
/// key.
struct LossRefusal {
  std::string_view viscous, loss_factor;
};
inline constexpr LossRefusal kElasticLosses{};
inline constexpr LossRefusal kRotationLosses{
    "is not for beams and plates, because rotations carry no mass, and a moment that depends on their rate "
    "would make them states of their own; use loss_factor, or damping: rayleigh",
    {}};
inline constexpr LossRefusal kRigidLosses{"is not for rigid links, because they do not deform; remove it",
                                          "is not for rigid links, because they do not deform; remove it"};
inline constexpr LossRefusal kDashpotLosses{
    "is not for dashpots, because they have no stiffness; use damping, or add a spring",
    "is not for dashpots, because they have no stiffness; use damping, or add a spring"};

/// The sections of a scene. The root is kScene, or kBasedScene if the scene has a base.
namespace sections {
extern const Section kScene, kBasedScene, kTolerance, kVerdict, kIntegration, kPoint, kPointTable, kLinkTable,
    kRelease, kDamping, kRayleigh, kAttractor, kInitial, kInitialPoint, kInitialMode, kWheel, kLoad, kWrench,
    kPulse, kSine, kTable, kFeedback, kLeaveOut, kModes, kPublish, kPublishedPoints, kPublishedLoads,
    kCommands;
/// One section for each kind of link. The name of a section is the key that gives the kind.
extern const std::vector<Section> kLinks;
}  // namespace sections

}  // namespace freeflex::io::reader
