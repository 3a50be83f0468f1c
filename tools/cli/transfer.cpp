#include "tools/cli/transfer.hpp"

#include <algorithm>
#include <cmath>
#include <complex>
#include <cstdio>
#include <numbers>
#include <optional>
#include <vector>

#include "tools/cli/commands.hpp"
#include "tools/cli/linear_plan.hpp"
#include "tools/control/held_modes.hpp"
#include "tools/plot/chart.hpp"
#include "tools/terminal/console.hpp"
#include "tools/terminal/json.hpp"
#include "tools/terminal/usage.hpp"

namespace freeflex::tools {
namespace {

using control::ModeGain;
using control::StateSpace;

Json finite(double value) { return std::isfinite(value) ? Json(value) : Json(); }

/// Returns frequencies [Hz] for a picture: evenly spread over the decades, and dense about the modes with the
/// largest peaks.
std::vector<double> frequencies_for(std::vector<ModeGain> gains) {
  double low = 1e300, high = 0.0;
  for (const ModeGain& gain : gains)
    if (gain.frequency > 0.0) low = std::min(low, gain.frequency), high = std::max(high, gain.frequency);
  if (!(high > 0.0)) low = high = 1.0;
  low *= 0.1;
  high *= 3.0;
  std::vector<double> all;
  constexpr int kEven = 300, kNear = 12;
  constexpr std::size_t kMostDense = 100;
  for (int k = 0; k <= kEven; ++k) all.push_back(low * std::pow(high / low, static_cast<double>(k) / kEven));
  std::stable_sort(gains.begin(), gains.end(),
                   [](const ModeGain& a, const ModeGain& b) { return a.peak > b.peak; });
  gains.resize(std::min(gains.size(), kMostDense));
  for (const ModeGain& gain : gains)
    for (int k = -kNear; k <= kNear; ++k) {
      // geometric steps away from the resonance, the nearest within its width
      const double width = std::max(gain.damping, 1e-4) * std::pow(2.0, std::abs(k) - 4);
      if (width < 0.3) all.push_back(gain.frequency * (1.0 + (k < 0 ? -width : width)));
    }
  std::erase_if(all, [&](double f) { return !(f >= low && f <= high); });
  std::sort(all.begin(), all.end());
  return all;
}

std::string draw_bode(const TransferOptions& options, const StateSpace& model,
                      const std::vector<ModeGain>& gains) {
  Panel gain{"gain [dB]", {}, {{options.pair, {}}}}, phase{"phase [deg]", {}, {{options.pair, {}}}};
  const control::Response response(model);
  double last = -170.0;  // the first phase is from -350 to 10 degrees
  for (const double frequency : frequencies_for(gains)) {
    const std::complex<double> g = response.at(2.0 * std::numbers::pi * frequency)(0, 0);
    if (g == 0.0) continue;
    const double at = std::log10(frequency);
    double angle = std::arg(g) * 180.0 / std::numbers::pi;
    angle += 360.0 * std::round((last - angle) / 360.0);  // without jumps of a whole turn
    last = angle;
    gain.x.push_back(at);
    gain.series[0].y.push_back(20.0 * std::log10(std::abs(g)));
    phase.x.push_back(at);
    phase.series[0].y.push_back(angle);
  }
  if (gain.x.empty()) return "the output does not depend on the input, so there is nothing to draw";
  return plot_panels(options.plot, "transfer function " + options.pair, "log10 of the frequency [Hz]",
                     {gain, phase});
}

void print_gains(const TransferOptions& options, const std::vector<ModeGain>& gains) {
  std::printf("%s\n  mode  frequency [Hz]    damping    gain             peak\n", options.pair.c_str());
  const std::size_t count =
      options.count > 0 ? std::min(gains.size(), static_cast<std::size_t>(options.count)) : gains.size();
  for (std::size_t k = 0; k < count; ++k)
    std::printf("  %4d  %-16.10g  %-9.4g  %-15.6g  %-15.6g\n", gains[k].mode, gains[k].frequency,
                gains[k].damping, gains[k].gain, gains[k].peak);
  if (count < gains.size()) std::printf("  ... %zu more (--count 0 shows all)\n", gains.size() - count);
  std::printf(
      "peak: largest output over input of the mode alone\n"
      "gain: that at resonance times 2 damping; for a displacement, that of the mode under a constant "
      "input\n");
}

}  // namespace

std::string check_pair(const std::string& value) {
  const std::size_t colon = value.find(':');
  const bool is_good = colon != std::string::npos && colon > 0 && colon + 1 < value.size();
  return is_good ? "" : service::found(value, "INPUT:OUTPUT, such as point.tip.fz:point.tip.z");
}

int print_transfer(const TransferOptions& options) {
  const std::size_t colon = options.pair.find(':');
  const control::Ports ports{{options.pair.substr(0, colon)}, {options.pair.substr(colon + 1)}};
  const std::optional<LinearPlan> loaded = load_linear_plan(options.scene, options.settings, ports);
  if (!loaded) return kExitUsage;
  const control::StateSpaceResult made = control::make_state_space(loaded->plan, ports);
  if (!made.model) return print_error(made.error), kExitUsage;
  const StateSpace& model = *made.model;
  if (model.inputs.size() != 1 || model.outputs.size() != 1)
    return print_error("--bode needs one input and one output, but " + options.pair + " stands for " +
                       std::to_string(model.inputs.size()) + " and " + std::to_string(model.outputs.size())),
           kExitUsage;
  const std::vector<ModeGain> gains = control::mode_gains(model);
  if (!options.plot.empty())
    if (const std::string error = draw_bode(options, model, gains); !error.empty())
      return print_error(error), kExitDiffers;
  if (!options.json) return print_gains(options, gains), kExitOk;
  Json modes = Json::array();
  for (std::size_t k = 0; k < gains.size(); ++k)
    modes.push_back({{"mode", gains[k].mode},
                     {"frequency", gains[k].frequency},
                     {"damping_ratio", gains[k].damping},
                     {"gain", finite(gains[k].gain)},
                     {"peak", finite(gains[k].peak)},
                     {"hankel", finite(gains[k].hankel)}});
  print_json({{"name", loaded->plan.name},
              {"input", model.inputs[0]},
              {"output", model.outputs[0]},
              {"modes", modes}});
  return kExitOk;
}

int print_held(const TransferOptions& options) {
  const std::optional<LinearPlan> loaded =
      load_linear_plan(options.scene, options.settings, {}, options.held);
  if (!loaded) return kExitUsage;
  const control::HeldModes held = control::hold(loaded->plan, options.held);
  if (!held.error.empty()) return print_error("--hold: " + held.error), kExitUsage;
  if (options.json) {
    const auto six = [](const control::SixNumbers& v) { return Json{v[0], v[1], v[2], v[3], v[4], v[5]}; };
    Json modes = Json::array();
    for (const control::HeldMode& mode : held.modes)
      modes.push_back({{"frequency", mode.frequency},
                       {"participation", six(mode.participation)},
                       {"effective_mass", six(mode.effective_mass)}});
    print_json({{"name", loaded->plan.name},
                {"held", options.held},
                {"all_modes", loaded->has_all_modes},
                {"holds_rotation", held.holds_rotation},
                {"about", Json{held.about[0], held.about[1], held.about[2]}},
                {"moving", six(held.moving)},
                {"modes", modes}});
    return kExitOk;
  }
  std::printf("%s, %s held; moments about %.6g %.6g %.6g m (scene axes)\n", loaded->plan.name.c_str(),
              options.held.c_str(), held.about[0], held.about[1], held.about[2]);
  std::printf("        frequency [Hz]    effective mass along x, y, z [kg] and about x, y, z [kg m^2]\n");
  const auto print_six = [](const control::SixNumbers& v) {
    for (int k = 0; k < 6; ++k) std::printf("  %-11.5g", v[k] < 1e-12 * v.maxCoeff() ? 0.0 : v[k]);
    std::printf("\n");
  };
  const std::size_t count = options.count > 0
                                ? std::min(held.modes.size(), static_cast<std::size_t>(options.count))
                                : held.modes.size();
  control::SixNumbers sum = control::SixNumbers::Zero();
  for (std::size_t k = 0; k < count; ++k) {
    std::printf("  %4zu  %-16.10g", k + 1, held.modes[k].frequency);
    print_six(held.modes[k].effective_mass);
    sum += held.modes[k].effective_mass;
  }
  std::printf("  sum of these          ");
  print_six(sum);
  std::printf("  sum of all modes      ");
  print_six(held.moving);
  if (!loaded->has_all_modes)
    print_warning("the scene keeps only its lowest modes, so frequencies are too high and masses too small");
  if (!held.holds_rotation)
    print_warning("'" + options.held +
                  "' has no inertia, so it is held in place but can turn; hold a body, or a group of points "
                  "that are not on a line");
  return kExitOk;
}

}  // namespace freeflex::tools
