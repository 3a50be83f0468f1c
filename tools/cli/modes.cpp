// freeflex modes prints mass properties, freedoms and frequencies of a scene or plan.
#include <CLI/App.hpp>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <memory>
#include <numbers>
#include <string>

#include "core/plan/modes/damped_modes.hpp"
#include "core/plan/modes/free_forces.hpp"
#include "core/structure/modes/dense/decompositions.hpp"
#include "tools/cli/commands.hpp"
#include "tools/cli/linear_plan.hpp"
#include "tools/cli/steady_modes.hpp"
#include "tools/cli/transfer.hpp"
#include "tools/plot/chart.hpp"
#include "tools/terminal/console.hpp"
#include "tools/terminal/json.hpp"
#include "tools/terminal/usage.hpp"
#include "tools/view/body.hpp"

namespace freeflex::tools {
namespace {

struct ModesOptions {
  std::string input;
  io::Settings settings;
  std::string plot;  // picture file, empty for no picture
  int count = 30;
  bool json = false;
  bool has_loads = false;
  double at = 0.0;  // [s]
  std::string spin;
  std::string pair, held;  // of --bode and --hold
};

constexpr const char* kModesFooter = R"(Example:
  freeflex modes service/scenes/rotor.yaml --count 8
  freeflex modes boom.yaml --set points.tip.mass=3
  freeflex modes boom.yaml --spin 0..2 --plot campbell.svg
  freeflex modes boom.yaml --bode point.tip.fz:point.tip.z --plot bode.svg
  freeflex modes boom.yaml --hold hub
JSON fields:
  name, points, links, rigid_freedoms, elastic_freedoms
               the last four are counts
  mass         [kg];  centre [m], scene axes
  principal_moments, principal_axes
               [kg m^2] ascending; unit vectors in body axes, one per row
  frequency_accuracy
               [-] relative, of the lowest frequency
  modes        for each: mode (number from 1), frequency [Hz] of the structure alone, damped_frequency [Hz],
               damping_ratio and decay_rate [1/s] of its free motion with damping, feedback, constant
               followers and wheels (null where not computed, negative where the motion grows), cluster
               (the same number for equal frequencies)
  nutation     [Hz] of the body where wheels couple it with the modes;  null: none
  not_computed why the damped motion of some modes was not computed;  empty: none is missing
  mechanisms   for each: names of the points that it moves
  coupling     what couples the modes, as a text;  dependent_loads: names of loads that depend on the elastic
               motion
  step_error   largest splitting error of a tick, relative to the damping in that tick;  null: no splitting
JSON fields with --spin or --loads: name, rung (corotational, or coupled for a large scene), and
  steady       for each spin: spin [rad/s], body axes; displacement [m], the largest of a point;
               acceleration [rad/s^2] of the rotation by a small moment of the loads; accuracy [-] of the motions;
               motions, for each: frequency [Hz], damping_ratio, decay_rate [1/s], mode and share
               (number of the mode with most of its energy, null for the rotation of the body, and its share)
JSON fields with --bode: name, input, output, and modes, for each: mode, frequency, damping_ratio, gain, peak, hankel
(gain: hankel times 4 damping_ratio; peak and hankel are null without damping). With --hold: name, held, about [m],
all_modes (false: only the lowest are kept), holds_rotation (false: it can turn), moving (sums of the effective
masses), and modes, for each: frequency [Hz], participation ([-] along, [m] about x y z; of a shape whose generalized
mass is that of the body) and effective_mass ([kg], [kg m^2])
Exit codes: 0 done, 1 the picture was not written or there is no steady motion, 2 the scene or plan has errors.)";

struct Frequency {
  double hertz = 0.0;  // [Hz] frequency of the structure alone
  DampedMode damped;   // the same mode with everything that couples the modes
  int cluster = 0;     // frequencies that are equal within the accuracy have the same number
};

/// Returns the relative difference up to which two frequencies are in one cluster, because symmetry makes
/// them equal and they differ only by rounding errors.
double cluster_width(const Plan& plan) { return std::max(1e-9, 10.0 * plan.frequency_accuracy); }

std::vector<Frequency> frequencies(const Plan& plan, const FreeMotion& motion) {
  std::vector<Frequency> out;
  const double width = cluster_width(plan);
  for (int mode = 0; mode < plan.num_elastic; ++mode) {
    const double omega = plan.omega[index(mode)];
    Frequency frequency;
    frequency.hertz = omega / (2.0 * std::numbers::pi);
    frequency.damped = motion.modes[index(mode)];
    frequency.cluster = 1;
    if (!out.empty()) {
      const bool is_same = std::abs(frequency.hertz - out.back().hertz) <= width * frequency.hertz;
      frequency.cluster = out.back().cluster + (is_same ? 0 : 1);
    }
    out.push_back(frequency);
  }
  return out;
}

/// Principal moments, ascending, and right-handed principal axes as columns. The largest component of each of
/// the first two axes is positive.
struct Principal {
  Eigen::Vector3d moments;  // [kg m^2]
  Eigen::Matrix3d axes;     // [-] body axes
};

Principal principal_axes(const Plan& plan) {
  const Eigen::Matrix3d inertia =
      Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(plan.inertia.data());
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(inertia);
  Principal principal{solver.eigenvalues(), solver.eigenvectors()};
  for (int k = 0; k < 2; ++k) {
    Eigen::Index largest = 0;
    principal.axes.col(k).cwiseAbs().maxCoeff(&largest);
    if (principal.axes(largest, k) < 0.0) principal.axes.col(k) *= -1.0;
  }
  principal.axes.col(2) = principal.axes.col(0).cross(principal.axes.col(1));
  // replaces -0 and rounding errors by 0, so that the screen shows no signed zeros
  principal.axes =
      principal.axes.unaryExpr([](double value) { return std::abs(value) < 1e-15 ? 0.0 : value; });
  return principal;
}

std::vector<std::vector<std::string>> mechanism_names(const Plan& plan) {
  std::vector<std::vector<std::string>> out;
  for (const auto& mechanism : plan.mechanisms) {
    std::vector<std::string>& names = out.emplace_back();
    for (const std::int32_t point : mechanism) names.push_back(plan.points[index(point)].name);
  }
  return out;
}

/// Returns the number of a mode in the scene, from 1. The numbering includes omitted modes.
int number_of(const Plan& plan, std::size_t mode) {
  return plan.mode_numbers.empty() ? static_cast<int>(mode) + 1 : plan.mode_numbers[mode];
}

/// Returns a text that says how dashpots and feedback couple the modes, or an empty text if they do not.
std::string damping_coupling_text(const Plan& plan) {
  const PlanModalCoupling& modal_coupling = plan.modal_coupling;
  if (modal_coupling.num_damping == 0 && plan.feedbacks.empty()) return {};
  const std::string what = plan.feedbacks.empty()            ? "dashpots"
                           : modal_coupling.num_damping == 0 ? "feedback"
                                                             : "dashpots and feedback";
  const std::string coupled = what + " couple" + (what == "feedback" ? "s " : " ");
  if (modal_coupling.path == PlanModalCoupling::Path::kExact)
    return coupled + counted(static_cast<std::int64_t>(modal_coupling.modes.size()), "mode") + " of " +
           std::to_string(plan.num_elastic) + "; the step advances them together, without error";
  if (modal_coupling.path == PlanModalCoupling::Path::kSplit)
    return coupled +
           "too many modes for the exact step, so their damping is advanced by splitting, with an error of "
           "second order in the step";
  return coupled + "the modes; the step applies the coupling as forces";
}

/// Returns the names of the loads, after the word "load" or "loads".
std::string load_names(const Plan& plan, const std::vector<std::size_t>& loads) {
  std::vector<std::string> names;
  names.reserve(loads.size());
  for (const std::size_t load : loads) names.push_back(plan.histories[load].name);
  return (names.size() == 1 ? "load " : "loads ") + listed(names, 8);
}

/// Returns a text that lists everything that couples the modes, or an empty text if nothing does.
std::string coupling_text(const Plan& plan) {
  if (plan.num_elastic == 0) return {};
  std::vector<std::string> texts;
  if (std::string text = damping_coupling_text(plan); !text.empty()) texts.push_back(std::move(text));
  if (const auto loads = follower_loads(plan, true); !loads.empty())
    texts.push_back(load_names(plan, loads) + (loads.size() == 1 ? " rotates" : " rotate") +
                    " with the structure and " + (loads.size() == 1 ? "couples" : "couple") + " the modes");
  if (const auto loads = follower_loads(plan, false); !loads.empty())
    texts.push_back(load_names(plan, loads) + (loads.size() == 1 ? " rotates" : " rotate") +
                    " with the structure and " + (loads.size() == 1 ? "varies" : "vary") +
                    "; these modes do not include this variation");
  if (has_gyroscopic_forces(plan))
    texts.push_back("wheels couple the modes with each other and with the body");
  std::string all;
  for (const std::string& text : texts) all += (all.empty() ? "" : "; ") + text;
  return all;
}

/// [-] Largest splitting error of a tick, relative to the damping in the tick, that causes no warning.
constexpr double kMostStepError = 0.01;

/// The largest splitting error of a tick, and its mode.
struct StepError {
  double size = 0.0;     // [-]
  std::size_t mode = 0;  // index
};
StepError largest_step_error(const std::vector<Frequency>& all) {
  StepError largest;
  for (std::size_t mode = 0; mode < all.size(); ++mode)
    if (all[mode].damped.step_error > largest.size) largest = {all[mode].damped.step_error, mode};
  return largest;
}

std::string step_error_text(const Plan& plan, const StepError& error) {
  return format_text("in a tick at %.10g Hz the splitting error of mode %d is %.2g %% of its damping",
                     1.0 / plan.period, number_of(plan, error.mode), 100.0 * error.size);
}

/// Returns the names of loads that depend on the elastic motion and therefore couple rigid and elastic
/// motion.
std::vector<std::string> dependent_loads(const Plan& plan) {
  std::vector<std::string> names;
  for (const PlanFeedback& feedback : plan.feedbacks) names.push_back("feedback " + feedback.name);
  for (const PlanHistory& history : plan.histories)
    if (!history.followers.empty() || !history.torques.empty()) names.push_back("load " + history.name);
  return names;
}

void print_modes_json(const Plan& plan, const Principal& principal, const FreeMotion& motion,
                      const std::vector<Frequency>& all) {
  Json out;
  out["name"] = plan.name;
  out["points"] = plan.points.size();
  out["links"] = plan.links.size();
  out["mass"] = plan.mass;
  out["centre"] = plan.p_SB;
  out["principal_moments"] = {principal.moments(0), principal.moments(1), principal.moments(2)};
  Json axes = Json::array();
  for (int k = 0; k < 3; ++k) {
    const Eigen::Vector3d axis = principal.axes.col(k);
    axes.push_back({axis(0), axis(1), axis(2)});
  }
  out["principal_axes"] = axes;
  out["rigid_freedoms"] = plan.rigid_freedoms;
  out["elastic_freedoms"] = plan.num_elastic;
  out["frequency_accuracy"] = plan.frequency_accuracy;
  Json modes = Json::array();
  std::size_t mode = 0;
  for (const Frequency& frequency : all) {
    const DampedMode& damped = frequency.damped;
    const auto known = [&](double value) { return damped.is_known ? Json(value) : Json(); };
    modes.push_back({{"mode", number_of(plan, mode++)},
                     {"frequency", frequency.hertz},
                     {"damped_frequency", known(damped.frequency / (2.0 * std::numbers::pi))},
                     {"damping_ratio", known(damped.ratio)},
                     {"decay_rate", known(damped.rate)},
                     {"cluster", frequency.cluster}});
  }
  out["modes"] = modes;
  const bool is_split = plan.modal_coupling.path == PlanModalCoupling::Path::kSplit;
  out["step_error"] = is_split ? Json(largest_step_error(all).size) : Json();
  out["nutation"] = motion.nutation > 0.0 ? Json(motion.nutation / (2.0 * std::numbers::pi)) : Json();
  out["not_computed"] = motion.unknown;
  out["mechanisms"] = mechanism_names(plan);
  out["coupling"] = coupling_text(plan);
  out["dependent_loads"] = dependent_loads(plan);
  print_json(out);
}

std::string damped_text(const DampedMode& mode) {
  if (!mode.is_known) return "not computed";
  if (mode.frequency == 0.0 && mode.rate != 0.0) return mode.rate < 0.0 ? "grows" : "no oscillation";
  return format_text("%.10g", mode.frequency / (2.0 * std::numbers::pi));
}

void print_row(const Plan& plan, std::size_t mode, const Frequency& frequency) {
  const DampedMode& damped = frequency.damped;
  std::printf("  %4d  %-16.10g  %-16s  %-9s", number_of(plan, mode), frequency.hertz,
              damped_text(damped).c_str(), damped.is_known ? format_text("%.4g", damped.ratio).c_str() : "-");
}

/// Returns true if a mechanism gets a row in the table. A mechanism that only keeps its displacement appears
/// only in the list of mechanisms.
bool has_row(const Frequency& mechanism) {
  const DampedMode& damped = mechanism.damped;
  return !damped.is_known || damped.frequency != 0.0 || damped.rate != 0.0;
}

void print_frequencies(const Plan& plan, const std::vector<Frequency>& all, int limit) {
  const auto num_mechanisms = plan.mechanisms.size();
  std::printf("  mode  frequency [Hz]    damped [Hz]       damping\n");
  for (std::size_t mode = 0; mode < num_mechanisms; ++mode) {
    if (!has_row(all[mode])) continue;
    print_row(plan, mode, all[mode]);
    std::printf("  a mechanism\n");
  }
  std::size_t shown = 0;
  for (std::size_t first = num_mechanisms; first < all.size();) {
    std::size_t last = first;
    while (last + 1 < all.size() && all[last + 1].cluster == all[first].cluster) ++last;
    if (limit > 0 && shown >= index(limit)) break;
    for (std::size_t i = first; i <= last; ++i, ++shown) {
      print_row(plan, i, all[i]);
      if (last > first) std::printf("  one of %zu equal", last - first + 1);
      std::printf("\n");
    }
    first = last + 1;
  }
  if (num_mechanisms + shown < all.size()) {
    std::printf("  ... %zu more up to %.10g Hz (--count 0 shows all)\n", all.size() - num_mechanisms - shown,
                all.back().hertz);
  }
}

/// Draws the lowest modes. Returns the exit code, and prints the error if the code is not kExitOk.
int plot_modes(const ModesOptions& options) {
  constexpr int kMostPlotted = 12;
  const std::optional<Body> body = make_body(options.input, options.plot, options.settings);
  if (!body) return kExitUsage;
  const Plan& plan = body->plan;
  std::vector<std::array<float, 3>> rest;
  for (const PlanPoint& point : plan.points)
    rest.push_back(
        {static_cast<float>(point.r[0]), static_cast<float>(point.r[1]), static_cast<float>(point.r[2])});
  std::vector<std::array<std::size_t, 2>> lines;
  for (std::size_t k = 0; k < body->line_links.size(); ++k)
    lines.push_back({body->lines[2 * k], body->lines[2 * k + 1]});
  for (std::size_t k = 0; k < body->triangle_links.size(); ++k)
    for (std::size_t side = 0; side < 3; ++side)
      lines.push_back({body->triangles[3 * k + side], body->triangles[3 * k + (side + 1) % 3]});
  std::vector<Shape> shapes;
  for (int l = 0; l < std::min(kMostPlotted, body->num_modes); ++l) {
    const auto mode = index(l);
    Shape shape{
        "mode " + std::to_string(number_of(plan, mode)) + ", " +
            (plan.omega[mode] == 0.0 ? std::string("mechanism")
                                     : format_text("%.5g Hz", plan.omega[mode] / (2.0 * std::numbers::pi))) +
            (couples_modes(plan) ? ", undamped" : ""),
        {}};
    float largest = 1e-30F;
    for (std::size_t i = 0; i < rest.size(); ++i) {
      const float* b = body->shapes.data() + 3 * (rest.size() * mode + i);
      shape.displacement.push_back({b[0], b[1], b[2]});
      largest = std::max(largest, std::hypot(b[0], b[1], b[2]));
    }
    for (auto& point : shape.displacement)
      for (float& x : point) x /= largest;
    shapes.push_back(std::move(shape));
  }
  const std::string error = plot_shapes(options.plot, plan.name, rest, lines, shapes);
  if (!error.empty()) return print_error(error), kExitDiffers;
  return kExitOk;
}

int modes(const ModesOptions& options) {
  const TransferOptions transfer{options.input, options.settings, options.pair, options.held,
                                 options.plot,  options.count,    options.json};
  if (!options.pair.empty()) return print_transfer(transfer);
  if (!options.held.empty()) return print_held(transfer);
  if (!options.spin.empty() || options.has_loads)
    return steady_modes({options.input, options.settings, options.spin,
                         options.has_loads ? std::optional(options.at) : std::nullopt, options.plot,
                         options.count, options.json});
  if (!options.plot.empty())
    if (const int code = plot_modes(options); code != kExitOk) return code;
  const std::optional<Plan> plan = load_or_explain(options.input, 0.0, {}, options.settings);
  if (!plan) return kExitUsage;
  const Principal principal = principal_axes(*plan);
  const FreeMotion motion = free_motion(*plan);
  const std::vector<Frequency> all = frequencies(*plan, motion);
  const StepError error = largest_step_error(all);
  if (error.size > kMostStepError)
    print_warning(step_error_text(*plan, error) + ", more than " + format_text("%g", 100.0 * kMostStepError) +
                  " %; raise the rate");
  if (options.json) {
    print_modes_json(*plan, principal, motion, all);
    return kExitOk;
  }
  const Eigen::Vector3d& moments = principal.moments;
  const char* kind = plan->rigid_freedoms == 6   ? ""
                     : plan->rigid_freedoms == 5 ? " (collinear)"
                                                 : " (one point)";
  std::printf("%s: %s, %s\n", plan->name.c_str(),
              counted(static_cast<std::int64_t>(plan->points.size()), "point").c_str(),
              counted(static_cast<std::int64_t>(plan->links.size()), "link").c_str());
  std::printf("mass               %.10g kg\n", plan->mass);
  std::printf("centre of mass     %.10g %.10g %.10g m (scene axes)\n", plan->p_SB[0], plan->p_SB[1],
              plan->p_SB[2]);
  std::printf("principal moments  %.10g %.10g %.10g kg m^2\n", moments(0), moments(1), moments(2));
  for (int k = 0; k < 3; ++k) {
    const Eigen::Vector3d axis = principal.axes.col(k);
    std::printf("  axis %d           % .6f % .6f % .6f\n", k + 1, axis(0), axis(1), axis(2));
  }
  std::printf("rigid freedoms     %d%s\n", plan->rigid_freedoms, kind);
  std::printf("elastic freedoms   %d%s\n", plan->num_elastic,
              leaves_modes_out(*plan) ? ", others are omitted (freeflex plan shows why)" : "");
  if (const std::string text = coupling_text(*plan); !text.empty())
    std::printf("coupled            %s\n", text.c_str());
  if (error.size > 0.0) std::printf("step               %s\n", step_error_text(*plan, error).c_str());
  if (const auto names = dependent_loads(*plan); !names.empty())
    std::printf("not separated      the body's motion under %s depends on the elastic motion\n",
                listed(names, 8).c_str());
  const auto mechanisms = mechanism_names(*plan);
  if (!mechanisms.empty()) {
    std::printf("mechanisms         %zu motions that strain no link, with frequency 0\n", mechanisms.size());
    for (std::size_t i = 0; i < mechanisms.size(); ++i) {
      std::printf("  mode %zu moves %s\n", i + 1, listed(mechanisms[i], 8).c_str());
    }
  }
  if (motion.nutation > 0.0)
    std::printf("nutation           %.10g Hz, of the body with its wheels\n",
                motion.nutation / (2.0 * std::numbers::pi));
  if (plan->num_elastic > static_cast<int>(mechanisms.size()) ||
      std::any_of(all.begin(), all.end(), has_row)) {
    std::printf(
        "frequencies        lowest to a relative accuracy of %.1g, equal within %.1g; of the body at rest\n",
        plan->frequency_accuracy, cluster_width(*plan));
    print_frequencies(*plan, all, options.count);
    if (!motion.unknown.empty()) std::printf("  not computed: %s\n", motion.unknown.c_str());
  }
  return kExitOk;
}

}  // namespace

void add_modes(CLI::App& app, int& exit_code) {
  auto options = std::make_shared<ModesOptions>();
  CLI::App* command =
      app.add_subcommand("modes", "mass, principal moments, freedoms, frequencies and mechanisms");
  command->add_option("SCENE", options->input, "scene or plan file")->required();
  add_settings(*command, options->settings);
  command
      ->add_option("--count", options->count,
                   "frequencies to print, 0 for all; at most 6 with a range of --spin")
      ->capture_default_str()
      ->check(whole_number(0, kMost<int>))
      ->type_name("N");
  CLI::Option* const spin =
      command
          ->add_option(
              "--spin", options->spin,
              "instead the small motions about a steady rotation at X,Y,Z [rad/s], body axes, with true "
              "geometry, or with the lowest modes of a large scene on the rung coupled; W for the axis "
              "of the largest moment of inertia; 0..X,Y,Z or 0..W for a range")
          ->check(check_spin)
          ->type_name("SPIN");
  CLI::Option* loads = command->add_flag(
      "--loads", options->has_loads,
      "instead the small motions under the built-in loads, with the same equations as --spin");
  command
      ->add_option("--at", options->at,
                   "time [s] at which --loads takes the values of the loads, rounded to a tick; default 0")
      ->needs(loads)
      ->check(not_negative())
      ->type_name("SECONDS");
  CLI::Option* const bode =
      command
          ->add_option("--bode", options->pair,
                       "instead the gain of each mode from INPUT to OUTPUT, as in point.tip.fz:point.tip.z "
                       "('freeflex export --help' lists inputs and outputs)")
          ->check(check_pair)
          ->type_name("PAIR");
  CLI::Option* const hold =
      command
          ->add_option("--hold", options->held,
                       "instead the modes with this point or group held, and their effective masses")
          ->type_name("NAME");
  CLI::Option* const plot =
      command
          ->add_option("--plot", options->plot,
                       std::string("shapes of the lowest 12 modes; with --bode the transfer function; with a "
                                   "range of --spin frequency and damping over spin: ") +
                           kPictures)
          ->check([](const std::string& path) {
            return is_picture(path) ? std::string() : "the value is '" + path + "', but must be " + kPictures;
          })
          ->type_name("FILE");
  for (CLI::Option* other : {spin, loads, bode, plot}) hold->excludes(other);
  for (CLI::Option* other : {spin, loads}) bode->excludes(other);
  command->add_flag("--json", options->json, "one JSON object on standard output, all frequencies");
  command->footer(kModesFooter);
  command->callback([options, &exit_code] { exit_code = modes(*options); });
}

}  // namespace freeflex::tools
