// freeflex plan shows which features of a scene a plan keeps and which it omits, the reasons, the error
// bounds, and the cost of a step.
#include <CLI/App.hpp>
#include <algorithm>
#include <cstdio>
#include <memory>
#include <string>
#include <vector>

#include "core/error/verdict.hpp"
#include "core/plan/make_plan.hpp"
#include "core/structure/structure.hpp"
#include "tools/cli/commands.hpp"
#include "tools/terminal/console.hpp"
#include "tools/terminal/json.hpp"
#include "tools/terminal/usage.hpp"
#include "tools/verification/report/step_cost.hpp"

namespace freeflex::tools {
namespace {

struct PlanOptions {
  std::string input;
  io::Settings settings;
  std::vector<std::string> keep;
  bool json = false;
};

constexpr const char* kPlanFooter = R"(Example:
  freeflex plan service/scenes/boom.yaml
  freeflex plan boom.yaml --keep rotation small_modes
  freeflex plan boom.yaml --set verdict=off
JSON fields:
  name, modes, modes_of_scene, mode_numbers
               number of modes kept, number in the scene, and which are kept
  tolerance, horizon, on_need
               values of the scene's leave_out: [-], [s], and keep, replan or refuse
  rung, substeps_per_tick
               the fidelity, and the substeps of a tick on a coupled rung
  rungs_tried  by fidelity: auto; for each: rung, finite, position [m], attitude [rad], elastic, meets
  integration  by (modes or points), why_modes; counted_seconds of a tick:
               on_modes, on_points, after_change (of the loads, on points); of points: accuracy, steps_per_tick,
               ticks_per_step
  verdict      null if nothing is judged, else of the motion with which the state is compared: fidelity, step [s];
               horizon [s], every (one in this many horizons is judged), delay [s] of the result in a daemon
  features     for each: feature, left_out, count, why, error [m], relative_error (to the largest displacement),
               error_per_force [m/N], relative_error_per_force, link_error [N, N m], link_error_per_force
  scene_uses   whether the scene has loads, follower_forces, feedback, dashpots, spin_load, attractor,
               coupled_rungs
  ns, ns_full_plan
               [ns] per step, of this plan and with every feature kept: step, and its rigid, modes, loads,
               fields, coupling, stages; in addition push and point (for a point pushed and a point read), shadow
Exit codes: 0 done, 2 the scene or plan has errors.)";

constexpr std::size_t kShownModes = 12;

std::vector<std::string> keep_names() {
  std::vector<std::string> names{"all"};
  for (int k = 0; k < kNumFeatures; ++k) names.emplace_back(name_of(static_cast<Feature>(k)));
  return names;
}

void keep_more(const std::vector<std::string>& names, LeaveOut& leave_out) {
  for (const std::string& name : names) {
    if (name == "all") leave_out.keeps.fill(true);
    for (int k = 0; k < kNumFeatures; ++k)
      if (name == name_of(static_cast<Feature>(k))) leave_out.keeps[index(k)] = true;
  }
}

/// The plan that is shown and, for a scene, the full plan, which keeps every feature.
struct Plans {
  std::optional<Plan> plan, full;
};

Plans load(const PlanOptions& options) {
  Plans plans;
  if (io::is_plan_file(options.input)) {
    if (!options.keep.empty()) {
      print_error(
          options.input +
          " is a plan, whose features are fixed; to use --keep, name the scene that it was made from");
      return plans;
    }
    plans.plan = load_or_explain(options.input, 0.0, {}, options.settings);
    return plans;
  }
  io::SceneResult read = io::read_scene(options.input, options.settings);
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
  plans.full = make_full_plan(*read.scene, *structure, plans.plan->fidelity, repeated);
  return plans;
}

/// Returns the names of the features that cost time only in scenes that use them and, for each, whether this
/// scene uses it.
std::vector<std::pair<const char*, bool>> scene_uses(const Plan& plan) {
  const auto has_followers = [](const PlanHistory& history) { return !history.followers.empty(); };
  return {{"loads", !plan.histories.empty()},
          {"follower_forces", std::any_of(plan.histories.begin(), plan.histories.end(), has_followers)},
          {"feedback", !plan.feedbacks.empty()},
          {"dashpots", plan.modal_coupling.num_damping > 0},
          {"spin_load", plan.has_spin_load},
          {"attractor", plan.attractor_mu > 0.0},
          {"coupled_rungs", is_coupled(plan)}};
}

Json to_json(const StepCost& cost) {
  return {{"step", cost.step()},   {"rigid", cost.rigid},   {"modes", cost.modes},
          {"loads", cost.loads},   {"fields", cost.fields}, {"coupling", cost.coupling},
          {"stages", cost.stages}, {"push", cost.push},     {"point", cost.point},
          {"shadow", cost.shadow}};
}

const char* on_need_name(const Plan& plan) {
  if (!plan.scope.lacks_rotation && !plan.scope.lacks_out_of_plane) return "keep";
  return plan.fallback.empty() ? "refuse" : "replan";
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

/// Prints whether the plan integrates modes or points, and the counted times from which this was chosen.
void print_integration(const Plan& plan) {
  const PlanIntegration& integration = plan.integration;
  const PlanPoints& method = plan.points_method;
  if (!traits_of(plan.fidelity).has_true_geometry) return;
  std::string text = "of modes, because " + integration.why_modes;
  if (integrates_points(plan))
    text = "of points, with " +
           (method.ticks > 1 ? format_text("one step in %d ticks", method.ticks)
                             : counted(method.steps, "step") + " in a tick") +
           format_text(" for an accuracy of %g", method.accuracy);
  if (integrates_points(plan) && integration.on_points > integration.on_modes)
    text += " (the scene asks for points, or modes need a higher rate)";
  if (integration.on_modes > 0.0)
    text += format_text(
        "; counted times of a tick: %.3g us on modes, %.3g us on points, %.3g us on points after a "
        "change of the loads",
        1e6 * integration.on_modes, 1e6 * integration.on_points, 1e6 * integration.after_change);
  std::printf("integration        %s\n", wrapped(text, 19).c_str());
}

Json integration_json(const Plan& plan) {
  const PlanIntegration& integration = plan.integration;
  const PlanPoints& method = plan.points_method;
  return {{"by", integrates_points(plan) ? "points" : "modes"},
          {"why_modes", integration.why_modes},
          {"steps_per_tick", method.steps},
          {"ticks_per_step", method.ticks},
          {"accuracy", method.accuracy},
          {"counted_seconds",
           {{"on_modes", integration.on_modes},
            {"on_points", integration.on_points},
            {"after_change", integration.after_change}}}};
}

/// Prints the rungs that the setting `fidelity: auto` tried, and how the motion is judged.
void print_rungs(const Plan& plan) {
  std::printf("rung               %s", name_of(plan.fidelity));
  if (plan.coupled.num_substeps > 1) std::printf(", %d substeps per tick", plan.coupled.num_substeps);
  std::printf("\n");
  for (const PlanRung& each : plan.tried_rungs) {
    if (each.is_finite)
      std::printf("  %-16s estimate %.2g m, %.2g rad, elastic %.2g: %s\n", name_of(each.rung), each.position,
                  each.attitude, each.elastic,
                  each.meets ? "meets the tolerance, chosen" : "does not meet the tolerance");
    else
      std::printf("  %-16s diverges\n", name_of(each.rung));
  }
  print_integration(plan);
  if (plan.verdict.shadows.empty()) {
    std::printf("verdict            %s\n", wrapped("not judged: " + not_judged_text(plan), 19).c_str());
    return;
  }
  const PlanShadow& shadow = plan.verdict.shadows.front();
  const std::string text = format_text(
      "compares the motion with %s at %.4g Hz; %s of %.6g s is judged; a daemon publishes the "
      "verdict %.3g s later",
      name_of(shadow.plan.fidelity), 1.0 / shadow.plan.period,
      shadow.every == 1 ? "every horizon" : ("one in " + std::to_string(shadow.every) + " horizons").c_str(),
      static_cast<double>(shadow.horizon_ticks) * plan.period,
      static_cast<double>(shadow.delay_ticks) * plan.period);
  std::printf("verdict            %s\n", wrapped(text, 19).c_str());
}

Json features_json(const Plan& plan) {
  Json features = Json::array();
  for (const PlanFeature& feature : plan.features)
    features.push_back({{"feature", name_of(feature.feature)},
                        {"left_out", feature.is_left_out},
                        {"count", feature.count},
                        {"why", feature.why},
                        {"error", feature.error},
                        {"relative_error", feature.relative_error},
                        {"error_per_force", feature.error_per_force},
                        {"relative_error_per_force", feature.relative_error_per_force},
                        {"link_error", feature.link_error},
                        {"link_error_per_force", feature.link_error_per_force}});
  return features;
}

void print_plan_json(const Plans& plans) {
  const Plan& plan = *plans.plan;
  Json out;
  out["name"] = plan.name;
  out["modes"] = plan.num_elastic;
  if (plans.full) out["modes_of_scene"] = plans.full->num_elastic;
  out["mode_numbers"] = plan.mode_numbers;
  out["tolerance"] = plan.tolerance;
  out["horizon"] = plan.horizon;
  out["on_need"] = on_need_name(plan);
  out["rung"] = name_of(plan.fidelity);
  out["substeps_per_tick"] = plan.coupled.num_substeps;
  out["rungs_tried"] = rungs_json(plan);
  out["integration"] = integration_json(plan);
  out["verdict"] = nullptr;
  for (const PlanShadow& shadow : plan.verdict.shadows)
    out["verdict"] = {{"fidelity", name_of(shadow.plan.fidelity)},
                      {"step", shadow.plan.period},
                      {"horizon", static_cast<double>(shadow.horizon_ticks) * plan.period},
                      {"every", shadow.every},
                      {"delay", static_cast<double>(shadow.delay_ticks) * plan.period}};
  out["features"] = features_json(plan);
  Json present = Json::object();
  for (const auto& [name, is_there] : scene_uses(plan)) present[name] = is_there;
  out["scene_uses"] = present;
  predict_step(plan);  // the processor warms up
  out["ns"] = to_json(predict_step(plan));
  if (plans.full) out["ns_full_plan"] = to_json(predict_step(*plans.full));
  print_json(out);
}

void print_errors(const Plan& plan, const PlanFeature& feature) {
  if (feature.feature != Feature::kSmallModes) return;
  if (feature.relative_error > 0.0 || feature.error > 0.0)
    std::printf(
        "    built-in loads and initial state, %.6g s: at most %.3g m, %.2g of the largest displacement\n",
        plan.horizon, feature.error, feature.relative_error);
  if (feature.error_per_force > 0.0)
    std::printf(
        "    commands: at most %.3g m per newton, %.2g of the static displacement, times the present force\n"
        "    plus the sum of its changes\n",
        feature.error_per_force, feature.relative_error_per_force);
  if (feature.link_error > 0.0 || feature.link_error_per_force > 0.0)
    std::printf(
        "    error of published link forces: at most %.3g N, plus %.3g N per newton of a command; none for "
        "steady loads\n",
        feature.link_error, feature.link_error_per_force);
}

std::string mode_list(const Plan& plan) {
  std::vector<std::string> names;
  for (const std::int32_t number : plan.mode_numbers) names.push_back(std::to_string(number));
  return listed(names, kShownModes);
}

void print_features(const Plan& plan) {
  std::printf("  %-16s %-9s %6s  why\n", "feature", "", "count");
  for (const PlanFeature& feature : plan.features) {
    const std::string count = feature.count > 0 ? std::to_string(feature.count) : "";
    std::printf("  %-16s %-9s %6s  %s\n", name_of(feature.feature), feature.is_left_out ? "omitted" : "kept",
                count.c_str(), wrapped(feature.why, 37).c_str());
    if (feature.is_left_out) print_errors(plan, feature);
  }
  std::string absent, present;
  for (const auto& [name, is_there] : scene_uses(plan))
    (is_there ? present : absent) += std::string(" ") + name;
  std::printf("the scene uses     %s\n", present.empty() ? " none of the other features" : present.c_str());
  std::printf("it does not use    %s\n", absent.c_str());
  if (plan.scope.lacks_rotation || plan.scope.lacks_out_of_plane)
    std::printf("a command that needs %s%s%s is %s\n", plan.scope.lacks_rotation ? "rotation" : "",
                plan.scope.lacks_rotation && plan.scope.lacks_out_of_plane ? " or " : "",
                plan.scope.lacks_out_of_plane ? "out_of_plane" : "",
                plan.fallback.empty()
                    ? "refused (left_out)"
                    : format_text("accepted: from the tick of the command on, %d modes are simulated",
                                  plan.fallback.front().num_elastic)
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
  if (cost.shadow > 0.0)
    std::printf("                   the verdict takes %.0f ns a tick, in a daemon on another processor\n",
                cost.shadow);
  if (plans.full && !is_coupled(*plans.plan))
    std::printf("                   full plan, with every feature kept: %.0f ns\n",
                predict_step(*plans.full).step());
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
  if (plans.full && plans.full->num_elastic != plan.num_elastic)
    head += format_text(" of %d; the numbers of those kept are %s", plans.full->num_elastic,
                        mode_list(plan).c_str());
  std::printf("%s\n", wrapped(head, 0).c_str());
  if (plan.features.empty())
    std::printf("everything is kept\n");
  else
    print_features(plan);
  print_rungs(plan);
  print_cost(plans);
  return kExitOk;
}

}  // namespace

void add_plan(CLI::App& app, int& exit_code) {
  auto options = std::make_shared<PlanOptions>();
  CLI::App* command = app.add_subcommand(
      "plan", "features of a scene that are kept or omitted, why, error bounds, ns per step");
  command->add_option("SCENE", options->input, "scene or plan file")->required();
  add_settings(*command, options->settings);
  command
      ->add_option("--keep", options->keep,
                   "features to keep even where the scene does not need them: " +
                       listed(keep_names(), keep_names().size()))
      ->check(one_of(keep_names()))
      ->type_name("FEATURE");
  command->add_flag("--json", options->json, "one JSON object on standard output");
  command->footer(kPlanFooter);
  command->callback([options, &exit_code] { exit_code = show(*options); });
}

}  // namespace freeflex::tools
