// The fields of acceleration are uniform gravity, the centrifugal field of the spin, and the field of an
// attractor (THEORY 8.14 to 8.23).
#pragma once

#include <array>

#include "core/step/state.hpp"
#include "core/step/vector.hpp"

namespace freeflex {

/// Returns the acceleration of free fall at a position [m/s^2], world axes. This is the uniform field, or -mu
/// / |rho|^3 rho, where rho is p_W minus the position of the attractor   (THEORY 8.17).
Vec3 gravity_at(const StepPlan& plan, const Vec3& p_W) noexcept;

/// Returns the attraction at the position x from the centre of mass, minus the attraction at the centre of
/// mass [m/s^2], in the axes of rho and x. The formula avoids subtracting two large numbers. With
/// y = |rho + x|^2 / |rho|^2:
///   g(rho + x) - g(rho) = -mu / |rho|^3 (y^(-3/2) x + (y^(-3/2) - 1) rho)   (THEORY 8.22)
Vec3 tidal_acceleration(double mu, const Vec3& rho, const Vec3& x) noexcept;

/// Returns the torque about the centre of mass due to the gravity gradient of an attractor [N m], body axes:
///   L_B = 3 mu / |rho|^5 rho x I rho   (THEORY 8.20)
/// \param rho  [m] position of the centre of mass from the attractor, body axes
Vec3 gradient_torque(const StepPlan& plan, const Vec3& rho) noexcept;

/// Returns the field S of accelerations S r: the components S_xx S_yy S_zz S_xy S_xz S_yz [rad^2/s^2], body
/// axes:
///   S = (w.w) 1 - w w^T + Gamma,   Gamma = mu / |rho|^3 (3 e e^T - 1),   e = rho / |rho| (THEORY 8.16, 8.19)
/// Gamma is zero without an attractor.
/// \param w_B  [rad/s] spin, body axes; zero: the field has no terms in the spin
/// \param p_W  [m] position of the centre of mass, world axes
std::array<double, 6> field_of(const StepPlan& plan, const Mat3& R_WB, const Vec3& w_B,
                               const Vec3& p_W) noexcept;

/// Returns true if the plan has a field that loads the elastic coordinates.
inline bool has_field(const StepPlan& plan) noexcept { return plan.has_spin_load || plan.attractor_mu > 0.0; }

/// Adds to Q the generalized forces of the centrifugal field and of the attractor's gradient. Their
/// acceleration at r_i is S r_i, in body axes:
///   Q_l += sum_ab S_ab Y_l,ab   (THEORY 8.14, 8.16)
/// The terms in the spin w are included only on the rung `spin-loaded`.
/// \param H_W  [kg m^2/s] angular momentum about the centre of mass, world axes
/// \param p_W  [m] position of the centre of mass, world axes
void add_field(const StepPlan& plan, const Mat3& R_WB, const Vec3& H_W, const Vec3& p_W, double* Q) noexcept;

}  // namespace freeflex
