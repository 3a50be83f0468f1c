// freeflex report: error against run time of scenes, beside other methods.
#include "tools/report/report.hpp"

#include <unistd.h>

#include <CLI/App.hpp>
#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <limits>
#include <memory>
#include <string>
#include <vector>

#include "core/reference/cartesian.hpp"
#include "service/io/scene/input.hpp"
#include "tools/cli/commands.hpp"
#include "tools/stability/stability.hpp"
#include "tools/terminal/usage.hpp"

namespace freeflex::tools {
namespace {

struct Options {
  std::vector<std::string> scenes;
  std::string folder;
  StudyOptions study;
  std::vector<double> ends{study.end};  // [s] one for all, or one a scene
  std::uint64_t seed = 2;               // the factor of the estimate was set on seed 1
  int num_estimates = 0;
  bool only_rungs = false;
  bool stability = false;
  bool quick = false;
  bool json = false;
};

bool write_file(const std::filesystem::path& path, const std::string& text) {
  std::ofstream stream(path, std::ios::binary);
  stream.write(text.data(), static_cast<std::streamsize>(text.size()));
  stream.close();
  if (stream) return true;
  print_error(path.string() + ": cannot be written");
  return false;
}

struct NamedText {
  const char* name;
  std::string text;
};

/// Makes the folder. What a long run is to fill must take files before it starts.
bool prepare_folder(const std::filesystem::path& folder) {
  if (folder.empty()) return true;
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  if (!error && !std::filesystem::is_directory(folder))
    error = std::make_error_code(std::errc::not_a_directory);
  if (!error && access(folder.c_str(), W_OK) != 0) error = std::error_code(errno, std::generic_category());
  if (!error) return true;
  print_error("--out " + folder.string() + ": " + error.message() + "; name a folder that can be written");
  return false;
}

/// Writes the files that are named into a folder.
bool write_folder(const std::filesystem::path& folder, const std::vector<NamedText>& files) {
  return std::all_of(files.begin(), files.end(),
                     [&folder](const NamedText& file) { return write_file(folder / file.name, file.text); });
}

/// Every scene read before the first is measured; empty on an error, which is printed.
std::vector<Scene> read_scenes(const std::vector<std::string>& files) {
  std::vector<Scene> scenes;
  for (const std::string& file : files) {
    if (io::is_plan_file(file)) {
      print_error(file + " is a plan, which holds no links: name the scene that it was made from");
      return {};
    }
    io::SceneResult read = io::read_scene(file);
    print_faults(read.faults, read.sources);
    if (!read.scene || has_error(read.faults)) return {};
    std::string why_not;
    if (!make_cartesian_system(*read.scene, why_not)) {
      print_error(file + ": there is no full system to compare with: " + why_not);
      return {};
    }
    scenes.push_back(std::move(*read.scene));
  }
  return scenes;
}

int stability(const Options& options) {
  StabilityOptions settings;
  settings.is_quick = options.quick;
  settings.has_peers = !options.only_rungs;
  settings.is_stopped = [] { return is_interrupted(); };
  StabilityReport report;
  {
    Progress progress("stability");
    report = check_stability(settings, [&progress](double share) { progress.update(share); });
  }
  if (options.json)
    print_json(to_json(report));
  else
    print_text(report);
  const bool is_written = options.folder.empty() ||
                          write_folder(options.folder, {{"stability.csv", to_csv(report)},
                                                        {"stability.json", to_json(report).dump(2) + "\n"},
                                                        {"stability.html", to_html(report)}});
  if (report.is_interrupted) return kExitInterrupted;
  return is_written && report.holds() ? kExitOk : kExitDiffers;
}

/// Options that do not go together. Empty: none.
std::string find_conflict(const CLI::App& command, const Options& options) {
  const bool draws = options.num_estimates > 0;
  if (!options.stability) {
    if (options.scenes.empty() && !draws)
      return "SCENE is needed, or --stability or --estimates N, which have scenes of their own";
    if (options.ends.size() > 1 && options.ends.size() != options.scenes.size())
      return format_text("--until has %zu times for %zu scenes: give one for all, or one a scene",
                         options.ends.size(), options.scenes.size());
    return options.quick ? "--quick goes with --stability" : "";
  }
  if (!options.scenes.empty()) return "--stability takes no SCENE: its cases are built in";
  for (const char* option : {"--until", "--budget", "--estimates", "--seed", "--repeats"})
    if (command.count(option) > 0) return std::string(option) + " does not go with --stability";
  return {};
}

/// What a report of scenes may write.
constexpr std::array kFileNames{"report.json", "report.html", "report.csv", "work-precision.svg",
                                "estimates.csv"};

std::vector<NamedText> files_of(const Report& report) {
  std::vector<NamedText> files{{"report.json", to_json(report).dump(2) + "\n"},
                               {"report.html", to_html(report)}};
  if (!report.studies.empty()) {
    files.push_back({"report.csv", to_csv(report)});
    files.push_back({"work-precision.svg", work_precision_svg(report)});
  }
  if (!report.estimates.empty()) files.push_back({"estimates.csv", estimates_to_csv(report)});
  return files;
}

int report(const Options& options) {
  const std::vector<Scene> scenes = read_scenes(options.scenes);
  if (scenes.size() < options.scenes.size()) return kExitUsage;
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
  bool is_interrupted_now = is_interrupted(), failed = false;
  for (std::size_t k = 0; k < scenes.size() && !is_interrupted_now; ++k) {
    Progress progress(scenes[k].name);
    study.end = options.ends[options.ends.size() == 1 ? 0 : k];
    report.studies.push_back(study_scene(options.scenes[k], scenes[k], study, [&](double share) {
      if (share >= 0.0) progress.update(share);
      return !is_interrupted();
    }));
    is_interrupted_now = is_interrupted();
    if (is_interrupted_now && report.studies.back().runs.empty()) {
      report.studies.pop_back();
    } else if (!report.studies.back().error.empty()) {
      // the others are measured all the same
      print_error(options.scenes[k] + ": " + report.studies.back().error);
      report.studies.pop_back();
      failed = true;
    }
  }
  if (options.num_estimates > 0 && !is_interrupted_now) {
    Progress progress("estimates");
    report.seed = options.seed;
    report.estimates = study_estimates(options.seed, options.num_estimates, [&](double share) {
      progress.update(share);
      return !is_interrupted();
    });
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
  auto options = std::make_shared<Options>();
  CLI::App* command = app.add_subcommand(
      "report", "error against run time of every rung, beside other methods on the same scene");
  command->add_option("SCENE", options->scenes, "scene files of springs and bars");
  command
      ->add_option("--estimates", options->num_estimates,
                   "random scenes on which the error estimate is held against the full system")
      ->check(whole_number(1, 100000));
  command->add_option("--seed", options->seed, "of the random scenes")
      ->capture_default_str()
      ->check(whole_number(0, std::numeric_limits<std::int64_t>::max()));
  command
      ->add_option("--out", options->folder,
                   "folder for report.csv, report.json, report.html and work-precision.svg, with --estimates "
                   "estimates.csv; with --stability stability.csv, stability.json and stability.html")
      ->check(file_name());
  command->add_option("--until", options->ends, "simulated time [s], one for all or one a scene")
      ->default_str("2")
      ->delimiter(',')
      ->allow_extra_args(false)
      ->check(study_time());
  command->add_option("--budget", options->study.budget, "CPU time that one run may take [s]")
      ->capture_default_str()
      ->check(positive_time());
  command->add_option("--repeats", options->study.repeats, "timings of a run, of which the median is taken")
      ->capture_default_str()
      ->check(whole_number(1, 1000));
  command->add_flag("--rungs", options->only_rungs,
                    "no other methods, only the rungs against the full system");
  command->add_flag("--stability", options->stability,
                    "stiff and extreme cases in place of scenes, each beside the figure that it must meet");
  command->add_flag("--quick", options->quick, "with --stability: fewer ticks");
  command->add_flag("--json", options->json, "one JSON object on standard output");
  command->footer(
      "Example:\n  freeflex report service/scenes/truss-s1.yaml --out report\n"
      "  freeflex report service/scenes/truss-s1.yaml service/scenes/truss-s3.yaml --until 2,0.5\n"
      "  freeflex report --stability --out report\n  freeflex report --estimates 200 --out report\n"
      "Exit codes: 0 done, 1 not written, or a case of --stability fails, 2 wrong arguments or a scene "
      "without a full system, 130 "
      "interrupted.");
  command->callback([options, command, &exit_code] {
    const std::string conflict = find_conflict(*command, *options);
    if (!conflict.empty()) {
      print_error(conflict);
      exit_code = kExitUsage;
      return;
    }
    exit_code = !prepare_folder(options->folder) ? kExitDiffers
                : options->stability             ? stability(*options)
                                                 : report(*options);
  });
}

}  // namespace freeflex::tools
