// The section of a report on the reliability of the error estimate.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>

#include "tools/terminal/json.hpp"
#include "tools/verification/report/report.hpp"

namespace freeflex::tools {
namespace {

constexpr std::array kVerdictNames{"good", "watch", "outside"};

Json json_of(const ErrorSize& error) { return {{"attitude", error.attitude}, {"elastic", error.elastic}}; }

Json json_of(const EstimateSummary& sum) {
  return {
      {"scenes", sum.num_scenes},
      {"failed", sum.num_failed},
      {"within_factor_1_3", {{"attitude", sum.close_attitude}, {"elastic", sum.close_elastic}}},
      {"within_factor_1_3_lower_bound", {{"attitude", sum.lower_attitude}, {"elastic", sum.lower_elastic}}},
      {"within_factor_3", {{"attitude", sum.near_attitude}, {"elastic", sum.near_elastic}}},
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
                   {"validity", kVerdictNames[static_cast<std::size_t>(row.verdict.level)]},
                   {"cause", row.cause},
                   {"lost", row.is_lost},
                   {"tolerance", row.tolerance},
                   {"chosen", row.chosen},
                   {"cheapest", row.cheapest},
                   {"chosen_error", row.chosen_error},
                   {"error", row.error}});
  return all;
}

constexpr int kMiddleBin = 6;  // first bin in which the estimate exceeds the true error

std::string range_of(int bin) {
  if (bin == 0) return "below 0.10";
  if (bin == kNumBins - 1) return "above 10";
  const auto edge = [](int k) { return std::pow(10.0, k / 5.0 - 1.0); };
  return format_text("%.2f to %.2f", edge(bin - 1), edge(bin));
}

void print_histogram(const char* name, const std::vector<int>& bins) {
  std::printf("%s\n", name);
  const int most = std::max(1, *std::max_element(bins.begin(), bins.end()));
  for (int k = 0; k < kNumBins; ++k) {
    const int count = bins[index(k)];
    std::printf("  %14s %4d %s\n", range_of(k).c_str(), count,
                std::string(index(50 * count / most), '#').c_str());
  }
}

/// Draws one histogram at x [px], 500 px wide.
std::string panel(const char* title, const std::vector<int>& bins, int x) {
  constexpr int kBase = 190, kHeight = 130, kBar = 38;
  const int most = std::max(1, *std::max_element(bins.begin(), bins.end()));
  std::string text = format_text(
      "<g transform=\"translate(%d,0)\"><text x=\"0\" y=\"20\" font-weight=\"600\">%s</text>\n", x, title);
  for (int k = 0; k < kNumBins; ++k) {
    const int count = bins[index(k)], height = kHeight * count / most, left = kBar * k;
    text += format_text(
        "<rect x=\"%d\" y=\"%d\" width=\"%d\" height=\"%d\" fill=\"%s\"/><text x=\"%d\" y=\"%d\" "
        "text-anchor=\"middle\">%d</text>\n",
        left + 1, kBase - height, kBar - 2, height, k < kMiddleBin ? "#c0392b" : "var(--mark)",
        left + kBar / 2, kBase - height - 4, count);
  }
  constexpr std::array kEdges{"0.1", "0.16", "0.25", "0.4", "0.63", "1", "1.6", "2.5", "4", "6.3", "10"};
  for (std::size_t k = 0; k < kEdges.size(); ++k)
    text += format_text("<text x=\"%d\" y=\"%d\" text-anchor=\"middle\">%s</text>\n",
                        kBar * (static_cast<int>(k) + 1), kBase + 16, kEdges[k]);
  return text + format_text("<text x=\"%d\" y=\"%d\" text-anchor=\"middle\">estimate over truth</text></g>\n",
                            kBar * kNumBins / 2, kBase + 34);
}

}  // namespace

void print_estimates(const Report& report) {
  const std::vector<EstimateRow>& rows = report.estimates;
  const EstimateSummary sum = summarize(rows);
  std::printf("%d random scenes of seed %llu, 1 s at 1 kHz, separated rung against the full system",
              sum.num_scenes, static_cast<unsigned long long>(report.seed));
  if (sum.num_failed > 0) std::printf(" (%d more without a result)", sum.num_failed);
  std::printf("\n\n%-34s %9s %9s\n", "", "attitude", "elastic");
  const auto line = [](const char* name, double attitude, double elastic) {
    std::printf("%-34s %8.1f%% %8.1f%%\n", name, 100.0 * attitude, 100.0 * elastic);
  };
  line("estimate within a factor of 1.3", sum.close_attitude, sum.close_elastic);
  line("  95 % lower confidence bound", sum.lower_attitude, sum.lower_elastic);
  line("estimate within a factor of 3", sum.near_attitude, sum.near_elastic);
  std::printf("\ngood %.1f%%, watch %.1f%%, outside %.1f%%\n", 100.0 * sum.good, 100.0 * sum.watch,
              100.0 * sum.outside);
  std::printf("fidelity: auto meets its tolerance in %.1f%%, with the cheapest such rung in %.1f%%\n\n",
              100.0 * sum.auto_meets, 100.0 * sum.auto_cheapest);
  print_histogram("estimate over truth, elastic error", histogram(rows, &ErrorSize::elastic));
  print_histogram("estimate over truth, attitude", histogram(rows, &ErrorSize::attitude));
}

Json estimates_to_json(const Report& report) {
  const std::vector<EstimateRow>& rows = report.estimates;
  return {{"seed", report.seed},
          {"summary", json_of(summarize(rows))},
          {"histogram_elastic", histogram(rows, &ErrorSize::elastic)},
          {"histogram_attitude", histogram(rows, &ErrorSize::attitude)},
          {"scenes", json_of(rows)}};
}

std::string estimates_to_csv(const Report& report) {
  std::string text =
      "scene,shape,stiffness [N/m],spin [rad/s],force [N],true attitude [rad],estimated attitude [rad],true "
      "elastic [-],estimated elastic [-],validity,tolerance [-],chosen,cheapest,error of chosen [-]\n";
  for (const EstimateRow& row : report.estimates)
    text += format_text("%d,%s,%.6g,%.6g,%.6g,%.6g,%.6g,%.6g,%.6g,%s,%.6g,%s,%s,%.6g\n", row.number,
                        row.shape.c_str(), row.stiffness, row.spin, row.force, row.truth.attitude,
                        row.estimate.attitude, row.truth.elastic, row.estimate.elastic,
                        kVerdictNames[static_cast<std::size_t>(row.verdict.level)], row.tolerance,
                        row.chosen.c_str(), row.cheapest.c_str(), row.chosen_error);
  return text;
}

std::string estimates_section(const Report& report) {
  const std::vector<EstimateRow>& rows = report.estimates;
  const EstimateSummary sum = summarize(rows);
  std::string text = "<h2>Reliability of the error estimate</h2>\n<p>";
  text += format_text(
      "%d random scenes of seed %llu: shape, stiffness from 1e3 to 1e9 N/m, spin up to 5 rad/s, pulses of "
      "0.1 to 1000 N. Each runs for 1 s at 1 kHz on the separated rung; the estimate of the verdict is "
      "compared with the true error relative to the full system. The estimate is within a factor of 1.3 of "
      "the true error for %.1f %% of the scenes in attitude (95 %% lower confidence bound %.1f %%) and for "
      "%.1f %% in elastic error (bound %.1f %%), and within a factor of 3 for %.1f %% in attitude and for "
      "%.1f %% in elastic error. The verdict is good for %.1f %%, watch for %.1f %% and "
      "outside for %.1f %%. <code>fidelity: auto</code> meets the tolerance for %.1f %% and chooses the "
      "cheapest rung that meets it for %.1f %%.</p>\n",
      sum.num_scenes, static_cast<unsigned long long>(report.seed), 100.0 * sum.close_attitude,
      100.0 * sum.lower_attitude, 100.0 * sum.close_elastic, 100.0 * sum.lower_elastic,
      100.0 * sum.near_attitude, 100.0 * sum.near_elastic, 100.0 * sum.good, 100.0 * sum.watch,
      100.0 * sum.outside, 100.0 * sum.auto_meets, 100.0 * sum.auto_cheapest);
  text += "<svg viewBox=\"0 0 1000 232\" font-size=\"12\" fill=\"currentColor\" role=\"img\">\n" +
          panel("elastic error", histogram(rows, &ErrorSize::elastic), 10) +
          panel("attitude", histogram(rows, &ErrorSize::attitude), 520) + "</svg>\n";
  return text +
         "<p>Red: scenes whose true error exceeds the estimate. Not compared: scenes whose shadow diverged, "
         "which are counted as outside, and true errors below 1e-9 rad or 1e-6 of the displacement.</p>\n";
}

}  // namespace freeflex::tools
