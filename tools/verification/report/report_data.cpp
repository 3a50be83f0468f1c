// The report as JSON and as CSV.
#include <cmath>

#include "tools/terminal/json.hpp"
#include "tools/verification/report/report.hpp"

namespace freeflex::tools {
namespace {

Json optional(const std::optional<double>& value) {
  return value && std::isfinite(*value) ? Json(*value) : Json(nullptr);
}

Json to_json(const Study& study, const Run& run) {
  Json json;
  json["family"] = name_of(run.family);
  json["method"] = run.method;
  json["step"] = run.step > 0.0 ? Json(run.step) : Json(nullptr);
  json["free_step"] = run.free_step > 0.0 ? Json(run.free_step) : Json(nullptr);
  json["tolerance"] = run.tolerance > 0.0 ? Json(run.tolerance) : Json(nullptr);
  if (!run.failure.empty()) {
    json["failure"] = run.failure;
    return json;
  }
  json["elastic_error"] = optional(run.elastic_error);
  json["integration_error"] = optional(run.integration_error);
  json["model_error"] = optional(run.model_error);
  json["position_error"] = optional(run.position_error);
  json["attitude_error"] = optional(run.attitude_error);
  json["frequency_error"] = optional(run.frequency_error);
  json["energy_drift"] = optional(run.energy_drift);
  json["cpu_once"] = optional(run.cpu[0]);
  json["cpu_10ms"] = optional(run.cpu[1]);
  json["cpu_1ms"] = optional(run.cpu[2]);
  json["steps"] = run.steps;
  json["evaluations"] = run.evaluations > 0 ? Json(run.evaluations) : Json(nullptr);
  json["ns_per_step"] = optional(ns_per_step(study, run));
  json["set_up"] = run.set_up;
  json["memory"] = run.memory;
  json["repeats"] = run.repeats;
  return json;
}

Json to_json(const Comparison::Other& other) {
  if (other.method.empty()) return nullptr;
  return {{"method", other.method}, {"cpu", other.cpu}, {"ratio", other.ratio}};
}

Json comparisons(const Study& study) {
  Json list = Json::array();
  for (const double level : kLevels)
    for (std::size_t load = 0; load < kReadOuts; ++load) {
      Json& json = list.emplace_back();
      json["level"] = level;
      json["read_out"] = kReadOutNames[load];
      const auto found = compare_at(study, level, static_cast<ReadOut>(load));
      if (!found) {
        json["rung"] = nullptr;
        continue;
      }
      const Run& ours = study.runs[found->ours];
      json["rung"] = ours.method;
      json["step"] = ours.step;
      json["free_step"] = ours.free_step > 0.0 ? Json(ours.free_step) : Json(nullptr);
      json["elastic_error"] = ours.elastic_error;
      json["model_error"] = ours.model_error;
      json["error_asked_of_others"] = found->error;
      json["cpu"] = found->cpu;
      json["best_other"] = to_json(found->best);
      json["hand_written"] = to_json(found->hand_written);
      json["packaged"] = to_json(found->packaged);
      json["linearised"] = to_json(found->linearised);
    }
  return list;
}

Json to_json(const Study& study) {
  Json json;
  json["scene"] = study.scene;
  json["file"] = study.file;
  json["points"] = study.points;
  json["links"] = study.links;
  json["elastic_freedoms"] = study.elastic_freedoms;
  json["lowest_frequency"] = study.lowest_frequency;
  json["top_frequency"] = study.top_frequency;
  json["spin"] = study.spin;
  json["end"] = study.end;
  json["reference"] = {{"method", study.reference},
                       {"accuracy", optional(study.reference_accuracy)},
                       {"cpu", study.reference_cpu}};
  json["evaluation_cpu"] = study.evaluation_cpu > 0.0 ? Json(study.evaluation_cpu) : Json(nullptr);
  json["complete"] = !study.is_interrupted;
  json["runs"] = Json::array();
  for (const Run& run : study.runs) json["runs"].push_back(to_json(study, run));
  json["left_out"] = Json::array();
  for (const LeftOut& item : study.left_out)
    json["left_out"].push_back({{"what", item.what}, {"why", item.why}});
  json["comparisons"] = comparisons(study);
  return json;
}

std::string csv_number(const std::optional<double>& value) {
  return value && std::isfinite(*value) ? format_text("%.6g", *value) : "";
}

/// Returns a text for CSV, quoted if necessary.
std::string csv_text(const std::string& text) {
  if (text.find_first_of(",\"\n") == std::string::npos) return text;
  std::string quoted = "\"";
  for (const char c : text) quoted += c == '"' ? std::string("\"\"") : std::string(1, c);
  return quoted + "\"";
}

}  // namespace

Json to_json(const Report& report) {
  const Machine& machine = report.machine;
  Json json;
  json["machine"] = {{"processor", machine.processor}, {"cores", machine.cores}, {"system", machine.system},
                     {"compiler", machine.compiler},   {"flags", machine.flags}, {"version", machine.version},
                     {"commit", machine.commit},       {"date", machine.date}};
  json["scenes"] = Json::array();
  for (const Study& study : report.studies) json["scenes"].push_back(to_json(study));
  json["complete"] = !report.is_interrupted;
  json["findings"] = findings(report);
  if (!report.estimates.empty()) json["estimates"] = estimates_to_json(report);
  if (!report.ticks.empty()) json["ticks"] = ticks_to_json(report);
  if (!report.omissions.empty()) json["omissions"] = omissions_to_json(report);
  return json;
}

std::string to_csv(const Report& report) {
  std::string text =
      "scene,family,method,step,free_step,tolerance,elastic_error,integration_error,model_error,position_"
      "error,"
      "attitude_error,"
      "frequency_error,energy_drift,cpu_once,cpu_10ms,cpu_1ms,steps,ns_per_step,set_up,memory,repeats,"
      "failure\n";
  for (const Study& study : report.studies)
    for (const Run& run : study.runs) {
      text += csv_text(study.scene) + "," + name_of(run.family) + "," + csv_text(run.method);
      const auto add = [&text](const std::optional<double>& value) { text += "," + csv_number(value); };
      add(run.step > 0.0 ? std::optional(run.step) : std::nullopt);
      add(run.free_step > 0.0 ? std::optional(run.free_step) : std::nullopt);
      add(run.tolerance > 0.0 ? std::optional(run.tolerance) : std::nullopt);
      const bool ok = run.failure.empty();
      for (const double error : {run.elastic_error, run.integration_error, run.model_error,
                                 run.position_error, run.attitude_error})
        add(ok ? std::optional(error) : std::nullopt);
      add(run.frequency_error);
      add(run.energy_drift);
      for (const auto& cpu : run.cpu) add(cpu);
      text += "," + std::to_string(run.steps) + "," + csv_number(ns_per_step(study, run));
      add(run.set_up);
      text += "," + std::to_string(run.memory) + "," + std::to_string(run.repeats) + "," +
              csv_text(run.failure) + "\n";
    }
  return text;
}

}  // namespace freeflex::tools
