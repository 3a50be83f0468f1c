// Writes the stability table as one HTML page.
#include <cmath>

#include "tools/verification/report/report.hpp"
#include "tools/verification/stability/stability.hpp"

namespace freeflex::tools {
namespace {

constexpr const char* kEnd = "</tbody></table></div>\n";

std::string number_cell(double value) {
  return std::isfinite(value) ? format_text("%.1e", value) : "&ndash;";
}

/// Returns the head of a table. For cases that must be refused, the table has a message instead of numbers.
std::string table_head(const StabilityCase& what) {
  std::string text =
      "<h2>" + escaped(what.group) + "</h2>\n<div class=\"wide\"><table><thead><tr><th class=\"t\">case</th>";
  text += what.must_refuse
              ? "<th class=\"t\">verdict</th><th class=\"t\">message</th>"
              : "<th class=\"t\">method</th><th class=\"t\">verdict</th><th>measured</th><th>at most</th>"
                "<th class=\"t\">quantity</th><th class=\"t\">remark</th>";
  return text + "</tr></thead><tbody>\n";
}

std::string text_cell(const std::string& text) {
  return "<td class=\"t message\">" + escaped(text) + "</td>";
}

std::string rows_of(const StabilityRow& row) {
  const std::string verdict =
      std::string("<td class=\"t ") + (row.holds() ? "ours" : "fails") + "\">" + row.verdict() + "</td>";
  const std::string name = "<tr><td class=\"t\">" + escaped(row.what.name) + "</td>";
  if (row.what.must_refuse) return name + verdict + text_cell(row.outcome.message) + "</tr>\n";
  std::string text = name + "<td class=\"t ours\">freeflex</td>" + verdict + "<td>" +
                     number_cell(row.outcome.measured) + "</td><td>" + number_cell(row.what.limit) + "</td>" +
                     text_cell(row.what.quantity) + text_cell(row.outcome.message) + "</tr>\n";
  for (const PeerFigure& peer : row.outcome.peers)
    text += "<tr><td></td><td class=\"t\">" + escaped(peer.method) + "</td><td></td><td>" +
            number_cell(peer.figure) + "</td><td></td><td></td>" + text_cell(peer.failure) + "</tr>\n";
  return text;
}

}  // namespace

std::string to_html(const StabilityReport& report) {
  const Machine& machine = report.machine;
  std::size_t failed = 0;
  for (const StabilityRow& row : report.rows) failed += row.holds() ? 0 : 1;
  std::string text =
      page_head("stability") +
      "<style>td.fails{color:#c22;font-weight:600}td.message{white-space:normal;max-width:34em}</style>\n";
  text += "<h1>Stiff and extreme cases</h1>\n<p>freeflex " + escaped(machine.version) + ", commit " +
          escaped(machine.commit) + ", " + escaped(machine.date) + ". " + escaped(machine.processor) + ", " +
          escaped(machine.compiler) + ", " + escaped(machine.flags) + ".</p>\n<p>" +
          format_text("%zu cases, %zu of them fail. ", report.rows.size(), failed) +
          (report.is_interrupted ? format_text("<b>Interrupted: %zu more did not run.</b> ",
                                               report.num_cases - report.rows.size())
                                 : std::string()) +
          "Each has a limit, shown after the measured value; scenes without a valid result must be refused "
          "or flagged by a message with the expected words. Hand-written methods run at our step, packaged "
          "ones at a local error of 1e-8 of the "
          "elastic scale; they solve the full system, so if the body rotates or deforms much, their value "
          "includes our model error.</p>\n";
  std::string group;
  for (const StabilityRow& row : report.rows) {
    if (row.what.group != group) text += (group.empty() ? "" : kEnd) + table_head(row.what);
    group = row.what.group;
    text += rows_of(row);
  }
  return text + (group.empty() ? "" : kEnd) + "</body></html>\n";
}

}  // namespace freeflex::tools
