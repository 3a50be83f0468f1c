// freeflex plan: what a plan keeps and leaves out of a scene, why, what that may change, and what a step
// costs.
#include <CLI/App.hpp>
#include <algorithm>
#include <cstdio>
#include <memory>
#include <string>
#include <vector>

#include "core/plan/make_plan.hpp"
#include "core/structure/structure.hpp"
#include "tools/cli/commands.hpp"
#include "tools/report/step_cost.hpp"
#include "tools/terminal/console.hpp"
#include "tools/terminal/json.hpp"
#include "tools/terminal/usage.hpp"

namespace freeflex::tools {
namespace {

struct PlanOptions {
  std::string input;
  std::vector<std::string> keep;
  bool json = false;
};

constexpr const char* kPlanFooter = R"(Example:
  freeflex plan service/scenes/boom.yaml
  freeflex plan boom.yaml --keep rotation small_modes
JSON fields:
  name, modes, modes_of_scene, mode_numbers
               how many are kept, of how many, and which
  tolerance, horizon, on_need
               as the scene's leave_out says: [-], [s], keep, replan or refuse
  rung, parts_of_a_tick
               the fidelity, and in how many parts a coupled rung takes a tick
  rungs_tried  by fidelity: auto; of each: rung, finite, position [m], attitude [rad], elastic, meets
  budget_horizon, budget_steps
               [s] of the error budget; of each rung beside the state: fidelity, steps_per_tick
  parts        of each: part, left_out, count, why, error [m], share, error_per_force [m/N],
               share_per_force, link_error [N, N m], link_error_per_force
  features     whether the scene has loads, follower_forces, feedback, dashpots, spin_load, attractor,
               coupled_rungs
  ns, ns_with_everything_kept
               [ns] a step: step, and its rigid, modes, loads, fields, coupling, stages; beside it push,
               point (a point pushed, a point read), budget
Exit codes: 0 done, 2 the scene or plan has errors.)";

constexpr std::size_t kShownModes = 12;

std::vector<std::string> keep_names() {
  std::vector<std::string> names{"all"};
  for (int k = 0; k < kNumParts; ++k) names.emplace_back(name_of(static_cast<Part>(k)));
  return names;
}

void keep_more(const std::vector<std::string>& names, LeaveOut& leave_out) {
  for (const std::string& name : names) {
    if (name == "all") leave_out.keeps.fill(true);
    for (int k = 0; k < kNumParts; ++k)
      if (name == name_of(static_cast<Part>(k))) leave_out.keeps[static_cast<std::size_t>(k)] = true;
  }
}

/// The plan that is shown and, of a scene, the same with everything kept.
struct Plans {
  std::optional<Plan> plan, whole;
};

Plans load(const PlanOptions& options) {
  Plans plans;
  if (io::is_plan_file(options.input)) {
    if (!options.keep.empty()) {
      print_error(options.input +
                  " is a plan, which is fixed: name the scene that it was made from to --keep parts");
      return plans;
    }
    plans.plan = load_or_explain(options.input, 0.0);
    return plans;
  }
  io::SceneResult read = io::read_scene(options.input);
  std::optional<Structure> structure;
  {
    Progress progress("set-up");
    if (read.scene) {
      keep_more(options.keep, read.scene->leave_out);
      structure = build_structure(*read.scene, read.faults, progress.of_setup());
    }
    if (structure) plans.plan = make_plan(*read.scene, *structure, read.faults);
  }
  print_faults(read.faults, read.sources);
  if (!plans.plan) return plans;
  const Progress progress("set-up");
  Faults repeated;
  plans.whole = make_whole_plan(*read.scene, *structure, plans.plan->fidelity, repeated);
  return plans;
}

/// Code that is there only for what the scene has, with whether it has it.
std::vector<std::pair<const char*, bool>> features(const Plan& plan) {
  const auto has_followers = [](const PlanHistory& history) { return !history.followers.empty(); };
  return {{"loads", !plan.histories.empty()},
          {"follower_forces", std::any_of(plan.histories.begin(), plan.histories.end(), has_followers)},
          {"feedback", !plan.feedbacks.empty()},
          {"dashpots", plan.mixing.num_damping > 0},
          {"spin_load", plan.has_spin_load},
          {"attractor", plan.attractor_mu > 0.0},
          {"coupled_rungs", is_coupled(plan)}};
}

Json to_json(const StepCost& cost) {
  return {{"step", cost.step()},   {"rigid", cost.rigid},   {"modes", cost.modes},
          {"loads", cost.loads},   {"fields", cost.fields}, {"coupling", cost.coupling},
          {"stages", cost.stages}, {"push", cost.push},     {"point", cost.point},
          {"budget", cost.budget}};
}

const char* on_need_name(const Plan& plan) {
  if (!plan.scope.lacks_rotation && !plan.scope.lacks_out_of_plane) return "keep";
  return plan.wide.empty() ? "refuse" : "replan";
}

Json rungs_json(const Plan& plan) {
  Json rungs = Json::array();
  for (const PlanRung& each : plan.tried_rungs)
    rungs.push_back({{"rung", name_of(each.rung)},
                     {"finite", each.is_finite},
                     {"position", each.position},
                     {"attitude", each.attitude},
                     {"elastic", each.elastic},
                     {"meets", each.meets}});
  return rungs;
}

/// What `fidelity: auto` tried, and what the error budget runs beside.
void print_rungs(const Plan& plan) {
  std::printf("rung               %s", name_of(plan.fidelity));
  if (plan.coupled.num_parts > 1) std::printf(", each tick in %d parts", plan.coupled.num_parts);
  std::printf("\n");
  for (const PlanRung& each : plan.tried_rungs) {
    if (each.is_finite)
      std::printf("  %-16s estimate %.2g m, %.2g rad, elastic %.2g: %s\n", name_of(each.rung), each.position,
                  each.attitude, each.elastic,
                  each.meets ? "meets the tolerance, taken" : "not within the tolerance");
    else
      std::printf("  %-16s leaves the numbers\n", name_of(each.rung));
  }
  if (plan.budget.shadows.empty()) return;
  std::string beside;
  for (const PlanShadow& shadow : plan.budget.shadows)
    beside += std::string(beside.empty() ? "" : ", ") + name_of(shadow.plan.fidelity) +
              (shadow.substeps > 1 ? " " + std::to_string(shadow.substeps) + " times a tick" : "");
  const std::string text =
      format_text("over %.6g s; steps beside the state: %s", plan.budget.horizon, beside.c_str());
  std::printf("error budget       %s\n", wrapped(text, 19).c_str());
}

Json parts_json(const Plan& plan) {
  Json parts = Json::array();
  for (const PlanPart& part : plan.parts)
    parts.push_back({{"part", name_of(part.part)},
                     {"left_out", part.is_left_out},
                     {"count", part.count},
                     {"why", part.why},
                     {"error", part.error},
                     {"share", part.share},
                     {"error_per_force", part.error_per_force},
                     {"share_per_force", part.share_per_force},
                     {"link_error", part.link_error},
                     {"link_error_per_force", part.link_error_per_force}});
  return parts;
}

void print_plan_json(const Plans& plans) {
  const Plan& plan = *plans.plan;
  Json out;
  out["name"] = plan.name;
  out["modes"] = plan.num_elastic;
  if (plans.whole) out["modes_of_scene"] = plans.whole->num_elastic;
  out["mode_numbers"] = plan.mode_numbers;
  out["tolerance"] = plan.tolerance;
  out["horizon"] = plan.horizon;
  out["on_need"] = on_need_name(plan);
  out["rung"] = name_of(plan.fidelity);
  out["parts_of_a_tick"] = plan.coupled.num_parts;
  out["rungs_tried"] = rungs_json(plan);
  out["budget_horizon"] = plan.budget.horizon;
  out["budget_steps"] = Json::array();
  for (const PlanShadow& shadow : plan.budget.shadows)
    out["budget_steps"].push_back(
        {{"fidelity", name_of(shadow.plan.fidelity)}, {"steps_per_tick", shadow.substeps}});
  out["parts"] = parts_json(plan);
  Json present = Json::object();
  for (const auto& [name, is_there] : features(plan)) present[name] = is_there;
  out["features"] = present;
  predict_step(plan);  // the processor warms up
  out["ns"] = to_json(predict_step(plan));
  if (plans.whole) out["ns_with_everything_kept"] = to_json(predict_step(*plans.whole));
  print_json(out);
}

void print_errors(const Plan& plan, const PlanPart& part) {
  if (part.part != Part::kSmallModes) return;
  if (part.share > 0.0 || part.error > 0.0)
    std::printf(
        "    built-in loads and initial state, %.6g s: at most %.3g m, %.2g of the largest displacement\n",
        plan.horizon, part.error, part.share);
  if (part.error_per_force > 0.0)
    std::printf(
        "    commands: at most %.3g m a newton, %.2g of the static displacement, times the force that "
        "stands\n"
        "    plus the sum of its changes\n",
        part.error_per_force, part.share_per_force);
  if (part.link_error > 0.0 || part.link_error_per_force > 0.0)
    std::printf("    published link forces: at most %.3g N, and %.3g a newton; right for steady loads\n",
                part.link_error, part.link_error_per_force);
}

std::string mode_list(const Plan& plan) {
  std::vector<std::string> names;
  for (const std::int32_t number : plan.mode_numbers) names.push_back(std::to_string(number));
  return listed(names, kShownModes);
}

void print_parts(const Plan& plan) {
  std::printf("  %-16s %-9s %6s  why\n", "part", "", "count");
  for (const PlanPart& part : plan.parts) {
    const std::string count = part.count > 0 ? std::to_string(part.count) : "";
    std::printf("  %-16s %-9s %6s  %s\n", name_of(part.part), part.is_left_out ? "left out" : "kept",
                count.c_str(), wrapped(part.why, 37).c_str());
    if (part.is_left_out) print_errors(plan, part);
  }
  std::string absent, present;
  for (const auto& [name, is_there] : features(plan))
    (is_there ? present : absent) += std::string(" ") + name;
  std::printf("the scene asks for %s\n", present.empty() ? " none of the rest" : present.c_str());
  std::printf("it has no          %s\n", absent.c_str());
  if (plan.scope.lacks_rotation || plan.scope.lacks_out_of_plane)
    std::printf("a command that needs %s%s%s is %s\n", plan.scope.lacks_rotation ? "rotation" : "",
                plan.scope.lacks_rotation && plan.scope.lacks_out_of_plane ? " or " : "",
                plan.scope.lacks_out_of_plane ? "out_of_plane" : "",
                plan.wide.empty() ? "refused (left_out)"
                                  : format_text("taken: from its tick on %d modes are stepped",
                                                plan.wide.front().num_elastic)
                                        .c_str());
}

void print_cost(const Plans& plans) {
  predict_step(*plans.plan);  // the processor warms up
  const StepCost cost = predict_step(*plans.plan);
  if (is_coupled(*plans.plan)) {
    std::printf("step               %.0f ns, measured; reading a point takes %.0f ns\n", cost.step(),
                cost.point);
  } else {
    std::printf(
        "step               %.0f ns predicted: body %.0f, modes %.0f, loads %.0f, fields %.0f, coupling "
        "%.0f\n",
        cost.step(), cost.rigid, cost.modes, cost.loads, cost.fields, cost.coupling);
    std::printf("                   each pushed point adds %.0f ns; reading a point takes %.0f ns\n",
                cost.push, cost.point);
  }
  if (cost.budget > 0.0)
    std::printf(
        "                   the error budget adds %.0f ns, %.3g times the step; leave error_budget out to "
        "save it\n",
        cost.budget, cost.budget / cost.step());
  if (plans.whole && !is_coupled(*plans.plan))
    std::printf("                   with everything kept %.0f ns\n", predict_step(*plans.whole).step());
}

int show(const PlanOptions& options) {
  const Plans plans = load(options);
  if (!plans.plan) return kExitUsage;
  if (options.json) {
    print_plan_json(plans);
    return kExitOk;
  }
  const Plan& plan = *plans.plan;
  std::string head = plan.name + ": " + counted(plan.num_elastic, "mode");
  if (plans.whole && plans.whole->num_elastic != plan.num_elastic)
    head +=
        format_text(" of %d, of the scene's numbers %s", plans.whole->num_elastic, mode_list(plan).c_str());
  std::printf("%s\n", wrapped(head, 0).c_str());
  if (plan.parts.empty())
    std::printf("everything is kept\n");
  else
    print_parts(plan);
  print_rungs(plan);
  print_cost(plans);
  return kExitOk;
}

}  // namespace

void add_plan(CLI::App& app, int& exit_code) {
  auto options = std::make_shared<PlanOptions>();
  CLI::App* command = app.add_subcommand(
      "plan", "what is kept and left out of a scene, why, what that may change, ns a step");
  command->add_option("SCENE", options->input, "scene or plan file")->required();
  command
      ->add_option("--keep", options->keep,
                   "parts that stay whatever the scene needs: " + listed(keep_names(), keep_names().size()))
      ->check(one_of(keep_names()))
      ->type_name("PART");
  command->add_flag("--json", options->json, "one JSON object on standard output");
  command->footer(kPlanFooter);
  command->callback([options, &exit_code] { exit_code = show(*options); });
}

}  // namespace freeflex::tools
