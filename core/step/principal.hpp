// Principal axes of the body. Principal axes split the energy of free rotation (THEORY 7.14).
#pragma once

#include "core/step/plan.hpp"

namespace freeflex {

/// Returns principal axes and inverse moments of a symmetric inverse inertia, by Jacobi's rotations (Jacobi
/// 1846; Golub and Van Loan 2013, 8.5). A diagonal matrix keeps its axes to the bit. libm is not used, so
/// that a plan has the same bits after it is written and read.
PlanPrincipal principal_of(const Mat3& inverse_inertia) noexcept;

/// Sets the member `principal` of a plan, of its fallback plan and of its shadows.
void set_principal(Plan& plan) noexcept;

}  // namespace freeflex
