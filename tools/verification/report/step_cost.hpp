// Predicts the time of a step on this machine from counts and measured constants.
#pragma once

#include "core/plan.hpp"

namespace freeflex::tools {

/// Parts of the predicted time of a step [ns] (THEORY 14.17, 14.18). The prediction includes built-in loads
/// but no commands.
struct StepCost {
  double rigid = 0.0;     // the body, and work that does not depend on the number of modes
  double modes = 0.0;     // single modes
  double loads = 0.0;     // projection of built-in loads
  double fields = 0.0;    // spin load, attractor
  double coupling = 0.0;  // dashpots, feedback, followers
  double stages = 0.0;    // all work of a step on a coupled rung, which is not divided into parts
  double push = 0.0;      // additional time for a command on one point in world axes
  double point = 0.0;     // reading one point once, which the step does not include
  double shadow = 0.0;    // a tick of the shadow of the verdict, which the step does not include

  double step() const { return rigid + modes + loads + fields + coupling + stages; }
};

/// Measures the costs of one pass at the sizes of the plan, which takes some tens of milliseconds, and adds
/// up the parts. For coupled rungs and shadows, measures the time of whole steps instead.
StepCost predict_step(const Plan& plan);

}  // namespace freeflex::tools
