#include "core/model/rungs.hpp"

#include "core/model/faults.hpp"
#include "core/model/propagator.hpp"

namespace freeflex {

Reduced without_modes(const Scene& scene, const Structure& structure, Faults& faults) {
  if (!scene.initial.points.empty() || !scene.initial.modes.empty())
    add_warning(faults, scene.initial.origin,
                "the initial elastic state is left out: fidelity is rigid; take separated or a rung above it");
  InitialModes at_rest;
  at_rest.q = at_rest.q_dot = Eigen::VectorXd::Zero(structure.omega.size());
  Reduced rigid = reduce(scene, structure, at_rest, {});
  if (!scene.publication.links.empty())
    add_warning(faults, {},
                "no forces of links are published: fidelity is rigid, and links carry load only where something "
                "deforms; take separated or a rung above it");
  rigid.scene.publication.links.clear();
  rigid.structure.link_forces.clear();
  return rigid;
}

void compile_coupled(const Scene& scene, const Structure& structure, Plan& plan, Faults& faults) {
  if (structure.num_constraints > 0)
    for (const Link& link : scene.links)
      if (std::holds_alternative<Rigid>(link.kind)) {
        add_error(faults, link.origin,
                  "a rigid link does not go with the coupled rungs, whose equations need every elastic mode; use a "
                  "stiff spring (a stiff mode costs these rungs nothing), or fidelity: spin-loaded or below");
        return;
      }
  for (const Feedback& feedback : scene.feedbacks)
    if (!feedback.acceleration_gain.isZero(0.0)) {
      add_error(faults, feedback.origin,
                "acceleration feedback does not go with the coupled rungs; use displacement and velocity gains, or "
                "fidelity: spin-loaded or below");
      return;
    }
  // dashpots and feedback act stage by stage
  plan.coupling.path = PlanCoupling::Path::kNone;
  plan.coupling.modes.clear();
  if (plan.fidelity < Fidelity::kExactBars) return;
  for (std::size_t k = 0; k < scene.links.size(); ++k) {
    const Link& link = scene.links[k];
    const auto *spring = std::get_if<Spring>(&link.kind);
    const auto *given = std::get_if<Bar>(&link.kind);
    if (spring == nullptr && given == nullptr) continue;
    const Eigen::Vector3d rest = scene.points[static_cast<std::size_t>(link.points[1])].position -
                                 scene.points[static_cast<std::size_t>(link.points[0])].position;
    PlanBar bar;
    bar.link = static_cast<std::int32_t>(k);
    bar.first = link.points[0];
    bar.second = link.points[1];
    bar.length = rest.stableNorm();
    bar.stiffness = spring != nullptr ? spring->stiffness : given->EA / bar.length;
    const Eigen::Vector3d direction = rest / bar.length;
    bar.direction = {direction.x(), direction.y(), direction.z()};
    plan.coupled.bars.push_back(bar);
  }
}

void set_coupled_period(Plan& plan) {
  if (!is_coupled(plan)) return;
  const auto n = static_cast<std::size_t>(plan.num_padded);
  plan.coupled.functions.assign(std::size_t{PlanCoupled::kNumEntries} * std::size_t{PlanCoupled::kNumFunctions} * n, 0.0);
  for (std::size_t l = 0; l < static_cast<std::size_t>(plan.num_elastic); ++l) {
    const ModeFunctions functions = mode_functions(plan.omega[l], plan.decay[l], plan.period);
    for (std::size_t k = 0; k < functions.size(); ++k) plan.coupled.functions[k * n + l] = functions[k];
  }
}

void check_bar_phase(const Plan& plan, Faults& faults) {
  if (plan.fidelity < Fidelity::kExactBars || plan.num_elastic == 0) return;
  const double omega = plan.omega[static_cast<std::size_t>(plan.num_elastic) - 1];
  if (omega * plan.period <= kMaxBarPhase) return;
  add_error(faults, {},
            join_text("fidelity exact-bars at ", 1.0 / plan.period, " Hz: the stiffest mode, ", omega,
                      " rad/s, turns by ", omega * plan.period, " rad a tick, and true bar forces hold to ",
                      kMaxBarPhase, "; raise the rate to ", omega / kMaxBarPhase,
                      " Hz or more, soften the stiffest bars, or take fidelity: coupled"));
}

}  // namespace freeflex
