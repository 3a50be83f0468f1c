// What a step of a plan costs on this machine, from counts and measured constants.
#pragma once

#include "core/step/plan.hpp"

namespace freeflex::tools {

/// Parts of the predicted time of one step [ns]   (THEORY X126). Built-in loads count, commands do not.
struct StepCost {
  double rigid = 0.0;     // the body and what does not grow with modes
  double modes = 0.0;     // single modes
  double loads = 0.0;     // projection of built-in loads
  double fields = 0.0;    // spin load, attractor
  double coupling = 0.0;  // dashpots, feedback, followers
  double stages = 0.0;    // all of a coupled rung, whose parts go through one another
  double push = 0.0;      // more for a command on one point in world axes
  double point = 0.0;     // reading one point, once; no part of the step
  double budget = 0.0;    // the shadows of the error budget, beside the step

  double step() const { return rigid + modes + loads + fields + coupling + stages; }
};

/// Measures the constants for some tens of milliseconds, at the plan's own sizes, and adds up. Coupled rungs
/// and shadows are measured as they are.
StepCost predict_step(const Plan& plan);

}  // namespace freeflex::tools
