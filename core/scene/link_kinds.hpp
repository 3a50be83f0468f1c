// What a kind of link is, each question answered once. A new kind is a new alternative of LinkKind; it does
// not compile until traits_of() knows it and every visit of the kinds has a case for it.
#pragma once

#include <cstddef>
#include <limits>
#include <vector>

#include "core/scene/scene.hpp"

namespace freeflex {

/// What a link does to the motion.
enum class LinkEffect {
  kStrains,  // carries force for deformation: natural deformations with stiffness   (THEORY X44-X46)
  kForbids,  // forbids displacements   (THEORY X64)
  kDamps,    // carries force for the rate of deformation alone   (THEORY X65)
};

struct LinkTraits {
  static constexpr std::size_t kAnyNumber = std::numeric_limits<std::size_t>::max();
  const char* name;                 // in plans and messages
  const char* noun;                 // in faults
  std::size_t least = 2, most = 2;  // points
  LinkEffect effect = LinkEffect::kStrains;
  bool is_axial = false;  // one force along the line of two points; at true length on the upper rungs (X94)
  bool turns_joints = false;   // its ends share the rotations of joints   (THEORY X47)
  bool follows_points = true;  // from each point to the next it has a direction
  bool lists_points = true;    // its points stand in the scene message
};
constexpr LinkTraits traits_of(const Spring&) {
  return {.name = "spring", .noun = "spring", .is_axial = true};
}
constexpr LinkTraits traits_of(const Bar&) { return {.name = "bar", .noun = "bar", .is_axial = true}; }
constexpr LinkTraits traits_of(const Beam&) { return {.name = "beam", .noun = "beam", .turns_joints = true}; }
inline LinkTraits traits_of(const MatrixLink& matrix) {
  return {.name = "matrix",
          .noun = "matrix link",
          .least = is_superelement(matrix) ? 1U : 2U,
          .most = LinkTraits::kAnyNumber,
          .turns_joints = matrix.has_rotations,
          .follows_points = false,
          .lists_points = false};
}
constexpr LinkTraits traits_of(const BendingSpring&) {
  return {.name = "bending", .noun = "bending spring", .least = 3, .most = 3};
}
constexpr LinkTraits traits_of(const TorsionSpring&) {
  return {.name = "torsion", .noun = "torsion spring", .least = 4, .most = 4};
}
constexpr LinkTraits traits_of(const Plate&) {
  return {.name = "plate", .noun = "plate", .least = 3, .most = 3, .turns_joints = true};
}
constexpr LinkTraits traits_of(const Rigid&) {
  return {
      .name = "rigid", .noun = "rigid link", .most = LinkTraits::kAnyNumber, .effect = LinkEffect::kForbids};
}
constexpr LinkTraits traits_of(const Dashpot&) {
  return {.name = "dashpot", .noun = "dashpot", .effect = LinkEffect::kDamps, .is_axial = true};
}

inline LinkTraits traits_of(const Link& link) {
  return std::visit([](const auto& kind) { return traits_of(kind); }, link.kind);
}

/// One case a kind, for std::visit over Link::kind.
template <class... Cases>
struct LinkCases : Cases... {
  using Cases::operator()...;
};
template <class... Cases>
LinkCases(Cases...) -> LinkCases<Cases...>;

/// A number that a link is made of.
struct LinkValue {
  const char* what;  // "stiffness"
  double value;
  const char* unit;
  bool may_be_zero = false;    // else > 0
  bool harms_if_small = true;  // a tiny one may be what makes numbers overflow
};
/// The numbers of a link but for matrices and Poisson's ratio.
std::vector<LinkValue> values_of(const Link& link);

/// What a link resists along the line of its two points; nothing unless traits_of(link).is_axial.
struct Axial {
  double stiffness = 0.0;  // [N/m] D of a spring, EA / L of a bar   (THEORY X44)
  double damping = 0.0;    // [N s/m] c of a dashpot   (THEORY X65)
};
Axial axial_of(const Scene& scene, const Link& link);

/// Rest vector from a link's first point to its second [m].
Eigen::Vector3d span_of(const Scene& scene, const Link& link);

/// A rigid link of three or more points; of two it is a rigid bar.
bool is_body(const Link& link);

/// Its forces are those on each of its points, as many as it has.
bool has_point_forces(const Link& link);

/// False of rigid links beside bodies or massless points, and of superelements, whose forces are not found.
bool publishes_forces(const Scene& scene, const Link& link);

}  // namespace freeflex
