#include "tools/campaign/columns.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "tools/campaign/summary.hpp"

namespace freeflex::campaign {
namespace {

constexpr double kNone = std::numeric_limits<double>::quiet_NaN();

double number_in(const std::string& text) {
  if (text.empty()) return kNone;
  char* end = nullptr;
  const double value = std::strtod(text.c_str(), &end);
  return end == text.c_str() + text.size() ? value : kNone;
}

/// Returns the mean ranks of values, so that equal values have equal ranks.
std::vector<double> ranks_of(const std::vector<double>& values) {
  std::vector<std::size_t> order(values.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) { return values[a] < values[b]; });
  std::vector<double> ranks(values.size());
  for (std::size_t first = 0, last = 0; first < order.size(); first = last) {
    while (last < order.size() && values[order[last]] == values[order[first]]) ++last;
    for (std::size_t k = first; k < last; ++k) ranks[order[k]] = 0.5 * static_cast<double>(first + last - 1);
  }
  return ranks;
}

double correlation_of(const std::vector<double>& a, const std::vector<double>& b) {
  const double n = static_cast<double>(a.size());
  const double mean_a = std::accumulate(a.begin(), a.end(), 0.0) / n,
               mean_b = std::accumulate(b.begin(), b.end(), 0.0) / n;
  double aa = 0.0, bb = 0.0, ab = 0.0;
  for (std::size_t k = 0; k < a.size(); ++k) {
    aa += (a[k] - mean_a) * (a[k] - mean_a);
    bb += (b[k] - mean_b) * (b[k] - mean_b);
    ab += (a[k] - mean_a) * (b[k] - mean_b);
  }
  return aa > 0.0 && bb > 0.0 ? ab / std::sqrt(aa * bb) : 0.0;
}

}  // namespace

bool is_numeric(const Choice& choice) {
  return std::none_of(choice.values.begin(), choice.values.end(),
                      [](const std::string& text) { return std::isnan(number_in(text)); });
}

Columns columns_of(const Campaign& campaign, const Results& results) {
  Columns columns;
  const auto texts_of = [&](std::size_t k) {
    const auto* const choice = std::get_if<Choice>(&campaign.sampling.variables[k]);
    return choice != nullptr && !is_numeric(*choice) ? choice : nullptr;
  };
  for (std::size_t k = 0; k < campaign.variables.size(); ++k)
    columns.variables.push_back(
        {campaign.variables[k].name + (texts_of(k) != nullptr ? " (place in its list)" : ""), {}});
  for (const Measure& measure : campaign.measures) columns.measures.push_back({measure.name, {}});
  const std::size_t num_variables = campaign.variables.size(), num_measures = campaign.measures.size();
  for (const auto& [number, stored] : results.rows) {
    std::vector<std::string> fields = fields_of(stored.row);
    fields.resize(num_variables + num_measures + 3);
    columns.cases.push_back(number);
    columns.outcomes.push_back(fields[1]);
    columns.messages.push_back(fields.back());
    columns.fails.push_back(fields[1] != "passed" && fields[1] != "refused");
    for (std::size_t k = 0; k < num_variables; ++k) {
      const std::string& text = fields[2 + k];
      double value = number_in(text);
      if (const Choice* const choice = texts_of(k))
        value = static_cast<double>(std::find(choice->values.begin(), choice->values.end(), text) -
                                    choice->values.begin() + 1);
      columns.variables[k].values.push_back(value);
    }
    for (std::size_t k = 0; k < num_measures; ++k)
      columns.measures[k].values.push_back(number_in(fields[2 + num_variables + k]));
  }
  return columns;
}

std::vector<double> sorted_values(const Column& column) {
  std::vector<double> sorted;
  std::copy_if(column.values.begin(), column.values.end(), std::back_inserter(sorted),
               [](double value) { return !std::isnan(value); });
  std::sort(sorted.begin(), sorted.end());
  return sorted;
}

double quantile_of(const std::vector<double>& sorted, double u) {
  if (sorted.empty()) return kNone;
  const double at = u * static_cast<double>(sorted.size() - 1);
  const auto below = static_cast<std::size_t>(at);
  const std::size_t above = std::min(below + 1, sorted.size() - 1);
  const double part = at - std::floor(at);
  if (part == 0.0 || sorted[below] == sorted[above]) return sorted[below];
  return sorted[below] + part * (sorted[above] - sorted[below]);
}

double rank_correlation(const Column& a, const Column& b) {
  std::vector<double> of_a, of_b;
  for (std::size_t k = 0; k < a.values.size(); ++k) {
    if (std::isnan(a.values[k]) || std::isnan(b.values[k])) continue;
    of_a.push_back(a.values[k]);
    of_b.push_back(b.values[k]);
  }
  return of_a.size() < 3 ? 0.0 : correlation_of(ranks_of(of_a), ranks_of(of_b));
}

double separation(const Column& column, const std::vector<bool>& fails) {
  std::vector<double> failing, others;
  for (std::size_t k = 0; k < column.values.size(); ++k)
    if (!std::isnan(column.values[k])) (fails[k] ? failing : others).push_back(column.values[k]);
  if (failing.empty() || others.empty()) return 0.0;
  std::sort(failing.begin(), failing.end());
  std::sort(others.begin(), others.end());
  double largest = 0.0;
  for (std::size_t i = 0, j = 0; i < failing.size() && j < others.size();) {
    const double value = std::min(failing[i], others[j]);
    while (i < failing.size() && failing[i] == value) ++i;
    while (j < others.size() && others[j] == value) ++j;
    largest = std::max(largest, std::abs(static_cast<double>(i) / static_cast<double>(failing.size()) -
                                         static_cast<double>(j) / static_cast<double>(others.size())));
  }
  return largest;
}

}  // namespace freeflex::campaign
