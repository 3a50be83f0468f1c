// Accelerations that depend on place: the spin's centrifugal field and an attractor's (THEORY X70-X72).
#pragma once

#include "core/step/state.hpp"
#include "core/step/vector.hpp"

namespace freeflex {

/// Acceleration of free fall at a place [m/s^2], world axes: uniform gravity, or the attractor's.
Vec3 gravity_at(const Plan& plan, const Vec3& p_W) noexcept;

/// What an attractor's pull at a place x from the centre of mass has beyond that at it [m/s^2],
/// g(rho + x) - g(rho), without a difference of large numbers   (THEORY X205). Axes of rho and x.
Vec3 tide(double mu, const Vec3& rho, const Vec3& x) noexcept;

/// Torque of an attractor's gravity gradient about the centre of mass [N m], in the axes of rho and inertia:
/// 3 mu / |rho|^5 rho x I rho   (THEORY X72). \param rho  [m] centre of mass from the attractor, body axes
Vec3 gradient_torque(const Plan& plan, const Vec3& rho) noexcept;

/// True when the plan has a field that loads elastic coordinates.
inline bool has_field(const Plan& plan) noexcept { return plan.has_spin_load || plan.attractor_mu > 0.0; }

/// Adds the field's generalized forces, Q_l += sum_ab S_ab Y_l,ab, with S r_i its acceleration in body axes:
/// S = w.w 1 - w w^T of the spin, mu / |rho|^3 (3 u u^T - 1) of an attractor   (THEORY X70, X72).
/// \param H_W  [kg m^2/s] angular momentum  \param p_W  [m] centre of mass
void add_field(const Plan& plan, const Mat3& R_WB, const Vec3& H_W, const Vec3& p_W, double* Q) noexcept;

}  // namespace freeflex
