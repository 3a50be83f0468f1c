#include "tools/verification/report/study.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "core/structure/structure.hpp"
#include "tools/terminal/console.hpp"
#include "tools/verification/reference/elastic_error.hpp"
#include "tools/verification/reference/integrate.hpp"
#include "tools/verification/report/study_runs.hpp"

namespace freeflex::tools {
namespace {

/// Returns the time at which the last load ends, or `end` if a load does not end.
double end_of_loads(const CartesianSystem& system, double end) {
  double last = 0.0;
  for (const CartesianLoad& load : system.loads) {
    const PulseHistory* pulse = pulse_of(load.history);
    if (pulse == nullptr) return end;
    last = std::max(last, pulse->start + pulse->duration);
  }
  return std::min(last, end);
}

/// Returns true if any displacement is larger than the rounding error of positions.
bool deforms(const CartesianSystem& system, const ReferenceRun& run) {
  constexpr double kRounding = 1e-13;  // [-] relative to positions and size
  const double size = system.r.colwise().norm().maxCoeff();
  return std::any_of(run.states.begin(), run.states.end(), [&](const CartesianState& state) {
    const Eigen::Matrix3Xd u = elastic_displacements(system.mass, system.r, state.p_W);
    return u.colwise().norm().maxCoeff() > kRounding * (size + state.p_W.colwise().norm().maxCoeff());
  });
}

/// Motion of the full system, which is computed far more accurately than any rung, with its estimated
/// accuracy.
struct Reference {
  ReferenceRun run;
  std::string method;
  double accuracy = 0.0;  // [-] elastic error of a coarser run, relative to this run
};

Reference integrate_reference(const CartesianSystem& system, const StudyOptions& options,
                              double top_frequency, const std::function<bool()>& is_stopped) {
  constexpr double kTolerance = 1e-12;
  constexpr double kStiff = 2e4;  // [rad] phase of the fastest mode over the study
  // [rad] phase of the fastest mode in a step. Fehlberg's method damps an oscillation by 8e-5 and 6e-5 a step
  // at these phases, and excites it above 2.35
  constexpr double kPhase = 2.0, kCoarsePhase = 2.3;
  std::vector<double> times;
  const auto frames = std::llround(options.end / kFramePeriod);
  for (std::int64_t k = 1; k < frames; ++k) times.push_back(static_cast<double>(k) * kFramePeriod);
  times.push_back(options.end);
  Reference reference;
  ReferenceOptions settings;
  settings.is_stopped = is_stopped;
  if (top_frequency * options.end < kStiff) {
    settings.tolerance = kTolerance;
    reference.method = format_text("Fehlberg 7(8), tolerance %g of the deformation", kTolerance);
    if (system.true_geometry) {  // check_independently() finds the accuracy
      reference.run = integrate(system, times, settings);
      return reference;
    }
    reference.run = integrate_with_estimate(system, times, settings);
    reference.accuracy = reference.run.accuracy;
    return reference;
  }
  // in a stiff system stability limits the step, so the step is fixed, and a run with a longer step estimates
  // the accuracy
  settings.fixed_step = kPhase / top_frequency;
  reference.method = format_text("Fehlberg 7(8), fixed step of %.3g s", settings.fixed_step);
  reference.run = integrate(system, times, settings);
  settings.fixed_step = kCoarsePhase / top_frequency;
  const double at_end[] = {options.end};
  const ReferenceRun check = integrate(system, at_end, settings);
  if (!reference.run.error.empty()) return reference;
  if (!check.error.empty()) {
    reference.run.error = check.error;
    return reference;
  }
  const auto u = elastic_displacements(system.mass, system.r, reference.run.states.back().p_W);
  reference.accuracy = elastic_error(elastic_displacements(system.mass, system.r, check.states[0].p_W), u);
  // the scale of which the tolerances of other methods are fractions
  for (std::size_t k = 0; k < reference.run.states.size(); ++k) {
    const double norm = elastic_displacements(system.mass, system.r, reference.run.states[k].p_W).norm();
    ElasticScale& scale = reference.run.scale;
    scale.displacement =
        std::max(scale.displacement, norm / std::sqrt(static_cast<double>(system.mass.size())));
    scale.velocity =
        std::max(scale.velocity, std::sqrt(2.0 * reference.run.strain_energy[k] / system.mass.sum()));
  }
  return reference;
}

/// Compares the end of the reference with an extrapolated method of order 16, which shares no step with
/// SUNDIALS. Raises the stated error of the reference to the difference.
void check_independently(const CartesianSystem& system, double top_frequency, double end,
                         const std::function<bool()>& is_stopped, Reference& reference) {
  constexpr double kPhase = 2.0;  // [rad] phase of the fastest mode in a step
  std::string error;
  auto method = make_rival(Rival::kStoermer16, system, error);
  const char* name = method ? "Stoermer 16" : "midpoint 16";
  if (!method) method = make_rival(Rival::kMidpoint16, system, error);
  RivalOptions options{kPhase / top_frequency, 0.0, reference.run.scale, is_stopped};
  CartesianState state;
  const double at_end[] = {end};
  const RivalRun run =
      method->run(at_end, options, [&](std::size_t, const CartesianState& read) { state = read; });
  if (!run.error.empty()) {
    reference.run.error = std::string(name) + " failed, which checks the reference: " + run.error;
    return;
  }
  const auto u = elastic_displacements(system.mass, system.r, reference.run.states.back().p_W);
  const double difference = elastic_error(elastic_displacements(system.mass, system.r, state.p_W), u);
  reference.method +=
      format_text("; %s with steps of %.3g s differs by %.1e", name, options.step, difference);
  reference.accuracy = std::max(reference.accuracy, difference);
}

Reference find_reference(const CartesianSystem& system, const StudyOptions& options, double top_frequency,
                         const std::function<bool()>& is_stopped) {
  Reference reference = integrate_reference(system, options, top_frequency, is_stopped);
  if (system.true_geometry && reference.run.error.empty())
    check_independently(system, top_frequency, options.end, is_stopped, reference);
  return reference;
}

Trajectory motion_of(const CartesianSystem& system, const ReferenceRun& run, double free_from) {
  Trajectory motion;
  for (const CartesianState& state : run.states) {
    motion.frames.push_back(state.p_W);
    if (!motion.energy_start && state.time >= free_from && state.time < run.states.back().time)
      motion.energy_start = total_energy(system, state);
  }
  motion.end = run.states.back();
  if (motion.energy_start) motion.energy_end = total_energy(system, motion.end);
  return motion;
}

void describe(const std::string& file, const Scene& scene, const StudyOptions& options, Study& study) {
  study.scene = scene.name;
  study.file = file;
  study.points = scene.points.size();
  study.links = scene.links.size();
  study.end = options.end;
  study.spin = scene.initial.angular_velocity.norm();
}

/// Returns why a structure has no elastic error, or an empty text.
std::string nothing_to_compare(const Structure& structure) {
  if (structure.omega.size() == 0)
    return "the scene has no elastic freedoms, so there is no elastic error to compare";
  if (!(structure.omega.maxCoeff() > 0.0))
    return "no link resists a deformation, so there is no elastic error to compare; use `freeflex run`";
  return {};
}

/// Moves the edges of pulses to the ticks of the scene, so that pulses act alike in every method at any step.
Scene with_pulses_at_ticks(Scene scene) {
  const auto at_tick = [&scene](double time) { return std::round(time * scene.rate) / scene.rate; };
  for (Load& load : scene.loads)
    if (const PulseHistory* pulse = pulse_of(load.history)) {
      const double start = at_tick(pulse->start), end = at_tick(pulse->start + pulse->duration);
      load.history = PulseHistory{start, end - start};
    }
  return scene;
}

}  // namespace

Study study_scene(const std::string& file, const Scene& given, const StudyOptions& options,
                  const std::function<bool(double)>& report_progress) {
  const Scene scene = with_pulses_at_ticks(given);
  Study study;
  describe(file, scene, options, study);
  if (const auto fault = find_no_full_system(scene)) {
    study.error = fault->message;
    return study;
  }
  const CartesianSystem system = make_full_system(scene);
  study.has_true_geometry = system.true_geometry.has_value();
  Faults faults;
  double start = thread_cpu();
  const auto structure = build_structure(scene, faults);
  const double structure_cpu = thread_cpu() - start;
  if (!structure) {
    study.error = faults.empty() ? "no structure" : faults.front().message;
    return study;
  }
  study.elastic_freedoms = index(structure->omega.size());
  study.error = nothing_to_compare(*structure);
  if (!study.error.empty()) return study;
  study.top_frequency = structure->omega.maxCoeff();
  for (const double omega : structure->omega)
    if (omega > 0.0 && study.lowest_frequency == 0.0) study.lowest_frequency = omega;
  bool stops = !report_progress(0.02);
  start = thread_cpu();
  Reference reference =
      find_reference(system, options, study.top_frequency, [&] { return stops || !report_progress(-1.0); });
  study.reference_cpu = thread_cpu() - start;
  study.reference = reference.method;
  study.reference_accuracy = reference.accuracy;
  if (!reference.run.error.empty() && (stops || !report_progress(-1.0))) {
    study.is_interrupted = true;
    return study;
  }
  if (!reference.run.error.empty()) {
    study.error = "the reference failed: " + reference.run.error;
    return study;
  }
  if (!deforms(system, reference.run)) {
    study.error =
        format_text("nothing deforms within %g s, so there is no elastic error to compare", options.end);
    return study;
  }
  const double free_from = end_of_loads(system, options.end);
  const ErrorMeter meter(system, *structure, free_from, motion_of(system, reference.run, free_from));
  // fractions of the progress bar for the reference, the rungs and the other methods, in this order
  constexpr double kReferencePart = 0.1, kRungsPart = 0.25;
  const auto advance = [&](double done) {
    stops = stops || !report_progress(done);
    return !stops;
  };
  const Bench bench{
      scene, system, *structure, meter, options, structure_cpu, free_from, reference.run.scale, [&] {
        return stops || !report_progress(-1.0);
      }};
  const std::vector<ExactRung> exact =
      run_rungs(bench, study, [&](double done) { return advance(kReferencePart + kRungsPart * done); });
  const Eigen::Matrix3Xd* linear = nullptr;
  for (const ExactRung& rung : exact)
    if (traits_of(rung.fidelity).takes_spin_load && rung.p_W.cols() > 0) linear = &rung.p_W;
  if (options.has_rivals && !stops)
    run_rivals(bench, linear, study, [&](double done) {
      return advance(kReferencePart + kRungsPart + (1.0 - kReferencePart - kRungsPart) * done);
    });
  study.is_interrupted = stops;
  return study;
}

// Sets the errors of a run. The integration error is the difference of the run from the exact motion of its
// rung. The model error is the error of that exact motion (THEORY 13.15).
void set_errors(const Bench& bench, const Trajectory& motion, const Eigen::Matrix3Xd* exact, Run& run) {
  const Eigen::Matrix3Xd& p_W = motion.end.p_W;
  run.elastic_error = bench.meter.elastic(p_W);
  run.position_error = bench.meter.position(p_W);
  run.attitude_error = bench.meter.attitude(p_W);
  run.frequency_error = bench.meter.frequency(motion);
  run.energy_drift = bench.meter.energy_drift(motion);
  // a method on the full system has no model error, so its whole error is integration error
  run.integration_error = run.elastic_error;
  if (exact == nullptr) return;
  run.model_error = bench.meter.elastic(*exact);
  // a rigid body has no displacements to compare, only rounding errors
  const Eigen::Matrix3Xd u = bench.meter.displacements(*exact);
  run.integration_error =
      std::abs(run.model_error - 1.0) < 1e-6 ? NAN : elastic_error(bench.meter.displacements(p_W), u);
}

const char* name_of(Family family) {
  switch (family) {
    case Family::kRung:
      return "freeflex";
    case Family::kHandWritten:
      return "hand-written";
    case Family::kPackaged:
      return "packaged";
    case Family::kLinearised:
      return "linearised";
  }
  return "?";
}

std::string setting_of(const Run& run) {
  const auto time = [](double step) {
    if (step >= 1.0) return format_text("%.3g s", step);
    return step >= 1e-4 ? format_text("%.3g ms", 1e3 * step) : format_text("%.3g us", 1e6 * step);
  };
  std::string text = run.step > 0.0 ? time(run.step) : std::string();
  if (run.free_step > 0.0) text += ", then " + time(run.free_step);
  if (run.tolerance > 0.0) text += format_text("%stol %.0e", text.empty() ? "" : ", ", run.tolerance);
  return text;
}

namespace {

/// Returns the cost of a method at an elastic error. This is the smaller of two costs: the cost of the
/// method's cheapest run with at most that error, and the cost that is interpolated linearly in logarithms
/// between two neighbouring settings, one with a smaller and one with a larger error.
double cost_at(const std::vector<const Run*>& runs, double error, std::size_t load) {
  double cost = std::numeric_limits<double>::infinity();
  for (std::size_t k = 0; k < runs.size(); ++k) {
    const Run& run = *runs[k];
    if (run.elastic_error > error) continue;
    cost = std::min(cost, *run.cpu[load]);
    if (k == 0) continue;
    const Run& coarser = *runs[k - 1];
    // a run whose error is as large as the motion is useless for interpolation
    if (coarser.elastic_error <= error || coarser.elastic_error > 0.5) continue;
    const double fraction =
        std::log(error / run.elastic_error) / std::log(coarser.elastic_error / run.elastic_error);
    cost = std::min(cost, *run.cpu[load] * std::pow(*coarser.cpu[load] / *run.cpu[load], fraction));
  }
  return cost;
}

void keep_cheaper(const std::string& method, double cpu, double ours, Comparison::Other& other) {
  if (!std::isfinite(cpu) || (!other.method.empty() && other.cpu <= cpu)) return;
  other = {method, cpu, cpu / ours};
}

}  // namespace

std::optional<Comparison> compare_at(const Study& study, double level, ReadOut read_out) {
  const auto load = static_cast<std::size_t>(read_out);
  Comparison found;
  found.level = level;
  found.cpu = std::numeric_limits<double>::infinity();
  for (std::size_t k = 0; k < study.runs.size(); ++k) {
    const Run& run = study.runs[k];
    if (run.family != Family::kRung || !run.failure.empty() || !run.cpu[load]) continue;
    if (run.elastic_error <= level && *run.cpu[load] < found.cpu) found.cpu = *run.cpu[load], found.ours = k;
  }
  if (!std::isfinite(found.cpu)) return std::nullopt;
  // methods with the same model error differ slightly in their integration errors, so the error of another
  // method may be 5 % larger than ours
  constexpr double kSame = 1.05;
  const Run& ours = study.runs[found.ours];
  const double error = found.error = kSame * std::max({ours.elastic_error, ours.model_error, kFinest});
  std::vector<std::string> methods;
  for (const Run& run : study.runs)
    if (run.family != Family::kRung && std::find(methods.begin(), methods.end(), run.method) == methods.end())
      methods.push_back(run.method);
  for (const std::string& method : methods) {
    std::vector<const Run*> runs;
    for (const Run& run : study.runs)
      if (run.method == method && run.failure.empty() && run.cpu[load]) runs.push_back(&run);
    if (runs.empty()) continue;
    const double cpu = cost_at(runs, error, load);
    const Family family = runs.front()->family;
    keep_cheaper(method, cpu, found.cpu, found.best);
    keep_cheaper(method, cpu, found.cpu,
                 family == Family::kHandWritten ? found.hand_written
                 : family == Family::kPackaged  ? found.packaged
                                                : found.linearised);
  }
  return found;
}

}  // namespace freeflex::tools
