// Principal axes of the body, along which the energy of free rotation is split (THEORY 7.14).
#pragma once

#include "core/step/plan.hpp"

namespace freeflex {

/// Returns principal axes and inverse moments of a symmetric inverse inertia, by Jacobi's rotations (Jacobi
/// 1846; Golub and Van Loan 2013, 8.5). The axes of a diagonal matrix are exact. libm is not used, so that a
/// plan that is read from a file gets the same bits as the plan that was written.
PlanPrincipal principal_of(const Mat3& inverse_inertia) noexcept;

/// Sets the member `principal` of a plan and of its fallback plan.
void set_principal(StepPlan& plan) noexcept;

}  // namespace freeflex
