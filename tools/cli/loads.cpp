// freeflex loads computes displacements and link forces under a steady load, by inertia relief.
#include <CLI/App.hpp>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <memory>
#include <string>
#include <vector>

#include "core/plan/loads/quasi_static.hpp"
#include "core/plan/make_plan.hpp"
#include "core/plan/rungs/shadow.hpp"
#include "core/steady/judge_steady.hpp"
#include "core/step/linear/kernels.hpp"
#include "core/step/readout.hpp"
#include "core/structure/structure.hpp"
#include "tools/cli/commands.hpp"
#include "tools/terminal/console.hpp"
#include "tools/terminal/json.hpp"
#include "tools/terminal/usage.hpp"

namespace freeflex::tools {
namespace {

struct LoadsOptions {
  std::string input;
  std::vector<std::string> forces;
  std::vector<std::string> wrenches;
  std::vector<std::string> torques;
  std::vector<double> spin;  // [rad/s] (3), empty if not given
  bool json = false;
};

constexpr const char* kLoadsFooter = R"(Shows published points and links.
Example:
  freeflex loads service/scenes/boom.yaml --force tip=0,5,0
JSON fields:
  name         of the scene;  force [N] and torque [N m]: the resultant about the centre of mass, body axes
  points       for each: name, elastic displacement [m] in body axes, which are the mean axes
  links        for each: name, kind, values [N, N m] by kind (messages/README.md, section 7)
  validity     0 good, 1 watch, 2 outside, null if not judged;  cause: why not good;  error, scale [m]: the estimated
               error and what the verdict compares it with
Exit codes: 0 done, 2 the scene, plan or load has errors.)";

/// Returns the index of the item with this name, or -1.
template <class Items>
std::int32_t find_name(const Items& items, const std::string& name) {
  for (std::size_t i = 0; i < items.size(); ++i)
    if (items[i].name == name) return static_cast<std::int32_t>(i);
  return -1;
}

template <class Items>
std::string names_of(const Items& items) {
  std::vector<std::string> names;
  names.reserve(items.size());
  for (const auto& item : items) names.push_back(item.name);
  return names.empty() ? "none" : listed(names, 12);
}

/// Reads the forces of --force. If a force is wrong, prints an error and returns false.
bool read_forces(const LoadsOptions& options, const Plan& plan, std::vector<PointForce>& forces) {
  for (const std::string& text : options.forces) {
    const auto named = parse_named_numbers(text, 3);
    if (!named || named->numbers.empty()) {
      print_error("--force " + text + " must be POINT=FX,FY,FZ in newtons");
      return false;
    }
    const std::int32_t point = find_name(plan.points, named->name);
    if (point < 0 || plan.points[index(point)].row < 0) {
      print_error(
          "--force: " +
          std::string(point < 0 ? "there is no point '" : "the plan stores no mode shapes at point '") +
          named->name +
          (point < 0 ? "'; points are " + names_of(plan.points)
                     : "'; add it to 'commands: points' of the scene"));
      return false;
    }
    forces.push_back({point, 0, {named->numbers[0], named->numbers[1], named->numbers[2]}});
  }
  return true;
}

bool read_wrenches(const LoadsOptions& options, const Plan& plan, std::vector<Wrench>& wrenches) {
  for (const std::string& text : options.wrenches) {
    const auto named = parse_named_numbers(text, 6);
    if (!named || named->numbers.empty()) {
      print_error("--wrench " + text + " must be GROUP=FX,FY,FZ,TX,TY,TZ in newtons and newton metres");
      return false;
    }
    const std::int32_t group = find_name(plan.groups, named->name);
    if (group < 0) {
      print_error("--wrench: there is no group '" + named->name + "'; groups are " + names_of(plan.groups));
      return false;
    }
    const std::vector<double>& x = named->numbers;
    wrenches.push_back({group, 0, {x[0], x[1], x[2]}, {x[3], x[4], x[5]}});
  }
  return true;
}

bool read_torques(const LoadsOptions& options, const Plan& plan, std::vector<PointTorque>& torques) {
  for (const std::string& text : options.torques) {
    const auto named = parse_named_numbers(text, 3);
    if (!named || named->numbers.empty()) {
      print_error("--torque " + text + " must be POINT=TX,TY,TZ in newton metres");
      return false;
    }
    const std::int32_t point = find_name(plan.points, named->name);
    if (point < 0 || attitude_index_of(plan, point) < 0) {
      print_error("--torque: " +
                  (point < 0 ? "there is no point '" + named->name + "'; points are " + names_of(plan.points)
                             : "point '" + named->name +
                                   "' has no inertia, or is neither in commands: points nor "
                                   "in publish: points of the scene"));
      return false;
    }
    torques.push_back({point, 0, {named->numbers[0], named->numbers[1], named->numbers[2]}});
  }
  return true;
}

struct LinkForce {
  std::string name, kind;
  std::vector<double> values;
};

std::vector<LinkForce> link_forces(const Plan& plan, const State& state) {
  std::vector<LinkForce> all;
  for (std::size_t i = 0; i < plan.link_outputs.size(); ++i) {
    const PlanLink& link = plan.links[index(plan.link_outputs[i].link)];
    LinkForce force{link.name, traits_of(link.type).name,
                    std::vector<double>(index(plan.link_outputs[i].num_rows))};
    read_link(plan, state, static_cast<int>(i), force.values);
    all.push_back(std::move(force));
  }
  return all;
}

void print_loads_json(const Plan& plan, const State& state, const SteadyLoad& load) {
  Json out;
  out["name"] = plan.name;
  out["force"] = state.force_W;
  out["torque"] = state.moment_B;
  Json points = Json::array();
  for (const std::int32_t i : plan.published_points)
    points.push_back(
        {{"name", plan.points[index(i)].name}, {"displacement", read_point(plan, state, i).V_B}});
  out["points"] = points;
  Json links = Json::array();
  for (const LinkForce& force : link_forces(plan, state))
    links.push_back({{"name", force.name}, {"kind", force.kind}, {"values", force.values}});
  out["links"] = links;
  const SteadyVerdict verdict = judge_steady(plan, state, load);
  const bool is_judged = verdict.why_not.empty();
  out["validity"] = is_judged ? Json(static_cast<int>(verdict.level)) : Json();
  out["cause"] = is_judged ? verdict.cause : verdict.why_not;
  out["error"] = is_judged ? Json(verdict.error) : Json();
  out["scale"] = is_judged ? Json(verdict.scale) : Json();
  print_json(out);
}

void print_loads(const Plan& plan, const State& state, const SteadyLoad& load) {
  std::printf("%s: %s, %s\n", plan.name.c_str(),
              counted(static_cast<std::int64_t>(plan.points.size()), "point").c_str(),
              counted(static_cast<std::int64_t>(plan.links.size()), "link").c_str());
  std::printf("resultant          %.10g %.10g %.10g N, %.10g %.10g %.10g N m about the centre of mass\n",
              state.force_W[0], state.force_W[1], state.force_W[2], state.moment_B[0], state.moment_B[1],
              state.moment_B[2]);
  std::printf("elastic displacements [m] in body axes, which are the mean axes\n");
  for (const std::int32_t i : plan.published_points) {
    const Vec3 V = read_point(plan, state, i).V_B;
    std::printf("  %-16s % .9e % .9e % .9e\n", plan.points[index(i)].name.c_str(), V[0], V[1], V[2]);
  }
  std::printf("forces of links (values by kind: messages/README.md, section 7)\n");
  for (const LinkForce& force : link_forces(plan, state)) {
    std::printf("  %-16s %-8s", force.name.c_str(), force.kind.c_str());
    for (std::size_t k = 0; k < force.values.size(); ++k)
      std::printf("%s% .6e", k > 0 && k % 6 == 0 ? "\n                            " : " ", force.values[k]);
    std::printf("\n");
  }
  const SteadyVerdict verdict = judge_steady(plan, state, load);
  if (!verdict.why_not.empty()) {
    std::printf("verdict: not judged (%s)\n", verdict.why_not.c_str());
    return;
  }
  std::printf("verdict: %s%s\n", name_of(verdict.level),
              verdict.cause.empty() ? "" : (" (" + verdict.cause + ")").c_str());
  std::printf("estimated error: %s %.2g m (%s)\n", share_text(verdict.error, verdict.scale).c_str(),
              verdict.scale, plan.verdict.tolerance > 0.0 ? "tolerance" : "displacement");
}

/// Loads the full plan of a scene, because the load may need features that the scene's loads do not need.
/// Refuses a plan file that omits modes or rotation. Prints the faults.
std::optional<Plan> load_full_plan_or_explain(const std::string& path) {
  if (io::is_plan_file(path)) {
    std::optional<Plan> plan = load_or_explain(path, 0.0);
    const auto lacks = [](const PlanFeature& feature) {
      return feature.is_left_out &&
             (feature.feature == Feature::kRotation || feature.feature == Feature::kOutOfPlane ||
              feature.feature == Feature::kUnreachedModes || feature.feature == Feature::kSmallModes);
    };
    if (!plan || std::none_of(plan->features.begin(), plan->features.end(), lacks)) return plan;
    print_error(path +
                " omits modes or rotation, which this load may need; name the scene that it was made from");
    return std::nullopt;
  }
  io::SceneResult read = io::read_scene(path);
  std::optional<Structure> structure;
  std::optional<Plan> plan;
  {
    Progress progress("set-up");
    if (read.scene) structure = build_structure(*read.scene, read.faults, progress.of_setup());
    // the steady response is linear, so the highest linear rung replaces a coupled rung and `fidelity: auto`
    const bool is_linear = read.scene && !read.scene->automatic && !traits_of(read.scene->fidelity).couples;
    const Fidelity rung = is_linear ? read.scene->fidelity : Fidelity::kSpinLoaded;
    if (structure) plan = make_full_plan(*read.scene, *structure, rung, read.faults);
    if (plan) compile_verdict(*read.scene, *structure, *structure, *plan);
  }
  print_faults(read.faults, read.sources);
  return plan;
}

int loads(const LoadsOptions& options) {
  if (options.forces.empty() && options.wrenches.empty() && options.torques.empty() && options.spin.empty()) {
    print_error("no load is given; give --force, --wrench, --torque or --spin");
    return kExitUsage;
  }
  const std::optional<Plan> plan = load_full_plan_or_explain(options.input);
  if (!plan) return kExitUsage;
  std::vector<PointForce> forces;
  std::vector<Wrench> wrenches;
  std::vector<PointTorque> torques;
  if (!read_forces(options, *plan, forces) || !read_wrenches(options, *plan, wrenches) ||
      !read_torques(options, *plan, torques))
    return kExitUsage;
  SteadyLoad load{forces, wrenches, {}, torques};
  if (!options.spin.empty()) load.spin = {options.spin[0], options.spin[1], options.spin[2]};
  std::string error;
  const std::optional<State> state = quasi_static(*plan, load, error);
  if (!state) {
    print_error(error);
    return kExitUsage;
  }
  if (!plan->feedbacks.empty()) print_warning("feedback is ignored in the steady response");
  options.json ? print_loads_json(*plan, *state, load) : print_loads(*plan, *state, load);
  return kExitOk;
}

}  // namespace

void add_loads(CLI::App& app, int& exit_code) {
  auto options = std::make_shared<LoadsOptions>();
  CLI::App* command = app.add_subcommand(
      "loads", "displacements and link forces under a steady load (inertia relief) and a steady spin");
  command->add_option("SCENE", options->input, "scene or plan file")->required();
  command->add_option("--force", options->forces, "force on a point, body axes [N]; may be repeated")
      ->type_name("POINT=FX,FY,FZ");
  command
      ->add_option("--wrench", options->wrenches, "force and torque on a group, body axes; may be repeated")
      ->type_name("GROUP=FX,FY,FZ,TX,TY,TZ");
  command->add_option("--torque", options->torques, "torque on a body, body axes [N m]; may be repeated")
      ->type_name("POINT=TX,TY,TZ");
  add_vector(
      *command, "--spin", options->spin,
      "steady spin, body axes [rad/s]; needs a scene whose fidelity is auto, spin-loaded or a higher rung, "
      "or a plan whose fidelity is spin-loaded",
      "rad/s")
      ->type_name("WX,WY,WZ");
  command->add_flag("--json", options->json, "one JSON object on standard output");
  command->footer(kLoadsFooter);
  command->callback([options, &exit_code] { exit_code = loads(*options); });
}

}  // namespace freeflex::tools
