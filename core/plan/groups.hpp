// Groups of points that take wrenches.
#pragma once

#include "core/step/plan.hpp"
#include "core/structure/structure.hpp"

namespace freeflex {

/// Groups with mass-weighted rigid weights, F_i = (m_i / m_g) F_g + m_i (J_g^-1 T_g) x d_i over points and
/// over the particles of bodies, whose rows are added   (THEORY X12, X160); a line takes no torque about
/// itself, one place takes none at all.  \pre plan.points
void compile_groups(const Scene& scene, const Structure& structure, Plan& plan);

}  // namespace freeflex
