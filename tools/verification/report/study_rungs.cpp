// Runs the rungs of the fidelity ladder in a study.
#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <string>

#include "core/motion.hpp"
#include "core/plan/file/plan_bytes.hpp"
#include "core/plan/make_plan.hpp"
#include "core/plan/rungs/rates.hpp"
#include "core/step/linear/kernels.hpp"
#include "core/step/readout.hpp"
#include "core/step/vector.hpp"
#include "tools/terminal/console.hpp"
#include "tools/verification/reference/elastic_error.hpp"
#include "tools/verification/report/rung.hpp"
#include "tools/verification/report/study_runs.hpp"

namespace freeflex::tools {
namespace {

constexpr std::array kSteps{0.1, 0.05, 0.025, 0.02, 0.01, 0.005, 0.004, 0.0025, 0.002, 0.001, 0.0005};  // [s]
// [s] small steps, at which the motion of a rung counts as exact
constexpr std::array kFineSteps{0.00025, 0.0001, 0.00005};
// [s] limit of the CPU time of a run on the rung `full`. This rung divides its steps into substeps, so the
// cost hardly depends on the step
constexpr double kMostFullCost = 4.0;
constexpr std::array kFullSteps{0.01, 0.001};  // [s]

bool is_whole(double ratio) { return std::abs(ratio - std::round(ratio)) < 1e-6; }

/// Returns the reason why a step does not fit the scene, or an empty text if it fits.
std::string find_misfit(const Bench& bench, double step) {
  if (!is_whole(bench.options.end / step)) return "the end is not a whole number of steps";
  for (const double edge : discontinuities(bench.system, bench.options.end))
    if (!is_whole(edge / step)) return "a load begins or ends between two steps";
  return {};
}

/// Returns the number of ticks at the first step: up to the free motion if it has a step of its own, else to
/// the end.
std::int64_t loaded_ticks(const Bench& bench, const Rung& rung) {
  return std::llround((rung.free_plan ? bench.free_from : bench.options.end) / rung.plan.period);
}

/// Runs to the end. Stores a frame every 10 ms if 10 ms is a whole number of ticks. Returns false if the
/// state is not finite.
bool follow(const Bench& bench, Rung& rung, Trajectory& motion) {
  const double period = rung.plan.period;
  rung.restart();
  const auto ticks = loaded_ticks(bench, rung);
  const auto points = static_cast<Eigen::Index>(rung.num_read());
  motion.end = {bench.options.end, Eigen::Matrix3Xd(3, points), Eigen::Matrix3Xd(3, points)};
  const bool has_frames = period <= kFramePeriod * (1.0 + 1e-9) && is_whole(kFramePeriod / period);
  const std::int64_t per_frame = has_frames ? std::llround(kFramePeriod / period) : 0;
  const auto free_tick = std::llround(bench.free_from / period);
  if (free_tick == 0) motion.energy_start = rung.energy();
  for (std::int64_t k = 1; k <= ticks; ++k) {
    if (!rung.advance(1)) return false;
    if (per_frame > 0 && k % per_frame == 0) {
      rung.read(motion.end);
      motion.frames.push_back(motion.end.p_W);
    }
    if (k == free_tick && (k < ticks || rung.free_plan)) motion.energy_start = rung.energy();
  }
  if (rung.free_plan && !rung.advance_freely()) return false;
  rung.read(motion.end);
  if (motion.energy_start) motion.energy_end = rung.energy();
  return motion.end.p_W.allFinite();
}

void time_read_outs(const Bench& bench, Rung& rung, Run& run) {
  const double period = rung.plan.period;
  const auto ticks = loaded_ticks(bench, rung);
  CartesianState now{0.0, Eigen::Matrix3Xd(3, rung.num_read()), Eigen::Matrix3Xd(3, rung.num_read())};
  constexpr std::array<double, kReadOuts> kEvery{0.0, 0.01, 0.001};  // [s]
  for (std::size_t load = 0; load < kReadOuts; ++load) {
    std::int64_t every = ticks;
    if (load > 0) {
      // readings must be at ticks
      if (rung.free_plan || kEvery[load] < period * (1.0 - 1e-9) || !is_whole(kEvery[load] / period))
        continue;
      every = std::llround(kEvery[load] / period);
    }
    const Timing timing = time_work(
        [&] {
          rung.restart();
          if (rung.free_plan) {
            rung.advance(ticks);
            rung.advance_freely();
            rung.read(now);
            return;
          }
          for (std::int64_t k = 0; k < ticks; k += every) {
            rung.advance(std::min<std::int64_t>(every, ticks - k));
            rung.read(now);
          }
        },
        bench.options.repeats);
    run.cpu[load] = timing.seconds / bench.options.end;
    if (load == 0) run.repeats = timing.repeats;
  }
}

std::string first_error(const Faults& faults) {
  for (const Fault& fault : faults)
    if (fault.severity == Fault::Severity::kError) return fault.message;
  return "no plan can be made";
}

Scene with_all_points(const Bench& bench, Fidelity fidelity) {
  Scene scene = bench.scene;
  scene.fidelity = fidelity;
  scene.publication = {};
  scene.pushable.clear();
  for (std::size_t i = 0; i < scene.points.size(); ++i)
    scene.publication.points.push_back(static_cast<int>(i));
  return scene;
}

/// Sets up the scene on a rung at a step. If the plan is refused, sets `why` to the reason and returns
/// nullopt.
std::unique_ptr<Rung> make_rung(const Bench& bench, Scene& scene, double step, std::string& why) {
  Faults faults;
  scene.rate = 1.0 / step;
  std::optional<Plan> plan = make_full_plan(scene, bench.structure, scene.fidelity, faults);
  if (plan && !has_error(faults)) return std::make_unique<Rung>(std::move(*plan), bench.system);
  why = first_error(faults);
  return nullptr;
}

/// Returns the reason to omit a run if the run would take more than `most` [s] of CPU time, otherwise an
/// empty text.
std::string find_excess(const Bench& bench, Rung& rung, double most) {
  const auto cost_of = [&](std::int64_t ticks) {
    rung.restart();
    const double start = thread_cpu();
    rung.advance(ticks);
    return (thread_cpu() - start) * bench.options.end / (rung.plan.period * static_cast<double>(ticks));
  };
  double cost = cost_of(1);
  if (cost > most) cost = cost_of(3);  // measured again, because the first tick ran with cold caches
  return cost <= most ? std::string()
                      : format_text("a run would take %.0f s of CPU time, more than is allowed", cost);
}

/// Adds one run of a rung at a step, and at `free_step` after the end of the loads (0: the same step). If the
/// scene integrates points, the run is named so.
void add_run(const Bench& bench, Scene& scene, double step, double free_step, const ExactRung& exact,
             Study& study) {
  const bool is_by_points = scene.integration.by == IntegrateBy::kPoints;
  const std::string name = name_of(exact.fidelity) + std::string(is_by_points ? kByPoints : "");
  std::string why;
  const double start = thread_cpu();
  const std::unique_ptr<Rung> rung = make_rung(bench, scene, step, why);
  const double set_up = bench.structure_cpu + thread_cpu() - start;
  if (rung)
    why = find_excess(bench, *rung,
                      traits_of(exact.fidelity).divides_tick ? kMostFullCost : bench.options.budget);
  if (!why.empty()) {
    study.left_out.push_back({name + format_text(" at %g ms", 1e3 * step), why});
    return;
  }
  if (free_step > 0.0) rung->take_freely(std::llround(bench.free_from / step), free_step);
  Run& run = study.runs.emplace_back();
  run.set_up = set_up;
  run.family = Family::kRung;
  run.method = name;
  run.step = step;
  run.free_step = free_step;
  run.tolerance = is_by_points ? scene.integration.accuracy : 0.0;
  run.memory = rung->memory();
  run.steps = loaded_ticks(bench, *rung) + (free_step > 0.0 ? 1 : 0);
  Trajectory motion;
  if (!follow(bench, *rung, motion)) {
    run.failure = "the state is not finite, because the step exceeds the method's stability limit";
    return;
  }
  set_errors(bench, motion, exact.p_W.cols() > 0 ? &exact.p_W : nullptr, run);
  time_read_outs(bench, *rung, run);
}

/// Returns the steps of a rung [s], beginning with the longest. The steps include the scene's own step.
std::vector<double> steps_of(const Bench& bench, Fidelity fidelity) {
  if (traits_of(fidelity).divides_tick) return {kFullSteps.begin(), kFullSteps.end()};
  std::vector<double> steps(kSteps.begin(), kSteps.end());
  const double own = 1.0 / bench.scene.rate;
  const auto is_own = [own](double step) { return std::abs(step - own) < 1e-6 * own; };
  if (own >= kFineSteps[0] && std::none_of(steps.begin(), steps.end(), is_own)) steps.push_back(own);
  std::sort(steps.rbegin(), steps.rend());
  return steps;
}

/// Adds a run that takes the whole motion after the loads in one step. Before, the run uses the longest step
/// that fits the loads. On rungs up to `spin-loaded` there are no stages, so only the rotation of the body
/// limits the step.
void add_longest(const Bench& bench, Scene& scene, const ExactRung& exact, Study& study) {
  const double free_step = bench.options.end - bench.free_from;
  if (traits_of(exact.fidelity).couples || free_step <= 0.0) return;
  const std::vector<double> steps = steps_of(bench, exact.fidelity);
  if (bench.free_from == 0.0) {
    const auto is_free_step = [&](double step) { return std::abs(free_step / step - 1.0) < 1e-9; };
    if (std::ranges::none_of(steps, is_free_step)) add_run(bench, scene, free_step, 0.0, exact, study);
    return;
  }
  for (const double step : steps)
    if (is_whole(bench.free_from / step) && std::abs(free_step / step - 1.0) > 1e-9 &&
        find_misfit(bench, step).empty())
      return add_run(bench, scene, step, free_step, exact, study);
}

/// Adds runs that integrate points, at several accuracies and ticks.
void add_points_runs(const Bench& bench, Scene scene, const ExactRung& exact, Study& study) {
  constexpr std::array kAccuracies{1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8, 1e-9};
  constexpr std::array kTicks{0.1, 0.01, 0.001};  // [s]
  scene.integration.by = IntegrateBy::kPoints;
  scene.integration.accuracy = kAccuracies[0];
  scene.rate = 1.0 / kTicks[0];
  Faults faults;
  if (!make_full_plan(scene, bench.structure, scene.fidelity, faults)) {
    study.left_out.push_back({name_of(exact.fidelity) + std::string(kByPoints), first_error(faults)});
    return;
  }
  for (const double tick : kTicks)
    for (const double accuracy : kAccuracies) {
      scene.integration.accuracy = accuracy;
      if (find_misfit(bench, tick).empty()) add_run(bench, scene, tick, 0.0, exact, study);
    }
}

/// Returns the first of several small steps [s] that fits the scene: the steps of kFineSteps, then a fraction
/// of the scene's period. If none fits, sets `why` to the reason and returns 0.
double fine_step(const Bench& bench, std::string& why) {
  std::vector<double> steps(kFineSteps.begin(), kFineSteps.end());
  const double period = 1.0 / bench.scene.rate;
  steps.push_back(period / std::ceil(period / kFineSteps[0] * (1.0 - 1e-9)));
  for (const double step : steps)
    if (why = find_misfit(bench, step); why.empty()) return step;
  why = "neither a step from 0.25 to 0.05 ms nor a fraction of the scene's period fits, because " + why +
        "; set --until to a whole number of periods of the scene's rate";
  return 0.0;
}

/// Runs a rung at a small step. Returns the positions at the end, which are empty if the state is not finite.
/// If the run is refused, sets `why` to the reason and returns nullopt.
std::optional<Eigen::Matrix3Xd> follow_finely(const Bench& bench, Scene scene, Fidelity fidelity, double step,
                                              std::string& why) {
  scene.fidelity = fidelity;
  const std::unique_ptr<Rung> fine = make_rung(bench, scene, step, why);
  if (!fine) return std::nullopt;
  if (const std::string excess = find_excess(bench, *fine, 4.0 * bench.options.budget); !excess.empty()) {
    why =
        format_text(
            "the reference solution of this rung's equations, with steps of %g ms, is not computed, because ",
            1e3 * step) +
        excess;
    return std::nullopt;
  }
  Trajectory motion;
  return follow(bench, *fine, motion) ? motion.end.p_W : Eigen::Matrix3Xd();
}

/// Solves the rung's own equations at a small step. If this is refused, sets `why` to the reason and returns
/// nullopt. `below` holds the results of the lower rungs.
std::optional<ExactRung> solve_exactly(const Bench& bench, Fidelity fidelity,
                                       const std::vector<ExactRung>& below, const Scene& scene,
                                       std::string& why) {
  if (traits_of(fidelity).divides_tick) {
    // the rung `full` has the equations of `corotational`
    for (const ExactRung& each : below)
      if (traits_of(each.fidelity).has_true_geometry) return ExactRung{fidelity, each.p_W};
    why = "it has the equations of corotational, and this scene is refused on corotational";
    return std::nullopt;
  }
  const double step = fine_step(bench, why);
  if (step == 0.0) return std::nullopt;
  // if bars are stiff, the equations of `corotational` need substeps, which only the rung `full` makes
  const bool is_corotational = fidelity == Fidelity::kCorotational;
  auto p_W = follow_finely(bench, scene, is_corotational ? Fidelity::kFull : fidelity, step, why);
  if (is_corotational && bench.system.true_geometry) {
    // Without stiff bars the steps of `corotational` itself may be finer than the substeps of `full`. Both
    // rungs have the equations of the full system, so the motion nearest to the reference is the more exact
    // one
    std::string refusal;
    const auto other = follow_finely(bench, scene, fidelity, step, refusal);
    const auto error = [&](const auto& end) {
      return end && end->cols() > 0 ? bench.meter.elastic(*end) : std::numeric_limits<double>::infinity();
    };
    if (error(other) < error(p_W)) p_W = other;
  }
  return p_W ? std::optional(ExactRung{fidelity, *p_W}) : std::nullopt;
}

}  // namespace

std::vector<ExactRung> run_rungs(const Bench& bench, Study& study,
                                 const std::function<bool(double)>& report_progress) {
  std::vector<ExactRung> exact;
  for (std::size_t r = 0; r < kRungs.size(); ++r) {
    Scene scene = with_all_points(bench, kRungs[r].rung);
    scene.integration.by = IntegrateBy::kModes;
    std::string why;
    std::optional<ExactRung> solved = solve_exactly(bench, kRungs[r].rung, exact, scene, why);
    if (!solved) {
      study.left_out.push_back({std::string("rung ") + name_of(kRungs[r].rung), why});
      continue;
    }
    exact.push_back(std::move(*solved));
    add_longest(bench, scene, exact.back(), study);
    const std::vector<double> steps = steps_of(bench, kRungs[r].rung);
    for (std::size_t s = 0; s < steps.size(); ++s) {
      if (!report_progress(
              (static_cast<double>(r) + static_cast<double>(s) / static_cast<double>(steps.size())) /
              kRungs.size()))
        return exact;
      why = find_misfit(bench, steps[s]);
      if (why.empty())
        add_run(bench, scene, steps[s], 0.0, exact.back(), study);
      else if (r == 0)
        study.left_out.push_back({format_text("rungs at %g ms", 1e3 * steps[s]), why});
    }
    const RungTraits& traits = traits_of(kRungs[r].rung);
    if (traits.has_true_geometry && !traits.divides_tick) add_points_runs(bench, scene, exact.back(), study);
  }
  return exact;
}

}  // namespace freeflex::tools
