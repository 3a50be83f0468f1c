#include "tools/cli/steady_modes.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numbers>
#include <vector>

#include "core/plan/make_plan.hpp"
#include "core/steady/relative_equilibrium.hpp"
#include "core/structure/structure.hpp"
#include "tools/cli/branches.hpp"
#include "tools/cli/commands.hpp"
#include "tools/terminal/console.hpp"
#include "tools/terminal/json.hpp"
#include "tools/terminal/usage.hpp"

namespace freeflex::tools {
namespace {

using Eigen::Vector3d;

constexpr int kNumSpins = 41;          // of a range, with its ends
constexpr std::size_t kMostDrawn = 6;  // branches in a picture and in the table of a range
constexpr double kAccurate = 1e-4;     // [-] a worse accuracy is a warning
constexpr double kMostSpin = 1e9;      // [rad/s] of each number of --spin
constexpr double kMostTicks = 1e15;    // of --at; a double holds each exactly
// The work grows with the cube of the number of freedoms. 988 took 160 s.
constexpr int kMostFreedoms = 1000;

struct Spin {
  Vector3d value = Vector3d::Zero();  // [rad/s] body axes
  bool is_range = false;
};

/// The numbers of --spin: three, or one for the axis of the largest moment of inertia.
struct SpinNumbers {
  std::vector<double> numbers;
  bool is_range = false;
};
std::optional<SpinNumbers> parse_spin(std::string text) {
  SpinNumbers result;
  if (text.starts_with("0..")) result.is_range = true, text.erase(0, 3);
  for (const std::size_t count : {1U, 3U}) {
    const auto parsed = parse_named_numbers("spin=" + text, count);
    if (!parsed) continue;
    result.numbers = parsed->numbers;
    const bool is_zero =
        std::all_of(result.numbers.begin(), result.numbers.end(), [](double x) { return x == 0.0; });
    if (is_zero && result.is_range) return std::nullopt;
    if (std::any_of(result.numbers.begin(), result.numbers.end(),
                    [](double x) { return std::abs(x) > kMostSpin; }))
      return std::nullopt;
    return result;
  }
  return std::nullopt;
}

/// Returns the unit vector of the axis of the largest moment of inertia, whose largest component is positive.
Vector3d axis_of_largest_inertia(const StepPlan& plan) {
  const Eigen::Matrix3d inertia =
      Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(plan.inertia.data());
  Vector3d axis = Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(inertia).eigenvectors().col(2);
  Eigen::Index largest = 0;
  axis.cwiseAbs().maxCoeff(&largest);
  return axis[largest] < 0.0 ? -axis : axis;
}

Spin spin_of(const std::string& text, const StepPlan& plan) {
  if (text.empty()) return {};
  const SpinNumbers parsed = *parse_spin(text);  // check_spin() has checked it
  if (parsed.numbers.size() == 1) return {parsed.numbers[0] * axis_of_largest_inertia(plan), parsed.is_range};
  return {Eigen::Map<const Vector3d>(parsed.numbers.data()), parsed.is_range};
}

/// Returns the full plan with true geometry. Prints the faults.
/// Returns the coupled rung with linear links.
Fidelity linear_coupled_rung() {
  return std::ranges::find_if(kRungs,
                              [](const RungTraits& rung) { return rung.couples && !rung.has_true_geometry; })
      ->rung;
}
std::optional<Plan> load(const std::string& path, const io::Settings& settings) {
  if (io::is_plan_file(path)) {
    print_error(path + " is a plan; --spin and --loads need the scene that it was made from");
    return std::nullopt;
  }
  io::SceneResult read = io::read_scene(path, settings);
  std::optional<Plan> plan;
  if (read.scene) {
    const Progress progress("set-up");
    // the rung corotational needs all modes; a larger scene keeps its lowest ones on the rung coupled
    const bool is_large = 3 * read.scene->points.size() > std::size_t{kMostFreedoms} + 6;
    if (!is_large) read.scene->modes = {};
    read.scene->fidelity = is_large ? linear_coupled_rung() : kTrueGeometry;
    read.scene->automatic = {};
    const auto structure = build_structure(*read.scene, read.faults);
    if (structure && structure->omega.size() <= kMostFreedoms) {
      plan = make_full_plan(*read.scene, *structure, read.scene->fidelity, read.faults);
    } else if (structure) {
      add_error(read.faults, {},
                join_text("the scene has ", structure->omega.size(),
                          " elastic freedoms, but --spin and --loads take at most ", kMostFreedoms,
                          "; keep fewer modes (modes: {count: N}), or use a coarser mesh"));
    }
  }
  print_faults(read.faults, read.sources);
  if (!plan && read.scene)
    print_error(
        "--spin and --loads use the rung corotational whatever the fidelity of the scene, or the rung "
        "coupled with the lowest modes of a large scene, and it does not take this scene");
  return plan;
}

double hertz(const SmallMotion& small) { return small.rate.imag() / (2.0 * std::numbers::pi); }
double ratio(const SmallMotion& small) {
  const double size = std::abs(small.rate);
  return size > 0.0 ? -small.rate.real() / size : 0.0;
}
Json json_of(const Plan& plan, const RelativeEquilibrium& found) {
  Json motions = Json::array();
  for (const SmallMotion& small : found.motions)
    motions.push_back({{"frequency", hertz(small)},
                       {"damping_ratio", ratio(small)},
                       {"decay_rate", -small.rate.real()},
                       {"mode", small.mode < 0 ? Json() : Json(number_of(plan, small.mode))},
                       {"share", small.share}});
  return {{"spin", {found.spin[0], found.spin[1], found.spin[2]}},
          {"displacement", found.displacements.colwise().norm().maxCoeff()},
          {"acceleration", {found.acceleration[0], found.acceleration[1], found.acceleration[2]}},
          {"accuracy", found.accuracy},
          {"motions", motions}};
}

void warn_of_accuracy(double accuracy) {
  if (accuracy > kAccurate)
    print_warning(
        format_text("the frequencies are accurate to %.2g only, because some links are much stiffer than "
                    "others; lower the stiffness of links that hardly stretch",
                    accuracy));
}

double worst_accuracy(const std::vector<RelativeEquilibrium>& all) {
  double worst = 0.0;
  for (const RelativeEquilibrium& each : all) worst = std::max(worst, each.accuracy);
  return worst;
}

std::string loads_text(const SteadyOptions& options, const RelativeEquilibria& equilibria) {
  return options.loads_at ? format_text("as at %.10g s", equilibria.time()) : "none";
}

/// Returns the components as text. Rounding errors are shown as zero.
std::string vector_text(const Vector3d& v) {
  const Vector3d x = (v.array().abs() < 1e-12 * v.norm()).select(Vector3d::Zero(), v);
  return format_text("%.10g %.10g %.10g", x[0] + 0.0, x[1] + 0.0, x[2] + 0.0);
}

void print_motion(const Plan& plan, const SmallMotion& small) {
  const double size = std::abs(small.rate), growth = growth_of(small.rate);
  const bool oscillates = small.rate.imag() > 0.0;
  const std::string frequency = oscillates ? format_text("%.10g", hertz(small)) : "-";
  const std::string damping = oscillates ? format_text("%.4g", 0.0 - growth / size) : "-";
  const std::string like =
      small.mode < 0 ? "rotation of the body" : "mode " + std::to_string(number_of(plan, small.mode));
  std::printf("  %-16s  %-12s  %-12.4g  %s, %.0f %%\n", frequency.c_str(), damping.c_str(), growth,
              like.c_str(), 100.0 * small.share);
}

int show_one(const Plan& plan, const SteadyOptions& options, const Spin& spin) {
  RelativeEquilibria equilibria(plan, options.loads_at);
  const RelativeEquilibrium found = [&] {
    const Progress progress("small motions");
    return equilibria.find(spin.value);
  }();
  if (!found.error.empty()) return print_error(found.error), kExitDiffers;
  warn_of_accuracy(found.accuracy);
  if (options.json) {
    Json out{{"name", plan.name}, {"rung", name_of(plan.fidelity)}};
    out["steady"] = Json::array({json_of(plan, found)});
    print_json(out);
    return kExitOk;
  }
  Eigen::Index point = 0;
  const double largest = found.displacements.colwise().norm().maxCoeff(&point);
  std::printf("%s\n", plan.name.c_str());
  std::printf("spin               %s rad/s (body axes)\n", vector_text(found.spin).c_str());
  const bool is_idle = options.loads_at && largest == 0.0;
  if (!traits_of(plan.fidelity).has_true_geometry)
    std::printf(
        "equations          the rung coupled with the %d lowest modes; the displacement is that of these "
        "modes alone\n",
        plan.num_elastic);
  std::printf("loads              %s%s\n", loads_text(options, equilibria).c_str(),
              is_idle ? ", when none acts" : "");
  std::printf("displacement       up to %.4g m, of point '%s'\n", largest,
              plan.points[index(point)].name.c_str());
  if (!found.acceleration.isZero(0.0))
    std::printf("not quite steady   the loads accelerate the rotation by %s rad/s^2\n",
                vector_text(found.acceleration).c_str());
  std::printf(
      "small motions      about this steady motion, in the axes of the body, to a relative accuracy of "
      "%.1g\n",
      found.accuracy);
  std::printf("  frequency [Hz]    damping       growth [1/s]  most of the energy\n");
  const std::size_t shown =
      options.count > 0 ? std::min(index(options.count), found.motions.size()) : found.motions.size();
  for (std::size_t k = 0; k < shown; ++k) print_motion(plan, found.motions[k]);
  if (shown < found.motions.size())
    std::printf("  ... %zu more up to %.10g Hz (--count 0 shows all)\n", found.motions.size() - shown,
                hertz(found.motions.back()));
  if (std::any_of(found.motions.begin(), found.motions.end(),
                  [](const SmallMotion& small) { return grows(small.rate); }))
    std::printf("unstable           some motions grow, see the column growth\n");
  return kExitOk;
}

/// Prints at which spins of a range some motion grows, shown or not.
void print_growth(const std::vector<double>& spins, const std::vector<RelativeEquilibrium>& all) {
  double first = -1.0, last = 0.0, most = 0.0, at = 0.0;
  for (std::size_t k = 0; k < all.size(); ++k)
    for (const SmallMotion& small : all[k].motions) {
      if (!grows(small.rate)) continue;
      if (first < 0.0) first = spins[k];
      last = spins[k];
      if (small.rate.real() > most) most = small.rate.real(), at = spins[k];
    }
  if (first >= 0.0)
    std::printf(
        "unstable           motions marked * grow; at spins from %.6g to %.6g rad/s some motion grows, "
        "at most by %.4g 1/s at %.6g rad/s\n",
        first, last, most, at);
}

void print_range(const std::string& name, const std::string& loads, const std::vector<double>& spins,
                 const std::vector<Branch>& branches, const std::vector<RelativeEquilibrium>& all) {
  const RelativeEquilibrium& last = all.back();
  std::printf("%s\n", name.c_str());
  std::printf("axis of spin       %s (body axes), at %.10g rad/s\n",
              vector_text(last.spin.normalized()).c_str(), spins.back());
  std::printf("loads              %s\n", loads.c_str());
  std::printf("small motions      frequencies [Hz] in the axes of the body, to a relative accuracy of %.1g\n",
              worst_accuracy(all));
  std::printf("  %-14s", "spin [rad/s]");
  for (const Branch& branch : branches) std::printf("  %-14s", branch.name.c_str());
  std::printf("\n");
  for (std::size_t k = 0; k < spins.size(); k += 4) {
    std::printf("  %-14.6g", spins[k]);
    for (const Branch& branch : branches) {
      const std::complex<double> rate = branch.rates[k];
      const bool is_growing = grows(rate);
      const std::string text =
          format_text("%.8g%s", rate.imag() / (2.0 * std::numbers::pi), is_growing ? " *" : "");
      std::printf("  %-14s", std::isnan(rate.real()) ? "-" : text.c_str());
    }
    std::printf("\n");
  }
  print_growth(spins, all);
}

int show_range(const Plan& plan, const SteadyOptions& options, const Spin& spin) {
  std::vector<RelativeEquilibrium> all;
  std::vector<double> spins;
  RelativeEquilibria equilibria(plan, options.loads_at);
  {
    Progress progress("small motions");
    for (int k = 0; k < kNumSpins; ++k) {
      const double share = static_cast<double>(k) / (kNumSpins - 1);
      all.push_back(equilibria.find(share * spin.value));
      spins.push_back(share * spin.value.norm());
      if (!all.back().error.empty()) break;
      progress.update(share);
    }
  }
  if (!all.back().error.empty()) {
    print_error(format_text("at a spin of %.6g rad/s: ", spins.back()) + all.back().error);
    return kExitDiffers;
  }
  warn_of_accuracy(worst_accuracy(all));
  std::vector<Branch> branches = branches_of(plan, all);
  branches.resize(
      std::min({kMostDrawn, branches.size(), options.count > 0 ? index(options.count) : kMostDrawn}));
  if (options.json) {
    Json out{{"name", plan.name}, {"rung", name_of(plan.fidelity)}};
    out["steady"] = Json::array();
    for (const RelativeEquilibrium& found : all) out["steady"].push_back(json_of(plan, found));
    print_json(out);
  } else {
    print_range(plan.name, loads_text(options, equilibria), spins, branches, all);
  }
  if (options.plot.empty()) return kExitOk;
  const std::string error =
      draw_branches(plan.name + ": small motions over spin, body axes", options.plot, spins, branches);
  if (!error.empty()) return print_error(error), kExitDiffers;
  return kExitOk;
}

}  // namespace

std::string check_spin(const std::string& text) {
  if (parse_spin(text)) return {};
  return "the value is '" + text +
         "', but must be X,Y,Z or W [rad/s], or 0..X,Y,Z or 0..W for a range that ends above zero, "
         "with numbers of at most 1e9";
}

int steady_modes(const SteadyOptions& options) {
  const bool is_range = options.spin.starts_with("0..");
  if (!options.plot.empty() && !is_range) {
    print_error("--plot draws frequencies over a range of spins; give --spin 0..X,Y,Z or 0..W");
    return kExitUsage;
  }
  const std::optional<Plan> plan = load(options.scene, options.settings);
  if (!plan) return kExitUsage;
  if (options.loads_at.value_or(0.0) > kMostTicks * plan->period) {
    print_error(format_text("--at is %.10g s, but must be at most %.3g s, 1e15 ticks", *options.loads_at,
                            kMostTicks * plan->period));
    return kExitUsage;
  }
  if (plan->attractor_mu > 0.0)
    print_warning("the small motions do not include the attraction of the attractor");
  const Spin spin = spin_of(options.spin, *plan);
  return spin.is_range ? show_range(*plan, options, spin) : show_one(*plan, options, spin);
}

}  // namespace freeflex::tools
