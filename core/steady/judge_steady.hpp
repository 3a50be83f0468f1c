// The verdict on a quasi-static response: its distance from the shape on a rung with true geometry.
#pragma once

#include <string>

#include "core/error/verdict.hpp"
#include "core/plan/loads/quasi_static.hpp"

namespace freeflex {

/// The verdict on a quasi-static response.
struct SteadyVerdict {
  std::string why_not;  // why it is not judged; empty if it is
  Verdict::Level level = Verdict::Level::kGood;
  std::string cause;   // why not good, and what to do
  double error = 0.0;  // [m] distance from the shape on a rung with true geometry, rms over the mass
  double scale = 0.0;  // [m] the tolerance of the scene, or the larger displacement of both shapes
};

/// Returns the verdict on a quasi-static response. Newton's method finds the shape under the same load and
/// spin on the shadow of the plan   (THEORY 15.11). \pre quasi_static() returned the state for the load
SteadyVerdict judge_steady(const Plan& plan, const State& state, const SteadyLoad& load);

}  // namespace freeflex
