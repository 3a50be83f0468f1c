#include "tools/campaign/summary.hpp"

#include <algorithm>
#include <boost/math/special_functions/beta.hpp>
#include <numeric>

#include "tools/terminal/console.hpp"

namespace freeflex::campaign {

Interval probability_interval(std::int64_t count, std::int64_t total, double confidence) {
  if (total <= 0) return {};
  const double tail = 0.5 * (1.0 - confidence), k = static_cast<double>(count),
               n = static_cast<double>(total);
  return {count == 0 ? 0.0 : boost::math::ibeta_inv(k, n - k + 1.0, tail),
          count == total ? 1.0 : boost::math::ibeta_inv(k + 1.0, n - k, 1.0 - tail)};
}

std::int64_t Summary::total() const { return std::accumulate(counts.begin(), counts.end(), std::int64_t{0}); }

Summary summarize(const Results& results) {
  Summary summary;
  for (const auto& [number, stored] : results.rows) {
    const auto outcome = std::find(kAllOutcomes.begin(), kAllOutcomes.end(), outcome_of(stored.row));
    if (outcome != kAllOutcomes.end())
      ++summary.counts[static_cast<std::size_t>(outcome - kAllOutcomes.begin())];
    summary.setup_seconds += stored.setup_seconds;
    summary.run_seconds += stored.run_seconds;
  }
  return summary;
}

std::string summary_text(const Summary& summary) {
  std::string text = tools::counted(summary.total(), "case") + ":";
  for (std::size_t k = 0; k < kAllOutcomes.size(); ++k)
    if (summary.counts[k] > 0 || k == 0)
      text += (k == 0 ? " " : ", ") + std::to_string(summary.counts[k]) + " " + kAllOutcomes[k];
  if (summary.num_judged() == 0) return text + "\n";
  const Interval interval = probability_interval(summary.num_failed(), summary.num_judged(), 0.95);
  const double share = static_cast<double>(summary.num_failed()) / static_cast<double>(summary.num_judged());
  return text +
         tools::format_text("\nprobability of failure %.3g %% (%.3g to %.3g %% with a confidence of 95 %%)\n",
                            100.0 * share, 100.0 * interval.low, 100.0 * interval.high);
}

std::vector<std::string> fields_of(std::string_view row) {
  std::vector<std::string> fields(1);
  bool is_quoted = false;
  for (std::size_t i = 0; i < row.size(); ++i) {
    if (is_quoted && row[i] == '"' && i + 1 < row.size() && row[i + 1] == '"')
      fields.back() += row[++i];
    else if (row[i] == '"')
      is_quoted = !is_quoted;
    else if (row[i] == ',' && !is_quoted)
      fields.emplace_back();
    else
      fields.back() += row[i];
  }
  return fields;
}

}  // namespace freeflex::campaign
