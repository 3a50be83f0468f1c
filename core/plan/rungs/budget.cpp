#include "core/plan/rungs/budget.hpp"

#include <algorithm>

#include "core/faults.hpp"
#include "core/plan/compile.hpp"
#include "core/plan/rungs/rates.hpp"

namespace freeflex {

bool carries(Fidelity rung, const Structure& structure) {
  return !traits_of(rung).has_true_geometry ||
         (structure.num_constraints == 0 && structure.resolved.are_point_masses && !structure.kept.is_subset);
}

namespace {

// Returns the highest rung that `fidelity: auto` tries and that supports the scene.
Fidelity best_rung(const Structure& structure) {
  for (auto each = kRungs.rbegin(); each != kRungs.rend(); ++each)
    if (each->is_tried && carries(each->rung, structure)) return each->rung;
  return kRungs.front().rung;
}

}  // namespace

Fidelity best_rung_beside(Fidelity rung, const Structure& structure) {
  return traits_of(rung).has_true_geometry ? rung : best_rung(structure);
}

void warn_of_best_rung(const Structure& structure, const char* judge, const Origin& origin, Faults& faults) {
  const RungTraits& best = traits_of(best_rung(structure));
  if (best.has_true_geometry) return;
  add_warning(faults, origin,
              join_text(judge, ": the best rung that supports ",
                        structure.num_constraints > 0          ? "rigid links"
                        : !structure.resolved.are_point_masses ? "bodies and massless points"
                                                               : "the lowest modes alone",
                        " is ", best.name,
                        ", and errors are relative to it. They do not include the second-order terms of the "
                        "geometry of links, which the verdict estimates"));
}

std::span<const double> frequencies_of(const Structure& structure) {
  return {structure.omega.data(), index(structure.omega.size())};
}

void set_horizon(double horizon, Plan& plan) {
  plan.budget.horizon = horizon;
  plan.budget.horizon_ticks = horizon_in_ticks(horizon, plan.period);
}

bool add_shadow(const Scene& scene, const Structure& structure, PlanShadow::Kind kind, Fidelity rung,
                std::int32_t resolving, Plan& plan, Faults& faults) {
  const std::int32_t substeps = shadow_substeps(kind, plan.fidelity, resolving);
  const PlanSpec spec = unpublished_spec(scene, structure, rung, substeps);
  Faults own;
  std::optional<Plan> compiled = compile(scene, structure, spec, own);
  for (const Fault& fault : own)
    add_error(faults, scene.automatic ? scene.automatic->origin : fault.origin,
              join_text(scene.automatic ? "fidelity: auto" : "error_budget",
                        ": the reference equations (fidelity ", name_of(rung), " at ", scene.rate * substeps,
                        " Hz) do not support the scene, because ", fault.message, "; or ",
                        scene.automatic ? "set a rung instead of auto" : "remove error_budget"));
  if (!compiled) return false;
  plan.budget.shadows.push_back({kind, substeps, std::move(*compiled)});
  return true;
}

void compile_budget(const Scene& scene, const Structure& structure, Plan& plan, Faults& faults) {
  if (scene.error_budget.horizon <= 0.0) return;
  if (!plan.fallback.empty()) {
    add_error(faults, scene.error_budget.origin,
              "error_budget cannot be combined with leave_out: {on_need: replan}, which changes the plan "
              "during the motion; set on_need: keep or refuse");
    return;
  }
  set_horizon(scene.error_budget.horizon, plan);
  const RungTraits& rung = traits_of(plan.fidelity);
  const std::int32_t resolving = resolving_substeps(frequencies_of(structure), plan.period);
  const auto add = [&](PlanShadow::Kind kind, Fidelity of) {
    return add_shadow(scene, structure, kind, of, resolving, plan, faults);
  };
  warn_of_best_rung(structure, "error_budget", scene.error_budget.origin, faults);
  const Fidelity best = best_rung_beside(plan.fidelity, structure);
  if (!add(PlanShadow::Kind::kBest, best)) return;
  if (best != plan.fidelity && !add(PlanShadow::Kind::kFine, plan.fidelity)) return;
  const bool lacks_modes = rung.has_modes && !plan.mode_numbers.empty() &&
                           plan.mode_numbers.size() < index(structure.omega.size());
  if (lacks_modes) add(PlanShadow::Kind::kFull, plan.fidelity);
}

}  // namespace freeflex
