// Writes the section of a report on long ticks, which shows the verdicts as a function of the rotation per
// tick.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>

#include "tools/terminal/json.hpp"
#include "tools/verification/report/report.hpp"

namespace freeflex::tools {
namespace {

constexpr std::array kTickVerdicts{"good", "watch", "outside"};
const char* verdict_of(const TickRow& row) { return kTickVerdicts[static_cast<std::size_t>(row.level)]; }

/// Draws the fractions of the verdicts as bars, one bar for each range of the rotation per tick.
std::string picture(const std::vector<TickBin>& bins) {
  constexpr int kLeft = 60, kBase = 210, kHeight = 170, kBar = 110;
  std::string text = "<svg viewBox=\"0 0 880 290\" font-size=\"12\" fill=\"currentColor\" role=\"img\">\n";
  for (const int percent : {0, 50, 100})
    text += format_text("<text x=\"%d\" y=\"%d\" text-anchor=\"end\">%d %%</text>\n", kLeft - 8,
                        kBase - kHeight * percent / 100 + 4, percent);
  int left = kLeft;
  for (const TickBin& bin : bins) {
    int top = kBase;
    const auto bar = [&](int count, const char* fill) {
      if (bin.count == 0 || count == 0) return;
      const int height = std::max(1, kHeight * count / bin.count);
      top -= height;
      text += format_text("<rect x=\"%d\" y=\"%d\" width=\"%d\" height=\"%d\" fill=\"%s\"/>\n", left + 2, top,
                          kBar - 4, height, fill);
    };
    bar(bin.num_good, "var(--mark)");
    bar(bin.num_watch, "#e0a030");
    bar(bin.num_outside, "#c0392b");
    const int middle = left + kBar / 2;
    const auto line = [&](int y, const std::string& label) {
      text +=
          format_text("<text x=\"%d\" y=\"%d\" text-anchor=\"middle\">%s</text>\n", middle, y, label.c_str());
    };
    line(kBase + 16, format_text("%.2g to %.2g", bin.from, bin.to));
    line(kBase + 32, format_text("%d bodies", bin.count));
    line(kBase + 48, format_text("%.1e rad", bin.worst_attitude));
    line(kBase + 64, format_text("%.0f ns", bin.ns_per_tick));
    left += kBar;
  }
  return text + "</svg>\n";
}

}  // namespace

void print_ticks(const Report& report) {
  std::printf(
      "%zu random bodies of seed %llu, inertia ratios up to 1e6, wheels with up to 1000 times the momentum "
      "of the body, 1 Hz to 10 kHz\n\n",
      report.ticks.size(), static_cast<unsigned long long>(report.ticks_seed));
  std::printf("%-18s %7s %7s %7s %8s %14s %14s %10s\n", "rad per tick", "bodies", "good", "watch", "outside",
              "attitude [rad]", "energy [-]", "ns per tick");
  for (const TickBin& bin : bin_ticks(report.ticks))
    std::printf("%-18s %7d %7d %7d %8d %14.1e %14.1e %10.0f\n",
                format_text("%.2g to %.2g", bin.from, bin.to).c_str(), bin.count, bin.num_good, bin.num_watch,
                bin.num_outside, bin.worst_attitude, bin.worst_energy, bin.ns_per_tick);
  std::printf(
      "\nattitude and energy: the largest errors where the verdict is good; attitude compared with "
      "SUNDIALS at 1e-12\n");
}

Json ticks_to_json(const Report& report) {
  Json bins = Json::array(), bodies = Json::array();
  for (const TickBin& bin : bin_ticks(report.ticks))
    bins.push_back({{"from", bin.from},
                    {"to", bin.to},
                    {"bodies", bin.count},
                    {"good", bin.num_good},
                    {"watch", bin.num_watch},
                    {"outside", bin.num_outside},
                    {"worst_attitude_error", bin.worst_attitude},
                    {"worst_energy_error", bin.worst_energy},
                    {"ns_per_tick", bin.ns_per_tick}});
  for (const TickRow& row : report.ticks)
    bodies.push_back({{"body", row.number},
                      {"rate", row.rate},
                      {"rotation", row.rotation},
                      {"wheel", row.wheel},
                      {"inertia_ratio", row.inertia_ratio},
                      {"substeps", row.substeps},
                      {"ticks", row.ticks},
                      {"validity", verdict_of(row)},
                      {"attitude_error", row.attitude_error},
                      {"energy_error", row.energy_error},
                      {"ns_per_tick", row.ns_per_tick},
                      {"error", row.error}});
  return {{"seed", report.ticks_seed}, {"bins", std::move(bins)}, {"bodies", std::move(bodies)}};
}

std::string ticks_to_csv(const Report& report) {
  std::string text =
      "body,rate [Hz],rotation [rad],wheel [-],inertia ratio [-],substeps,ticks,validity,attitude error "
      "[rad],energy error [-],ns per tick\n";
  for (const TickRow& row : report.ticks)
    text +=
        format_text("%d,%.6g,%.6g,%.6g,%.6g,%d,%lld,%s,%.6g,%.6g,%.6g\n", row.number, row.rate, row.rotation,
                    row.wheel, row.inertia_ratio, row.substeps, static_cast<long long>(row.ticks),
                    verdict_of(row), row.attitude_error, row.energy_error, row.ns_per_tick);
  return text;
}

std::string ticks_section(const Report& report) {
  return format_text(
             "<h2>Long ticks</h2>\n<p>%zu random bodies of seed %llu in free motion: moments in ratios up "
             "to 1e6, two of three with a wheel that has 0.01 to 1000 times the momentum of the body, 1 Hz "
             "to 10 kHz, 0.001 to 3 rad per tick. Fractions of the verdicts by rotation per tick: good, "
             "watch (yellow), outside (red). Below each bar: the range [rad], the number of bodies, the "
             "largest attitude error where the verdict is good, against SUNDIALS at 1e-12, and the median "
             "CPU time of a tick.</p>\n",
             report.ticks.size(), static_cast<unsigned long long>(report.ticks_seed)) +
         picture(bin_ticks(report.ticks));
}

}  // namespace freeflex::tools
