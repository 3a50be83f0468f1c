#include "core/steady/judge_steady.hpp"

#include <algorithm>
#include <cmath>

#include "core/steady/relative_equilibrium.hpp"
#include "core/step/loads/loads.hpp"
#include "core/step/readout.hpp"

namespace freeflex {
namespace {

// Returns the plan with the steady load alone.
StepPlan with_load(StepPlan plan, const SteadyLoad& load) {
  plan.histories.clear();
  plan.feedbacks.clear();
  plan.attractor_mu = 0.0;
  for (PlanWheel& wheel : plan.wheels) wheel.momentum = 0.0;
  PlanHistory history;
  history.name = "steady load";
  history.pattern = build_pattern(plan, {1, load.forces, load.wrenches, load.torques});
  plan.histories.push_back(std::move(history));
  return plan;
}

}  // namespace

SteadyVerdict judge_steady(const Plan& plan, const State& state, const SteadyLoad& load) {
  SteadyVerdict verdict;
  const auto not_judged = [&](const std::string& why) {
    verdict.why_not = why;
    return verdict;
  };
  if (plan.verdict.shadows.empty()) return not_judged(not_judged_text(plan));
  const StepPlan shadow = with_load(plan.verdict.shadows.front().plan, load);
  const RelativeEquilibrium steady =
      RelativeEquilibria(shadow, 0.0).respond({load.spin[0], load.spin[1], load.spin[2]});
  if (!steady.error.empty()) return not_judged(steady.error);
  // points of links with mass may have none themselves
  const bool have_mass =
      std::ranges::any_of(shadow.points, [](const PlanPoint& point) { return point.mass > 0.0; });
  double mass = 0.0, off = 0.0, size = 0.0, displacement = 0.0, extent = 0.0;
  for (std::size_t i = 0; i < plan.points.size(); ++i) {
    const PlanPoint& point = shadow.points[i];
    if (plan.points[i].row < 0) continue;
    const Vec3 V = read_point(plan, state, static_cast<std::int32_t>(i)).V_B;
    const Eigen::Vector3d own(V[0], V[1], V[2]);
    const Eigen::Vector3d other = steady.displacements.col(static_cast<Eigen::Index>(i));
    const double weight = have_mass ? point.mass : 1.0;
    mass += weight;
    off += weight * (own - other).squaredNorm();
    size += weight * other.squaredNorm();
    displacement += weight * own.squaredNorm();
    extent = std::max(extent, length(point.r));
  }
  if (mass == 0.0)
    return not_judged("no point with mass is published or pushed, so there is nothing to compare");
  verdict.error = std::sqrt(off / mass);
  const double larger = std::sqrt(std::max(displacement, size) / mass);
  const bool has_tolerance = plan.verdict.tolerance > 0.0;
  verdict.scale = std::max(has_tolerance ? plan.verdict.tolerance : larger, 1e-9 * extent);
  const double ratio = verdict.scale > 0.0 ? verdict.error / verdict.scale : 0.0;
  verdict.level = grade(ratio, kGoodElastic, kMostElastic);
  if (steady.is_unstable) {
    verdict.level = Verdict::Level::kOutside;
    verdict.cause =
        "this shape is unstable: the structure buckles, and a small push moves it far; reduce the load";
  } else if (verdict.level > Verdict::Level::kGood) {
    verdict.cause = std::string("the shape on the rung ") + name_of(shadow.fidelity) +
                    " differs; reduce the load, or find the shape by a damped run on that rung";
  } else if (plan.verdict.shared != SharedError::kNone) {
    verdict.level = Verdict::Level::kWatch;
    verdict.cause = plan.verdict.shared_text;
  }
  return verdict;
}

}  // namespace freeflex
