#include "core/plan/automatic.hpp"

#include <algorithm>
#include <cmath>

#include "core/plan/budget.hpp"
#include "core/plan/compile.hpp"
#include "core/plan/motion.hpp"
#include "core/plan/rates.hpp"
#include "core/scene/faults.hpp"
#include "core/step/budget.hpp"
#include "core/validity/judgement.hpp"

namespace freeflex {
namespace {

// parts of ticks of a run by which auto chooses: with 20 points a few seconds each
constexpr std::int64_t kMostTicksTried = 200'000;

bool is_within(double error, const std::optional<double>& tolerance) {
  return !tolerance || error <= *tolerance;
}

// the plan of a rung with the best rung beside it; nullopt on an error
std::optional<Plan> plan_to_try(const Scene& scene, const Structure& structure, Fidelity rung,
                                Faults& faults) {
  PlanSpec spec = unpublished_spec(scene, structure, rung, 1);
  spec.is_judged = true;
  Faults own;  // warnings are said of the rung that is taken
  std::optional<Plan> plan = compile(scene, structure, spec, own);
  if (plan) check_motion(scene, structure, *plan, own);
  if (has_error(own)) {
    faults.insert(faults.end(), own.begin(), own.end());
    return std::nullopt;
  }
  // longer than the run, so that errors grow from its start
  set_horizon(2.0 * scene.automatic->horizon, *plan);
  const std::int32_t parts = resolving_parts(frequencies_of(structure), plan->period);
  if (!add_shadow(scene, structure, PlanShadow::Kind::kBest, best_rung_beside(rung, scene, structure), parts,
                  *plan, faults))
    return std::nullopt;
  return plan;
}

struct Tried {
  PlanRung rung;
  Verdict::Word word = Verdict::Word::kGood;  // the worst on it
  std::string why;
};

Tried try_rung(const Scene& scene, const Structure& structure, Fidelity rung, Faults& faults) {
  Tried tried;
  PlanRung& result = tried.rung;
  result.rung = rung;
  const std::optional<Plan> plan = plan_to_try(scene, structure, rung, faults);
  if (!plan) return tried;
  State state = make_state(*plan);
  Workspace workspace = make_workspace(*plan);
  Budget budget = make_budget(*plan);
  // by what the rung neglects; what the rung beside it finds is held against the tolerances
  Judgement judgement(*plan);
  Budget none;
  judgement.take(state, none);
  StepReport report;
  const std::int64_t ticks = std::max<std::int64_t>(1, std::llround(scene.automatic->horizon / plan->period));
  for (std::int64_t k = 1, sample = 1; k <= ticks; ++k) {
    step(*plan, state, {}, workspace, budget, report);
    if (report.status != StepStatus::kOk || budget.is_lost) return tried;
    judgement.take(state, none);
    if (k * kRungSamples < sample * ticks) continue;
    ++sample;
    const ErrorSize error = read_budget(*plan, state, budget).total;
    result.position = std::max(result.position, error.position);
    result.attitude = std::max(result.attitude, error.attitude);
    result.elastic = std::max(result.elastic, error.elastic);
  }
  result.is_finite = std::isfinite(result.position) && std::isfinite(result.elastic);
  const AutomaticRung& asked = *scene.automatic;
  tried.word = judgement.worst().word;
  tried.why = text_of(*plan, judgement.worst());
  result.meets = result.is_finite && tried.word != Verdict::Word::kOutside &&
                 is_within(result.position, asked.position) && is_within(result.attitude, asked.attitude) &&
                 is_within(result.elastic, asked.elastic);
  return tried;
}

std::string describe(const std::vector<Tried>& all) {
  std::string text;
  for (const Tried& tried : all) {
    const PlanRung& each = tried.rung;
    text += (text.empty() ? "" : ", ") + std::string(name_of(each.rung));
    text += each.is_finite
                ? join_text(" ", each.position, " m, ", each.attitude, " rad, elastic ", each.elastic)
                : std::string(" leaves the numbers");
    if (tried.word == Verdict::Word::kOutside) text += " (outside by " + tried.why + ")";
  }
  return text;
}

}  // namespace

std::string find_untried_rate(const Plan& plan, double rate) {
  if (plan.tried_rungs.empty() || std::abs(rate * plan.period - 1.0) < 1e-9) return {};
  return join_text("fidelity: auto took ", name_of(plan.fidelity), " at ", 1.0 / plan.period, " Hz; at ",
                   rate, " Hz its tolerance was not tried: put the rate into the scene");
}

std::optional<Fidelity> choose_rung(const Scene& scene, const Structure& structure,
                                    std::vector<PlanRung>& tried, Faults& faults) {
  const std::int32_t parts = resolving_parts(frequencies_of(structure), 1.0 / scene.rate);
  const double rate = scene.rate * parts, most = static_cast<double>(kMostTicksTried);
  if (scene.automatic->horizon * rate > most) {
    const std::string in_parts =
        parts > 1 ? join_text(" in ", parts, " parts each, ", scene.automatic->horizon * rate, " in all")
                  : "";
    add_error(faults, scene.automatic->origin,
              join_text("tolerance: horizon of ", scene.automatic->horizon, " s is ",
                        scene.automatic->horizon * scene.rate, " ticks", in_parts, ", at most ",
                        kMostTicksTried, " are tried; take a horizon of ", most / rate,
                        " s or less, or name a rung in place of auto"));
    return std::nullopt;
  }
  warn_of_best_rung(scene, structure, "fidelity: auto", scene.automatic->origin, faults);
  std::vector<Tried> all;
  for (const RungTraits& each : kRungs) {
    if (!each.is_tried || !carries(each.rung, scene, structure)) continue;
    all.push_back(try_rung(scene, structure, each.rung, faults));
    tried.push_back(all.back().rung);
    if (has_error(faults)) return std::nullopt;
    if (!tried.back().meets) continue;
    if (all.back().word == Verdict::Word::kWatch)
      add_warning(
          faults, scene.automatic->origin,
          join_text("fidelity: auto took ", name_of(each.rung),
                    ", whose error by what is known meets the tolerance, but the word on its motion is "
                    "watch: ",
                    all.back().why));
    return each.rung;
  }
  add_error(
      faults, scene.automatic->origin,
      join_text("fidelity: no rung meets the tolerance over ", scene.automatic->horizon,
                " s: ", describe(all),
                "; allow more, take a shorter horizon, raise the rate, load less, or take fidelity: full"));
  return std::nullopt;
}

}  // namespace freeflex
