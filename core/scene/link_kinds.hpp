// Traits of the kinds of link. If a new alternative is added to LinkKind, the program does not compile until
// traits_of() and every std::visit over the kinds have a case for it.
#pragma once

#include <array>
#include <cstddef>
#include <limits>
#include <optional>
#include <vector>

#include "core/scene/scene.hpp"

namespace freeflex {

/// The effect of a link on the motion.
enum class LinkEffect {
  kStrains,  // resists its natural deformations with a stiffness   (THEORY 3.1)
  kForbids,  // forbids displacements   (THEORY 3.40, 3.41)
  kDamps,    // resists only the rate of deformation   (THEORY 3.45)
};

/// Holds the properties of a link. The properties that do not depend on its parameters are those of its type.
struct LinkTraits : LinkTypeTraits {
  static constexpr std::size_t kAnyNumber = std::numeric_limits<std::size_t>::max();
  std::size_t least = 2, most = 2;  // points
  LinkEffect effect = LinkEffect::kStrains;
  bool has_joint_rotations = false;  // acts on the rotations of joints at its points   (THEORY 3.21)
  bool follows_points = true;        // is defined by the positions of its points, in their order
  bool lists_points = true;          // its points are listed in the scene message
  bool is_surface = false;           // the triangle between its three points, which may have mass
};
constexpr LinkTraits traits_of(const Spring&) { return {traits_of(LinkType::kSpring)}; }
constexpr LinkTraits traits_of(const Bar&) { return {traits_of(LinkType::kBar)}; }
constexpr LinkTraits traits_of(const Beam&) {
  return {traits_of(LinkType::kBeam), 2, 2, LinkEffect::kStrains, true};
}
inline LinkTraits traits_of(const MatrixLink& matrix) {
  LinkTraits traits{traits_of(LinkType::kMatrix), is_superelement(matrix) ? 1U : 2U, LinkTraits::kAnyNumber};
  traits.has_joint_rotations = matrix.has_rotations;
  traits.follows_points = traits.lists_points = false;
  return traits;
}
constexpr LinkTraits traits_of(const BendingSpring&) { return {traits_of(LinkType::kBending), 3, 3}; }
constexpr LinkTraits traits_of(const TorsionSpring&) { return {traits_of(LinkType::kTorsion), 4, 4}; }
constexpr LinkTraits traits_of(const Plate&) {
  return {traits_of(LinkType::kPlate), 3, 3, LinkEffect::kStrains, true, true, true, true};
}
constexpr LinkTraits traits_of(const Rigid&) {
  return {traits_of(LinkType::kRigid), 2, LinkTraits::kAnyNumber, LinkEffect::kForbids};
}
constexpr LinkTraits traits_of(const Dashpot&) {
  return {traits_of(LinkType::kDashpot), 2, 2, LinkEffect::kDamps};
}

inline LinkTraits traits_of(const Link& link) {
  return std::visit([](const auto& kind) { return traits_of(kind); }, link.kind);
}

/// A parameter of a link.
struct LinkValue {
  const char* what;  // "stiffness"
  double value;
  const char* unit;
  bool may_be_zero = false;    // false: must be > 0
  bool harms_if_small = true;  // a very small value may cause an overflow
};
/// Returns the parameters of a link except matrices and Poisson's ratio.
std::vector<LinkValue> values_of(const Link& link);

/// Holds the coefficients of a link along the line of its two points. The coefficients are zero unless
/// traits_of(link).is_axial.
struct Axial {
  double stiffness = 0.0;  // [N/m] D of a spring, EA / L of a bar   (THEORY 3.3)
  double damping = 0.0;    // [N s/m] c_d of a dashpot   (THEORY 3.45)
};
Axial axial_of(const Scene& scene, const Link& link);

/// Returns the rest vector from the first to the second point of a link [m].
Eigen::Vector3d span_of(const Scene& scene, const Link& link);

/// Returns whether a link is a rigid body. A rigid body is a rigid link of three or more points.
bool is_body(const Link& link);

/// Returns whether a link forbids displacements: a rigid link or a rigid body.
inline bool is_rigid(const Link& link) { return traits_of(link).effect == LinkEffect::kForbids; }

/// Sets the mass of a bar, beam or plate to zero.
void remove_mass(Link& link);

/// Returns the matrices of a link that is given by matrices, or nullptr for any other link.
const MatrixLink* matrices_of(const Link& link);

/// Returns the number of inner coordinates of a link, which are those of a superelement.
int num_inner(const Link& link);

/// Rotations of the ends of a link about its local axes, one row for each end; true: released from the joint.
using Releases = std::array<std::array<bool, 3>, 2>;
Releases releases_of(const Link& link);

/// Returns the local axes of a link of two points as columns: x along the link, y in the direction that the
/// link gives, or else the scene axis to which the link is least parallel   (THEORY 3.4).
Eigen::Matrix3d axes_of(const Scene& scene, const Link& link);

/// Ratios phi = 12 EI / (GA L^2) of a beam for deflection along its local axes   (THEORY 3.10).
struct ShearRatios {
  double along_y = 0.0, along_z = 0.0;  // [-] 0: no shear deformation
};
/// Returns the ratios of a link of `length` [m] that bends, or nullopt for a link without bending stiffness.
std::optional<ShearRatios> shear_ratios_of(const Link& link, double length);

/// Returns whether a link is a beam whose bending stiffness is not the same about both axes.
bool bends_unequally(const Link& link);
/// Returns whether the published forces of a link are one force on each of its points.
bool has_point_forces(const Link& link);

/// Returns whether forces of the link can be published. Link forces are not computed for superelements, nor
/// for rigid links in scenes with bodies or massless points.
bool publishes_forces(const Scene& scene, const Link& link);

}  // namespace freeflex
