#include "core/plan/rungs/rungs.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>

#include "core/faults.hpp"
#include "core/plan/modes/modal_coupling.hpp"
#include "core/plan/modes/propagator.hpp"
#include "core/plan/rungs/kinetics.hpp"
#include "core/plan/rungs/true_links.hpp"
#include "core/plan/rungs/turning.hpp"
#include "core/structure/modes/dense/decompositions.hpp"

namespace freeflex {
namespace {

using RowMatrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

// Returns the largest singular value of rows (count x num_padded), in the unit of the rows.
double norm_of_rows(const Array& array, Eigen::Index count, const StepPlan& plan) {
  if (count == 0 || array.empty()) return 0.0;
  const Eigen::Map<const RowMatrix> rows(array.data(), count, plan.num_padded);
  const double largest = rows.cwiseAbs().maxCoeff();
  if (!(largest > 0.0)) return 0.0;
  const RowMatrix unit = rows / largest;
  return largest * std::sqrt(Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(unit * unit.transpose(),
                                                                            Eigen::EigenvaluesOnly)
                                 .eigenvalues()
                                 .maxCoeff());
}

double top_frequency(const StepPlan& plan) {
  return plan.num_elastic == 0 ? 0.0 : plan.omega[static_cast<std::size_t>(plan.num_elastic) - 1];
}

// Returns a bound of the rates [1/s] of dashpots and feedback,
// sigma = |R|^2 / M + sum_f (|F_v| |B_f| / M + (|F_q| |B_f| / M)^(1/2))   (THEORY 12.31).
double stage_rate(const StepPlan& plan) {
  const double damping =
      norm_of_rows(plan.modal_coupling.damping_rows, plan.modal_coupling.num_damping, plan);
  double rate = damping * (damping / plan.mass);
  for (const PlanFeedback& feedback : plan.feedbacks) {
    const Array rows(plan.rows.begin() + 3 * std::ptrdiff_t{feedback.row} * plan.num_padded,
                     plan.rows.begin() + 3 * (std::ptrdiff_t{feedback.row} + 1) * plan.num_padded);
    const double out = norm_of_rows(rows, 3, plan) / plan.mass;
    rate += norm_of_rows(feedback.q_dot_rows, 3, plan) * out +
            std::sqrt(norm_of_rows(feedback.q_rows, 3, plan) * out);
  }
  return rate;
}

// Returns 2 max decay_l [1/s] if dashpots, or springs or bars with damping, act in their true direction,
// otherwise 0. The difference between their true and linear damping forces acts stage by stage, like that
// between true and linear forces of bars (THEORY 12.19, 12.32).
double damper_rate(const StepPlan& plan) {
  const auto damps = [](const PlanBar& bar) { return bar.damping > 0.0; };
  if (std::ranges::none_of(plan.coupled.bars, damps)) return 0.0;
  double rate = 0.0;
  for (const double decay : plan.decay) rate = std::max(rate, 2.0 * decay);
  return rate;
}

// Returns a bar at true length and direction. A spring or bar has the tension D (l - L) (THEORY 12.17) and
// the damping force c l' with c = (beta_R + tau) D. A dashpot has only the force c l'   (THEORY 12.19).
PlanBar true_bar(const Scene& scene, const ResolvedScene& resolved, int number) {
  const Link& link = scene.links[index(number)];
  const Eigen::Vector3d rest =
      scene.points[index(link.points[1])].position - scene.points[index(link.points[0])].position;
  PlanBar bar;
  bar.link = number;
  bar.first = link.points[0];
  bar.second = link.points[1];
  bar.length = rest.stableNorm();
  const Axial& axial = resolved.links[index(number)].axial;
  bar.stiffness = axial.stiffness;
  bar.damping = axial.damping + (scene.damping.beta + link.viscous) * bar.stiffness;
  // at a massless point, whose rate is not known, beta acts on the true strain   (THEORY 12.114)
  if (std::ranges::any_of(link.points, [&](int point) { return !resolved.moves_mass[index(point)]; }))
    bar.damping = 0.0;
  const Eigen::Vector3d direction = rest / bar.length;
  bar.direction = {direction.x(), direction.y(), direction.z()};
  return bar;
}

// The times t_l = 2 zeta_l / omega_l, from the ratios that scenes and loss factors give   (THEORY 12.114).
// The decays of the plan are not used, because they contain dashpots, which act in their true direction
// already.
void compile_strain_times(const Scene& scene, const Structure& structure, StepPlan& plan) {
  const Eigen::VectorXd ratio = damping_ratios(scene.damping, structure);
  if (ratio.isZero(0.0) && scene.damping.beta == 0.0) return;
  plan.coupled.strain_times.assign(index(plan.num_padded), 0.0);
  for (std::size_t l = 0; l < index(plan.num_elastic); ++l)
    if (plan.omega[l] > 0.0)
      plan.coupled.strain_times[l] = 2.0 * ratio[static_cast<Eigen::Index>(l)] / plan.omega[l];
  plan.coupled.beta = scene.damping.beta;
}

// Warns of viscous links that are damped along their rest directions.
void warn_of_viscous_links(const Scene& scene, const ResolvedScene& resolved, Faults& faults) {
  for (std::size_t k = 0; k < scene.links.size(); ++k) {
    const Link& link = scene.links[k];
    if (link.viscous == 0.0 || resolved.links[k].traits.is_axial) continue;
    return add_warning(
        faults, link.origin,
        join_text("link ", called(link, static_cast<int>(k)),
                  ": viscous damps angle springs and matrices along their rest "
                  "directions, which brakes parts that turn or bend far; use 'rayleigh', 'ratio' "
                  "or 'loss_factor', which do not"));
  }
}

// Warns of joints on a line that nothing holds about it, if a beam bends more easily in one plane than in
// another, so that bending turns them   (THEORY 12.76).
void warn_of_idle_joints(const Scene& scene, const StepPlan& plan, Faults& faults) {
  if (plan.coupled.links.joints.idle.empty()) return;
  for (std::size_t k = 0; k < scene.links.size(); ++k) {
    if (!bends_unequally(scene.links[k])) continue;
    return add_warning(
        faults, scene.links[k].origin,
        join_text("link ", called(scene.links[k], static_cast<int>(k)),
                  ": EIy and EIz differ, and neither mass nor links hold the joints of this straight chain "
                  "about its line, so that bending in both planes at once may stop the run; give one of its "
                  "points an inertia about the line, for example inertia: [0.001, 0.001, 0.001]"));
  }
}

}  // namespace

Eigen::VectorXd damping_ratios(const Damping& damping, const Structure& structure) {
  Eigen::VectorXd ratio = Eigen::VectorXd::Constant(structure.omega.size(), damping.modal_ratio);
  for (const auto& [mode, zeta] : damping.mode_ratios) ratio[mode - 1] = zeta;
  return ratio + structure.structural_ratio;
}

void compile_coupled(const Scene& scene, const Structure& structure, const PlanSpec& spec, StepPlan& plan,
                     Faults& faults) {
  assert(is_coupled(plan));
  if (!keeps_rotation_about_line(structure)) {
    add_error(faults, {},
              join_text("fidelity ", name_of(spec.rung),
                        " is not possible, because the points are on a line and the kept modes do not let "
                        "them rotate about it; keep "
                        "both modes of each transverse pair, or set fidelity: spin-loaded or a lower rung"));
    return;
  }
  if ((!traits_of(spec.rung).has_true_geometry || structure.resolved.have_links_mass()) &&
      !structure.resolved.are_point_masses && plan.num_elastic > kMaxBodyModes) {
    add_error(faults, {},
              join_text("fidelity ", name_of(spec.rung),
                        " supports bodies and massless points with tables over pairs of modes, for at most ",
                        kMaxBodyModes, " modes, but the scene has ", plan.num_elastic,
                        "; join fewer points, or set fidelity: spin-loaded or a lower rung"));
    return;
  }
  for (const Feedback& feedback : scene.feedbacks)
    if (!feedback.acceleration_gain.isZero(0.0)) {
      add_error(
          faults, feedback.origin,
          "acceleration feedback cannot be combined with the coupled rungs; use displacement and velocity "
          "gains, or set fidelity: spin-loaded or a lower rung");
      return;
    }
  // the coupled rungs apply dashpots and feedback stage by stage
  plan.modal_coupling.path = PlanModalCoupling::Path::kNone;
  plan.modal_coupling.modes.clear();
  plan.coupled.substep_phase = spec.substep_phase;
  if (!traits_of(spec.rung).has_true_geometry) return;
  compile_strain_times(scene, structure, plan);
  warn_of_viscous_links(scene, structure.resolved, faults);
  compile_large_rotations(scene, structure, plan, faults);
  if (has_error(faults)) return;
  for (std::size_t k = 0; k < scene.links.size(); ++k)
    if (structure.resolved.links[k].traits.is_axial)
      plan.coupled.bars.push_back(true_bar(scene, structure.resolved, static_cast<int>(k)));
  compile_true_links(scene, structure, plan, faults);
  warn_of_idle_joints(scene, plan, faults);
}

double rotation_rate(const StepPlan& plan) {
  const Eigen::Map<const Eigen::Vector3d> w(plan.initial.w_B.data());
  Eigen::Vector3d h = Eigen::Vector3d::Zero();
  for (const PlanWheel& wheel : plan.wheels)
    h += wheel.momentum * Eigen::Map<const Eigen::Vector3d>(wheel.axis.data());
  const Vec3& inverse = plan.principal.inverse_moment;
  return w.norm() + h.norm() * std::sqrt(inverse[0] * inverse[1]);
}

void set_coupled_period(StepPlan& plan) {
  if (!is_coupled(plan)) return;
  PlanCoupled& coupled = plan.coupled;
  coupled.num_substeps = 1;
  if (coupled.substep_phase > 0.0) {
    const double phase = std::max(top_frequency(plan), stage_rate(plan)) * plan.period;
    const double decay = damper_rate(plan) * plan.period;
    while ((phase > coupled.substep_phase * coupled.num_substeps ||
            decay > kMaxBarPhase * coupled.num_substeps) &&
           coupled.num_substeps < kMaxSubsteps)
      coupled.num_substeps *= 2;
  }
  if (plan.num_elastic > 0)
    while (rotation_rate(plan) * plan.period > kRotationPhase * coupled.num_substeps &&
           coupled.num_substeps < kMaxSubsteps)
      coupled.num_substeps *= 2;
  const double period = plan.period / coupled.num_substeps;
  PlanCurve& curve = coupled.curve;
  curve.stiff.clear();
  curve.filter.clear();
  coupled.damps_true_strains = !coupled.strain_times.empty() && top_frequency(plan) * period <= kFilterPhase;
  for (std::size_t k = 0; k < curve.modes.size(); ++k) {
    const double phase = plan.omega[index(curve.modes[k])] * period;
    if (phase <= (curve.is_axial[k] != 0 ? kResolvedPhase : kLongestPhase)) continue;
    curve.stiff.push_back(static_cast<std::int32_t>(k));
    const double average = phase < kLongestPhase ? std::sin(phase) / phase : 0.0;
    curve.filter.push_back(average * average);
  }
  curve.is_filtered = !curve.stiff.empty() && plan.omega[index(curve.modes.back())] * period > kFilterPhase;
  const auto n = static_cast<std::size_t>(plan.num_padded);
  coupled.functions.assign(
      std::size_t{PlanCoupled::kNumEntries} * std::size_t{PlanCoupled::kNumFunctions} * n, 0.0);
  for (std::size_t l = 0; l < static_cast<std::size_t>(plan.num_elastic); ++l) {
    const ModeFunctions functions = mode_functions(plan.omega[l], plan.decay[l], period);
    for (std::size_t k = 0; k < functions.size(); ++k) coupled.functions[k * n + l] = functions[k];
  }
}

/// Returns the largest (t_l + beta_R) omega_l^2 [1/s], at which (12.114) would let a mode decay.
double fastest_strain_decay(const StepPlan& plan) {
  double decay = 0.0;
  for (std::size_t l = 0; l < static_cast<std::size_t>(plan.num_elastic); ++l)
    decay =
        std::max(decay, (plan.coupled.strain_times[l] + plan.coupled.beta) * plan.omega[l] * plan.omega[l]);
  return decay;
}

std::string find_unresolved_damping(const StepPlan& plan) {
  const PlanCoupled& coupled = plan.coupled;
  if (coupled.strain_times.empty()) return "";
  const double omega = top_frequency(plan), hertz = 1.0 / plan.period;
  if (!coupled.damps_true_strains)
    return join_text("damping: at ", hertz, " Hz a tick does not resolve the stiffest mode, ", omega,
                     " rad/s, so damping acts on linear strains, which brakes parts that turn far; if they "
                     "turn by more than some 0.1 rad, raise the rate to ",
                     std::ceil(omega / kFilterPhase), " Hz or more, or set fidelity: full");
  const double substep = plan.period / coupled.num_substeps, decay = fastest_strain_decay(plan);
  if (decay * substep <= kFilterPhase) return "";
  return join_text("damping: in a tick of ", hertz, " Hz the fastest mode would decay by ", decay * substep,
                   " time constants; if parts turn by more than some 0.1 rad, the steps may become unstable; "
                   "raise the rate to ",
                   std::ceil(decay / kFilterPhase * substep * hertz), " Hz or more, or reduce the damping");
}

void check_stages(const Scene& scene, const StepPlan& plan, Faults& faults) {
  const double omega = top_frequency(plan), rate = stage_rate(plan), hertz = 1.0 / plan.period;
  const double substep = plan.period / plan.coupled.num_substeps;
  const std::string at =
      join_text("fidelity ", name_of(plan.fidelity), " at ", hertz, " Hz is not possible, because ");
  const double decay = damper_rate(plan);
  if (plan.coupled.substep_phase > 0.0) {
    if (std::max(omega, rate) * substep > plan.coupled.substep_phase || decay * substep > kMaxBarPhase)
      add_error(faults, {},
                join_text(at, "the fastest rate, ", std::max({omega, rate, decay}),
                          " 1/s, requires more than ", kMaxSubsteps,
                          " substeps per tick; raise the rate, soften the stiffest links, or set fidelity: "
                          "coupled"));
    return;
  }
  if (rate * substep > kMaxStagePhase) {
    const Origin& origin = scene.feedbacks.empty() ? Origin{} : scene.feedbacks.front().origin;
    add_error(
        faults, origin,
        join_text(at, "dashpots and feedback change the motion at ", rate, " 1/s, which is ", rate * substep,
                  " in a tick, but this rung applies them at stage times, which is accurate up to ",
                  kMaxStagePhase, " in a tick. Raise the rate to ", rate / kMaxStagePhase,
                  " Hz or more, use smaller gains, or set fidelity: full, spin-loaded or a rung "
                  "below spin-loaded"));
  }
  if (traits_of(plan.fidelity).has_true_geometry && decay * substep > kMaxBarPhase)
    add_error(
        faults, {},
        join_text(
            at, "the fastest decay of a mode, ", decay, " 1/s, is ", decay * substep,
            " in a tick, but with the exact forces of dashpots, and of springs and bars with damping, at "
            "most ",
            kMaxBarPhase, " in a tick is allowed. Raise the rate to ", decay / kMaxBarPhase,
            " Hz or more, reduce the damping, or set 'fidelity: coupled' or 'fidelity: full' (full divides "
            "the tick)"));
  if (traits_of(plan.fidelity).has_true_geometry && omega * substep > kMaxBarPhase)
    add_error(
        faults, {},
        join_text(
            at, "the stiffest mode, ", omega, " rad/s, advances by ", omega * substep,
            " rad in a tick, but with the exact forces of bars at most ", kMaxBarPhase,
            " rad in a tick is allowed. Raise the rate to ", omega / kMaxBarPhase,
            " Hz or more, soften the stiffest bars, or set 'fidelity: coupled' or 'fidelity: full' (full "
            "divides the tick)"));
}

}  // namespace freeflex
