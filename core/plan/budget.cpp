#include "core/plan/budget.hpp"

#include <algorithm>
#include <cmath>
#include <span>

#include "core/plan/compile.hpp"
#include "core/plan/rungs.hpp"
#include "core/scene/faults.hpp"

namespace freeflex {
namespace {

// what a rung is compared with: exact bars, or itself in parts of half the size where that is not better
constexpr Fidelity top_of(Fidelity rung) { return std::max(rung, Fidelity::kExactBars); }

// the scene on another rung, with nothing to publish
Scene shadow_scene(const Scene& scene, Fidelity rung, std::int32_t substeps) {
  Scene shadow = scene;
  shadow.fidelity = rung;
  shadow.rate = scene.rate * substeps;
  shadow.publication.links.clear();
  // its budget is nobody's, but every point is looked at
  shadow.error_budget.horizon = scene.error_budget.horizon;
  return shadow;
}

// [rad] of a mode in a part of a tick that resolves it: estimates are 1.25 of the truth (budget_test)
constexpr double kPartTurn = 1.0;
// parts a second with up to kFewModes modes, some 15 us each; beyond, in proportion to what a part costs
constexpr double kMostPartRate = 16384.0, kFewModes = 64.0;

// Parts of a tick, a power of two, in which every mode that parts can resolve turns by kPartTurn at most, and
// the stiffest by what exact bars hold to: spin turns what vibrates, and a step that does not resolve the
// vibration does not see it (X96)
std::int32_t resolving_parts(std::span<const double> omega, double period) {
  const double crowd = std::max(1.0, static_cast<double>(omega.size()) / kFewModes);
  const double most =
      std::clamp(kMostPartRate / (crowd * crowd) * period, 1.0, static_cast<double>(kMaxParts));
  std::int32_t parts = 1;
  while (2 * parts <= most) parts *= 2;
  double turn = 0.0, fastest = 0.0;
  for (const double each : omega) {
    fastest = std::max(fastest, each * period);
    if (each * period <= kPartTurn * parts) turn = std::max(turn, each * period);
  }
  while (parts > 1 && turn <= 0.5 * kPartTurn * parts && fastest <= 0.5 * kMaxBarPhase * parts) parts /= 2;
  return parts;
}
std::span<const double> span_of(const Eigen::VectorXd& omega) {
  return {omega.data(), static_cast<std::size_t>(omega.size())};
}

// steps a tick of a shadow of a plan on `rung`, when the best one takes `parts`
std::int32_t steps_of(PlanShadow::Kind kind, Fidelity rung, std::int32_t parts) {
  if (kind == PlanShadow::Kind::kWhole) return 1;
  if (rung == Fidelity::kFull) return 2;  // it divides its own step
  const bool is_halved = kind == PlanShadow::Kind::kFine || rung >= Fidelity::kCoupled;
  return std::max(parts, is_halved ? 2 : 1);
}

// parts of ticks of a run by which auto chooses: with 20 points a few seconds each
constexpr std::int64_t kMostTicksTried = 200'000;

bool add_shadow(const Scene& scene, const Structure& structure, PlanShadow::Kind kind, Fidelity rung,
                std::int32_t substeps, Plan& plan, Faults& faults) {
  Faults own;
  Structure unread = structure;
  unread.link_forces.clear();
  unread.constraint_shapes.resize(structure.shapes.rows(), 0);
  std::optional<Plan> compiled = compile_plan(shadow_scene(scene, rung, substeps), unread, own);
  if (!compiled) {
    for (const Fault& fault : own)
      if (fault.severity == Fault::Severity::kError)
        add_error(faults, scene.automatic ? scene.automatic->origin : fault.origin,
                  join_text(scene.automatic ? "fidelity: auto" : "error_budget",
                            ": the equations it compares with, fidelity ", name_of(rung), " at ",
                            scene.rate * substeps, " Hz, cannot carry the scene: ", fault.message, "; or ",
                            scene.automatic ? "name a rung" : "leave error_budget out"));
    return false;
  }
  if (rung == Fidelity::kFull) {
    // twice the rate alone would be as many parts a second
    compiled->coupled.part_phase /= substeps;
    set_rate(*compiled, scene.rate * substeps);
  }
  plan.budget.shadows.push_back({kind, substeps, std::move(*compiled)});
  return true;
}

void set_horizon(double horizon, Plan& plan) {
  plan.budget.horizon = horizon;
  plan.budget.horizon_ticks = horizon_in_ticks(horizon, plan.period);
}

bool is_within(double error, const std::optional<double>& tolerance) {
  return !tolerance || error <= *tolerance;
}

PlanRung try_rung(const Scene& scene, const Structure& structure, Fidelity rung, Faults& faults) {
  PlanRung result;
  result.rung = rung;
  Scene tried = scene;
  tried.fidelity = rung;
  tried.publication.links.clear();
  // longer than the run, so that errors grow from its start
  tried.error_budget.horizon = 2.0 * scene.automatic->horizon;
  Faults own;
  std::optional<Plan> plan = compile_plan(tried, structure, own);
  if (!plan) {
    faults.insert(faults.end(), own.begin(), own.end());
    return result;
  }
  set_horizon(tried.error_budget.horizon, *plan);
  const std::int32_t parts = resolving_parts(span_of(structure.omega), plan->period);
  constexpr PlanShadow::Kind kBest = PlanShadow::Kind::kBest;
  if (!add_shadow(tried, structure, kBest, top_of(rung), steps_of(kBest, rung, parts), *plan, faults))
    return result;
  State state = make_state(*plan);
  Workspace workspace = make_workspace(*plan);
  Budget budget = make_budget(*plan);
  StepReport report;
  const std::int64_t ticks = std::max<std::int64_t>(1, std::llround(scene.automatic->horizon / plan->period));
  for (std::int64_t k = 1, sample = 1; k <= ticks; ++k) {
    step(*plan, state, {}, workspace, budget, report);
    if (report.status != StepStatus::kOk || budget.is_lost) return result;
    if (k * kRungSamples < sample * ticks) continue;
    ++sample;
    const ErrorSize error = read_budget(*plan, state, budget).total;
    result.position = std::max(result.position, error.position);
    result.attitude = std::max(result.attitude, error.attitude);
    result.elastic = std::max(result.elastic, error.elastic);
  }
  result.is_finite = std::isfinite(result.position) && std::isfinite(result.elastic);
  const AutomaticRung& asked = *scene.automatic;
  result.meets = result.is_finite && is_within(result.position, asked.position) &&
                 is_within(result.attitude, asked.attitude) && is_within(result.elastic, asked.elastic);
  return result;
}

std::string describe(const std::vector<PlanRung>& tried) {
  std::string text;
  for (const PlanRung& each : tried) {
    text += (text.empty() ? "" : ", ") + std::string(name_of(each.rung));
    text += each.is_finite
                ? join_text(" ", each.position, " m, ", each.attitude, " rad, elastic ", each.elastic)
                : std::string(" leaves the numbers");
  }
  return text;
}

}  // namespace

const char* name_of(Fidelity rung) {
  static constexpr std::array kNames{"rigid", "separated", "spin-loaded", "coupled", "exact-bars", "full"};
  return kNames[static_cast<std::size_t>(rung)];
}

std::string find_untried_rate(const Plan& plan, double rate) {
  if (plan.tried_rungs.empty() || std::abs(rate * plan.period - 1.0) < 1e-9) return {};
  return join_text("fidelity: auto took ", name_of(plan.fidelity), " at ", 1.0 / plan.period, " Hz; at ",
                   rate, " Hz its tolerance was not tried: put the rate into the scene");
}

std::int64_t horizon_in_ticks(double horizon, double period) {
  constexpr double kForever = 1e15;  // far inside 64 bits, also times substeps
  return std::max<std::int64_t>(1, std::llround(std::min(horizon / period, kForever)));
}

void compile_budget(const Scene& scene, const Structure& structure, Plan& plan, Faults& faults) {
  if (scene.error_budget.horizon <= 0.0) return;
  if (!plan.wide.empty()) {
    add_error(
        faults, scene.error_budget.origin,
        "error_budget does not go with leave_out: {on_need: replan}, which changes the plan in motion; take "
        "on_need: keep or refuse");
    return;
  }
  set_horizon(scene.error_budget.horizon, plan);
  const std::int32_t parts = resolving_parts(span_of(structure.omega), plan.period);
  const auto add = [&](PlanShadow::Kind kind, Fidelity rung) {
    return add_shadow(scene, structure, kind, rung, steps_of(kind, plan.fidelity, parts), plan, faults);
  };
  if (!add(PlanShadow::Kind::kBest, top_of(plan.fidelity))) return;
  if (plan.fidelity < Fidelity::kExactBars && !add(PlanShadow::Kind::kFine, plan.fidelity)) return;
  const bool lacks_modes = plan.fidelity != Fidelity::kRigid && !plan.mode_numbers.empty() &&
                           plan.mode_numbers.size() < static_cast<std::size_t>(structure.omega.size());
  if (lacks_modes) add(PlanShadow::Kind::kWhole, plan.fidelity);
}

void set_shadow_rates(Plan& plan) {
  if (plan.budget.shadows.empty()) return;
  const Plan& best = plan.budget.shadows.front().plan;
  const std::int32_t parts =
      resolving_parts({best.omega.data(), static_cast<std::size_t>(best.num_elastic)}, plan.period);
  for (PlanShadow& shadow : plan.budget.shadows) {
    shadow.substeps = steps_of(shadow.kind, plan.fidelity, parts);
    set_rate(shadow.plan, shadow.substeps / plan.period);
  }
  plan.budget.horizon_ticks = horizon_in_ticks(plan.budget.horizon, plan.period);
}

std::optional<Fidelity> choose_rung(const Scene& scene, const Structure& structure,
                                    std::vector<PlanRung>& tried, Faults& faults) {
  const std::int32_t parts = resolving_parts(span_of(structure.omega), 1.0 / scene.rate);
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
  for (const Fidelity rung : {Fidelity::kRigid, Fidelity::kSeparated, Fidelity::kSpinLoaded,
                              Fidelity::kCoupled, Fidelity::kExactBars}) {
    tried.push_back(try_rung(scene, structure, rung, faults));
    if (has_error(faults)) return std::nullopt;
    if (tried.back().meets) return rung;
  }
  add_error(
      faults, scene.automatic->origin,
      join_text("fidelity: no rung meets the tolerance over ", scene.automatic->horizon,
                " s: ", describe(tried),
                "; allow more, take a shorter horizon, raise the rate, load less, or take fidelity: full"));
  return std::nullopt;
}

}  // namespace freeflex
