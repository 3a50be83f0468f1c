// Two plans of one scene side by side: with a part left out and with it forced back in.
#pragma once

#include <vector>

#include "tests/support/simulation.hpp"

namespace freeflex::testing {

/// Aborts with the faults of the scene when it has no plan.
Plan lean_plan_of(const Scene& scene);

/// The account of a part.  \pre the plan was judged
const PlanPart& part_of(const Plan& plan, Part part);

/// A command and the tick at which it is given.
struct TimedCommand {
  std::int64_t tick = 0;
  ForceCommand command;
};

/// The most that two runs differ by at any tick.
struct Change {
  double displacement = 0.0;   // [m] of a point, body axes
  double position = 0.0;       // [m] of a point, world axes
  double link_force = 0.0;     // [N], [N m]
  double largest = 0.0;        // [m] displacement of the run with everything in
  double largest_force = 0.0;  // [N], [N m]
};

/// Runs the scene as it is and with `back` kept, and compares what is published.
Change change_by(Scene scene, Part back, std::int64_t ticks, const std::vector<TimedCommand>& commands = {});

}  // namespace freeflex::testing
