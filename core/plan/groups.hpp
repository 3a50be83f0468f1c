// Groups of points that take wrenches.
#pragma once

#include "core/step/plan.hpp"
#include "core/structure/structure.hpp"

namespace freeflex {

/// Mass-weighted rigid weights of a group, F_i = (m_i / m_g) F_g + m_i (J_g^-1 T_g) x d_i   (THEORY
/// X12); a line takes no torque about itself, one place takes none at all.
PlanGroup compile_group(const Scene& scene, const Group& group, const MassProperties& body);

}  // namespace freeflex
