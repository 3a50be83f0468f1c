// freeflex report measures error against run time on scenes, with other methods for comparison.
#include "tools/verification/report/report.hpp"

#include <CLI/App.hpp>
#include <algorithm>
#include <array>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "service/io/scene/input.hpp"
#include "tools/cli/commands.hpp"
#include "tools/cli/folder.hpp"
#include "tools/terminal/json.hpp"
#include "tools/terminal/usage.hpp"
#include "tools/verification/reference/cartesian.hpp"

namespace freeflex::tools {
namespace {

struct ReportOptions {
  std::vector<std::string> scenes;
  std::string folder;
  StudyOptions study;
  std::vector<double> ends{study.end};  // [s] one end for all scenes, or one per scene
  std::uint64_t seed = 2;
  int num_estimates = 0, num_ticks = 0;
  std::vector<std::string> omissions;  // scenes
  bool only_rungs = false;
  bool json = false;
};

constexpr const char* kReportFooter = R"(Example:
  freeflex report service/scenes/truss-s1.yaml --out report
  freeflex report service/scenes/truss-s1.yaml service/scenes/truss-s3.yaml --until 2,0.5
  freeflex report --estimates 200 --out report
  freeflex report --ticks 1000 --out report
  freeflex report --omissions service/scenes/truss-s1.yaml,service/scenes/satellite.yaml
JSON fields:
  machine      processor, cores, system, compiler, flags, version, commit, date
  scenes       for each: scene, file, points, links, elastic_freedoms, lowest_frequency and top_frequency
               [rad/s], spin [rad/s], end [s], reference (method, accuracy of its elastic error, cpu [s]),
               evaluation_cpu [s] of the forces at true geometry (null: springs and bars), complete, runs,
               left_out (what, why), comparisons
  runs         for each: family, method, step and free_step [s], tolerance, repeats, and failure, or else
               elastic_error, integration_error, model_error (relative to the elastic displacements),
               position_error [m rms], attitude_error [rad], frequency_error, energy_drift, CPU time
               cpu_once, cpu_10ms, cpu_1ms [s] per simulated second by read-out, steps, evaluations of the
               forces (null: a rung), ns_per_step, set_up [s], memory [bytes]; null: not applicable
  comparisons  for each: level, read_out, rung (null: none reaches the level), step and free_step [s],
               elastic_error, model_error, error_asked_of_others, cpu [s/s], and best_other, hand_written,
               packaged, linearised (null, or method, cpu, ratio to ours)
  complete     whether everything requested is included;  findings: conclusions, as sentences
  estimates    with --estimates: seed; summary (fractions: within_factor_1_3, within_factor_1_3_lower_bound,
               within_factor_3, each of attitude and elastic; good, watch, outside, auto_meets,
               auto_cheapest; counts: scenes, failed); histogram_elastic, histogram_attitude; scenes (for
               each: scene, shape, stiffness [N/m], spin [rad/s], force [N], truth and estimate (attitude
               [rad], elastic), validity, cause, lost, tolerance, chosen, cheapest, chosen_error, error)
  ticks        with --ticks: seed; bins (for each: from, to [rad per tick], bodies, good, watch, outside,
               worst_attitude_error [rad], worst_energy_error, ns_per_tick); bodies (for each: body, rate
               [Hz], rotation [rad per tick], wheel, inertia_ratio, substeps, ticks, validity, attitude_error
               [rad], energy_error, ns_per_tick, error)
  omissions    with --omissions: for each scene and feature: scene, omission, default (whether the scene as it
               is written omits it), count, CPU time of a tick ns_with and ns_without the feature, ratio,
               bytes_with, bytes_without (size of the plan), why (why the feature is kept)
Exit codes: 0 done, 1 not written, 2 wrong arguments or a scene without a full system, 130 interrupted.)";

/// Reads all scenes, so that errors are found before the first measurement. On an error, prints it and
/// returns an empty list.
/// \param is_compared  true: a scene must have a full system
std::vector<Scene> read_scenes(const std::vector<std::string>& files, bool is_compared = true) {
  std::vector<Scene> scenes;
  for (const std::string& file : files) {
    if (io::is_plan_file(file)) {
      print_error(file + " is a plan, which contains no links; name the scene that it was made from");
      return {};
    }
    io::SceneResult read = io::read_scene(file);
    print_faults(read.faults, read.sources);
    if (!read.scene || has_error(read.faults)) return {};
    if (const auto fault = is_compared ? find_no_full_system(*read.scene) : std::nullopt) {
      print_faults({*fault}, read.sources);
      print_error(file + ": there is no full system to compare with");
      return {};
    }
    scenes.push_back(std::move(*read.scene));
  }
  return scenes;
}

/// Returns the error in the combination of arguments, or an empty text if there is none.
std::string find_fault(const ReportOptions& options) {
  if (options.scenes.empty() && options.num_estimates == 0 && options.num_ticks == 0 &&
      options.omissions.empty())
    return "SCENE is needed, unless --estimates N or --ticks N is given, which use random scenes, or "
           "--omissions, which names its scenes";
  if (options.ends.size() > 1 && options.ends.size() != options.scenes.size())
    return format_text(
        "--until has %zu times for %zu scenes; give one time for all scenes, or one for each scene",
        options.ends.size(), options.scenes.size());
  return {};
}

/// Names of the files that a report may write.
constexpr std::array kFileNames{"report.json",        "report.html",   "report.csv",
                                "work-precision.svg", "estimates.csv", "ticks.csv"};

std::vector<NamedText> files_of(const Report& report) {
  std::vector<NamedText> files{{"report.json", json_text(to_json(report), 2) + "\n"},
                               {"report.html", to_html(report)}};
  if (!report.studies.empty()) {
    files.push_back({"report.csv", to_csv(report)});
    files.push_back({"work-precision.svg", work_precision_svg(report)});
  }
  if (!report.estimates.empty()) files.push_back({"estimates.csv", estimates_to_csv(report)});
  if (!report.ticks.empty()) files.push_back({"ticks.csv", ticks_to_csv(report)});
  return files;
}

/// Measures the omissions of scenes until an interrupt.
void measure_omissions(const std::vector<Scene>& scenes, Report& report) {
  for (const Scene& scene : scenes) {
    if (is_interrupted()) return;
    Progress progress("omissions of " + scene.name);
    const std::vector<OmissionRow> rows = study_omissions(scene, [&](double done) {
      progress.update(done);
      return !is_interrupted();
    });
    report.omissions.insert(report.omissions.end(), rows.begin(), rows.end());
  }
}

int report(const ReportOptions& options) {
  const std::vector<Scene> scenes = read_scenes(options.scenes);
  const std::vector<Scene> measured = read_scenes(options.omissions, false);
  if (scenes.size() < options.scenes.size() || measured.size() < options.omissions.size()) return kExitUsage;
  for (const Scene& scene : scenes)
    for (const std::string& source : scene.sources)
      for (const char* name : kFileNames)
        if (!options.folder.empty() &&
            would_overwrite(source, (std::filesystem::path(options.folder) / name).string()))
          return kExitUsage;
  Report report;
  report.machine = this_machine();
  StudyOptions study = options.study;
  study.has_rivals = !options.only_rungs;
  // an interrupt ends the program until the first call of is_interrupted(), which is after the first set-up
  bool is_interrupted_now = false, failed = false;
  for (std::size_t k = 0; k < scenes.size() && !is_interrupted_now; ++k) {
    study.end = options.ends[options.ends.size() == 1 ? 0 : k];
    {
      Progress progress(scenes[k].name);
      report.studies.push_back(study_scene(options.scenes[k], scenes[k], study, [&](double done) {
        if (done >= 0.0) progress.update(done);
        return !is_interrupted();
      }));
    }
    is_interrupted_now = is_interrupted();
    if (is_interrupted_now && report.studies.back().runs.empty()) {
      report.studies.pop_back();
    } else if (!report.studies.back().error.empty()) {
      // after a failure, the other scenes are still measured
      print_error(options.scenes[k] + ": " + report.studies.back().error);
      report.studies.pop_back();
      failed = true;
    }
  }
  if (options.num_estimates > 0 && !is_interrupted_now) {
    Progress progress("estimates");
    report.seed = options.seed;
    report.estimates = study_estimates(options.seed, options.num_estimates, [&](double done) {
      progress.update(done);
      return !is_interrupted();
    });
    is_interrupted_now = is_interrupted();
  }
  if (options.num_ticks > 0 && !is_interrupted_now) {
    Progress progress("ticks");
    report.ticks_seed = options.seed;
    report.ticks = study_ticks(options.seed, options.num_ticks, [&](double done) {
      progress.update(done);
      return !is_interrupted();
    });
    is_interrupted_now = is_interrupted();
  }
  if (!is_interrupted_now) {
    measure_omissions(measured, report);
    is_interrupted_now = is_interrupted();
  }
  report.is_interrupted = is_interrupted_now;
  if (options.json)
    print_json(to_json(report));
  else
    print_text(report);
  if (!options.folder.empty() && !write_folder(options.folder, files_of(report))) return kExitDiffers;
  if (is_interrupted_now) return kExitInterrupted;
  return failed ? kExitUsage : kExitOk;
}

}  // namespace

void add_report(CLI::App& app, int& exit_code) {
  auto options = std::make_shared<ReportOptions>();
  CLI::App* command = app.add_subcommand(kReport.name, kReport.meaning);
  command->add_option("SCENE", options->scenes, "scene files with links of any kind");
  command
      ->add_option("--estimates", options->num_estimates,
                   "random scenes on which the error estimate is compared with the full system")
      ->check(whole_number(1, 100000))
      ->type_name("N");
  command
      ->add_option(
          "--ticks", options->num_ticks,
          "random bodies with wheels on which the verdict is compared with SUNDIALS, by rotation per tick")
      ->check(whole_number(1, 100000))
      ->type_name("N");
  command
      ->add_option(
          "--omissions", options->omissions,
          "scenes on which the cost of a tick is measured with and without each feature that a plan may "
          "omit")
      ->delimiter(',')
      ->type_name("SCENE[,SCENE...]");
  command->add_option("--seed", options->seed, "seed of the random scenes and bodies")
      ->capture_default_str()
      ->check(whole_number(0, kMost<std::int64_t>))
      ->type_name("S");
  command
      ->add_option("--out", options->folder,
                   "folder for report.csv, report.json, report.html and work-precision.svg, with --estimates "
                   "estimates.csv, with --ticks ticks.csv")
      ->check(file_name())
      ->type_name("DIR");
  command
      ->add_option("--until", options->ends, "simulated time [s]: one for all scenes, or one for each scene")
      ->default_str("2")
      ->delimiter(',')
      ->allow_extra_args(false)
      ->check(study_time())
      ->type_name("S[,S...]");
  command->add_option("--budget", options->study.budget, "largest CPU time of one run [s]")
      ->capture_default_str()
      ->check(positive_time())
      ->type_name("S");
  command->add_option("--repeats", options->study.repeats, "timings of a run; the median is reported")
      ->capture_default_str()
      ->check(whole_number(1, 1000))
      ->type_name("N");
  command->add_flag("--rungs", options->only_rungs,
                    "compare only the rungs with the full system, without other methods");
  // this option existed up to version 0.3. Now it only refers to the new command, so --help does not show it.
  command
      ->add_flag_callback(
          "--stability",
          [] { throw CLI::ValidationError("--stability", "use freeflex stability, a command of its own"); })
      ->group("");
  command->add_flag("--json", options->json, "one JSON object on standard output");
  command->footer(kReportFooter);
  command->callback([options, &exit_code] {
    if (const std::string fault = find_fault(*options); !fault.empty()) {
      print_error(fault);
      exit_code = kExitUsage;
      return;
    }
    exit_code = prepare_folder(options->folder) ? report(*options) : kExitDiffers;
  });
}

}  // namespace freeflex::tools
