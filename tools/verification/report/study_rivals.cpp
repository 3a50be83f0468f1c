// Runs the other methods of a study, each over a range of steps or tolerances.
#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "tools/terminal/console.hpp"
#include "tools/verification/report/study_runs.hpp"

namespace freeflex::tools {
namespace {

struct Entry {
  Rival rival;
  Family family;
  const char* name;
};
constexpr std::array kEntries{Entry{Rival::kVerlet, Family::kHandWritten, "velocity Verlet"},
                              Entry{Rival::kRungeKutta4, Family::kHandWritten, "Runge-Kutta 4"},
                              Entry{Rival::kStoermer8, Family::kHandWritten, "Stoermer 8"},
                              Entry{Rival::kStoermer12, Family::kHandWritten, "Stoermer 12"},
                              Entry{Rival::kStoermer16, Family::kHandWritten, "Stoermer 16"},
                              Entry{Rival::kKahanLi8, Family::kHandWritten, "Kahan-Li 8"},
                              Entry{Rival::kMidpoint8, Family::kHandWritten, "midpoint 8"},
                              Entry{Rival::kMidpoint12, Family::kHandWritten, "midpoint 12"},
                              Entry{Rival::kMidpoint16, Family::kHandWritten, "midpoint 16"},
                              Entry{Rival::kErk4, Family::kPackaged, "ARKODE explicit 4"},
                              Entry{Rival::kErk8, Family::kPackaged, "ARKODE explicit 8"},
                              Entry{Rival::kDirk5, Family::kPackaged, "ARKODE implicit 5"},
                              Entry{Rival::kAdams, Family::kPackaged, "CVODE Adams"},
                              Entry{Rival::kBdf, Family::kPackaged, "CVODE BDF"},
                              Entry{Rival::kLeapfrog, Family::kLinearised, "leapfrog, linear"},
                              Entry{Rival::kKrylov, Family::kLinearised, "Krylov, linear"}};

struct Setting {
  double step = 0.0, tolerance = 0.0;
};

/// Order of a fixed-step method, and the largest usable phase of the fastest mode in a step [rad].
struct FixedStep {
  int order;
  double limit;
};

std::optional<FixedStep> fixed_step_of(Rival rival) {
  switch (rival) {
    case Rival::kVerlet:
    case Rival::kLeapfrog:
      return FixedStep{2, 2.0};
    case Rival::kRungeKutta4:
      return FixedStep{4, 2.0 * std::sqrt(2.0)};
    case Rival::kStoermer8:
      return FixedStep{8, 4.1};
    // above phases of 3.7 and 3.6 these two methods are unstable, but in a short run the growth is negligible
    case Rival::kStoermer12:
      return FixedStep{12, 4.25};
    case Rival::kStoermer16:
      return FixedStep{16, 5.0};
    case Rival::kKahanLi8:
      return FixedStep{8, 5.6};
    // above phases of 3.4, 3.4 and 3.5 these methods are unstable, but growth is negligible in a short run
    case Rival::kMidpoint8:
      return FixedStep{8, 3.44};
    case Rival::kMidpoint12:
      return FixedStep{12, 3.98};
    case Rival::kMidpoint16:
      return FixedStep{16, 5.28};
    default:
      return std::nullopt;
  }
}

/// Returns the settings of a method, beginning with the coarsest usable setting.
std::vector<Setting> settings_of(Rival rival, double top_frequency, double end) {
  constexpr double kInside = 0.99;  // fraction of the limit
  std::vector<Setting> settings;
  if (rival == Rival::kKrylov) {
    for (const double step : {end, 0.5, 0.2, 0.1, 0.05, 0.02, 0.01})
      if (step < end || settings.empty())
        for (const double tolerance : {1e-3, 1e-5, 1e-7}) settings.push_back({step, tolerance});
    return settings;
  }
  if (const auto fixed = fixed_step_of(rival)) {
    const double coarsest = std::min(kInside * fixed->limit / top_frequency, end);
    // from one setting to the next the error falls by a factor of four; costs between settings are
    // interpolated
    const double factor = std::exp2(-2.0 / fixed->order);
    for (int k = 0; k < (fixed->order == 2 ? 12 : 18); ++k)
      settings.push_back({coarsest * std::pow(factor, k), 0.0});
    return settings;
  }
  for (int k = 3; k <= 10; ++k) settings.push_back({0.0, std::pow(10.0, -k)});
  return settings;
}

std::vector<double> reading_times(double end, double every) {
  std::vector<double> times;
  const auto count = std::llround(end / every);
  for (std::int64_t k = 1; k < count; ++k) times.push_back(static_cast<double>(k) * every);
  times.push_back(end);
  return times;
}

/// Runs another method once and stores the motion, from which the errors are computed.
RivalRun follow(const Bench& bench, RivalMethod& method, const RivalOptions& options, double every,
                Trajectory& motion) {
  const std::vector<double> times = reading_times(bench.options.end, every);
  const auto per_frame = static_cast<std::size_t>(std::llround(kFramePeriod / every));
  bool is_free = false;
  return method.run(times, options, [&](std::size_t k, const CartesianState& state) {
    if ((k + 1) % per_frame == 0) motion.frames.push_back(state.p_W);
    // the first reading after the loads end; if it were the last reading, no time would remain for a drift
    if (!is_free && state.time >= bench.free_from && k + 1 < times.size()) {
      is_free = true;
      motion.energy_start = total_energy(bench.system, state);
    }
    if (k + 1 < times.size()) return;
    motion.end = state;
    if (is_free) motion.energy_end = total_energy(bench.system, state);
  });
}

class Sweep {
 public:
  Sweep(const Bench& bench, const Eigen::Matrix3Xd* linear, Study& study)
      : bench_(bench), linear_(linear), study_(study) {}

  /// Runs one method at all its settings. Returns false if the user stopped the study.
  bool run(const Entry& entry, const std::function<bool(double)>& report_progress) {
    std::string error;
    const double start = thread_cpu();
    const std::unique_ptr<RivalMethod> method = make_rival(entry.rival, bench_.system, error);
    const double set_up = thread_cpu() - start;
    if (!method) {
      study_.left_out.push_back({entry.name, error});
      return true;
    }
    const auto settings = settings_of(entry.rival, study_.top_frequency, bench_.options.end);
    for (std::size_t k = 0; k < settings.size(); ++k) {
      if (!report_progress(static_cast<double>(k) / static_cast<double>(settings.size()))) return false;
      Run run;
      run.family = entry.family;
      run.method = entry.name;
      run.step = settings[k].step;
      run.tolerance = settings[k].tolerance;
      run.set_up = set_up;
      const Next next = measure(*method, run);
      if (next == Next::kOverBudget) return true;
      study_.runs.push_back(run);
      if (next == Next::kFinest) return true;
    }
    return true;
  }

 private:
  enum class Next { kGoOn, kFinest, kOverBudget };
  static constexpr double kVeryLong = 3.0;  // [s]

  Next measure(RivalMethod& method, Run& run) {
    RivalOptions options{run.step, run.tolerance, bench_.scale, {}};
    double deadline = thread_cpu() + bench_.options.budget;
    options.is_stopped = [&] { return thread_cpu() > deadline || bench_.is_stopped(); };
    Trajectory motion;
    const double start = thread_cpu();
    const RivalRun done = follow(bench_, method, options, kFramePeriod, motion);
    const double taken = thread_cpu() - start;
    run.steps = done.num_steps;
    run.evaluations = done.num_evaluations;
    run.memory = done.memory;
    run.failure = done.error;
    if (done.error.find("stopped") != std::string::npos) {
      if (!bench_.is_stopped())
        study_.left_out.push_back({std::string(run.method) + " at " + setting_of(run) + " and finer",
                                   format_text("takes more than %g s of CPU time", bench_.options.budget)});
      return Next::kOverBudget;
    }
    if (!run.failure.empty()) return Next::kGoOn;
    if (study_.has_true_geometry && run.family == Family::kHandWritten)
      study_.evaluation_cpu = taken / static_cast<double>(done.num_evaluations);
    set_errors(bench_, motion, run.family == Family::kLinearised ? linear_ : nullptr, run);
    time_read_outs(method, options, deadline, taken, run);
    return is_finest(run, taken) ? Next::kFinest : Next::kGoOn;
  }

  /// Returns true if finer settings would take more time without giving a smaller error.
  bool is_finest(const Run& run, double taken) {
    // [-] below this, an error that no longer decreases consists of rounding errors
    constexpr double kSmall = 1e-4;
    constexpr double kSmallEnough = 1e-5;  // [-] error that is small enough if a run takes very long
    if (run.integration_error < kFinest) return true;
    // a slow run with a small error is not refined
    if (taken > kVeryLong && run.integration_error < kSmallEnough) return true;
    if (run.tolerance > 0.0) return false;
    // the next setting takes at least 1.4 times as long
    if (1.4 * taken > bench_.options.budget) return true;
    if (run.family == Family::kLinearised && run.integration_error < 0.02 * run.model_error) return true;
    // in a short run two settings may divide the pieces of the motion into the same steps
    if (std::exchange(last_steps_[run.method], run.steps) == run.steps) return false;
    const double before = std::exchange(last_error_[run.method], run.integration_error);
    return before > 0.0 && before < kSmall && run.integration_error > 0.7 * before;
  }

  /// Measures the times of the read-outs. If the run took more than kLong, the first two read-outs get the
  /// time of the run itself. If it took more than kVeryLong, all three get this time.
  void time_read_outs(RivalMethod& method, const RivalOptions& options, double& deadline, double taken,
                      Run& run) {
    constexpr double kLong = 0.3;                                                // [s]
    const std::array<double, kReadOuts> every{bench_.options.end, 0.01, 0.001};  // [s]
    run.cpu.fill(taken / bench_.options.end);
    run.repeats = 1;
    if (taken > kVeryLong) return;
    for (std::size_t load = taken > kLong ? 2 : 0; load < kReadOuts; ++load) {
      const std::vector<double> times = reading_times(bench_.options.end, every[load]);
      const Timing timing = time_work(
          [&] {
            deadline = thread_cpu() + bench_.options.budget;
            method.run(times, options, [](std::size_t, const CartesianState&) {});
          },
          load == 0 ? bench_.options.repeats : 1);
      // if the user stopped the study, the run did not finish, so it has no time
      if (bench_.is_stopped())
        run.cpu[load].reset();
      else
        run.cpu[load] = timing.seconds / bench_.options.end;
      if (load == 0) run.repeats = timing.repeats;
    }
  }

  const Bench& bench_;
  const Eigen::Matrix3Xd* linear_;
  Study& study_;
  std::map<std::string, double> last_error_;  // [-] error of the previous run of each method
  std::map<std::string, long> last_steps_;    // number of steps of the previous run of each method
};

}  // namespace

void run_rivals(const Bench& bench, const Eigen::Matrix3Xd* linear, Study& study,
                const std::function<bool(double)>& report_progress) {
  Sweep sweep(bench, linear, study);
  for (std::size_t k = 0; k < kEntries.size(); ++k) {
    // springs and bars need no method for forces that depend on velocities
    if (is_midpoint(kEntries[k].rival) && !study.has_true_geometry) continue;
    const bool goes_on = sweep.run(kEntries[k], [&](double done) {
      return report_progress((static_cast<double>(k) + done) / kEntries.size());
    });
    if (!goes_on) return;
  }
}

}  // namespace freeflex::tools
