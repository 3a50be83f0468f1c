// freeflex report --estimates: how honest the error estimate is.
#include <cstdio>
#include <fstream>

#include "tools/commands.hpp"
#include "tools/estimates.hpp"
#include "tools/report.hpp"
#include "tools/usage.hpp"

namespace freeflex::tools {
namespace {

constexpr std::array kWords{"good", "watch", "outside"};

Json json_of(const ErrorSize& error) {
  return {{"position", error.position}, {"elastic", error.elastic}};
}

Json json_of(const EstimateSummary& sum) {
  return {{"scenes", sum.num_scenes},
          {"failed", sum.num_failed},
          {"inside", {{"position", sum.inside_position}, {"elastic", sum.inside_elastic}}},
          {"inside_lower_bound", {{"position", sum.lower_position}, {"elastic", sum.lower_elastic}}},
          {"within_factor_3", {{"position", sum.close_position}, {"elastic", sum.close_elastic}}},
          {"good", sum.good},
          {"watch", sum.watch},
          {"outside", sum.outside},
          {"auto_meets", sum.auto_meets},
          {"auto_cheapest", sum.auto_cheapest}};
}

Json json_of(const std::vector<EstimateRow>& rows) {
  Json all = Json::array();
  for (const EstimateRow& row : rows)
    all.push_back({{"scene", row.number},
                   {"shape", row.shape},
                   {"stiffness", row.stiffness},
                   {"spin", row.spin},
                   {"force", row.force},
                   {"truth", json_of(row.truth)},
                   {"estimate", json_of(row.estimate)},
                   {"validity", kWords[static_cast<std::size_t>(row.verdict.word)]},
                   {"cause", row.verdict.cause},
                   {"lost", row.is_lost},
                   {"tolerance", row.tolerance},
                   {"chosen", row.chosen},
                   {"cheapest", row.cheapest},
                   {"chosen_error", row.chosen_error},
                   {"error", row.error}});
  return all;
}

void print_histogram(const char* name, const std::vector<int>& bins) {
  std::printf("%s\n", name);
  int most = 1;
  for (const int bin : bins) most = std::max(most, bin);
  for (int k = 0; k < kNumBins; ++k) {
    const double low = std::pow(10.0, (k - 1) / 5.0 - 1.0), high = std::pow(10.0, k / 5.0 - 1.0);
    const int count = bins[static_cast<std::size_t>(k)];
    std::string range = format_text("%5.2f to %5.2f", low, high);
    if (k == 0) range = "  below 0.10  ";
    if (k == kNumBins - 1) range = "   above 10   ";
    std::printf("  %-14s %4d %s\n", range.c_str(), count, std::string(static_cast<std::size_t>(50 * count / most), '#').c_str());
  }
}

void print_text(const std::vector<EstimateRow>& rows, std::uint64_t seed) {
  const EstimateSummary sum = summarize(rows);
  std::printf("%d random scenes of seed %llu, 1 s at 1 kHz, separated rung against the full system", sum.num_scenes,
              static_cast<unsigned long long>(seed));
  if (sum.num_failed > 0) std::printf(" (%d more without an answer)", sum.num_failed);
  std::printf("\n\n%-34s %9s %9s\n", "", "position", "elastic");
  std::printf("%-34s %8.1f%% %8.1f%%\n", "truth inside the estimate", 100.0 * sum.inside_position, 100.0 * sum.inside_elastic);
  std::printf("%-34s %8.1f%% %8.1f%%\n", "  95 % lower confidence bound", 100.0 * sum.lower_position, 100.0 * sum.lower_elastic);
  std::printf("%-34s %8.1f%% %8.1f%%\n\n", "estimate within a factor of 3", 100.0 * sum.close_position, 100.0 * sum.close_elastic);
  std::printf("good %.1f%%, watch %.1f%%, outside %.1f%%\n", 100.0 * sum.good, 100.0 * sum.watch, 100.0 * sum.outside);
  std::printf("fidelity: auto meets its tolerance in %.1f%%, with the cheapest rung that does in %.1f%%\n\n",
              100.0 * sum.auto_meets, 100.0 * sum.auto_cheapest);
  print_histogram("estimate over truth, elastic error", histogram(rows, &ErrorSize::elastic));
  print_histogram("estimate over truth, position", histogram(rows, &ErrorSize::position));
}

}  // namespace

int report_estimates(const EstimateOptions& options) {
  bool is_whole = true;
  std::vector<EstimateRow> rows;
  {
    Progress progress("estimates");
    rows = study_estimates(options.seed, options.count, [&](double share) {
      progress.update(share);
      is_whole = !is_interrupted();
      return is_whole;
    });
  }
  const Json out{{"seed", options.seed},
                 {"summary", json_of(summarize(rows))},
                 {"histogram_elastic", histogram(rows, &ErrorSize::elastic)},
                 {"histogram_position", histogram(rows, &ErrorSize::position)},
                 {"scenes", json_of(rows)}};
  if (options.json)
    print_json(out);
  else
    print_text(rows, options.seed);
  return is_whole ? kExitOk : kExitInterrupted;
}

}  // namespace freeflex::tools
