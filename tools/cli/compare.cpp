// freeflex compare reports the differences of two motions.
#include "tools/bus/compare.hpp"

#include <CLI/App.hpp>
#include <algorithm>
#include <array>
#include <cinttypes>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "tools/cli/commands.hpp"
#include "tools/plot/chart.hpp"
#include "tools/terminal/console.hpp"
#include "tools/terminal/json.hpp"
#include "tools/terminal/usage.hpp"

namespace freeflex::tools {
namespace {

using Result = CompareOutcome::Result;

struct CompareOptions {
  CompareRequest request;
  std::string plot;  // picture file, empty for no picture
  bool json = false;
};

constexpr const char* kCompareFooter = R"(Example:
  freeflex run boom.yaml --until 3 --out a.log
  freeflex compare a.log b.csv --tolerance 1e-6 --plot difference.svg
Rows of one tick are compared, columns by their names; q and -q are the same attitude. Differences are relative to the
largest value of the quantity in either file; a column that freeflex does not name is a quantity of its own.
The picture shows, for the six quantities that differ most, the column with the largest difference in both files, and
below it the difference, with the tolerance as broken lines.
If a file is damaged, its intact part is compared, and the error describes the damage.
JSON fields:
  a, b, tolerance, rows
  result       same, differs, incomplete, nothing, interrupted or error
  first        the earliest difference beyond the tolerance: tick, column, a, b
  quantities   for each: name with unit, values, scale (largest value), largest (difference, null where a value is
               no number), tick, column, beyond (the tolerance)
  not_compared contents of only one file, as texts
  other_content
               contents that do not belong to a motion, as texts
  error        a text, if any
Exit codes: 0 the same within the tolerance, 1 differs, 2 wrong arguments or no file that holds a motion, 3 a file is
damaged, or only one of them holds a tick or a column, 130 interrupted.)";

struct ResultName {
  const char* name;  // in JSON
  int exit_code;
};
/// Names and exit codes, in the order of CompareOutcome::Result.
constexpr std::array<ResultName, 6> kResults{{{"same", kExitOk},
                                              {"differs", kExitDiffers},
                                              {"incomplete", kExitIncomplete},
                                              {"nothing", kExitIncomplete},
                                              {"interrupted", kExitInterrupted},
                                              {"error", kExitUsage}}};

Json json_of(const ValuePair& pair) {
  return {{"tick", pair.tick}, {"column", pair.column}, {"a", pair.a}, {"b", pair.b}};
}

void report_json(const CompareOptions& options, const CompareOutcome& outcome) {
  Json out{{"a", options.request.a},
           {"b", options.request.b},
           {"tolerance", options.request.tolerance},
           {"result", kResults[static_cast<std::size_t>(outcome.result)].name},
           {"rows", outcome.num_rows},
           {"first", outcome.first ? json_of(*outcome.first) : Json()},
           {"quantities", Json::array()},
           {"not_compared", outcome.not_compared},
           {"other_content", outcome.other_content}};
  for (const QuantityDifference& each : outcome.quantities)
    out["quantities"].push_back({{"name", each.name},
                                 {"values", each.num_values},
                                 {"scale", each.scale},
                                 {"largest", std::isfinite(each.largest) ? Json(each.largest) : Json()},
                                 {"tick", each.largest > 0.0 ? Json(each.at.tick) : Json()},
                                 {"column", each.largest > 0.0 ? Json(each.at.column) : Json()},
                                 {"beyond", each.is_beyond}});
  if (!outcome.error.empty()) out["error"] = outcome.error;
  print_json(out);
}

void print_quantities(const CompareOutcome& outcome) {
  std::printf("%-32s %12s %12s %12s %12s  %s\n", "quantity", "values", "largest", "difference", "of largest",
              "at tick, column");
  for (const QuantityDifference& each : outcome.quantities) {
    std::printf("%-32s %12" PRId64 " %12.4g %12.4g", each.name.c_str(), each.num_values, each.scale,
                each.largest);
    if (each.largest == 0.0) {
      std::printf(" %12s\n", "same");
      continue;
    }
    std::printf(" %12.4g  %" PRId64 ", %s%s\n", each.largest / each.scale, each.at.tick,
                printable(each.at.column).c_str(), each.is_beyond ? "  beyond" : "");
  }
}

/// Draws the curves of both files and their difference. Chooses the quantities with the largest relative
/// differences and, of each quantity, the column with the largest difference. Returns an empty text or the
/// error.
std::string plot(const CompareOptions& options, const CompareOutcome& outcome) {
  constexpr std::size_t kMostQuantities = 6;
  std::vector<const QuantityDifference*> shown;
  for (const QuantityDifference& each : outcome.quantities)
    if (each.num_values > 0 && !each.name.starts_with("time")) shown.push_back(&each);
  const auto share = [](const QuantityDifference& each) {
    return each.scale > 0.0 ? each.largest / each.scale : each.largest;
  };
  std::stable_sort(shown.begin(), shown.end(),
                   [&](const auto* a, const auto* b) { return share(*a) > share(*b); });
  if (shown.size() > kMostQuantities) shown.resize(kMostQuantities);
  std::vector<std::string> columns;
  columns.reserve(shown.size());
  for (const QuantityDifference* each : shown)
    columns.push_back(each->largest > 0.0 ? each->at.column : each->largest_column);
  std::vector<Samples> samples(shown.size(), Samples(3));
  trace_columns(options.request, columns, [&](std::int64_t tick, std::size_t column, double a, double b) {
    samples[column].take(static_cast<double>(tick), {a, b, b - a});
  });
  const auto file = [](const std::string& path) { return std::filesystem::path(path).filename().string(); };
  const std::string &a = options.request.a, &b = options.request.b;
  std::vector<Panel> panels;
  for (std::size_t k = 0; k < shown.size(); ++k) {
    const double tolerance = options.request.tolerance * shown[k]->scale;
    const std::vector<double> ticks = samples[k].time();
    panels.push_back({shown[k]->name + ", " + printable(columns[k]),
                      ticks,
                      {{"A: " + file(a), samples[k].column(0)}, {"B: " + file(b), samples[k].column(1)}}});
    const std::size_t unit = shown[k]->name.find(" [");
    panels.push_back(
        {"difference of " + printable(columns[k]) +
             (unit == std::string::npos ? "" : shown[k]->name.substr(unit)) +
             (tolerance > 0.0 ? format_text(", tolerance \u00b1%.3g", tolerance) : ", no tolerance"),
         ticks,
         {{"B - A", samples[k].column(2)}}});
    // a tolerance far above the difference would flatten the curve of the difference
    constexpr double kFar = 10.0;
    if (tolerance > 0.0 && tolerance < kFar * shown[k]->largest)
      panels.back().levels = {-tolerance, tolerance};
  }
  return plot_panels(options.plot, "A: " + a + "   B: " + b, "tick", panels);
}

int report(const CompareOptions& options, const CompareOutcome& outcome) {
  const int exit_code = kResults[static_cast<std::size_t>(outcome.result)].exit_code;
  if (options.json) return report_json(options, outcome), exit_code;
  if (outcome.num_rows > 0) print_quantities(outcome);
  for (const std::string& what : outcome.not_compared) std::printf("not compared: %s\n", what.c_str());
  for (const std::string& what : outcome.other_content)
    std::printf("not part of a motion: %s\n", what.c_str());
  if (!outcome.error.empty()) print_error(outcome.error);
  if (outcome.result != Result::kSame && outcome.result != Result::kDiffers) return exit_code;
  for (const QuantityDifference& each : outcome.quantities)
    if (each.name.starts_with("time") && each.is_beyond)
      std::printf(
          "note: equal ticks have different times, because the rates (--rate) or the starts of the runs "
          "differ\n");
  const std::string rows = counted(outcome.num_rows, "row");
  if (outcome.result == Result::kSame)
    std::printf("the same within %g of each quantity's largest value, %s compared%s\n",
                options.request.tolerance, rows.c_str(),
                outcome.not_compared.empty() ? "" : "; the rest was not compared (--common)");
  else
    std::printf("differs from tick %" PRId64 " on, where %s is %.17g and %.17g\n", outcome.first->tick,
                printable(outcome.first->column).c_str(), outcome.first->a, outcome.first->b);
  return exit_code;
}

int compare(const CompareOptions& options) {
  for (const std::string& read : {options.request.a, options.request.b})
    if (!options.plot.empty() && would_overwrite(read, options.plot)) return kExitUsage;
  const CompareOutcome outcome = compare_motions(options.request);
  const int exit_code = report(options, outcome);
  if (options.plot.empty() || outcome.num_rows == 0) return exit_code;
  const std::string error = plot(options, outcome);
  if (error.empty()) return exit_code;
  print_error(error);
  return exit_code == kExitOk ? kExitDiffers : exit_code;
}

}  // namespace

void add_compare(CLI::App& app, int& exit_code) {
  auto options = std::make_shared<CompareOptions>();
  CompareRequest& request = options->request;
  CLI::App* command = app.add_subcommand("compare", "differences of two recordings or tables");
  command->add_option("A", request.a, "LCM event log, or a table with the columns of freeflex run")
      ->required();
  command->add_option("B", request.b, "the other")->required();
  command
      ->add_option("--tolerance", request.tolerance,
                   "ignore differences up to this fraction of the quantity's largest value")
      ->check(not_negative())
      ->type_name("X")
      ->capture_default_str();
  for (const auto& [name, session] :
       {std::pair{"--session-a", &request.session_a}, {"--session-b", &request.session_b}})
    command->add_option(name, *session, "session of that recording, if it contains several")
        ->check(whole_number(0, kMost<std::int64_t>))
        ->type_name("N");
  command->add_option("--prefix", request.prefix, "first part of the channel names")
      ->check(channel_prefix())
      ->type_name("NAME")
      ->capture_default_str();
  command
      ->add_option("--plot", options->plot, std::string("both and their difference over time: ") + kPictures)
      ->check([](const std::string& path) {
        return is_picture(path) ? std::string() : "the value is '" + path + "', but must be " + kPictures;
      })
      ->type_name("FILE");
  command->add_flag("--common", request.is_common_enough,
                    "accept files in which only some ticks and columns can be compared");
  command->add_flag("--json", options->json, "one JSON object on standard output");
  command->footer(kCompareFooter);
  command->callback([options, &exit_code] { exit_code = compare(*options); });
}

}  // namespace freeflex::tools
