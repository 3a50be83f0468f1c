// The motion of mass that is spread over links at true geometry. Its displacements are linear in the
// coordinates; rigid bodies turn by any angle   (THEORY 12.107 to 12.113).
#pragma once

#include <cstdint>
#include <vector>

#include "core/step/vector.hpp"

namespace freeflex {

/// Holds what a stage needs to find the velocities from the momenta; empty without spread mass.
struct SpreadWorkspace {
  struct Body {
    Mat3 A{};          // [-] spin of the body relative to the frame per rate of its rotation vector
    Mat3 D{}, E{};     // [kg m^2] of (THEORY 12.109)
    Mat3 G{};          // [-] Theta C^T / M
    Mat3 to_spin{};    // [kg m^2] E^T - G^T D
    Mat3 by_spin{};    // [-] (1 + K D)^-1 (G + K E): minus the change of theta' per angular velocity
    Vec3 theta{};      // [rad/s], [rad/s^2] theta' or theta'' that was found last
    Vec3 theta_dot{};  // [rad/s] rate of the rotation vector at the last evaluation
  };
  std::vector<Body> bodies;
  std::vector<double> coupling;      // [1/(kg m^2)] (3B x 3B) Theta Theta^T / M
  std::vector<double> factor;        // (3B x 3B) of 1 + coupling D, LU with rows exchanged
  std::vector<std::int32_t> pivots;  // (3B)
  std::vector<double> right;         // (3B)
  Mat3 inertia{}, inertia_rate{};    // [kg m^2], [kg m^2/s] I(q) and its rate at the last evaluation
};

struct StepPlan;
struct CoupledWorkspace;
struct StageState;
struct StageRate;
struct MotionState;
struct PlanTurningBody;
struct TurningMotion;

SpreadWorkspace make_spread_workspace(const StepPlan& plan);

/// Finds the velocities of the frame, the coordinates and the bodies from the momenta (THEORY 12.110). Sets
/// rate.w_B, rate.rate_q, w.q_dot, and in the bodies v and s; in w.W the velocities of points.
/// \pre the bodies are placed, and their S is Theta p
void set_spread_velocities(const StepPlan& plan, const StageState& stage, CoupledWorkspace& w,
                           StageRate& rate) noexcept;

/// Sets rate.rate_p, except for modal loads, from the forces on points and bodies (THEORY 12.111), and adds
/// the attraction of each part of the mass. Adds the generalized forces to rate.Q if it is set.
void set_spread_rates(const StepPlan& plan, const StageState& stage, CoupledWorkspace& w,
                      StageRate& rate) noexcept;

/// Sets rate.q_ddot and rate.w_dot_B   (THEORY 12.112).  \pre rate.rate_p is complete
void accelerate_spread(const StepPlan& plan, const StageState& stage, CoupledWorkspace& w,
                       StageRate& rate) noexcept;

/// The acceleration of the centre of a body without that of the centre of mass of the structure, in the axes
/// of the frame, and the rate of its spin, in its own axes   (THEORY 12.112).
struct SpreadRates {
  Vec3 a, s_dot;
};
SpreadRates read_spread_rates(const StepPlan& plan, const MotionState& state, const PlanTurningBody& body,
                              const TurningMotion& at) noexcept;

/// Returns the angular momentum of a motion without wheels [kg m^2/s], body axes, and changes p from q' to
/// the momenta [m/s] (num_padded)   (THEORY 12.109).
Vec3 momenta_of_spread(const StepPlan& plan, const Vec3& w_B, const double* q, const double* q_dot,
                       double* p) noexcept;

}  // namespace freeflex
