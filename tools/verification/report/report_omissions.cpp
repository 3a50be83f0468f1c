// Writes the section of a report on omissions, which shows what leaving out each feature saves.
#include <cmath>
#include <cstdio>

#include "tools/terminal/json.hpp"
#include "tools/verification/report/report.hpp"

namespace freeflex::tools {
namespace {

bool is_timed(const OmissionRow& row) { return std::isfinite(row.ratio); }

}  // namespace

void print_omissions(const Report& report) {
  std::printf("%-12s %-16s %8s %8s %12s %12s %8s %10s %10s\n", "scene", "omission", "default", "count",
              "with [ns]", "without [ns]", "ratio", "with [kB]", "without");
  for (const OmissionRow& row : report.omissions) {
    std::printf("%-12s %-16s %8s %8d ", row.scene.c_str(), omission_name(row).c_str(),
                row.is_default ? "yes" : "no", row.count);
    if (is_timed(row))
      std::printf("%12.1f %12.1f %8.3f %10.1f %10.1f\n", row.ns_with, row.ns_without, row.ratio,
                  1e-3 * row.bytes_with, 1e-3 * row.bytes_without);
    else
      std::printf("%s\n", row.why.c_str());
  }
  std::printf("\nratio: CPU time of a tick without the feature over that with it, median of turns\n");
}

Json omissions_to_json(const Report& report) {
  const auto size = [](double bytes) {
    return std::isnan(bytes) ? Json() : Json(static_cast<std::int64_t>(bytes));
  };
  Json rows = Json::array();
  for (const OmissionRow& row : report.omissions)
    rows.push_back({{"scene", row.scene},
                    {"omission", omission_name(row)},
                    {"default", row.is_default},
                    {"count", row.count},
                    {"ns_with", row.ns_with},
                    {"ns_without", row.ns_without},
                    {"ratio", row.ratio},
                    {"bytes_with", size(row.bytes_with)},
                    {"bytes_without", size(row.bytes_without)},
                    {"why", row.why}});
  return rows;
}

std::string omissions_section(const Report& report) {
  std::string text =
      "<h2>What leaving out saves</h2>\n<p>Median CPU time of a tick with each feature and without it, timed "
      "in turns. The plan omits as much as it can (on_need: refuse, tolerance 1e-3 for small modes unless "
      "the scene gives one); each omission is then undone alone. <i>Default</i>: the scene as it is written "
      "omits the feature. <i>second_plan</i>: on_need: replan against keep.</p>\n"
      "<table><tr><th>scene</th><th>omission</th><th>default</th><th>omitted</th><th>with [ns]</th>"
      "<th>without [ns]</th><th>ratio</th><th>plan with [kB]</th><th>without [kB]</th></tr>\n";
  for (const OmissionRow& row : report.omissions) {
    text += "<tr><td>" + escaped(row.scene) + "</td><td>" + omission_name(row) + "</td><td>" +
            (row.is_default ? "yes" : "no") + "</td>";
    text += is_timed(row)
                ? format_text("<td>%d</td><td>%.1f</td><td>%.1f</td><td>%.3f</td><td>%.1f</td><td>%.1f</td>",
                              row.count, row.ns_with, row.ns_without, row.ratio, 1e-3 * row.bytes_with,
                              1e-3 * row.bytes_without)
                : "<td colspan=\"6\">kept: " + escaped(row.why) + "</td>";
    text += "</tr>\n";
  }
  return text + "</table>\n";
}

}  // namespace freeflex::tools
