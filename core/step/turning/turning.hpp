// Rigid bodies that turn by any angle, in a complete set of modes. The unknowns are the velocities of points
// and centres of mass, and the spins of bodies in their own axes   (THEORY 12.84 to 12.92).
#pragma once

#include <span>
#include <vector>

#include "core/step/links/rotations.hpp"
#include "core/step/plan.hpp"

namespace freeflex {

/// Returns whether a plan has mass that is spread over links at true geometry.
inline bool has_spread_mass(const StepPlan& plan) noexcept {
  return plan.coupled.kinetics.form == PlanKinetics::Form::kSpread;
}
/// Returns whether a plan has bodies that turn by any angle, or spread mass.
inline bool turns(const StepPlan& plan) noexcept {
  return !plan.coupled.turning.bodies.empty() || has_spread_mass(plan);
}

/// Returns whether a point is a point mass, which belongs to no body. \pre turns(plan)
inline bool is_free(const StepPlan& plan, std::size_t point) noexcept {
  return plan.coupled.turning.of_points[point] < 0;
}

/// Returns whether the matrix A of alpha in (THEORY 12.87) defines the axes of the frame: no rotation of the
/// body at rest corresponds to an alpha that is more than 10 times faster. Two bodies on a line lose the axis
/// along it if both turn across it by 90 degrees. \pre turns(plan)
bool has_frame(const StepPlan& plan, const Mat3& A) noexcept;

struct CoupledWorkspace;

/// Holds the motion of one body.
struct TurningMotion {
  Vec3 V{}, theta{};  // [m] elastic displacement of its centre; [rad] rotation vector, body axes
  Vec3 W{}, S{};  // [m/s], [rad/s] velocity and spin of the momenta p, sum_l b_cl p_l and sum_l theta_l p_l
  Mat3 R{};       // exp(theta)
  double inverse_tangent = 0.0;  // coefficient of [theta x]^2 in N(theta)
  Vec3 line{};                   // [-] unit vector along a rod, axes of the body; zero for other bodies
  double roll_rate = 1.0;        // l . N l of a rod with the line l
  Vec3 v{}, s{};           // [m/s] velocity of the centre, axes of the frame; [rad/s] spin, axes of the body
  Vec3 wheels{};           // [N m s] momentum of its wheels, axes of the body
  Vec3 force{}, torque{};  // [N], [N m] loads, axes of the frame; the torque is about its centre
  Vec3 linear_torque{};    // [N m] of the linear links, rest axes
  Vec3 motors{};           // [N m] torque of the motors of its wheels on the body, axes of the body
};

/// [rad] Largest rotation of a body against the frame. At 2 pi the rotation vector has no rate
/// (THEORY 12.86).
inline constexpr double kMostRotationOfBody = 5.5;
/// [rad] The same of a rod, the direction of which has no rotation vector at pi   (THEORY 12.118).
inline constexpr double kMostRotationOfRod = 2.8;
/// [rad] The same with spread mass, whose displacements are linear in the rotation vectors (THEORY 12.107).
inline constexpr double kMostRotationWithSpreadMass = 1.0;
/// Returns the first body that has turned further, or -1.
std::int32_t body_turned_too_far(const StepPlan& plan, std::span<const TurningMotion> bodies) noexcept;

/// Returns N(theta) s, the rate of a rotation vector from the spin in the axes of the body:
///   N = 1 + [theta x] / 2 + coefficient [theta x]^2   (THEORY 12.86)
inline Vec3 rate_with_roll(const TurningMotion& body, const Vec3& s) noexcept {
  const Vec3 once = cross(body.theta, s);
  return add_scaled(add_scaled(s, 0.5, once), body.inverse_tangent, cross(body.theta, once));
}
/// Returns the same for the roll of a rod at which its rotation vector stays normal to its line:
///   N s - N l (l . N s) / (l . N l)   (THEORY 12.118)
inline Vec3 rate_of_rotation(const TurningMotion& body, const Vec3& s) noexcept {
  const Vec3 rate = rate_with_roll(body, s);
  if (is_zero(body.line)) return rate;
  return add_scaled(rate, -dot(body.line, rate) / body.roll_rate, rate_with_roll(body, body.line));
}

/// Returns whether a body has no inertia about a line.
/// \param along  [m] from the first to the last of its points
inline bool is_rod(const PlanTurningBody& body, const Vec3& along) noexcept {
  constexpr double kNone = 1e-12;  // [-] of the trace of the inertia
  const Vec3 J = multiply(body.inertia, along);
  const double trace = body.inertia[0] + body.inertia[4] + body.inertia[8];
  return dot(J, J) <= kNone * kNone * trace * trace * dot(along, along) && !is_zero(along);
}
/// Returns the unit vector along a rod, or zero for other bodies.
Vec3 line_of(const StepPlan& plan, const PlanTurningBody& body) noexcept;

/// Sets the displacement and the rotation of a body at coordinates q.
void place_body(const StepPlan& plan, const PlanTurningBody& body, const double* q,
                TurningMotion& at) noexcept;
/// Sets the displacements and rotations of the bodies at coordinates q, and the displacements of their
/// points:
///   V_i = V_c + (R - 1) d_i   (THEORY 12.85).
/// \param V  [m] (num_points) those of point masses are set already
void place_bodies(const StepPlan& plan, const double* q, std::span<Vec3> V,
                  std::span<TurningMotion> bodies) noexcept;

/// Sets the force of each body to what acts on its momenta beyond the linear links, in the axes of the frame,
/// the torque to that of all links in the axes of the body, and the torque of the linear links
/// (THEORY 12.91).
void sum_body_forces(const StepPlan& plan, CoupledWorkspace& w) noexcept;
/// Adds the forces on bodies to Q.
void add_body_forces(const StepPlan& plan, const CoupledWorkspace& w, double* Q) noexcept;

/// Returns the present position of a point or particle of a body, from the centre of mass of the structure.
/// \param r  [m] its rest position
Vec3 position_on_body(const PlanTurningBody& plan, const TurningMotion& body, const Vec3& r) noexcept;

/// Returns the motion of a body of a state on a complete set of modes, without momenta and loads.
/// \param w  [rad/s] angular velocity of the frame, body axes
TurningMotion read_turning(const StepPlan& plan, const PlanTurningBody& body, const double* q,
                           const double* q_dot, const Vec3& w) noexcept;

/// Returns the angular momentum of a motion [kg m^2/s], body axes, with that of wheels, and sets the momenta
/// p [m/s] (num_padded) from q'   (THEORY 12.87, 12.89).
Vec3 momenta_of_turning(const StepPlan& plan, std::span<const double> wheels, const Vec3& w, const double* q,
                        const double* q_dot, double* p) noexcept;
/// Returns the momentum of the wheels, sum R h a [N m s], body axes.
Vec3 wheel_momentum_in_frame(const StepPlan& plan, std::span<const double> momentum,
                             const double* q) noexcept;
/// Returns the kinetic energy about the centre of mass without that of wheels [J].
double kinetic_energy_of_turning(const StepPlan& plan, const Vec3& w, const double* q,
                                 const double* q_dot) noexcept;

}  // namespace freeflex
