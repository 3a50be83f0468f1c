// Groups of points that take wrenches.
#pragma once

#include "core/step/plan.hpp"
#include "core/structure/structure.hpp"

namespace freeflex {

/// Mass-weighted rigid weights of a group, f_i = m_i (F / m + (I^-1 T) x d_i)   (THEORY X12); a line takes no
/// torque about itself, one place takes none at all.
PlanGroup compile_group(const Scene& scene, const Group& group, const MassProperties& body);

}  // namespace freeflex
