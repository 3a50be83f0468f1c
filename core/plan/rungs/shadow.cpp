#include "core/plan/rungs/shadow.hpp"

#include <Eigen/Geometry>
#include <Eigen/QR>
#include <algorithm>
#include <cmath>

#include "core/faults.hpp"
#include "core/plan/compile.hpp"
#include "core/plan/loads/fast_loads.hpp"
#include "core/plan/rungs/rates.hpp"
#include "core/plan/rungs/rungs.hpp"
#include "core/structure/links/link_factor.hpp"
#include "core/structure/masses/distributed_mass.hpp"

namespace freeflex {
namespace {

// [s] Longest step of a shadow, and [rad] largest phase of the lowest elastic mode in it. The share of mode l
// in the response to a force on a point falls as 1 / omega_l^2, so modes that turn by more than 1 rad in a
// step carry less than 1e-3 of it. Of 41 motions of 20 random structures, all estimates were then within a
// factor of 1.3 of the error; with twice the phase, 39 were (verdict_test).
constexpr double kLongestStep = 0.01, kLowestPhase = 0.03;
// [rad] The same for a shadow that would take more than its share of a processor, or [-] more than this one.
constexpr double kCostlyPhase = 0.125, kCheapShare = 0.05;
// [s] Horizon if all horizons are judged, and if only some are.
constexpr double kHorizon = 10.0, kHorizonOfSome = 2.0;
// [rad] Largest phase of the lowest mode in the step of a shadow that divides the tick of a motion without
// true geometry. Beside a motion with true geometry it is kLowestPhase, because both have the same error in
// high modes: half a tick of 80 Hz gave an estimate of 5.9e-3 for an error of 4.0e-2.
constexpr double kDividedPhase = 0.5;
// [rad] Largest phase of the fastest mode in the step of a shadow beside a motion with true geometry, if this
// is cheap. Without it, the estimate lacks the error of modes that neither motion resolves: 2.1e-3,
// and 9.01e-3 with it, for rods with 938 rad/s at 66 Hz and an error of 9.03e-3 (verdict_kinds_test).
constexpr double kFastestPhase = 2.0;
// Number of points up to which the shadow of a plan with its lowest modes has all modes, and [B] largest
// memory of the mode shapes of a shadow with twice as many.
constexpr std::size_t kMostPointsWithAllModes = 300;
constexpr double kMostBytes = 500e6;
// [-] Most processors that a shadow which divides the tick may take while a horizon is judged.
constexpr double kMostProcessors = 4.0;
// [s] Time for which a daemon waits for the result of the shadow, beside the time that the shadow takes.
constexpr double kSlack = 0.05;

/// Holds the structure on which a shadow is compiled: that of the plan, or one of its own.
struct Ground {
  Scene scene;
  std::optional<Structure> own;
};

// Returns whether the structure of a scene does not depend on the rung: if only points have mass, and no
// rigid link holds them.
bool is_same_on_all_rungs(const Structure& structure) {
  return structure.resolved.are_point_masses && structure.num_constraints == 0;
}

// Returns the scene on another rung, with a structure of its own if it needs one: for rungs on which rigid
// links or mass on links differ, and, if only the lowest modes are kept, with all modes of a small structure
// or with twice as many. Adds an error if the rung does not support the scene.
std::optional<Ground> ground_on(const Scene& scene, const Structure& structure, Fidelity rung,
                                Faults& faults) {
  Ground ground{scene, std::nullopt};
  ground.scene.fidelity = rung;
  ground.scene.automatic.reset();
  const bool is_true = traits_of(rung).has_true_geometry;
  const bool is_small = scene.points.size() <= kMostPointsWithAllModes;
  if (structure.kept.is_subset) {
    if (is_true && !is_small) {
      add_error(faults, scene.modes.origin, "only the lowest modes are kept");
      return std::nullopt;
    }
    ground.scene.modes = {};
    if (!is_small) ground.scene.modes.count = static_cast<int>(2 * structure.omega.size());
    const double bytes = 48.0 * static_cast<double>(scene.points.size() * index(structure.omega.size()));
    if (!is_small && bytes > kMostBytes) {
      add_error(faults, scene.modes.origin,
                join_text("a better plan, with twice as many modes of ", scene.points.size(),
                          " points, would take more than ", kMostBytes * 1e-6, " MB"));
      return std::nullopt;
    }
  } else if ((scene.fidelity == rung && !scene.automatic) || is_same_on_all_rungs(structure)) {
    return ground;
  }
  ground.own = build_structure(ground.scene, faults);
  if (!ground.own || has_error(faults)) return std::nullopt;
  return ground;
}

std::string first_error(const Faults& faults) {
  for (const Fault& fault : faults)
    if (fault.severity == Fault::Severity::kError) return fault.message;
  return {};
}

// Returns the displacements of points and the rotations of points with an attitude in each mode, and in six
// rigid motions if `with_rigid`.
Eigen::MatrixXd motions_of(const Scene& scene, const Structure& structure, bool with_rigid) {
  const Freedoms freedoms(scene);
  std::vector<int> turned;
  for (int i = 0; i < static_cast<int>(scene.points.size()); ++i)
    if (has_attitude(scene.points[index(i)])) turned.push_back(i);
  const Eigen::Index num_points = static_cast<Eigen::Index>(scene.points.size()), n = structure.omega.size();
  Eigen::MatrixXd motions = Eigen::MatrixXd::Zero(3 * (num_points + static_cast<Eigen::Index>(turned.size())),
                                                  n + (with_rigid ? 6 : 0));
  motions.topLeftCorner(3 * num_points, n) = structure.shapes;
  for (std::size_t k = 0; k < turned.size(); ++k)
    motions.block(3 * (num_points + static_cast<Eigen::Index>(k)), 0, 3, n) = structure.rotations.middleRows(
        freedoms.rotation(turned[k]) - freedoms.num_all() + freedoms.num_rotations(), 3);
  for (int a = 0; a < 3 && with_rigid; ++a) {
    const Eigen::Vector3d axis = Eigen::Vector3d::Unit(a);
    for (Eigen::Index i = 0; i < num_points; ++i) {
      motions.block(3 * i, n + a, 3, 1) = axis;
      motions.block(3 * i, n + 3 + a, 3, 1) = axis.cross(structure.mass_properties.r.col(i));
    }
    for (std::size_t k = 0; k < turned.size(); ++k)
      motions.block(3 * (num_points + static_cast<Eigen::Index>(k)), n + 3 + a, 3, 1) = axis;
  }
  return motions;
}

// Returns the coordinates of the modes of one structure on those of another, of the same points: sum m b . b
// / M if points or particles carry all mass, else the least squares of the motions of points   (THEORY 15.3).
Eigen::MatrixXd projection(const Scene& scene, const Structure& from, const Structure& to) {
  const Eigen::MatrixXd &a = particle_shapes(from), &b = particle_shapes(to);
  const bool have_mass = from.matrix_sums.momenta.size() == 0 && a.rows() == b.rows() && a.rows() > 0;
  if (!have_mass) {
    const Eigen::ColPivHouseholderQR<Eigen::MatrixXd> solver(motions_of(scene, to, true));
    return solver.solve(motions_of(scene, from, false)).topRows(to.omega.size());
  }
  Eigen::MatrixXd weighted = a;
  for (Eigen::Index i = 0; i < a.rows(); ++i)
    weighted.row(i) *= from.particles.mass[i / 3] / from.mass_properties.mass;
  return b.transpose() * weighted;
}

// Returns whether two structures of the same points have the same modes up to rounding errors. Points do not
// show the inner coordinates of superelements, so such modes cannot be projected.
bool have_same_modes(const Structure& a, const Structure& b) {
  constexpr double kRounding = 1e-9;
  const auto are_equal = [](const Eigen::MatrixXd& x, const Eigen::MatrixXd& y) {
    return x.rows() == y.rows() && x.cols() == y.cols() && (x - y).norm() <= kRounding * x.norm();
  };
  return are_equal(a.omega, b.omega) && are_equal(a.shapes, b.shapes) && are_equal(a.rotations, b.rotations);
}

void set_modes(const Scene& scene, const Structure& of_plan, const Structure& of_shadow, const StepPlan& plan,
               const StepPlan& shadow, ShadowModes& result) {
  result.numbers = indices_of_modes(plan);
  if (&of_plan == &of_shadow || have_same_modes(of_plan, of_shadow)) return;
  const Eigen::MatrixXd P = projection(scene, of_plan, of_shadow);
  result.projection.assign(result.numbers.size() * index(shadow.num_padded), 0.0);
  for (std::size_t l = 0; l < result.numbers.size(); ++l)
    for (int s = 0; s < shadow.num_elastic; ++s)
      result.projection[l * index(shadow.num_padded) + index(s)] = P(s, result.numbers[l]);
}

// Returns whether the forces inside a link are not known.
bool hides_inside(const Link& link) { return matrices_of(link) != nullptr; }

// Returns whether a superelement has mass at inner coordinates, whose positions are not known.
bool hides_mass(const Link& link) {
  const MatrixLink* const matrix = matrices_of(link);
  return matrix != nullptr && matrix->num_inner > 0 && matrix->mass.nonZeros() > 0;
}

// Returns a text, cut after a word if it has more than 80 characters.
std::string shortened(const std::string& text) {
  constexpr std::size_t kMost = 80;
  return text.size() <= kMost ? text : text.substr(0, text.rfind(' ', kMost)) + " ...";
}

// Names the error that the shadow shares with the plan   (THEORY 15.10).
void find_shared_errors(const Scene& scene, const Structure& of_shadow, const std::string& refusal,
                        PlanVerdict& verdict) {
  const auto hidden = std::ranges::find_if(scene.links, hides_inside);
  if (of_shadow.kept.is_subset) {
    verdict.shared = SharedError::kTruncation;
    verdict.shared_text =
        "only the lowest modes are kept, and the response of the others is not known; keep more with modes:";
  } else if (!refusal.empty()) {
    verdict.shared = SharedError::kRung;
    verdict.shared_text =
        "no rung with true geometry supports the scene, so second-order terms of links are "
        "not judged (" +
        shortened(refusal) + ")";
  } else if (hidden != scene.links.end()) {
    const bool has_mass = std::ranges::any_of(scene.links, hides_mass);
    verdict.shared = has_mass ? SharedError::kInsideMass : SharedError::kInside;
    verdict.shared_text = "the inside of link " +
                          called(*hidden, static_cast<int>(hidden - scene.links.begin())) +
                          " is not known; compare with a model of its parts";
  }
}

// Returns the largest number of ticks, a power of two, in a step of a shadow in which the lowest mode turns
// by at most `phase` [rad].
std::int32_t most_ticks(const Plan& plan, double phase) {
  const PlanVerdict& verdict = plan.verdict;
  const bool is_given = verdict.longest_step > 0.0;
  const double longest = is_given ? verdict.longest_step : kLongestStep;
  std::int32_t ticks = 1;
  while (ticks < PlanShadow::kMostTicks && 2 * ticks * plan.period <= longest &&
         (is_given || verdict.lowest_omega * (2 * ticks * plan.period) <= phase))
    ticks *= 2;
  return ticks;
}

// Returns the least number of steps into which a shadow divides a tick. A plan whose step has an error of its
// own is compared with half the step, or with a quarter if an attractor acts, because the error then falls
// with the square of the step, and half the step would show three quarters of it (true_kinds_test).
std::int32_t least_substeps(const Plan& plan, const StepPlan& shadow) {
  if (!is_coupled(plan) && shadow.num_elastic > 0) return 1;
  return plan.attractor_mu > 0.0 ? 4 : 2;
}

// Returns the number of steps into which a shadow divides a tick so that it resolves the lowest mode, before
// spin and wheels are considered.
std::int32_t resolving_substeps(const Plan& plan, const StepPlan& shadow) {
  const PlanVerdict& verdict = plan.verdict;
  const double phase = traits_of(plan.fidelity).has_true_geometry ? kLowestPhase : kDividedPhase;
  const double most = verdict.longest_step > 0.0   ? verdict.longest_step
                      : verdict.lowest_omega > 0.0 ? phase / verdict.lowest_omega
                                                   : plan.period;
  std::int32_t substeps = least_substeps(plan, shadow);
  while (substeps < kMaxSubsteps && plan.period > most * substeps) substeps *= 2;
  return substeps;
}

// Returns the number of steps into which a shadow divides a tick so that it resolves the fastest mode too.
std::int32_t substeps_for_fastest_mode(const Plan& plan, const PlanShadow& shadow) {
  const StepPlan& own = shadow.plan;
  const double fastest = *std::max_element(own.omega.begin(), own.omega.end()),
               phase = fastest * plan.period / own.coupled.num_substeps;
  std::int32_t substeps = shadow.substeps;
  while (substeps < kMaxSubsteps && phase > kFastestPhase * substeps) substeps *= 2;
  return substeps;
}

}  // namespace

std::optional<Plan> whole_plan(const Scene& scene, const Structure& structure, Fidelity rung, double rate,
                               Faults& faults) {
  PlanSpec spec = full_spec(scene, structure, rung);
  spec.substep_phase *= scene.rate / rate;
  spec.rate = rate;
  spec.has_every_row = true;
  spec.publishes_links = false;
  spec.integration.by =
      IntegrateBy::kModes;  // the motion may be in points; the two then share no error of a method
  return compile(scene, structure, spec, faults);
}

std::vector<std::int32_t> indices_of_modes(const StepPlan& plan) {
  std::vector<std::int32_t> indices(index(plan.num_elastic));
  for (std::int32_t l = 0; l < plan.num_elastic; ++l)
    indices[index(l)] = plan.mode_numbers.empty() ? l : plan.mode_numbers[index(l)] - 1;
  return indices;
}

double seconds_of_step(const StepPlan& plan) {  // (THEORY 15.9)
  const double n = plan.num_elastic, points = static_cast<double>(plan.points.size()),
               passes = plan.coupled.curve.is_filtered ? 2.6 : 1.0;
  const double pairs = has_tables(plan.coupled.kinetics) ? n * n : n * std::max(n, 3.0 * points);
  return passes * plan.coupled.num_substeps * (1e-6 + 0.58e-6 * n + 1.7e-9 * pairs + 15e-9 * points);
}

void set_shadow_rate(Plan& plan) {
  PlanVerdict& verdict = plan.verdict;
  if (verdict.shadows.empty()) return;
  PlanShadow& shadow = verdict.shadows.front();
  const auto set = [&](std::int32_t ticks, std::int32_t substeps) {
    shadow.ticks = ticks;
    shadow.substeps = substeps;
    set_rate(shadow.plan, substeps / (ticks * plan.period));
  };
  const auto ratio = [&] { return seconds_of_step(shadow.plan) / shadow.plan.period; };
  const bool is_true = traits_of(plan.fidelity).has_true_geometry;
  set(is_true ? 1 : most_ticks(plan, kLowestPhase), 1);
  const std::int32_t most = is_true ? 1 : most_ticks(plan, kCostlyPhase);
  while (2 * shadow.ticks <= most && ratio() > std::min(verdict.share, kCheapShare)) set(2 * shadow.ticks, 1);
  // loads over several ticks are parabolas of an undivided step
  while (shadow.ticks > 1 && shadow.plan.coupled.num_substeps > 1) set(shadow.ticks / 2, 1);
  if (shadow.ticks == 1) {
    set(1, resolving_substeps(plan, shadow.plan));
    // a shadow that does not resolve the lowest mode states its own error   (THEORY 15.8)
    const std::int32_t least = least_substeps(plan, shadow.plan);
    while (verdict.longest_step == 0.0 && shadow.substeps > least && ratio() > kMostProcessors)
      set(1, shadow.substeps / 2);
  }
  if (is_true && shadow.plan.num_elastic > 0 && verdict.longest_step == 0.0) {
    const std::int32_t before = shadow.substeps;
    set(1, substeps_for_fastest_mode(plan, shadow));
    if (ratio() > std::min(verdict.share, kCheapShare)) set(1, before);
  }
  // spin and wheels may divide the steps of plan and shadow alike
  const double own = plan.period / plan.coupled.num_substeps;
  const auto length = [&] { return shadow.plan.period / shadow.plan.coupled.num_substeps; };
  while (shadow.ticks == 1 && is_coupled(plan) && 2.0 * length() > own && shadow.substeps < kMaxSubsteps)
    set(1, 2 * shadow.substeps);
  const double every = std::ceil(ratio() / verdict.share);
  shadow.every = std::max<std::int64_t>(
      1, std::llround(std::min(every, static_cast<double>(PlanShadow::kMostHorizons))));
  const double automatic = shadow.every == 1 ? kHorizon : kHorizonOfSome;
  const double horizon = verdict.horizon > 0.0 ? verdict.horizon : automatic;
  const std::int64_t ticks = std::min(horizon_in_ticks(horizon, plan.period), PlanShadow::kMostHorizonTicks);
  shadow.horizon_ticks = (ticks + shadow.ticks - 1) / shadow.ticks * shadow.ticks;
  verdict.fast_loads = takes_scene_loads(shadow) ? find_unseen_loads(plan) : find_fast_loads(shadow.plan);
  const double wait = kSlack + horizon * std::max(0.0, 2.0 * ratio() - 1.0);
  shadow.delay_ticks =
      shadow.ticks + std::min(horizon_in_ticks(wait, plan.period) + 1, PlanShadow::kMostHorizonTicks);
}

void compile_verdict(const Scene& scene, const Structure& structure, const Structure& of_plan, Plan& plan) {
  PlanVerdict& verdict = plan.verdict;
  verdict.is_off = scene.verdict.is_off;
  verdict.horizon = scene.verdict.horizon;
  verdict.share = scene.verdict.share;
  verdict.longest_step = scene.verdict.step;
  verdict.tolerance = scene.tolerance;
  for (const double omega : structure.omega)
    if (omega > 0.0 && (verdict.lowest_omega == 0.0 || omega < verdict.lowest_omega))
      verdict.lowest_omega = omega;
  if (verdict.is_off) return;
  std::string refusal;
  // `full` divides the tick where dashpots or damping are too fast for the steps of `corotational`
  std::vector<Fidelity> rungs(kBetterRungs.begin(), kBetterRungs.end());
  // modes may need a higher rate than a motion in points
  const auto is_left_out = [&](Fidelity rung) {
    return rung != plan.fidelity && !(integrates_points(plan) && traits_of(rung).divides_tick);
  };
  if (traits_of(plan.fidelity).has_true_geometry) std::erase_if(rungs, is_left_out);
  for (const Fidelity rung : rungs) {
    Faults faults;
    const std::optional<Ground> ground = ground_on(scene, structure, rung, faults);
    std::optional<Plan> better;
    if (ground)
      better = whole_plan(ground->scene, ground->own ? *ground->own : structure, rung, scene.rate, faults);
    const bool is_second = traits_of(rung).divides_tick && rungs.size() > 1;
    if (better && is_second && seconds_of_step(*better) > kMostProcessors * better->period) better.reset();
    if (!better) {
      if (refusal.empty()) refusal = first_error(faults);
      continue;
    }
    PlanShadow& shadow = verdict.shadows.emplace_back();
    shadow.plan = std::move(*better);
    const Structure& of_shadow = ground->own ? *ground->own : structure;
    set_modes(scene, of_plan, of_shadow, plan, shadow.plan, shadow.modes[0]);
    if (!plan.fallback.empty())
      set_modes(scene, of_plan, of_shadow, plan.fallback.front(), shadow.plan, shadow.modes[1]);
    find_shared_errors(scene, of_shadow, traits_of(rung).has_true_geometry ? "" : refusal, verdict);
    set_shadow_rate(plan);
    return;
  }
  verdict.shared = SharedError::kNoShadow;
  verdict.shared_text = "no better plan supports the scene: " + refusal;
}

}  // namespace freeflex
