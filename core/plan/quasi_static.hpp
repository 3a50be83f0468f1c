// Quasi-static answer of a free structure: what it settles to under a steady load (inertia relief).
#pragma once

#include <optional>
#include <span>
#include <string>

#include "core/step/command.hpp"
#include "core/step/state.hpp"

namespace freeflex {

/// Steady load in body axes; the structure accelerates with it as a rigid body.
struct SteadyLoad {
  std::span<const PointForce> forces;  // [N]
  std::span<const Wrench> wrenches;    // [N], [N m]
  Vec3 spin{};                         // [rad/s] body axes; its centrifugal load needs a spin-loaded plan
  std::span<const PointTorque> torques = {};  // [N m] on points that turn
};

/// The state in which elastic forces balance F - S and the centrifugal load, q_l = Q_l / (M omega_l^2)
/// (THEORY X69, 7.1-7.3), at rest in the frame, which stands as the world. nullopt and `error` when a
/// mechanism is driven, a group cannot take a torque, the plan has no spin load for a spin or the answer is
/// not finite. Feedback, followers, attractors and wheels take no part.
std::optional<State> quasi_static(const Plan& plan, const SteadyLoad& load, std::string& error);

}  // namespace freeflex
