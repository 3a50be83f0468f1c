// Compares two plans of one scene: one plan omits a feature, and the other plan is forced to keep it.
#pragma once

#include <vector>

#include "tests/support/simulation.hpp"

namespace freeflex::testing {

/// Returns the plan that omits every feature that the scene does not need. Aborts with the faults of the
/// scene if there is no plan.
Plan reduced_plan_of(const Scene& scene);

/// Returns what the plan records about a feature.  \pre the plan was judged
const PlanFeature& feature_of(const Plan& plan, Feature feature);

/// A command and the tick at which it is sent.
struct TimedCommand {
  std::int64_t tick = 0;
  ForceCommand command;
};

/// Largest differences between two runs at any tick.
struct Change {
  double displacement = 0.0;   // [m] largest difference of the displacement of a point, body axes
  double position = 0.0;       // [m] largest difference of the position of a point, world axes
  double link_force = 0.0;     // [N], [N m]
  double largest = 0.0;        // [m] largest displacement in the run that keeps the feature
  double largest_force = 0.0;  // [N], [N m]
};

/// Runs the scene unchanged and with the feature `back` kept, and compares the published quantities.
Change change_by(Scene scene, Feature back, std::int64_t ticks,
                 const std::vector<TimedCommand>& commands = {});

}  // namespace freeflex::testing
