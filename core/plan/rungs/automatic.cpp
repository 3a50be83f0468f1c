#include "core/plan/rungs/automatic.hpp"

#include <algorithm>
#include <cmath>

#include "core/faults.hpp"
#include "core/motion.hpp"
#include "core/plan/check_motion.hpp"
#include "core/plan/compile.hpp"
#include "core/plan/rungs/budget.hpp"
#include "core/plan/rungs/rates.hpp"

namespace freeflex {
namespace {

// The largest number of substeps in a run that tries a rung. A run of this length takes a few seconds with 20
// points.
constexpr std::int64_t kMostTicksTried = 200'000;

bool is_within(double error, const std::optional<double>& tolerance) {
  return !tolerance || error <= *tolerance;
}

// Returns the plan of a rung, with the best rung as its shadow. If there is an error, returns nullopt.
std::optional<Plan> plan_to_try(const Scene& scene, const Structure& structure, Fidelity rung,
                                Faults& faults) {
  PlanSpec spec = unpublished_spec(scene, structure, rung, 1);
  spec.is_judged = true;
  Faults own;  // warnings of a rung that is not chosen are not reported
  std::optional<Plan> plan = compile(scene, structure, spec, own);
  if (plan) check_motion(scene, structure, *plan, own);
  if (has_error(own)) {
    faults.insert(faults.end(), own.begin(), own.end());
    return std::nullopt;
  }
  // The horizon of the budget is longer than the run. The shadow therefore starts only once, and errors grow
  // from the start of the run.
  set_horizon(2.0 * scene.automatic->horizon, *plan);
  const std::int32_t substeps = resolving_substeps(frequencies_of(structure), plan->period);
  if (!add_shadow(scene, structure, PlanShadow::Kind::kBest, best_rung_beside(rung, structure), substeps,
                  *plan, faults))
    return std::nullopt;
  return plan;
}

struct Tried {
  PlanRung rung;
  Verdict::Level level = Verdict::Level::kGood;  // worst verdict of the run
  std::string why;                               // text of its cause
};

Tried try_rung(const Scene& scene, const Structure& structure, Fidelity rung, Faults& faults) {
  Tried tried;
  PlanRung& result = tried.rung;
  result.rung = rung;
  const std::optional<Plan> plan = plan_to_try(scene, structure, rung, faults);
  if (!plan) return tried;
  // The verdict judges only the terms that the rung neglects. The distance from the best rung, which the
  // budget holds, is compared with the tolerances below.
  Motion motion(*plan, {.verdict_uses_budget = false});
  const std::int64_t ticks = std::max<std::int64_t>(1, std::llround(scene.automatic->horizon / plan->period));
  for (std::int64_t k = 1, sample = 1; k <= ticks; ++k) {
    if (motion.advance().status != StepStatus::kOk || motion.has_lost_reference()) return tried;
    if (k * kRungSamples < sample * ticks) continue;
    ++sample;
    const ErrorSize error = motion.read_budget().total;
    result.position = std::max(result.position, error.position);
    result.attitude = std::max(result.attitude, error.attitude);
    result.elastic = std::max(result.elastic, error.elastic);
  }
  result.is_finite = std::isfinite(result.position) && std::isfinite(result.elastic);
  const AutomaticRung& asked = *scene.automatic;
  tried.level = motion.worst().level;
  tried.why = text_of(*plan, motion.worst());
  result.meets = result.is_finite && tried.level != Verdict::Level::kOutside &&
                 is_within(result.position, asked.position) && is_within(result.attitude, asked.attitude) &&
                 is_within(result.elastic, asked.elastic);
  return tried;
}

std::string describe(const std::vector<Tried>& all) {
  std::string text;
  for (const Tried& tried : all) {
    const PlanRung& each = tried.rung;
    text += (text.empty() ? "" : "; ") + std::string(name_of(each.rung));
    text += each.is_finite
                ? join_text(" ", each.position, " m, ", each.attitude, " rad, elastic ", each.elastic)
                : std::string(" diverges");
    if (tried.level == Verdict::Level::kOutside) text += " (verdict outside, " + tried.why + ")";
  }
  return text;
}

}  // namespace

std::string find_untried_rate(const Plan& plan, double rate) {
  if (plan.tried_rungs.empty() || std::abs(rate * plan.period - 1.0) < 1e-9) return {};
  return join_text("fidelity: auto chose ", name_of(plan.fidelity), " at ", 1.0 / plan.period, " Hz, but at ",
                   rate, " Hz the tolerance was not checked; set this rate in the scene");
}

std::optional<Fidelity> choose_rung(const Scene& scene, const Structure& structure,
                                    std::vector<PlanRung>& tried, Faults& faults) {
  const std::int32_t substeps = resolving_substeps(frequencies_of(structure), 1.0 / scene.rate);
  const double rate = scene.rate * substeps, most = static_cast<double>(kMostTicksTried);
  if (scene.automatic->horizon * rate > most) {
    const std::string in_parts = substeps > 1 ? join_text(" of ", substeps, " substeps each, ",
                                                          scene.automatic->horizon * rate, " substeps in all")
                                              : "";
    add_error(faults, scene.automatic->origin,
              join_text("tolerance: the horizon of ", scene.automatic->horizon, " s has ",
                        scene.automatic->horizon * scene.rate, " ticks", in_parts, ", but at most ",
                        kMostTicksTried, " are simulated to choose a rung; set a horizon of ", most / rate,
                        " s or less, or a rung instead of auto"));
    return std::nullopt;
  }
  warn_of_best_rung(structure, "fidelity: auto", scene.automatic->origin, faults);
  std::vector<Tried> all;
  for (const RungTraits& each : kRungs) {
    if (!each.is_tried || !carries(each.rung, structure)) continue;
    all.push_back(try_rung(scene, structure, each.rung, faults));
    tried.push_back(all.back().rung);
    if (has_error(faults)) return std::nullopt;
    if (!tried.back().meets) continue;
    if (all.back().level == Verdict::Level::kWatch)
      add_warning(faults, scene.automatic->origin,
                  join_text("fidelity: auto chose ", name_of(each.rung),
                            ", whose estimated error meets the tolerance but whose verdict is watch (",
                            all.back().why, ")"));
    return each.rung;
  }
  add_error(
      faults, scene.automatic->origin,
      join_text("fidelity: no rung meets the tolerance over ", scene.automatic->horizon,
                " s. The errors are: ", describe(all),
                ". Raise the tolerance or the rate, reduce the horizon or the loads, or set fidelity: full"));
  return std::nullopt;
}

}  // namespace freeflex
