#include "core/plan/explain.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <sstream>

#include "core/faults.hpp"
#include "core/motion.hpp"
#include "core/plan/rungs/rates.hpp"
#include "core/plan/rungs/shadow.hpp"
#include "core/step/readout.hpp"

namespace freeflex {
namespace {

// Returns the effective length of a step [s].
double step_of(const StepPlan& plan) { return plan.period / plan.coupled.num_substeps; }

// Returns a plan without the stiffness by loads and fields.
std::optional<Plan> without_stiffness(std::optional<Plan> plan) {
  if (!plan) return plan;
  plan->field_stiffening = plan->command_stiffening = {};
  for (PlanHistory& history : plan->histories) history.stiffening = {};
  return plan;
}

// The ladder is stepped from the start of an epoch to its end.
constexpr std::int64_t kForever = std::int64_t{1} << 60;
// Largest number of steps into which the ladder divides a tick to halve the length of the step.
constexpr std::int32_t kMostHalves = 1024;

}  // namespace

Explanation::Explanation(const Scene& scene, const Structure& structure, const Plan& plan) : plan_(plan) {
  for (const PlanPoint& point : plan.verdict.shadows.front().plan.points) mass_.push_back(point.mass);
  if (std::ranges::all_of(mass_, [](double mass) { return mass == 0.0; })) std::ranges::fill(mass_, 1.0);
  const double rate = 1.0 / plan.period;
  const bool is_true = traits_of(plan.fidelity).has_true_geometry;
  const auto whole = [&](Fidelity rung, std::int32_t substeps) {
    Faults faults;  // a rung that does not support the scene is left out
    return whole_plan(scene, structure, rung, substeps * rate, faults);
  };
  const bool omits = !plan.mode_numbers.empty() || plan.num_elastic < structure.omega.size();
  if (omits && traits_of(plan.fidelity).has_modes) add(Effect::kTruncation, whole(plan.fidelity, 1), 1);
  // spin and wheels may divide the steps of both plans alike
  std::optional<Plan> fine;
  std::int32_t halves = 1;
  do {
    halves *= 2;
    fine = whole(plan.fidelity, halves);
  } while (fine && is_coupled(plan) && 2.0 * step_of(*fine) > step_of(plan) && halves < kMostHalves);
  add(Effect::kIntegration, std::move(fine), halves);
  if (!traits_of(plan.fidelity).couples) {
    std::optional<Plan> coupled = whole(kBetterRungs.back(), 2);
    add(Effect::kGyration, without_stiffness(coupled), 2);
    add(Effect::kStiffness, std::move(coupled), 2);
  }
  const PlanShadow& best = plan.verdict.shadows.front();
  if (!is_true && traits_of(best.plan.fidelity).has_true_geometry) {
    Plan curved = plan;  // for the parts of a plan that the step does not read
    static_cast<StepPlan&>(curved) = best.plan;
    set_rate(static_cast<StepPlan&>(curved), 2.0 * rate);
    add(Effect::kCurvature, std::move(curved), 2);
    steps_.back().plan.modes = best.modes;
  }
  // below the coupled rungs, a plan can only take loads as it samples them, so all plans do
  for (const Step& step : steps_) shadows_.emplace_back(plan_, step.plan, false);
  has_stopped_.resize(steps_.size(), false);
}

/// Adds a plan to the ladder, with the modes of the structure unless they are set afterwards.
void Explanation::add(Effect effect, std::optional<Plan> plan, std::int32_t substeps) {
  if (!plan) return;
  Step& step = steps_.emplace_back();
  step.effect = effect;
  step.plan.plan = std::move(*plan);
  step.plan.substeps = substeps;
  step.plan.horizon_ticks = kForever;
  step.plan.modes[0].numbers = indices_of_modes(plan_);
  if (!plan_.fallback.empty()) step.plan.modes[1].numbers = indices_of_modes(plan_.fallback.front());
  sizes_.push_back({effect, {}});
}

void Explanation::command(std::int64_t tick, std::span<const ForceCommand> commands) {
  for (Shadow& shadow : shadows_) shadow.command(tick, commands);
}

void Explanation::take(const MotionState& state) {
  std::optional<Place> before;
  const StepPlan& active = active_plan(plan_, state);
  const bool has_rows =
      std::ranges::all_of(active.points, [](const PlanPoint& point) { return point.row >= 0; });
  if (has_rows) before = place_of(active, state);
  for (std::size_t k = 0; k < shadows_.size(); ++k) {
    shadows_[k].take(state);
    has_stopped_[k] = has_stopped_[k] || shadows_[k].status() != StepStatus::kOk;
    if (has_stopped_[k]) {
      constexpr double kUnknown = std::numeric_limits<double>::infinity();
      sizes_[k].most = {kUnknown, kUnknown, kUnknown};
      continue;
    }
    const Place now = place_of(steps_[k].plan.plan, shadows_[k].state());
    MotionError off = shadows_[k].error();  // distance from the state, if its plan has no rows for all points
    if (before) off = distance(*before, now);
    MotionError& most = sizes_[k].most;
    most = {std::max(most.position, off.position), std::max(most.attitude, off.attitude),
            std::max(most.deformation, off.deformation)};
    before = now;
  }
}

Explanation::Place Explanation::place_of(const StepPlan& plan, const MotionState& state) {
  Place place{std::vector<Vec3>(plan.points.size()), state.p_WB, state.q_WB};
  for (std::size_t i = 0; i < place.V.size(); ++i)
    place.V[i] = read_in_frame(plan, state, static_cast<int>(i)).V;
  return place;
}

MotionError Explanation::distance(const Place& a, const Place& b) const {
  double sum = 0.0, mass = 0.0;
  for (std::size_t i = 0; i < mass_.size(); ++i) {
    const Vec3 off = sub(a.V[i], b.V[i]);
    sum += mass_[i] * dot(off, off);
    mass += mass_[i];
  }
  return {length(sub(a.p_W, b.p_W)), length(rotation_between(a.q_WB, b.q_WB)), std::sqrt(sum / mass)};
}

std::vector<EffectSize> Explanation::effects() const {
  std::vector<EffectSize> all = sizes_;
  std::ranges::stable_sort(all, std::greater<>(),
                           [](const EffectSize& each) { return each.most.deformation; });
  return all;
}

std::string Explanation::leading() const {
  const std::vector<EffectSize> all = effects();
  if (all.empty() || all.front().most.deformation == 0.0) return {};
  std::ostringstream size;
  size.precision(2);
  size << all.front().most.deformation;
  return std::string("mostly ") + name_of(all.front().effect) + " (" + size.str() + " m)";
}

std::optional<std::vector<EffectSize>> explain_motion(const Scene& scene, const Structure& structure,
                                                      const Plan& plan, double seconds) {
  Explanation explanation(scene, structure, plan);
  Motion motion(plan, kMotionAlone);
  explanation.take(motion.state());
  for (std::int64_t k = std::llround(seconds / plan.period); k > 0; --k) {
    if (motion.advance().status != StepStatus::kOk) return std::nullopt;
    explanation.take(motion.state());
  }
  return explanation.effects();
}

const char* name_of(Effect effect) {
  switch (effect) {
    case Effect::kTruncation:
      return "omitted modes";
    case Effect::kIntegration:
      return "length of the tick";
    case Effect::kGyration:
      return "Coriolis and centrifugal forces";
    case Effect::kStiffness:
      return "geometric stiffness";
    case Effect::kCurvature:
      break;
  }
  return "true geometry of links";
}

std::string remedy_of(Effect effect, const Plan& plan) {
  const std::string better = name_of(plan.verdict.shadows.front().plan.fidelity);
  switch (effect) {
    case Effect::kTruncation:
      return "lower leave_out: tolerance, or keep more modes";
    case Effect::kIntegration:
      return "raise the rate";
    case Effect::kGyration:
    case Effect::kStiffness:
      return "set fidelity: coupled or " + better;
    case Effect::kCurvature:
      break;
  }
  return "set fidelity: " + better + ", or reduce loads and spin";
}

}  // namespace freeflex
