#include "tools/verification/stability/stability.hpp"

#include <algorithm>
#include <cstdio>

#include "tools/terminal/json.hpp"
#include "tools/verification/report/measure.hpp"
#include "tools/verification/stability/ride.hpp"

namespace freeflex::tools {
namespace {

std::string number(double value) { return std::isfinite(value) ? format_text("%.1e", value) : "-"; }

std::string csv_text(const std::string& text) {
  std::string quoted = "\"";
  for (const char c : text) quoted += c == '"' ? std::string("\"\"") : std::string(1, c);
  return quoted + "\"";
}

std::string csv_number(double value) { return std::isfinite(value) ? format_text("%.6g", value) : ""; }

/// Prints a text after the columns of a line, or on new lines if the text does not fit.
void print_remark(const std::string& text, std::size_t column) {
  constexpr std::size_t kIndent = 13;
  if (column + text.size() <= kLineWidth)
    std::printf("%s%s\n", text.empty() ? "" : "  ", text.c_str());
  else
    std::printf("\n%*s%s\n", static_cast<int>(kIndent), "", wrapped(text, kIndent).c_str());
}

}  // namespace

void print_row(const StabilityRow& row) {
  const auto& [what, outcome, cpu] = row;
  if (what.must_refuse) {
    std::printf("  %-8s %-58s", row.verdict(), what.name.c_str());
    print_remark(outcome.message, 71);
    return;
  }
  std::printf("  %-8s %-58s %8s %8s", row.verdict(), what.name.c_str(), number(outcome.measured).c_str(),
              number(what.limit).c_str());
  print_remark(outcome.message, 89);
  for (const PeerFigure& peer : outcome.peers) {
    std::printf("  %-8s   %-56s %8s         ", "", peer.method.c_str(), number(peer.figure).c_str());
    print_remark(peer.failure, 89);
  }
}

std::vector<StabilityCase> stability_cases() {
  std::vector<StabilityCase> cases;
  for (const auto add : {add_frequency_cases, add_oscillator_cases, add_small_cases, add_motion_cases,
                         add_tick_cases, add_rung_cases, add_refusal_cases})
    add(cases);
  return cases;
}

const char* StabilityRow::verdict() const {
  if (!holds()) return "FAILS";
  return what.must_refuse ? "reported" : "holds";
}

bool StabilityReport::holds() const {
  return !is_interrupted &&
         std::all_of(rows.begin(), rows.end(), [](const StabilityRow& row) { return row.holds(); });
}

StabilityReport check_stability(const StabilityOptions& options,
                                const std::function<void(double)>& report_progress) {
  StabilityReport report;
  report.machine = this_machine();
  const std::vector<StabilityCase> cases = stability_cases();
  report.num_cases = cases.size();
  for (std::size_t k = 0; k < cases.size(); ++k) {
    const double start = thread_cpu();
    StabilityRow row{cases[k], cases[k].run(options), 0.0};
    row.cpu = thread_cpu() - start;
    if (options.is_stopped()) {
      report.is_interrupted = true;
      break;
    }
    report.rows.push_back(std::move(row));
    report_progress(static_cast<double>(k + 1) / static_cast<double>(cases.size()));
  }
  return report;
}

void print_text(const StabilityReport& report) {
  const Machine& machine = report.machine;
  const std::string where =
      format_text("%s, %d cores; %s; commit %s; %s", machine.processor.c_str(), machine.cores,
                  machine.compiler.c_str(), machine.commit.c_str(), machine.date.c_str());
  std::printf("%s\n", wrapped(where, 0).c_str());
  std::string group, quantity;
  for (const StabilityRow& row : report.rows) {
    if (row.what.group != group) std::printf("\n%s\n", row.what.group.c_str());
    if (!row.what.must_refuse && (row.what.group != group || row.what.quantity != quantity))
      std::printf("  %-8s %-58s %8s %8s\n", "", row.what.quantity.c_str(), "measured", "at most");
    group = row.what.group;
    quantity = row.what.quantity;
    print_row(row);
  }
  const auto failed = std::count_if(report.rows.begin(), report.rows.end(),
                                    [](const StabilityRow& row) { return !row.holds(); });
  std::printf("\n%zu cases, %d of them fail\n", report.rows.size(), static_cast<int>(failed));
  if (report.is_interrupted)
    std::printf("interrupted: %zu of %zu cases did not run\n", report.num_cases - report.rows.size(),
                report.num_cases);
}

Json to_json(const StabilityReport& report) {
  const Machine& machine = report.machine;
  Json json;
  json["machine"] = {{"processor", machine.processor}, {"cores", machine.cores}, {"system", machine.system},
                     {"compiler", machine.compiler},   {"flags", machine.flags}, {"version", machine.version},
                     {"commit", machine.commit},       {"date", machine.date}};
  json["complete"] = !report.is_interrupted;
  json["holds"] = report.holds();
  json["cases"] = Json::array();
  for (const auto& row : report.rows) {
    Json& each = json["cases"].emplace_back();
    each["group"] = row.what.group;
    each["case"] = row.what.name;
    each["quantity"] = row.what.quantity;
    each["verdict"] = row.verdict();
    each["measured"] = row.outcome.measured;
    each["limit"] = row.what.limit;
    each["message"] = row.outcome.message;
    each["cpu"] = row.cpu;
    each["peers"] = Json::array();
    for (const PeerFigure& peer : row.outcome.peers)
      each["peers"].push_back(
          {{"method", peer.method}, {"measured", peer.figure}, {"failure", peer.failure}});
  }
  return json;
}

std::string to_csv(const StabilityReport& report) {
  std::string text = "group,case,quantity,method,verdict,measured,limit,message\n";
  for (const auto& row : report.rows) {
    const std::string front =
        csv_text(row.what.group) + "," + csv_text(row.what.name) + "," + csv_text(row.what.quantity);
    text += front + ",freeflex," + row.verdict() + "," + csv_number(row.outcome.measured) + "," +
            csv_number(row.what.limit) + "," + csv_text(row.outcome.message) + "\n";
    for (const PeerFigure& peer : row.outcome.peers)
      text += front + "," + csv_text(peer.method) + ",," + csv_number(peer.figure) + ",," +
              csv_text(peer.failure) + "\n";
  }
  return text;
}

}  // namespace freeflex::tools
