// The principal axes of the body, in which free rotation divides into turns about one axis each (THEORY
// X200).
#pragma once

#include "core/step/plan.hpp"

namespace freeflex {

/// Principal axes and inverse moments of a symmetric inverse inertia, by Jacobi's rotations (Jacobi 1846;
/// Golub and Van Loan 2013, 8.5): a diagonal one keeps its axes to the bit. No libm, so that a plan that is
/// read from a file gets the bits of the one that was written.
PlanPrincipal principal_of(const Mat3& inverse_inertia) noexcept;

/// Sets Plan::principal of a plan and of the plans in it.
void set_principal(Plan& plan) noexcept;

}  // namespace freeflex
