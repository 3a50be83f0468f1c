#include "core/plan/rungs/automatic.hpp"

#include <algorithm>
#include <cmath>

#include "core/faults.hpp"
#include "core/motion.hpp"
#include "core/plan/check_motion.hpp"
#include "core/plan/compile.hpp"
#include "core/plan/rungs/shadow.hpp"

namespace freeflex {
namespace {

// The largest number of ticks in a run that tries a rung. A run of this length takes a few seconds with 20
// points.
constexpr std::int64_t kMostTicksTried = 200'000;

bool is_within(double error, const std::optional<double>& tolerance) {
  return !tolerance || error <= *tolerance;
}

// Returns the plan of a rung, with its shadow. If there is an error, returns nullopt.
std::optional<Plan> plan_to_try(const Scene& scene, const Structure& structure, Fidelity rung,
                                Faults& faults) {
  Faults own;  // warnings of a rung that is not chosen are not reported
  std::optional<Plan> plan = compile(scene, structure, full_spec(scene, structure, rung), own);
  if (plan) check_motion(scene, structure, *plan, own);
  if (has_error(own)) {
    faults.insert(faults.end(), own.begin(), own.end());
    return std::nullopt;
  }
  // The horizon of the verdict is longer than the run. The shadow therefore starts only once, and errors grow
  // from the start of the run.
  Scene judged = scene;
  judged.verdict = {.horizon = 2.0 * scene.automatic->horizon};
  compile_verdict(judged, structure, structure, *plan);
  if (!plan->verdict.shadows.empty()) return plan;
  add_error(faults, scene.automatic->origin,
            join_text("fidelity: auto: ", plan->verdict.shared_text, "; set a rung instead of auto"));
  return std::nullopt;
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
  Motion motion(*plan);
  const std::int64_t ticks = std::max<std::int64_t>(1, std::llround(scene.automatic->horizon / plan->period));
  double peak = 0.0;
  for (std::int64_t k = 1; k <= ticks; ++k) {
    if (motion.advance().status != StepStatus::kOk) return tried;
    const Verdict& verdict = motion.verdict();
    if (verdict.cause == Verdict::Cause::kLost) return tried;
    result.position = std::max(result.position, verdict.error.position);
    result.attitude = std::max(result.attitude, verdict.error.attitude);
    result.elastic = std::max(result.elastic, verdict.error.deformation);
    peak = std::max(peak, verdict.displacement_now + verdict.error.deformation);
  }
  if (result.elastic > 0.0) result.elastic /= peak;
  result.is_finite = std::isfinite(result.position) && std::isfinite(result.elastic);
  const AutomaticRung& asked = *scene.automatic;
  tried.level = motion.worst().level;
  tried.why = text_of(*plan, motion.worst());
  result.meets = result.is_finite && is_within(result.position, asked.position) &&
                 is_within(result.attitude, asked.attitude) && is_within(result.elastic, asked.elastic);
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
  const double most = static_cast<double>(kMostTicksTried);
  if (scene.automatic->horizon * scene.rate > most) {
    add_error(faults, scene.automatic->origin,
              join_text("tolerance: the horizon of ", scene.automatic->horizon, " s has ",
                        scene.automatic->horizon * scene.rate, " ticks, but at most ", kMostTicksTried,
                        " are simulated to choose a rung; set a horizon of ", most / scene.rate,
                        " s or less, or a rung instead of auto"));
    return std::nullopt;
  }
  std::vector<Tried> all;
  for (const RungTraits& each : kRungs) {
    if (!each.is_tried) continue;
    all.push_back(try_rung(scene, structure, each.rung, faults));
    tried.push_back(all.back().rung);
    if (has_error(faults)) return std::nullopt;
    if (!tried.back().meets) continue;
    if (all.back().level != Verdict::Level::kGood)
      add_warning(faults, scene.automatic->origin,
                  join_text("fidelity: auto chose ", name_of(each.rung),
                            ", whose estimated error meets the tolerance but whose verdict is ",
                            name_of(all.back().level), " (", all.back().why, ")"));
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
