// A compiled scene in motion, with the read-out of the motion as matrices.
#pragma once

#include <Eigen/Core>
#include <span>
#include <string_view>

#include "core/plan.hpp"
#include "core/step/readout.hpp"
#include "core/step/step.hpp"
#include "core/structure/structure.hpp"

namespace freeflex::testing {

/// Returns the full plan of a scene. Aborts with the faults of the scene if it has no plan.
Plan plan_of(const Scene& scene);

struct Simulation {
  explicit Simulation(const Scene& scene) : Simulation(plan_of(scene)) {}
  explicit Simulation(Plan given);

  /// Steps `ticks` times. The commands take effect at the first tick. Aborts if a step fails.
  void run(std::int64_t ticks, std::span<const ForceCommand> commands = {});

  Eigen::Matrix3Xd positions_W() const;      // [m] (3 x N), NaN for a point without a mode-shape row
  Eigen::Matrix3Xd velocities_W() const;     // [m/s] (3 x N)
  Eigen::Matrix3Xd displacements_B() const;  // [m] (3 x N)
  Eigen::VectorXd link_forces() const;  // [N], [N m] values of all published links, one link after another

  Plan plan;
  State state;
  Workspace workspace;
  StepReport report;
};

/// Returns a plan without the stiffness by loads and spin, so that sums over points give its momenta and
/// energy.
inline Plan without_load_stiffness(Plan plan) {
  plan.field_stiffening = plan.command_stiffening = {};
  for (PlanHistory& history : plan.histories) history.stiffening = {};
  return plan;
}

/// Returns a command without loads from sender "test" that takes effect at the next tick and never ends.
/// add_force adds forces to it.
ForceCommand make_command(int slot, std::int64_t sequence, Axes axes = Axes::kWorld,
                          std::int64_t duration_ticks = std::int64_t{1} << 40);
void add_force(ForceCommand& command, int point, const Eigen::Vector3d& force);

}  // namespace freeflex::testing
