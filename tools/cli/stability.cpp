// freeflex stability runs stiff and extreme cases, each with the limit that it must meet.
#include "tools/verification/stability/stability.hpp"

#include <CLI/App.hpp>
#include <memory>
#include <string>

#include "tools/cli/commands.hpp"
#include "tools/cli/folder.hpp"
#include "tools/terminal/console.hpp"
#include "tools/terminal/json.hpp"
#include "tools/terminal/usage.hpp"

namespace freeflex::tools {
namespace {

struct StabilityArguments {
  std::string folder;
  bool only_rungs = false;
  bool quick = false;
  bool json = false;
};

constexpr const char* kStabilityFooter = R"(Example:
  freeflex stability --out report
JSON fields:
  machine      processor, cores, system, compiler, flags, version, commit, date
  complete     whether every case ran
  holds        whether every case meets its limit, or is refused or flagged if it must be
  cases        for each: group, case, quantity, verdict, measured, limit (in the quantity), message, cpu [s],
               peers (other methods: method, measured, failure)
Exit codes: 0 holds is true, 1 a case fails or a file was not written, 2 wrong arguments,
130 interrupted.)";

int stability(const StabilityArguments& options) {
  if (!prepare_folder(options.folder)) return kExitDiffers;
  StabilityOptions settings;
  settings.is_quick = options.quick;
  settings.has_peers = !options.only_rungs;
  settings.is_stopped = [] { return is_interrupted(); };
  StabilityReport report;
  {
    Progress progress("stability");
    report = check_stability(settings, [&progress](double done) { progress.update(done); });
  }
  if (options.json)
    print_json(to_json(report));
  else
    print_text(report);
  const bool is_written =
      options.folder.empty() ||
      write_folder(options.folder, {{"stability.csv", to_csv(report)},
                                    {"stability.json", json_text(to_json(report), 2) + "\n"},
                                    {"stability.html", to_html(report)}});
  if (report.is_interrupted) return kExitInterrupted;
  return is_written && report.holds() ? kExitOk : kExitDiffers;
}

}  // namespace

void add_stability(CLI::App& app, int& exit_code) {
  auto options = std::make_shared<StabilityArguments>();
  CLI::App* command = app.add_subcommand(kStability.name, kStability.meaning);
  command->add_option("--out", options->folder, "folder for stability.csv, stability.json and stability.html")
      ->check(file_name())
      ->type_name("DIR");
  command->add_flag("--rungs", options->only_rungs, "no other methods");
  command->add_flag("--quick", options->quick, "fewer ticks");
  command->add_flag("--json", options->json, "one JSON object on standard output");
  command->footer(kStabilityFooter);
  command->callback([options, &exit_code] { exit_code = stability(*options); });
}

}  // namespace freeflex::tools
