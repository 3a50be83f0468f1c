// A rung of the fidelity ladder that runs in a study.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "core/motion.hpp"
#include "tools/verification/report/study_runs.hpp"

namespace freeflex::tools {

/// Simulates a plan. If the free motion after the loads has a step of its own, the same plan continues with
/// that step.
struct Rung {
  Plan plan;
  std::optional<Plan> free_plan;
  std::vector<CarriedPoint> carried;  // points of the reference on bodies, after those of the plan
  Motion motion;

  std::vector<Vec3> V, V_dot;  // [m], [m/s] (num_points) body axes

  Rung(const Rung&) = delete;  // the motion refers to the plan
  Rung(Plan given, const CartesianSystem& system);

  /// Returns to the initial values of the plan.
  void restart() { motion.set_plan(plan), motion.reset(); }
  /// Advances by ticks. Returns false if the state is not finite.
  bool advance(std::int64_t ticks) { return advance(plan, ticks); }
  bool advance_freely() { return advance(*free_plan, 1); }

  /// Sets a step [s] of its own for the motion after the first `ticks`, by which every pulse has ended.
  void take_freely(std::int64_t ticks, double free_step);

  /// Reads positions and velocities of all points into the form that other methods use.
  /// \pre mode-shape row i belongs to point i
  void read(CartesianState& to);
  std::size_t num_read() const { return plan.points.size() + carried.size(); }

  double energy() const;
  std::size_t memory() const;  // [bytes]

 private:
  bool advance(const Plan& at, std::int64_t ticks);
  void read_points(CartesianState& to);
};

}  // namespace freeflex::tools
