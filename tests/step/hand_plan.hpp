// This file makes plans in which the test chooses every number.
#pragma once

#include <span>
#include <vector>

#include "core/step/step.hpp"

namespace freeflex::testing {

/// The mode obeys q'' + 2 decay q' + omega^2 q = Q / mass.
struct Mode {
  double omega = 0.0;  // [rad/s]
  double decay = 0.0;  // [1/s]
  double q = 0.0;      // [m] at the start
  double q_dot = 0.0;  // [m/s] at the start
};

/// Returns a plan of a body of 2 kg with the principal moments 2, 3 and 4 kg m^2 and the given modes. Point k
/// of num_points lies at hand_point(k) and moves in mode l by hand_shape(k, l). Every point is pushable and
/// has mode-shape rows.
StepPlan hand_plan(double period, std::span<const Mode> modes, int num_points = 1);
Vec3 hand_point(int point);
Vec3 hand_shape(int point, int mode);

/// Returns a group of the given points with its mass, centre and inverse inertia.
PlanGroup hand_group(const StepPlan& plan, std::vector<std::int32_t> points);

/// Returns a command of `sender` without loads that never ends. add_force and add_wrench fill it.
ForceCommand hand_command(const char* sender, int slot, std::int32_t axes = 0);
void add_force(ForceCommand& command, int point, const Vec3& force);
void add_wrench(ForceCommand& command, int group, const Vec3& force, const Vec3& torque);

/// Holds a reference to a plan, and a state and a workspace for it. The commands given to run() take effect
/// at its first tick.
struct HandRun {
  explicit HandRun(const StepPlan& given)
      : plan(given), state(make_state(given)), workspace(make_workspace(given)) {}
  StepStatus step_once(std::span<const ForceCommand> commands = {}) {
    step(plan, state, {commands}, workspace, report);
    return report.status;
  }
  void run(std::int64_t ticks, std::span<const ForceCommand> commands = {});

  const StepPlan& plan;
  State state;
  Workspace workspace;
  StepReport report;
};

}  // namespace freeflex::testing
