// freeflex compare: two motions beside each other, in words.
#include "tools/bus/compare.hpp"

#include <CLI/App.hpp>
#include <array>
#include <cinttypes>
#include <cmath>
#include <cstdio>
#include <memory>
#include <string>

#include "tools/cli/commands.hpp"
#include "tools/terminal/console.hpp"
#include "tools/terminal/json.hpp"
#include "tools/terminal/usage.hpp"

namespace freeflex::tools {
namespace {

using Result = CompareOutcome::Result;

struct CompareOptions {
  CompareRequest request;
  bool json = false;
};

constexpr const char* kCompareFooter = R"(Example:
  freeflex run boom.yaml --until 3 --out a.log
  freeflex compare a.log b.csv --tolerance 1e-6
Rows of one tick are compared, columns by their names; q and -q are one attitude. What differs is judged by the
largest value of its quantity in either file; a column that freeflex does not name is a quantity of its own.
JSON fields:
  a, b, tolerance, rows
  result       same, differs, incomplete, nothing, interrupted or error
  first        the earliest difference beyond the tolerance: tick, column, a, b
  quantities   of each: name with unit, values, scale (largest value), largest (difference, null where one is no
               number), tick, column, beyond
  not_compared what only one of them holds, in words
  beside       what they hold that is no motion, in words
  error        in words, where there is one
Exit codes: 0 the same within the tolerance, 1 differs, 2 wrong arguments or no file that holds a motion, 3 a file is
damaged, or only one of them holds a tick or a column, 130 interrupted.)";

struct ResultWord {
  const char* name;  // in JSON
  int exit_code;
};
/// In the order of CompareOutcome::Result.
constexpr std::array<ResultWord, 6> kResults{{{"same", kExitOk},
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
           {"beside", outcome.beside}};
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

int report(const CompareOptions& options, const CompareOutcome& outcome) {
  const int exit_code = kResults[static_cast<std::size_t>(outcome.result)].exit_code;
  if (options.json) return report_json(options, outcome), exit_code;
  if (outcome.num_rows > 0) print_quantities(outcome);
  for (const std::string& what : outcome.not_compared) std::printf("not compared: %s\n", what.c_str());
  for (const std::string& what : outcome.beside) std::printf("no motion: %s\n", what.c_str());
  if (!outcome.error.empty()) print_error(outcome.error);
  if (outcome.result != Result::kSame && outcome.result != Result::kDiffers) return exit_code;
  for (const QuantityDifference& each : outcome.quantities)
    if (each.name.starts_with("time") && each.is_beyond)
      std::printf(
          "note: one tick is not one time in both: they ran at other rates (--rate), or began apart\n");
  const std::string rows = counted(outcome.num_rows, "row");
  if (outcome.result == Result::kSame)
    std::printf("the same within %g of each quantity's largest value, %s compared%s\n",
                options.request.tolerance, rows.c_str(),
                outcome.not_compared.empty() ? "" : "; the rest was not, as --common says");
  else
    std::printf("differs from tick %" PRId64 " on: %s: %.17g, %.17g\n", outcome.first->tick,
                printable(outcome.first->column).c_str(), outcome.first->a, outcome.first->b);
  return exit_code;
}

}  // namespace

void add_compare(CLI::App& app, int& exit_code) {
  auto options = std::make_shared<CompareOptions>();
  CompareRequest& request = options->request;
  CLI::App* command =
      app.add_subcommand("compare", "two recordings or tables, how far one is from the other");
  command->add_option("A", request.a, "LCM event log, or a table with the columns of freeflex run")
      ->required();
  command->add_option("B", request.b, "the other")->required();
  command
      ->add_option("--tolerance", request.tolerance,
                   "share of the largest value of a quantity that is no difference")
      ->check(not_negative())
      ->type_name("X")
      ->capture_default_str();
  for (const auto& [name, session] :
       {std::pair{"--session-a", &request.session_a}, {"--session-b", &request.session_b}})
    command->add_option(name, *session, "session of that recording when it holds several")
        ->check(whole_number(0, kMost<std::int64_t>))
        ->type_name("N");
  command->add_option("--prefix", request.prefix, "first part of the channel names")
      ->check(channel_prefix())
      ->type_name("NAME")
      ->capture_default_str();
  command->add_flag("--common", request.is_common_enough, "ticks and columns that both hold are enough");
  command->add_flag("--json", options->json, "one JSON object on standard output");
  command->footer(kCompareFooter);
  command->callback(
      [options, &exit_code] { exit_code = report(*options, compare_motions(options->request)); });
}

}  // namespace freeflex::tools
