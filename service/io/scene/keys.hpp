// Every key of a scene and what may stand there. The reader checks by this table, and the schema for editors
// is made of it.
#pragma once

#include <cstddef>
#include <string_view>
#include <vector>

#include "service/io/scene/text.hpp"

namespace freeflex::io::reader {

/// What stands at a key.
enum class Form {
  kNumber,     // of its quantity
  kWhole,      // a whole number
  kNumbers,    // a list of numbers, as many as one of `counts` says
  kGain,       // a number, 3 numbers or 3 lists of 3
  kName,       // a name that is given here
  kReference,  // the name of a point
  kSelection,  // all, a name, a range a..b, or a list of names and ranges
  kText,       // the name of a file, or other text
  kWord,       // one of `words`
  kWords,      // one of `words`, or a list of them
  kSection,    // a mapping, of the keys of sections[0]
  kItems,      // a list of mappings, each of the keys of one of `sections`; one item may stand by itself
};

/// A key may hold a mapping, and what its form says at each key of that.
enum class Per { kNothing, kName, kNewName, kMode };

struct Section;

struct Key {
  std::string_view name;
  Form form;
  std::string_view about;  // sentences for who writes a scene, without unit and range
  Quantity quantity{"-"};
  Range range{};                      // beside that of the quantity: the reader has words of its own for it
  std::vector<std::size_t> counts{};  // of kNumbers; empty: any
  std::vector<std::string_view> words{};
  std::vector<const Section*> sections{};
  Per per = Per::kNothing;
  bool is_required = false;
  std::string_view example{};  // JSON
};

/// A key with a meaning elsewhere, and why it has none here: "is not for beams: ...".
struct RefusedKey {
  std::string_view key, reason;
};

/// The keys of a mapping, in the order in which messages name them.
struct Section {
  std::string_view name;
  std::vector<Key> keys;
  std::string_view number_key{};           // the key that a number in place of the mapping is for
  std::vector<std::string_view> any_of{};  // at least one of these must be there
  std::vector<RefusedKey> refused{};

  /// nullptr for a key that is not of the section.
  const Key* find(std::string_view key) const;
  /// \pre the key is of the section
  const Key& at(std::string_view key) const { return *find(key); }
  std::vector<std::string_view> names() const;
};

// quantities of the tables beside a scene too
inline constexpr Quantity kMass{"kg", Bound::kNonNegative};  // 0: a point that links hold
inline constexpr Quantity kPosition{"m"};
inline constexpr Quantity kStiffness{"N/m", Bound::kPositive};
inline constexpr Quantity kAxialRigidity{"N", Bound::kPositive};  // and of shear
inline constexpr Quantity kRigidity{"N m^2", Bound::kPositive};
inline constexpr Quantity kModulus{"Pa", Bound::kPositive};
inline constexpr Quantity kPoissonRatio{"-", Bound::kPoissonRatio};
inline constexpr Quantity kThickness{"m", Bound::kPositive};
inline constexpr Quantity kMassPerLength{"kg/m", Bound::kNonNegative};
inline constexpr Quantity kDensity{"kg/m^3", Bound::kNonNegative};
inline constexpr Quantity kDampingCoefficient{"N s/m", Bound::kPositive};
inline constexpr Quantity kViscous{"s", Bound::kNonNegative};
inline constexpr Quantity kLossFactor{"-", Bound::kNonNegative};

/// Why a kind of link does not take viscous or loss_factor; empty: it does.
struct LossRefusal {
  std::string_view viscous, loss_factor;
};
inline constexpr LossRefusal kElasticLosses{};
inline constexpr LossRefusal kRotationLosses{
    "is not for beams and plates: rotations carry no mass, and a moment that depends on their rate would "
    "make "
    "them states of their own; use loss_factor, or damping: rayleigh",
    {}};
inline constexpr LossRefusal kRigidLosses{"is not for rigid links: they do not deform; remove it",
                                          "is not for rigid links: they do not deform; remove it"};
inline constexpr LossRefusal kDashpotLosses{
    "is not for dashpots: they have no stiffness; use damping, or add a spring",
    "is not for dashpots: they have no stiffness; use damping, or add a spring"};

/// The sections of a scene; `scene` is the whole.
namespace sections {
extern const Section kScene, kTolerance, kErrorBudget, kPoint, kPointTable, kLinkTable, kRelease, kDamping,
    kRayleigh, kAttractor, kInitial, kInitialPoint, kInitialMode, kWheel, kLoad, kWrench, kPulse, kSine,
    kTable, kFeedback, kLeaveOut, kModes, kPublish, kPublishedPoints, kPublishedLoads, kCommands;
/// One a kind of link, whose name is the key that gives the kind.
extern const std::vector<Section> kLinks;
}  // namespace sections

}  // namespace freeflex::io::reader
