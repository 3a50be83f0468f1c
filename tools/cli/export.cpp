// freeflex export writes a linear model of a scene.
#include <CLI/App.hpp>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "tools/cli/commands.hpp"
#include "tools/cli/linear_plan.hpp"
#include "tools/control/matrix_file.hpp"
#include "tools/terminal/console.hpp"
#include "tools/terminal/usage.hpp"

namespace freeflex::tools {
namespace {

struct ExportOptions {
  std::string scene;
  io::Settings settings;
  std::string file;
  control::Ports ports;
  std::optional<int> count;
  std::optional<double> share;
  std::string band;
};

constexpr const char* kExportFooter = R"(Example:
  freeflex export boom.yaml --state-space boom.npz --in point.tip.fz --out point.tip.z
  freeflex export satellite.yaml --state-space sat.mat --in wheel.spin_z.torque --out rz,wz,point.l41.d --modes 6
Inputs: point.NAME.fx fy fz [N], point.NAME.tx ty tz [N m] of a body, group.NAME.fx .. tz, wheel.NAME.torque [N m].
Outputs: x y z, rx ry rz, vx vy vz, wx wy wz of the body; q1 .., q_dot1 ..; wheel.NAME.momentum; point.NAME.x y z, vx
.., ax .., dx .. (elastic); point.NAME.rx .., wx .. of a body; link.NAME.axial, moment, 1 .. In place of three, write
point.NAME.f t and point.NAME.p v a d r w. All vectors are in body axes. The model is x' = A x + B u, y = C x + D u,
exact to first order for small motions of the undeformed body from rest, without the built-in loads. It has all modes
unless you choose some: first those in --band, of these those above --hankel, and of these the number --modes. Then
the largest possible gain of the others is printed.
Exit codes: 0 written, 1 not written, 2 the scene or an input or output is wrong.)";

/// Parses LOW..HIGH in Hz. Returns false if the text has another form.
bool parse_band(const std::string& text, control::Reduction& reduction) {
  const std::size_t dots = text.find("..");
  if (dots == std::string::npos) return false;
  const auto low = read_number(text.substr(0, dots)), high = read_number(text.substr(dots + 2));
  if (!low || !high || *low < 0.0 || !(*high > *low)) return false;
  reduction.low = *low;
  reduction.high = *high;
  return true;
}

int export_model(const ExportOptions& options) {
  control::Reduction reduction;
  reduction.share = options.share;
  reduction.count = options.count;
  if (!options.band.empty() && !parse_band(options.band, reduction))
    return print_error("--band: " + service::found(options.band, "LOW..HIGH [Hz] with 0 <= LOW < HIGH")),
           kExitUsage;
  const std::optional<LinearPlan> loaded = load_linear_plan(options.scene, options.settings, options.ports);
  if (!loaded) return kExitUsage;
  control::StateSpaceResult made = control::make_state_space(loaded->plan, options.ports);
  if (!made.model) return print_error(made.error), kExitUsage;
  const control::Reduced reduced = control::reduce(*made.model, reduction);
  if (const std::string error = control::write_model(reduced.model, options.file); !error.empty())
    return print_error(error), kExitDiffers;
  std::printf("%s: %s, %s, %s, %s\n", options.file.c_str(),
              counted(static_cast<std::int64_t>(reduced.model.states.size()), "state").c_str(),
              counted(static_cast<std::int64_t>(reduced.model.inputs.size()), "input").c_str(),
              counted(static_cast<std::int64_t>(reduced.model.outputs.size()), "output").c_str(),
              (counted(static_cast<std::int64_t>(reduced.model.modes.size()), "mode") + " of " +
               std::to_string(made.model->modes.size()))
                  .c_str());
  if (!loaded->has_all_modes)
    print_warning(
        "the scene keeps only its lowest modes (modes:, or many points); the effect of the others, also on "
        "slow motions and on accelerations, is not in the model, and no bound of it is known");
  if (reduced.model.modes.size() == made.model->modes.size()) return kExitOk;
  if (std::isnan(reduced.bound))
    std::printf(
        "left out: modes that dashpots, feedback or wheels couple, so their gain has no simple bound\n");
  else if (std::isfinite(reduced.bound))
    // rounded up
    std::printf("left out: a gain of at most %.3g, for each input and output in their units\n",
                reduced.bound * 1.005);
  else
    std::printf("left out: modes without damping, whose gain has no bound; give them damping to have one\n");
  return kExitOk;
}

}  // namespace

void add_export(CLI::App& app, int& exit_code) {
  auto options = std::make_shared<ExportOptions>();
  CLI::App* const command = app.add_subcommand("export", "writes a linear model for control design");
  command->add_option("SCENE", options->scene, "scene file")->required();
  add_settings(*command, options->settings);
  command->add_option("--state-space", options->file, std::string("what to write: ") + control::kModelFiles)
      ->required()
      ->check([](const std::string& path) {
        return control::is_model_file(path) ? std::string() : service::found(path, control::kModelFiles);
      })
      ->type_name("FILE");
  command->add_option("--in", options->ports.inputs, "inputs, separated by commas")
      ->required()
      ->delimiter(',');
  command->add_option("--out", options->ports.outputs, "outputs, separated by commas")
      ->required()
      ->delimiter(',');
  command
      ->add_option("--modes", options->count,
                   "keeps this number of modes, those with the largest Hankel values")
      ->check(whole_number(0, kMost<int>))
      ->type_name("N");
  command
      ->add_option("--hankel", options->share,
                   "keeps modes whose Hankel value is at least this share of the largest")
      ->check(must_be("a number from 0 to 1", [](double share) { return share >= 0.0 && share <= 1.0; }))
      ->type_name("SHARE");
  command->add_option("--band", options->band, "keeps modes with frequencies in LOW..HIGH [Hz]")
      ->type_name("BAND");
  command->footer(kExportFooter);
  command->callback([options, &exit_code] { exit_code = export_model(*options); });
}

}  // namespace freeflex::tools
