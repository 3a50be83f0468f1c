// This file defines a plan in motion with an error budget.
#pragma once

#include "core/error/budget.hpp"
#include "core/error/judgement.hpp"
#include "tests/motion/rung_cases.hpp"
#include "tests/support/omissions.hpp"

namespace freeflex::testing {

/// Watched is a plan in motion with the shadows of the error budget.
struct Watched {
  Plan plan;
  State state;
  Workspace workspace;
  Budget budget;
  StepReport report;

  explicit Watched(const Scene& scene)
      : plan(reduced_plan_of(scene)),
        state(make_state(plan)),
        workspace(make_workspace(plan)),
        budget(make_budget(plan)) {}

  BudgetReading run(int ticks, const Inputs& first = {}) {
    for (int k = 0; k < ticks; ++k) {
      const bool is_first = k == 0 && !first.commands.empty();
      step(plan, state, is_first ? first : Inputs{}, workspace, budget, report);
      EXPECT_EQ(report.status, StepStatus::kOk);
    }
    return read_budget(plan, state, budget);
  }
};

inline Scene watched_truss(Fidelity rung, double horizon, double spin = 0.5) {
  Scene scene = boxed_truss(spin, 10.0);
  scene.fidelity = rung;
  scene.rate = 1000.0;
  scene.error_budget.horizon = horizon;
  return scene;
}

inline std::pair<Verdict, std::string> verdict_of(const Scene& scene, int ticks) {
  Watched watched(scene);
  Judgement judgement(watched.plan);
  judgement.take(watched.state, watched.budget);
  for (int k = 0; k < ticks; ++k) {
    watched.run(1);
    judgement.take(watched.state, watched.budget);
  }
  return {judgement.now(), text_of(watched.plan, judgement.now())};
}

}  // namespace freeflex::testing
