#include "service/campaign/case.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <stdexcept>

#include "core/plan/make_plan.hpp"
#include "core/scene/check/check_scene.hpp"
#include "service/campaign/measures.hpp"
#include "service/campaign/numbers.hpp"
#include "service/io/scene/settings.hpp"
#include "service/io/scene/text.hpp"

namespace freeflex::campaign {
namespace {

double seconds_since(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

// a field of a CSV table: in quotes if it must be, without ends of lines
std::string csv_field(std::string text) {
  std::replace_if(
      text.begin(), text.end(), [](char c) { return c == '\n' || c == '\r' || c == '\t'; }, ' ');
  if (text.find_first_of(",\"") == std::string::npos) return text;
  std::string quoted = "\"";
  for (const char c : text) quoted += c == '"' ? std::string("\"\"") : std::string(1, c);
  return quoted + "\"";
}

// the sign of what is not a number differs between machines
std::string number_text(double value) { return std::isnan(value) ? "nan" : io::reader::format_number(value); }

/// What differs between the scenes of two cases.
enum class Differences { kNone, kMotion, kStructure };

/// Returns true if a value does not change the structure: the initial state, when loads act, fields, and
/// limits. The sizes of loads count as structure, because its response to them is part of it.
bool is_of_motion(const std::string& path) {
  std::vector<io::reader::PathStep> steps;
  if (!io::reader::parse_path(path, steps).empty()) return false;
  const std::string& first = steps[0].text;
  if (first == "loads")
    return steps.size() > 2 &&
           (steps[2].text == "pulse" || steps[2].text == "sine" || steps[2].text == "table");
  return first == "initial" || first == "gravity" || first == "tolerance";
}

Differences differences_of(const io::Settings& a, const io::Settings& b) {
  if (a.size() != b.size()) return Differences::kStructure;
  Differences differences = Differences::kNone;
  for (std::size_t k = 0; k < a.size(); ++k) {
    if (a[k].path != b[k].path) return Differences::kStructure;
    if (a[k].value == b[k].value) continue;
    if (!is_of_motion(a[k].path)) return Differences::kStructure;
    differences = Differences::kMotion;
  }
  return differences;
}

/// Returns the first error without its position, so that a row does not depend on where the files are.
std::string first_error(const Faults& faults) {
  const auto error = std::find_if(faults.begin(), faults.end(),
                                  [](const Fault& each) { return each.severity == Fault::Severity::kError; });
  return error == faults.end() ? "the scene has no plan" : error->message;
}

}  // namespace

std::uint64_t seed_of(const Campaign& campaign, std::int64_t number) {
  constexpr std::uint64_t kControllerKey = 1000;  // those of the sampler are small
  return random_bits({static_cast<std::uint64_t>(number), 0, 0, 0},
                     {campaign.sampling.seed, kControllerKey})[0];
}

Case make_case(const Campaign& campaign, const Sampler& sampler, std::int64_t number) {
  std::vector<std::string> texts;
  const std::vector<double> values = sampler.values(number);
  for (std::size_t k = 0; k < values.size(); ++k) {
    const auto* const choice = std::get_if<Choice>(&campaign.sampling.variables[k]);
    texts.push_back(choice != nullptr ? choice->values[static_cast<std::size_t>(values[k])]
                                      : io::reader::format_number(values[k]));
  }
  return make_case(campaign, number, std::move(texts));
}

Case make_case(const Campaign& campaign, std::int64_t number, std::vector<std::string> values) {
  Case made;
  made.number = number;
  made.values = std::move(values);
  made.scene = campaign.scene;
  made.settings = campaign.set;
  made.parameters = campaign.controller.parameters;
  for (std::size_t k = 0; k < campaign.variables.size(); ++k)
    for (const std::string& path : campaign.variables[k].paths) {
      if (!path.starts_with(kControllerPath)) {
        made.settings.push_back({path, made.values[k],
                                 campaign.path + ":" + std::to_string(campaign.variables[k].origin.line) +
                                     ": " + path + "=" + made.values[k]});
        continue;
      }
      const std::string name = path.substr(std::string_view(kControllerPath).size());
      const double value = io::reader::parse_number(made.values[k], {"-"}).value.value_or(0.0);
      const auto known = std::find_if(made.parameters.begin(), made.parameters.end(),
                                      [&](const auto& each) { return each.first == name; });
      if (known != made.parameters.end())
        known->second = value;
      else
        made.parameters.emplace_back(name, value);
    }
  return made;
}

std::string Commander::begin(const std::shared_ptr<const CasePlan>& plan, const Case&, Watch watch) {
  plan_ = plan;
  motion_.emplace(plan_->plan, watch);
  return {};
}

std::shared_ptr<const CasePlan> CaseRunner::plan_of(const Case& of, std::string& fault) {
  const bool is_on_same_scene = plan_ != nullptr && planned_scene_ == of.scene;
  if (is_on_same_scene && differences_of(planned_, of.settings) == Differences::kNone) return plan_;
  if (!is_on_same_scene || differences_of(planned_, of.settings) == Differences::kStructure)
    structure_.reset();
  plan_.reset();
  auto made = std::make_shared<CasePlan>();
  std::optional<Plan> plan =
      io::is_plan_file(of.scene) ? load_plan_file(of, fault) : make_plan_of_scene(of, fault);
  if (!plan) return nullptr;
  made->plan = std::move(*plan);
  io::fill_name_table(made->plan, made->table);
  planned_scene_ = of.scene;
  planned_ = of.settings;
  plan_ = std::move(made);
  return plan_;
}

std::optional<Plan> CaseRunner::load_plan_file(const Case& of, std::string& fault) {
  io::PlanResult loaded = io::load_plan(of.scene, 0.0, {}, of.settings);
  fault = first_error(loaded.faults);
  return std::move(loaded.plan);
}

std::optional<Plan> CaseRunner::make_plan_of_scene(const Case& of, std::string& fault) {
  io::SceneResult read = io::read_scene(of.scene, of.settings);
  std::optional<Plan> plan;
  if (read.scene) {
    // `fidelity: auto` chooses the rung with the verdict
    const bool has_verdict = need_verdict(campaign_.measures) || read.scene->automatic.has_value();
    if (!has_verdict) read.scene->verdict.is_off = true;
    if (structure_) {
      // what build_structure would check
      check_physics(*read.scene, read.faults);
      if (!has_error(read.faults))
        check_modes(*read.scene, static_cast<int>(structure_->omega.size()), read.faults);
    } else {
      structure_ = build_structure(*read.scene, read.faults);
    }
    if (structure_ && !has_error(read.faults)) plan = make_plan(*read.scene, *structure_, read.faults);
  }
  if (!plan) fault = first_error(read.faults);
  return plan;
}

void CaseRunner::check_files(const std::string& fault) const {
  if (io::is_plan_file(campaign_.scene)) return;
  std::vector<std::string> nominal;
  for (const Variable& variable : campaign_.variables) nominal.push_back(variable.nominal);
  if (!io::read_scene(campaign_.scene, make_case(campaign_, 0, nominal).settings).scene)
    throw std::runtime_error("'" + campaign_.scene + "' can no longer be read: " + fault);
}

CaseResult CaseRunner::run(std::int64_t number, Commander& commander) {
  return run(case_of(number), commander);
}

CaseResult CaseRunner::run(const Case& given, Commander& commander, CaseObserver* observer) {
  CaseResult result;
  result.number = given.number;
  result.values = given.values;
  const auto start = std::chrono::steady_clock::now();
  const std::shared_ptr<const CasePlan> plan = plan_of(given, result.message);
  if (plan == nullptr) {
    check_files(result.message);
    result.outcome = Outcome::kRefused;
    result.setup_seconds = seconds_since(start);
    return result;
  }
  const Watch watch = need_verdict(campaign_.measures) ? Watch::kVerdict : Watch::kMotionAlone;
  result.message = commander.begin(plan, given, watch);
  result.setup_seconds = seconds_since(start);
  if (result.message.empty())
    step_to_end(commander, observer, result);
  else
    result.outcome = Outcome::kController;
  result.run_seconds = seconds_since(start) - result.setup_seconds;
  commander.end();
  return result;
}

void CaseRunner::step_to_end(Commander& commander, CaseObserver* observer, CaseResult& result) const {
  Motion& motion = commander.motion();
  const Plan& plan = motion.plan();
  const auto last = static_cast<std::int64_t>(std::llround(campaign_.until / plan.period));
  Measuring measuring(plan, campaign_.measures, last);
  if (!measuring.error().empty()) {
    result.outcome = Outcome::kRefused;
    result.message = measuring.error();
    return;
  }
  std::vector<ForceCommand> commands;
  measuring.take(motion);
  if (observer != nullptr) observer->begin(plan);
  while (motion.tick() < last) {
    commands.clear();
    result.message = commander.take(commands);
    if (!result.message.empty()) {
      result.outcome = Outcome::kController;
      break;
    }
    const StepReport& report = motion.advance(commands);
    if (report.status != StepStatus::kOk) {
      result.outcome = Outcome::kUnstable;
      result.message = report.status == StepStatus::kNotFinite
                           ? "the state after tick " + std::to_string(motion.tick()) + " is not finite"
                           : lost_shape_text(plan, report, motion.tick());
      break;
    }
    if (observer != nullptr) observer->stepped(motion.tick() - 1, report, commands);
    measuring.take(motion);
  }
  if (observer != nullptr) observer->end(motion.state());
  result.ticks = motion.tick();
  if (result.outcome != Outcome::kPassed) return;
  result.measures = measuring.results();
  result.message = find_failure(campaign_.measures, result.measures);
  if (!result.message.empty()) result.outcome = Outcome::kFailed;
}

std::string table_header(const Campaign& campaign) {
  std::string header = "case,outcome";
  for (const Variable& variable : campaign.variables) header += "," + csv_field(variable.name);
  for (const Measure& measure : campaign.measures) header += "," + csv_field(measure.name);
  return header + ",message";
}

std::string table_row(const Campaign& campaign, const CaseResult& result) {
  std::string row = std::to_string(result.number) + "," + kOutcomes[static_cast<std::size_t>(result.outcome)];
  for (const std::string& value : result.values) row += "," + csv_field(value);
  for (std::size_t k = 0; k < campaign.measures.size(); ++k)
    row += "," + (result.measures.empty() ? std::string() : number_text(result.measures[k]));
  return row + "," + csv_field(result.message);
}

}  // namespace freeflex::campaign
