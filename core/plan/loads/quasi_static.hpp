// Quasi-static response of a free structure to a steady load (inertia relief).
#pragma once

#include <optional>
#include <span>
#include <string>

#include "core/plan.hpp"
#include "core/step/command.hpp"
#include "core/step/state.hpp"

namespace freeflex {

/// Holds a steady load in body axes. Under this load, the structure accelerates as a rigid body.
struct SteadyLoad {
  std::span<const PointForce> forces;  // [N]
  std::span<const Wrench> wrenches;    // [N], [N m]
  Vec3 spin{};                         // [rad/s] body axes; its centrifugal load needs the rung `spin-loaded`
  std::span<const PointTorque> torques = {};  // [N m] torques on points with an attitude
};

/// Returns the state in which the elastic forces balance F - S plus the centrifugal load. Here F is the load,
/// and S is the part of it that accelerates the structure as a rigid body: q_l = Q_l / c_ll, c_ll = M
/// omega_l^2 (THEORY 4.19, 5.8, 11.1 to 11.3). The points are at rest in the body frame, whose axes are
/// parallel to the world axes. Returns nullopt and sets `error` if the load drives a mechanism, if a group
/// cannot support a torque, if there is a spin but the plan has no spin load, or if the result is not finite.
/// Feedback, followers, attractors and wheels do not act.
std::optional<State> quasi_static(const Plan& plan, const SteadyLoad& load, std::string& error);

}  // namespace freeflex
