#include "tools/campaign/page.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <numeric>

#include "tools/campaign/columns.hpp"
#include "tools/campaign/summary.hpp"
#include "tools/terminal/console.hpp"

namespace freeflex::campaign {
namespace {

using tools::format_text;

constexpr double kWidth = 300.0, kHeight = 190.0;                        // [px] of a picture
constexpr double kLeft = 52.0, kRight = 10.0, kTop = 8.0, kFoot = 34.0;  // [px] around its frame
constexpr std::size_t kMostPoints = 4000;  // passed cases that a scatter picture shows
constexpr std::size_t kMostPictures = 12;
constexpr std::size_t kMostWorst = 10;

constexpr const char* kStyle = R"(
body{font:15px/1.5 system-ui,sans-serif;margin:2em auto;max-width:62em;padding:0 1em;color:#1b2733;background:#fff}
h1{font-size:1.5em;margin:0}h2{font-size:1.15em;margin:2em 0 .4em}p{margin:.3em 0}
.pictures{display:flex;flex-wrap:wrap;gap:1em}figure{margin:0}figcaption{font-size:.87em;max-width:300px}
table{border-collapse:collapse;font-size:.87em}th,td{padding:.15em .7em;text-align:right;border-bottom:1px solid #d8dee4}
th{font-weight:600}td.t,th.t{text-align:left}code{background:#f0f3f6;padding:.1em .3em}
.bar{display:flex;height:1.2em;margin:.6em 0}.bar span{display:block}
.lines{white-space:pre-line}svg text{font:11px system-ui,sans-serif;fill:#43515f}
)";

std::string escaped(const std::string& text) {
  std::string safe;
  for (const char c : text)
    safe += c == '<'   ? "&lt;"
            : c == '>' ? "&gt;"
            : c == '&' ? "&amp;"
            : c == '"' ? "&quot;"
                       : std::string(1, c);
  return safe;
}

const char* color_of(const std::string& outcome) {
  if (outcome == "passed") return "#3b7dbb";
  if (outcome == "refused") return "#9aa7b3";
  return outcome == "failed" ? "#d1495b" : "#8a2d3b";
}

/// An axis from one number to another, in pixels.
struct Axis {
  double low, high, from, to;

  Axis(double least, double most, double begin, double end) : low(least), high(most), from(begin), to(end) {
    if (!(high > low)) high = low + std::max(1.0, std::abs(low)) * 1e-6;
  }
  double at(double value) const {
    return from + (std::clamp(value, low, high) - low) / (high - low) * (to - from);
  }
};

/// Returns round numbers on an axis.
std::vector<double> ticks_of(const Axis& axis) {
  const double span = axis.high - axis.low, power = std::pow(10.0, std::floor(std::log10(span / 3.0)));
  const double step = span / 3.0 / power < 2.0 ? power : span / 3.0 / power < 5.0 ? 2.0 * power : 5.0 * power;
  std::vector<double> ticks;
  for (double tick = std::ceil(axis.low / step) * step; tick <= axis.high + 1e-9 * span && ticks.size() < 9;
       tick += step)
    ticks.push_back(std::abs(tick) < 1e-9 * span ? 0.0 : tick);
  return ticks;
}

std::string begin_picture() {
  return format_text("<svg width=\"%g\" height=\"%g\" role=\"img\">", kWidth, kHeight);
}

std::string frame_of(const Axis& x, const Axis& y, const std::string& x_name) {
  std::string svg = format_text(
      "<path d=\"M%g %gV%gH%g\" fill=\"none\" stroke=\"#9aa7b3\"/><text x=\"%g\" y=\"%g\" "
      "text-anchor=\"middle\">",
      x.from, y.to, y.from, x.to, 0.5 * (x.from + x.to), kHeight - 4.0);
  svg += escaped(x_name) + "</text>";
  for (const double tick : ticks_of(x))
    svg += format_text("<text x=\"%.1f\" y=\"%g\" text-anchor=\"middle\">%.4g</text>", x.at(tick),
                       y.from + 14.0, tick);
  for (const double tick : ticks_of(y))
    svg += format_text("<text x=\"%g\" y=\"%.1f\" text-anchor=\"end\">%.4g</text>", x.from - 5.0,
                       y.at(tick) + 4.0, tick);
  return svg;
}

/// Returns the range of a column without its outermost hundredths, if these lie far out.
std::pair<double, double> shown_range(const std::vector<double>& sorted) {
  const double low = sorted.front(), high = sorted.back();
  const double inner_low = quantile_of(sorted, 0.01), inner_high = quantile_of(sorted, 0.99);
  const double span = inner_high - inner_low;
  if (!(span > 0.0)) return {low, high};
  return {low < inner_low - 2.0 * span ? inner_low : low, high > inner_high + 2.0 * span ? inner_high : high};
}

/// Returns the finite ones of sorted values.
std::vector<double> finite_of(const std::vector<double>& sorted) {
  std::vector<double> finite;
  std::copy_if(sorted.begin(), sorted.end(), std::back_inserter(finite),
               [](double value) { return std::isfinite(value); });
  return finite;
}

std::string limit_line(const Axis& x, const Axis& y, double limit) {
  if (limit < x.low || limit > x.high) return {};
  return format_text("<path d=\"M%.1f %gV%g\" stroke=\"#d1495b\" stroke-dasharray=\"4 3\"/>", x.at(limit),
                     y.from, y.to);
}

std::string histogram(const Measure& measure, const Column& column) {
  const std::vector<double> all = sorted_values(column), sorted = finite_of(all);
  const std::size_t num_infinite = all.size() - sorted.size(),
                    num_missing = column.values.size() - all.size();
  std::string notes;
  if (num_infinite > 0)
    notes += "; infinite in " + tools::counted(static_cast<std::int64_t>(num_infinite), "case");
  if (num_missing > 0) notes += "; none in " + tools::counted(static_cast<std::int64_t>(num_missing), "case");
  if (sorted.empty())
    return "<figure><figcaption>" + escaped(measure.name) + ": no case has a finite value" + notes +
           "</figcaption></figure>";
  auto [low, high] = shown_range(sorted);
  for (const auto& limit : {measure.fail_above, measure.fail_below})
    if (limit && *limit > low - 0.5 * (high - low) && *limit < high + 0.5 * (high - low)) {
      low = std::min(low, *limit);
      high = std::max(high, *limit);
    }
  const Axis x(low, high, kLeft, kWidth - kRight);
  const auto num_bins =
      static_cast<std::size_t>(std::clamp(std::sqrt(static_cast<double>(sorted.size())), 5.0, 40.0));
  std::vector<double> bins(num_bins, 0.0);
  for (const double value : sorted) {
    const double share = (std::clamp(value, x.low, x.high) - x.low) / (x.high - x.low);
    bins[std::min(static_cast<std::size_t>(share * static_cast<double>(num_bins)), num_bins - 1)] += 1.0;
  }
  const Axis y(0.0, *std::max_element(bins.begin(), bins.end()), kHeight - kFoot, kTop);
  std::string svg = begin_picture();
  const double width = (x.to - x.from) / static_cast<double>(num_bins);
  for (std::size_t k = 0; k < num_bins; ++k)
    svg += format_text("<rect x=\"%.1f\" y=\"%.1f\" width=\"%.1f\" height=\"%.1f\" fill=\"#3b7dbb\"/>",
                       x.from + static_cast<double>(k) * width + 0.5, y.at(bins[k]), width - 1.0,
                       y.from - y.at(bins[k]));
  for (const auto& limit : {measure.fail_above, measure.fail_below})
    if (limit) svg += limit_line(x, y, *limit);
  svg += frame_of(x, y, measure.name) + "</svg>";
  std::string caption = format_text(
      "median %.4g; 5 %% are below %.4g, 95 %% below %.4g; all from %.4g to %.4g", quantile_of(all, 0.5),
      quantile_of(all, 0.05), quantile_of(all, 0.95), all.front(), all.back());
  caption += notes;
  if (sorted.front() < x.low || sorted.back() > x.high)
    caption += "; values beyond the axis are in its outermost bars";
  return "<figure>" + svg + "<figcaption>" + caption + "</figcaption></figure>";
}

std::string scatter(const Columns& columns, const Column& variable, const Column& measure,
                    double correlation) {
  const std::vector<double> xs = sorted_values(variable), ys = finite_of(sorted_values(measure));
  if (xs.empty() || ys.empty()) return {};
  const auto [low, high] = shown_range(ys);
  const Axis x(xs.front(), xs.back(), kLeft, kWidth - kRight), y(low, high, kHeight - kFoot, kTop);
  const std::size_t every = columns.cases.size() / kMostPoints + 1;
  std::array<std::string, 2> paths;
  for (std::size_t k = 0; k < columns.cases.size(); ++k) {
    const bool fails = columns.fails[k];
    if (!std::isfinite(variable.values[k]) || std::isnan(measure.values[k]) || (!fails && k % every != 0))
      continue;
    paths[fails ? 1 : 0] +=
        format_text("M%.0f %.0fh2", x.at(variable.values[k]) - 1.0, y.at(measure.values[k]));
  }
  std::string svg = begin_picture();
  svg += "<path d=\"" + paths[0] + "\" stroke=\"#3b7dbb\" stroke-opacity=\"0.5\" stroke-width=\"2\"/>";
  svg += "<path d=\"" + paths[1] + "\" stroke=\"#d1495b\" stroke-width=\"3\"/>";
  svg += frame_of(x, y, variable.name) + "</svg>";
  return "<figure>" + svg + "<figcaption>" + escaped(measure.name) +
         format_text(", rank correlation %.2f", correlation) +
         (every > 1 ? format_text("; one passed case in %zu is shown", every) : "") +
         "</figcaption></figure>";
}

/// Returns pictures of the variables and measures that are related most.
std::string relations(const Columns& columns) {
  struct Pair {
    std::size_t variable, measure;
    double correlation, order;
  };
  std::vector<Pair> pairs;
  for (std::size_t v = 0; v < columns.variables.size(); ++v) {
    const double separates = separation(columns.variables[v], columns.fails);
    for (std::size_t m = 0; m < columns.measures.size(); ++m) {
      const double correlation = rank_correlation(columns.variables[v], columns.measures[m]);
      pairs.push_back({v, m, correlation, std::max(std::abs(correlation), separates)});
    }
  }
  std::stable_sort(pairs.begin(), pairs.end(),
                   [](const Pair& a, const Pair& b) { return a.order > b.order; });
  pairs.resize(std::min(pairs.size(), kMostPictures));
  std::string html;
  for (const Pair& pair : pairs)
    html +=
        scatter(columns, columns.variables[pair.variable], columns.measures[pair.measure], pair.correlation);
  return html;
}

std::string separations(const Columns& columns) {
  if (std::find(columns.fails.begin(), columns.fails.end(), true) == columns.fails.end()) return {};
  std::vector<std::pair<double, const Column*>> order;
  for (const Column& variable : columns.variables)
    order.emplace_back(separation(variable, columns.fails), &variable);
  std::stable_sort(order.begin(), order.end(),
                   [](const auto& a, const auto& b) { return a.first > b.first; });
  // Kolmogorov-Smirnov test of two samples
  const auto num_failing = static_cast<double>(std::count(columns.fails.begin(), columns.fails.end(), true)),
             num_others = static_cast<double>(columns.fails.size()) - num_failing;
  const double by_chance =
      num_others > 0.0 ? std::min(1.0, 1.36 * std::sqrt(1.0 / num_failing + 1.0 / num_others)) : 1.0;
  std::string html =
      "<h2>Which values make cases fail</h2><p>Distance between the distributions of failing and of other "
      "cases (0: alike, 1: apart)." +
      format_text(" Of a value that does not matter, it is below %.2f with a probability of 95 %%.</p>",
                  by_chance) +
      "<table><tr><th class=t>value</th><th>distance</th><th>median of "
      "failing</th>"
      "<th>median of all</th></tr>";
  for (std::size_t k = 0; k < std::min(order.size(), kMostWorst); ++k) {
    Column failing{{}, {}};
    for (std::size_t i = 0; i < columns.fails.size(); ++i)
      if (columns.fails[i]) failing.values.push_back(order[k].second->values[i]);
    html += "<tr><td class=t>" + escaped(order[k].second->name) +
            format_text("</td><td>%.2f</td><td>%.4g</td><td>%.4g</td></tr>", order[k].first,
                        quantile_of(sorted_values(failing), 0.5),
                        quantile_of(sorted_values(*order[k].second), 0.5));
  }
  return html + "</table>";
}

/// Returns how far a case is beyond the limits of its measures; infinite if it has no measures.
double badness(const Campaign& campaign, const Columns& columns, std::size_t k) {
  double worst = columns.fails[k] ? 0.0 : -1.0;
  for (std::size_t m = 0; m < campaign.measures.size(); ++m) {
    const double value = columns.measures[m].values[k];
    const Measure& measure = campaign.measures[m];
    if (std::isnan(value) && columns.fails[k]) return std::numeric_limits<double>::infinity();
    const auto beyond = [&](double excess, double limit) {
      worst = std::max(worst, excess / std::max(std::abs(limit), 1e-300));
    };
    if (measure.fail_above) beyond(value - *measure.fail_above, *measure.fail_above);
    if (measure.fail_below) beyond(*measure.fail_below - value, *measure.fail_below);
  }
  return worst;
}

std::string worst_cases(const Opened& opened, const Columns& columns) {
  const std::string words = escaped(words_of_campaign(opened));
  std::vector<std::pair<double, std::size_t>> order;
  for (std::size_t k = 0; k < columns.cases.size(); ++k)
    if (columns.outcomes[k] != "passed") order.emplace_back(badness(opened.campaign, columns, k), k);
  if (order.empty()) return {};
  std::stable_sort(order.begin(), order.end(),
                   [](const auto& a, const auto& b) { return a.first > b.first; });
  order.resize(std::min(order.size(), kMostWorst));
  std::string html = "<h2>Worst cases</h2><table><tr><th>case</th><th class=t>outcome</th>";
  for (const Column& measure : columns.measures) html += "<th>" + escaped(measure.name) + "</th>";
  html += "<th class=t>why</th></tr>";
  for (const auto& [bad, k] : order) {
    html += format_text("<tr><td>%lld</td><td class=t>", static_cast<long long>(columns.cases[k])) +
            columns.outcomes[k] + "</td>";
    for (const Column& measure : columns.measures)
      html += std::isnan(measure.values[k]) ? "<td></td>" : format_text("<td>%.4g</td>", measure.values[k]);
    html += "<td class=t>" + escaped(columns.messages[k]) + "</td></tr>";
  }
  return html +
         format_text(
             "</table><p>Run one again: <code>freeflex campaign rerun %s %lld</code>. Find what makes it "
             "fail: <code>freeflex campaign shrink %s %lld</code>.</p>",
             words.c_str(), static_cast<long long>(columns.cases[order[0].second]), words.c_str(),
             static_cast<long long>(columns.cases[order[0].second]));
}

std::string outcomes_of(const Summary& summary) {
  std::string bar = "<div class=bar>";
  const double total = static_cast<double>(std::max<std::int64_t>(summary.total(), 1));
  for (std::size_t k = 0; k < kAllOutcomes.size(); ++k) {
    if (summary.counts[k] == 0) continue;
    bar += format_text("<span style=\"width:%.4f%%;background:%s\" title=\"%s\"></span>",
                       100.0 * static_cast<double>(summary.counts[k]) / total, color_of(kAllOutcomes[k]),
                       kAllOutcomes[k]);
  }
  return bar + "</div>";
}

}  // namespace

std::string make_page(const Opened& opened, const Results& results) {
  const Campaign& campaign = opened.campaign;
  const Columns columns = columns_of(campaign, results);
  const Summary summary = summarize(results);
  std::string html =
      "<!doctype html><html lang=en><meta charset=utf-8><title>" + escaped(campaign.name) +
      "</title><style>" + kStyle + "</style><h1>Campaign " + escaped(campaign.name) + "</h1><p>Scene " +
      escaped(std::filesystem::path(campaign.scene).lexically_normal().string()) +
      format_text(", %g s a case, %zu values vary</p>", campaign.until, campaign.variables.size());
  html += outcomes_of(summary);
  html += "<p class=lines>" + escaped(summary_text(summary)) + "</p>";
  if (campaign.sampling.design != Design::kRandom)
    html +=
        "<p>The interval is for independent cases. Those of a Latin hypercube or a Sobol sequence are spread "
        "evenly, so the true interval is usually shorter.</p>";
  html += "<h2>Measures</h2><div class=pictures>";
  for (std::size_t k = 0; k < campaign.measures.size(); ++k)
    html += histogram(campaign.measures[k], columns.measures[k]);
  html += "</div>" + separations(columns);
  if (!columns.variables.empty())
    html +=
        "<h2>Values against measures</h2><p>The strongest relations; failing cases are red.</p><div "
        "class=pictures>" +
        relations(columns) + "</div>";
  return html + worst_cases(opened, columns) + "</html>\n";
}

}  // namespace freeflex::campaign
