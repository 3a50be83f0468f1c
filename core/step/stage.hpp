// One stage of a step on the coupled rungs: where the body stands, and what its motion gains there.
#pragma once

#include "core/step/external.hpp"
#include "core/step/state.hpp"
#include "core/step/vector.hpp"

namespace freeflex {

/// Where the body stands at one stage.
struct Place {
  const double *q, *p;  // [m], [m/s] (num_padded) elastic coordinates and momenta over the mass
  Vec3 H_B;             // [kg m^2/s]
  Mat3 R_WB;
  Vec3 p_WB;  // [m]
  Instant instant;
  std::span<const double> wheels;  // [N m s] (num_wheels) their momentum there
};

/// What the motion gains there. Arrays of the caller: rate_q [m/s], rate_p [m/s^2] (num_padded).
struct Gain {
  double *rate_q, *rate_p;
  double* Q = nullptr;       // [N] (num_padded) generalized forces, where they are asked for
  Vec3 w_B{};                // [rad/s]
  Vec3 moment_B{};           // [N m] with the arms of the deformed body
  Vec3 rest_moment_B{};      // [N m] with the arms of the body at rest
  Vec3 force_W{};            // [N]
  double* q_ddot = nullptr;  // [m/s^2] (num_padded) where Q is asked for and the modes are not complete
  Vec3 w_dot_B{};            // [rad/s^2] beside q_ddot
};

/// What the motion gains beside the modes' own linear motion   (THEORY X92, X190 to X195).
void evaluate(const External& external, const Place& place, Workspace& workspace, Gain& gain) noexcept;

/// The same where modes are not a complete set of point masses   (THEORY X190 to X195).
void evaluate_incomplete(const External& external, const Place& place, Workspace& workspace,
                         Gain& gain) noexcept;

/// Angular momentum and elastic momenta over the mass of a motion   (THEORY X91, X190), as
/// set_coupled_motion.
Vec3 momenta_by_tables(const Plan& plan, const Vec3& w_B, const double* q, const double* q_dot,
                       double* p) noexcept;

/// Bodies with an offset, whose centres the resultant of all loads accelerates   (THEORY X198). Added to
/// rate_p and Q.  \pre gain.force_W
void add_offset_loads(const Plan& plan, const Place& place, Gain& gain) noexcept;

/// Momentum of the wheels, axes turned with their bodies [N m s], body axes   (THEORY X168).
Vec3 turned_wheel_momentum(const Plan& plan, std::span<const double> momentum, const double* q) noexcept;
/// [J] what (w . H + M q'.p) has beside twice the kinetic energy, momenta less those of wheels   (X168).
double wheel_energy(const Plan& plan, std::span<const double> momentum, const double* q,
                    const double* q_dot) noexcept;
/// p_l += sign h theta_l . (a x theta) / (2 M) [m/s] (num_padded), which the momenta lack   (X168).
void add_wheel_momenta(const Plan& plan, std::span<const double> momentum, const double* q, double sign,
                       double* p) noexcept;
/// Generalized forces of the wheels [N] (num_padded), frame turning at w   (X168).
void add_wheel_forces(const External& external, const Place& place, const Vec3& w, const double* q_dot,
                      double* Q) noexcept;
/// Rate of turned_wheel_momentum [N m], and added to Q that of M add_wheel_momenta [N]   (X168).
Vec3 add_wheel_rates(const External& external, const Place& place, const double* q_dot, double* Q) noexcept;

/// Loads on what carries mass: histories, commands, and what followers add as they turn, theta x f   (X73).
void gather_forces(const External& external, const Place& place, CoupledWorkspace& w) noexcept;

/// Fields, dashpots, feedback and what followers stiffen: few coordinates, added after the sums over points.
void add_modal_loads(const External& external, const Place& place, Workspace& workspace, Gain& gain) noexcept;

/// An inertia as solve_turning takes it: on a line, which carries no spin about itself, the two equations
/// across it, held apart from the third.
Mat3 turning_matrix(const Plan& plan, const Mat3& J) noexcept;
/// J^-1 b, across the line where the body is on one.  \param matrix  turning_matrix of J
Vec3 solve_turning(const Plan& plan, const Mat3& matrix, const Vec3& b) noexcept;

}  // namespace freeflex
