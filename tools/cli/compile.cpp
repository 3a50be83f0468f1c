// freeflex compile writes the result of the set-up to a plan file, which every program accepts instead of the
// scene.
#include "core/plan/compile.hpp"

#include <CLI/App.hpp>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <string>

#include "core/plan/file/plan_bytes.hpp"
#include "tools/cli/commands.hpp"
#include "tools/terminal/console.hpp"
#include "tools/terminal/json.hpp"
#include "tools/terminal/usage.hpp"

namespace freeflex::tools {
namespace {

struct CompileOptions {
  std::string scene;
  io::Settings settings;
  std::string plan;
  double rate = 0.0;  // [Hz] 0: the scene's rate
  bool json = false;
};

constexpr const char* kCompileFooter = R"(Example:
  freeflex compile service/scenes/rotor.yaml -o rotor.plan --rate 2000
  freeflex compile boom.yaml -o heavy.plan --set points.hub.mass=41
JSON fields:
  plan         the file;  bytes: its size;  fingerprint: 16 hexadecimal digits
  rate         [Hz];  elastic_freedoms: number of them
Exit codes: 0 written, 1 cannot be written, 2 the scene has errors.)";

int compile(const CompileOptions& options) {
  const std::optional<Plan> plan =
      load_or_explain(options.scene, options.rate, {options.plan}, options.settings);
  if (!plan) return kExitUsage;
  std::error_code ignored;
  if (std::filesystem::is_regular_file(options.plan, ignored) &&
      std::filesystem::file_size(options.plan, ignored) > 0 && !io::is_plan_file(options.plan))
    return print_error("'" + options.plan +
                       "' exists and is not a plan file; remove it, or name another file"),
           kExitUsage;
  // from now on an interrupt must remove the file
  if (is_interrupted()) return std::fputs(kInterrupted, stderr), kExitInterrupted;
  const std::string error = io::save_plan(*plan, options.plan, is_interrupted);
  if (!error.empty() && is_interrupted()) return std::fputs(kInterrupted, stderr), kExitInterrupted;
  if (!error.empty()) {
    print_error(error);
    return kExitDiffers;
  }
  const std::string fingerprint = fingerprint_text(plan_fingerprint(*plan));
  const std::uintmax_t bytes = std::filesystem::file_size(options.plan, ignored);
  if (options.json) {
    print_json({{"plan", options.plan},
                {"bytes", bytes},
                {"fingerprint", fingerprint},
                {"rate", 1.0 / plan->period},
                {"elastic_freedoms", plan->num_elastic}});
  } else {
    std::printf("%s: fingerprint %s, %d elastic freedoms, %.10g Hz, %ju bytes\n", options.plan.c_str(),
                fingerprint.c_str(), plan->num_elastic, 1.0 / plan->period, bytes);
  }
  return kExitOk;
}

}  // namespace

void add_compile(CLI::App& app, int& exit_code) {
  auto options = std::make_shared<CompileOptions>();
  CLI::App* command =
      app.add_subcommand("compile", "scene to plan file: set up once, the same bits everywhere");
  command->add_option("SCENE", options->scene, "scene file, or a plan to write at another rate")->required();
  command->add_option("-o,--output", options->plan, "plan file to write")
      ->required()
      ->check(file_name())
      ->type_name("PLAN");
  add_settings(*command, options->settings);
  command->add_option("--rate", options->rate, "ticks per simulated second [Hz], instead of the scene's rate")
      ->check(rate_in_hertz())
      ->type_name("HZ");
  command->add_flag("--json", options->json, "one JSON object on standard output");
  command->footer(kCompileFooter);
  command->callback([options, &exit_code] { exit_code = compile(*options); });
}

}  // namespace freeflex::tools
