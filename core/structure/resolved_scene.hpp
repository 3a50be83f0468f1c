// The resolved scene holds the properties of points and links that follow from the scene alone. The set-up
// finds them once, and every later stage reads them here.
#pragma once

#include <vector>

#include "core/scene/link_kinds.hpp"

namespace freeflex {

/// Holds the properties of one link.
struct ResolvedLink {
  LinkTraits traits;
  Axial axial;  // coefficients along the line of its two points
  bool has_mass = false;

  bool is_rigid() const { return traits.effect == LinkEffect::kForbids; }
};

/// Holds the properties of all points and links of a scene.
struct ResolvedScene {
  bool are_point_masses = true;       // as are_point_masses(scene)
  std::vector<bool> has_attitude;     // one entry for each point, as has_attitude(point)
  std::vector<bool> moves_mass;       // one entry for each point, as points_that_move_mass()
  std::vector<bool> has_rotary_mass;  // one entry for each point, as points_with_rotary_mass()
  std::vector<ResolvedLink> links;

  /// Returns whether any link has mass.
  bool have_links_mass() const;
};

/// Returns the properties of the points and links of a scene. \pre check_physics found no error
ResolvedScene resolve(const Scene& scene);

}  // namespace freeflex
