// Compilation of groups of points on which wrenches act.
#pragma once

#include "core/plan.hpp"
#include "core/structure/structure.hpp"

namespace freeflex {

/// Compiles groups. A wrench on a group acts as the forces F_i = (m_i / m_g) F_g + m_i (J_g^-1 T_g) x d_i on
/// points and on the particles of bodies. The rows of these particles are added to the plan
/// (THEORY 8.8, 16.4). A collinear group supports no torque about its line, and a group at one position
/// supports no torque   (THEORY 8.9).
/// \pre plan.points is filled
void compile_groups(const Scene& scene, const Structure& structure, StepPlan& plan);

}  // namespace freeflex
