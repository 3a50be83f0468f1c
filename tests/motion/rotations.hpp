// This file computes elastic rotations of joints. It is header only.
#pragma once

#include "core/step/state.hpp"
#include "core/structure/links/link_factor.hpp"

namespace freeflex::testing {

/// Returns theta [rad] of the joint at a point, in body axes.
inline Eigen::Vector3d joint_rotation(const Structure& structure, const Freedoms& freedoms, int point,
                                      const State& state) {
  const Eigen::Map<const Eigen::VectorXd> q(state.q.data(), structure.omega.size());
  return structure.rotations.middleRows<3>(freedoms.rotation(point) - freedoms.num_displacements()) * q;
}

}  // namespace freeflex::testing
