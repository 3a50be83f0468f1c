// Writes the report as one HTML page.
#include <cmath>

#include "tools/verification/report/report.hpp"

namespace freeflex::tools {
namespace {

constexpr const char* kStart =
    "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\">"
    "<meta name=\"viewport\" content=\"width=device-width,initial-scale=1\">"
    "<title>freeflex: ";
constexpr const char* kStyle =
    "</title><style>\n"
    ":root{color-scheme:light dark;--ink:#1b1b1b;--paper:#fff;--line:#ccc;--soft:#f3f4f6;--mark:#1a6fc4}\n"
    "@media (prefers-color-scheme:dark){:root{--ink:#e8e8e8;--paper:#14171a;--line:#41474d;--soft:#1e2226;"
    "--mark:#6ab0f3}}\n"
    "body{font:15px/1.5 system-ui,'DejaVu "
    "Sans',Helvetica,Arial,sans-serif;color:var(--ink);background:var(--paper);"
    "max-width:1240px;margin:2rem auto;padding:0 1rem}\n"
    "h1{font-size:1.6rem;margin:0 0 .3rem}h2{font-size:1.2rem;margin:2rem 0 "
    ".5rem}h3{font-size:1rem;margin:1.4rem 0 .4rem}\n"
    ".wide{overflow-x:auto}table{border-collapse:collapse;font-size:12px;font-variant-numeric:tabular-nums}"
    "\n"
    "th,td{border-bottom:1px solid var(--line);padding:3px 6px;text-align:right;white-space:nowrap}\n"
    "th{background:var(--soft);vertical-align:bottom}td.t,th.t{text-align:left;white-space:normal}td.ours{"
    "color:var(--mark);"
    "font-weight:600}\n"
    "svg{width:100%;height:auto}dt{font-weight:600;margin-top:.4rem}dd{margin-left:1.2rem}\n"
    "@media print{body{margin:0;max-width:none;font-size:11px}h2{break-after:avoid}tr,svg{break-inside:avoid}"
    ".wide{overflow:visible}table{font-size:8px}th,td{padding:1px 3px}}\n"
    "</style></head><body>\n";

std::string number_cell(const std::optional<double>& value, const char* format = "%.1e") {
  if (!value || !std::isfinite(*value)) return "&ndash;";
  return format_text(format, *value);
}

std::string cell(const std::string& text, const char* kind = "") {
  return *kind == '\0' ? "<td>" + text + "</td>"
                       : std::string("<td class=\"") + kind + "\">" + text + "</td>";
}

std::string other_cell(const Comparison::Other& other) {
  if (other.method.empty()) return cell("&ndash;") + cell("not reached", "t");
  return cell(format_text("%.3g", other.ratio)) +
         cell(escaped(other.method) + format_text(" (%.1e)", other.cpu), "t");
}

std::string comparison_table(const Report& report) {
  std::string text =
      "<div class=\"wide\"><table><thead><tr><th class=\"t\">scene</th><th>level</th><th "
      "class=\"t\">read-out</th>"
      "<th class=\"t\">cheapest of ours</th><th>elastic error</th><th>model error</th><th>CPU [s/s]</th>"
      "<th colspan=\"2\" class=\"t\">by hand, full system</th><th colspan=\"2\" class=\"t\">packaged, full "
      "system</th>"
      "<th colspan=\"2\" class=\"t\">linearised, sparse</th></tr></thead><tbody>\n";
  for (const Study& study : report.studies)
    for (const double level : kLevels)
      for (std::size_t load = 0; load < kReadOuts; ++load) {
        const auto found = compare_at(study, level, static_cast<ReadOut>(load));
        text += "<tr>" + cell(escaped(study.scene), "t") + cell(format_text("%.0e", level)) +
                cell(kReadOutNames[load], "t");
        if (!found) {
          text += "<td class=\"t\" colspan=\"10\">no rung reaches it</td></tr>\n";
          continue;
        }
        const Run& ours = study.runs[found->ours];
        text += cell(escaped(ours.method) + ", " + setting_of(ours), "t ours") +
                cell(number_cell(ours.elastic_error)) + cell(number_cell(ours.model_error)) +
                cell(number_cell(found->cpu)) + other_cell(found->hand_written) +
                other_cell(found->packaged) + other_cell(found->linearised) + "</tr>\n";
      }
  return text + "</tbody></table></div>\n";
}

std::string run_table(const Study& study) {
  std::string text =
      "<div class=\"wide\"><table><thead><tr><th class=\"t\" rowspan=\"2\">method</th>"
      "<th class=\"t\" rowspan=\"2\">setting</th><th colspan=\"3\">elastic error [-]</th>"
      "<th rowspan=\"2\">position<br>[m rms]</th><th rowspan=\"2\">attitude<br>[rad]</th>"
      "<th rowspan=\"2\">frequency<br>error [-]</th><th rowspan=\"2\">energy<br>drift [-]</th>"
      "<th colspan=\"3\">CPU per simulated time [s/s]</th><th rowspan=\"2\">steps</th><th rowspan=\"2\">ns a "
      "step</th>"
      "<th rowspan=\"2\">set-up<br>[s]</th><th rowspan=\"2\">memory<br>[kB]</th></tr><tr><th>whole</th>"
      "<th>integration</th><th>model</th><th>once</th><th>each 10 ms</th><th>each 1 "
      "ms</th></tr></thead><tbody>\n";
  for (const Run& run : study.runs) {
    text += "<tr>" + cell(escaped(run.method), run.family == Family::kRung ? "t ours" : "t") +
            cell(setting_of(run), "t");
    if (!run.failure.empty()) {
      text += "<td class=\"t\" colspan=\"14\">" + escaped(run.failure) + "</td></tr>\n";
      continue;
    }
    text += cell(number_cell(run.elastic_error)) + cell(number_cell(run.integration_error)) +
            cell(number_cell(run.model_error)) + cell(number_cell(run.position_error)) +
            cell(number_cell(run.attitude_error)) + cell(number_cell(run.frequency_error)) +
            cell(number_cell(run.energy_drift));
    for (const auto& cpu : run.cpu) text += cell(number_cell(cpu));
    text += cell(std::to_string(run.steps)) + cell(number_cell(ns_per_step(study, run), "%.0f")) +
            cell(number_cell(run.set_up, "%.1e")) + cell(std::to_string(run.memory / 1024)) + "</tr>\n";
  }
  return text + "</tbody></table></div>\n";
}

std::string study_section(const Study& study) {
  std::string text =
      "<h3>" + escaped(study.scene) + "</h3>\n<p>" +
      format_text(
          "%zu points, %zu links, %zu elastic freedoms from %.4g to %.4g rad/s, spin %g rad/s at "
          "the start, %g s simulated. Reference: ",
          study.points, study.links, study.elastic_freedoms, study.lowest_frequency, study.top_frequency,
          study.spin, study.end) +
      escaped(study.reference) +
      format_text(", with an elastic error of at most %.0e, %.1f s of CPU time.</p>\n",
                  study.reference_accuracy, study.reference_cpu);
  if (const std::string note = forces_note(study); !note.empty()) text += "<p>" + escaped(note) + "</p>\n";
  text += run_table(study);
  if (study.left_out.empty()) return text;
  text += "<p>Left out:</p><ul>\n";
  for (const LeftOut& item : study.left_out)
    text += "<li>" + escaped(item.what) + ": " + escaped(item.why) + "</li>\n";
  return text + "</ul>\n";
}

constexpr const char* kColumns =
    "<h2>Terms and columns</h2><dl>\n<dt>rung</dt><dd>One of the six sets of equations that a scene "
    "chooses by <i>fidelity</i>. Each keeps more terms than the one before; the legend above lists them. A "
    "plan is one rung at one rate.</dd>\n<dt>full system</dt><dd>Newton's equations of every point with "
    "links of every kind at their true geometry: the reference for the rungs.</dd>\n"
    "<dt>by hand, packaged</dt><dd>Integrators of the full system. By hand: written for it (Verlet, "
    "Runge-Kutta, Stoermer extrapolated, Kahan and Li; the midpoint rule extrapolated if forces depend on "
    "velocities), packaged: those of SUNDIALS (ARKODE, CVODE), with a Jacobian for implicit "
    "methods.</dd>\n<dt>level</dt><dd>The "
    "required elastic error.</dd>\n<dt>read-out</dt><dd>How often all points are read: once at the end, "
    "each 10 ms or each 1 ms.</dd>\n<dt>elastic error</dt><dd>|u &minus; u<sub>ref</sub>| / "
    "|u<sub>ref</sub>| at the end, u the displacements relative to the best fitting rigid motion. A "
    "position error of 1e-7 of the size can hide a deformation that is entirely wrong; the elastic error "
    "cannot.</dd>\n<dt>integration, model</dt><dd>The two parts of the elastic error: the difference of a "
    "run from an exact solution of its own equations, and the difference of that solution from the full "
    "system. Methods on the full system have no model error.</dd>\n<dt>position, attitude</dt><dd>Error of "
    "position, root mean square over the points, and angle between the best fitting rotations.</dd>\n"
    "<dt>frequency error</dt><dd>Relative error of the frequency of the mode that moves most after the "
    "loads end. The frequency is fitted to the motion read each 10 ms.</dd>\n<dt>energy "
    "drift</dt><dd>Change of the energy from the end of the loads to the end of the run, relative to the "
    "elastic energy.</dd>\n<dt>CPU</dt><dd>Time of one thread without the set-up, median of repeats. "
    "<i>Once</i>, <i>each 10 ms</i>, <i>each 1 ms</i>: how often positions and velocities of all points "
    "are read. A rung is read at its ticks, so if a step is longer than the interval, there is no value. A "
    "run of more than 0.3 s is timed only once with reading each 10 ms, and this time is used for "
    "<i>once</i> too; a run of more than 3 s uses it for all three.</dd>\n<dt>setting</dt><dd>The step, "
    "the tolerance, or both. <i>100 ms, then 1.9 s</i>: without loads the motion of a rung is exact for "
    "any step, so a program may compute the whole free motion in one step, with the same plan at another "
    "rate. Krylov's method does the same here. The daemon's rate is fixed.</dd>\n<dt>ratio</dt><dd>Cost of "
    "the cheapest other method at our elastic error, divided by our cost. Our error is the elastic error "
    "of the run or the model error of its rung, whichever is larger. It is taken as at least 3e-8, because "
    "the runs of the other methods reach no smaller error. Other methods may have a 5 % larger error, "
    "because methods with the same model error differ slightly in their integration errors. Between two "
    "settings the cost is interpolated linearly in logarithms.</dd>\n<dt>linearised, sparse</dt><dd>The "
    "methods closest to ours: the equations of the spin-loaded rung without modes, spring by spring, by "
    "leapfrog and by Krylov's exponential with free steps.</dd></dl>\n";

}  // namespace

std::string page_head(const std::string& title) { return kStart + escaped(title) + kStyle; }

std::string to_html(const Report& report) {
  const Machine& machine = report.machine;
  std::string text = page_head("error against run time");
  text += "<h1>Error against run time</h1>\n<p>freeflex " + escaped(machine.version) + ", commit " +
          escaped(machine.commit) + ", " + escaped(machine.date) + ". " + escaped(machine.processor) +
          format_text(", %d cores, ", machine.cores) + escaped(machine.system) + ". " +
          escaped(machine.compiler) + ", " + escaped(machine.flags) + ".</p>\n";
  if (report.is_interrupted) text += "<p><b>Interrupted: the results are incomplete.</b></p>\n";
  if (!report.estimates.empty()) text += estimates_section(report);
  if (!report.ticks.empty()) text += ticks_section(report);
  if (!report.omissions.empty()) text += omissions_section(report);
  if (report.studies.empty()) return text + "</body></html>\n";
  text += "<h2>Conclusions</h2><ul>\n";
  for (const std::string& sentence : findings(report)) text += "<li>" + escaped(sentence) + "</li>\n";
  text +=
      "</ul>\n<h2>At equal error</h2><p>For each scene and level: the cheapest rung and step whose elastic "
      "error is at most the level, and the cost of other methods at the same error, divided by the cost of "
      "this rung.</p>\n";
  text += comparison_table(report);
  text += "<h2>Work and precision</h2>\n" + work_precision_svg(report);
  text += "<h2>Every run</h2>\n";
  for (const Study& study : report.studies) text += study_section(study);
  return text + kColumns + "</body></html>\n";
}

}  // namespace freeflex::tools
