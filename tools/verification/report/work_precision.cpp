// Draws work-precision curves as SVG. The curves show the elastic error over the CPU time on
// logarithmic axes.
#include <algorithm>
#include <array>
#include <cmath>
#include <map>

#include "core/words.hpp"
#include "tools/verification/report/report.hpp"

namespace freeflex::tools {
namespace {

// sizes in SVG user units, which print as 1/96 inch
constexpr double kPanelWidth = 300.0, kPanelHeight = 250.0;
constexpr double kLeft = 62.0, kBetween = 18.0, kRight = 18.0;
constexpr double kLegendRow = 20.0, kTitle = 46.0, kBelow = 62.0;

/// Colour (visible on white and on black), marker and dash pattern of a method's curve.
struct Style {
  const char* method;
  const char* colour;
  const char* marker;  // one of the shapes below
  const char* dash;    // empty: solid
  double width;
  double size = 3.0;  // size of the marker
};
// curves of rungs have different widths and marker sizes, so that each is visible if several coincide
constexpr std::array kStyles{Style{"rigid", "#888888", "circle", "", 2.0, 3.0},
                             Style{"separated", "#1f77d0", "circle", "", 1.6, 2.4},
                             Style{"spin-loaded", "#12a5c4", "square", "", 3.0, 4.2},
                             Style{"coupled", "#1a9850", "diamond", "", 4.4, 5.2},
                             Style{"corotational", "#8a5cd6", "triangle", "", 5.8, 7.0},
                             Style{"corotational, points", "#000000", "circle", "", 3.4, 3.0},
                             Style{"full", "#b13fd1", "plus", "", 7.2, 8.5},
                             Style{"velocity Verlet", "#e0530b", "ring", "", 1.4},
                             Style{"Runge-Kutta 4", "#e8a200", "box", "", 1.4},
                             Style{"Stoermer 8", "#c0392b", "triangle", "", 1.4},
                             Style{"Stoermer 12", "#e0357f", "kite", "", 1.4},
                             Style{"Stoermer 16", "#7a1f1f", "cross", "", 1.4},
                             Style{"Kahan-Li 8", "#9c8400", "plus", "", 1.4},
                             Style{"ARKODE explicit 4", "#b5651d", "cross", "5 3", 1.3},
                             Style{"ARKODE explicit 8", "#8c6d31", "plus", "5 3", 1.3},
                             Style{"ARKODE implicit 5", "#d6539f", "ring", "5 3", 1.3},
                             Style{"CVODE Adams", "#7f7f7f", "box", "5 3", 1.3},
                             Style{"CVODE BDF", "#9a9a30", "kite", "5 3", 1.3},
                             Style{"leapfrog, linear", "#ef6f6c", "cross", "1.5 3", 1.6},
                             Style{"Krylov, linear", "#c9184a", "kite", "1.5 3", 1.6}};

const Style& style_of(const std::string& method) {
  const auto found = std::find_if(kStyles.begin(), kStyles.end(),
                                  [&](const Style& style) { return method == style.method; });
  return found != kStyles.end() ? *found : kStyles.front();
}

std::string path(double x, double y, const char* shape, double r) {
  const std::string kind = shape;
  if (kind == "circle" || kind == "ring")
    return format_text("<circle cx=\"%.1f\" cy=\"%.1f\" r=\"%.1f\"", x, y, r);
  if (kind == "square" || kind == "box")
    return format_text("<path d=\"M%.1f %.1fh%.1fv%.1fh%.1fz\"", x - 0.9 * r, y - 0.9 * r, 1.8 * r, 1.8 * r,
                       -1.8 * r);
  if (kind == "diamond" || kind == "kite")
    return format_text("<path d=\"M%.1f %.1fl%.1f %.1fl%.1f %.1fl%.1f %.1fz\"", x, y - 1.3 * r, 1.1 * r,
                       1.3 * r, -1.1 * r, 1.3 * r, -1.1 * r, -1.3 * r);
  if (kind == "triangle")
    return format_text("<path d=\"M%.1f %.1fl%.1f %.1fh%.1fz\"", x, y - 1.2 * r, 1.2 * r, 2.1 * r, -2.4 * r);
  if (kind == "plus")
    return format_text("<path d=\"M%.1f %.1fh%.1fM%.1f %.1fv%.1f\"", x - r, y, 2.0 * r, x, y - r, 2.0 * r);
  return format_text("<path d=\"M%.1f %.1fl%.1f %.1fm%.1f 0l%.1f %.1f\"", x - r, y - r, 2.0 * r, 2.0 * r,
                     -2.0 * r, 2.0 * r, -2.0 * r);
}

std::string marker(double x, double y, const Style& style, const std::string& tip) {
  const std::string kind = style.marker;
  const bool is_filled = kind == "circle" || kind == "square" || kind == "diamond" || kind == "triangle";
  std::string text = path(x, y, style.marker, style.size);
  text += format_text(" stroke=\"%s\" stroke-width=\"1.3\" %s", style.colour,
                      is_filled ? format_text("fill=\"%s\"", style.colour).c_str() : "class=\"hollow\"");
  const bool is_round = kind == "circle" || kind == "ring";
  return text + (tip.empty()
                     ? "/>"
                     : "><title>" + escaped(tip) + (is_round ? "</title></circle>" : "</title></path>"));
}

std::string label(double x, double y, const char* anchor, const std::string& text, const char* kind = "") {
  return format_text("<text x=\"%.1f\" y=\"%.1f\" text-anchor=\"%s\"%s>", x, y, anchor,
                     *kind != '\0' ? format_text(" class=\"%s\"", kind).c_str() : "") +
         text + "</text>";
}

std::string power_of_ten(int exponent) {
  return format_text("10<tspan dy=\"-5\" font-size=\"9\">%d</tspan>", exponent);
}

constexpr int kLeastDecade = -8;  // smallest decade of the error that is drawn

struct Range {
  int low = 0, high = 0;  // decades
  double width() const { return high - low; }
};

const double kLeastError = std::pow(10.0, kLeastDecade);

bool is_shown(const Run& run, std::size_t load) {
  constexpr double kWrong = 3.0;  // [-] with a larger error, a motion is unrelated to the reference
  return run.failure.empty() && run.cpu[load] && run.elastic_error < kWrong &&
         (run.family == Family::kRung || run.elastic_error > kLeastError);
}

/// Returns the error at which a run is drawn. An error below the range of the panel is drawn on the edge.
double drawn_error(const Run& run) { return std::max(run.elastic_error, kLeastError); }

/// The decades that contain all runs of a scene. The three panels of a scene have the same scales.
struct Scales {
  Range cpu, error;
};

Scales axes_of(const Study& study) {
  double least_cpu = 1e300, most_cpu = 0.0, least_error = 1.0;
  for (const Run& run : study.runs)
    for (std::size_t load = 0; load < kReadOuts; ++load) {
      if (!is_shown(run, load)) continue;
      least_cpu = std::min(least_cpu, *run.cpu[load]);
      most_cpu = std::max(most_cpu, *run.cpu[load]);
      least_error = std::min(least_error, drawn_error(run));
    }
  const auto floor_of = [](double value) { return static_cast<int>(std::floor(std::log10(value))); };
  if (most_cpu == 0.0) return {{-6, 0}, {-6, 1}};
  return {{floor_of(0.8 * least_cpu), floor_of(1.25 * most_cpu) + 1},
          {std::max(kLeastDecade, floor_of(0.8 * least_error)), 1}};
}

/// Ranges and position of one panel.
struct Panel {
  const Scales& axes;
  double x0, y0;
  double x(double cpu) const {
    return x0 + (std::log10(cpu) - axes.cpu.low) / axes.cpu.width() * kPanelWidth;
  }
  double y(double error) const {
    return y0 + (axes.error.high - std::log10(error)) / axes.error.width() * kPanelHeight;
  }
};

/// Draws the grid of a panel. The last decade of CPU time has a label only in the last panel of a row.
std::string grid(const Panel& panel, bool is_first, bool is_last) {
  std::string text =
      format_text("<rect x=\"%.1f\" y=\"%.1f\" width=\"%.1f\" height=\"%.1f\" class=\"frame\"/>", panel.x0,
                  panel.y0, kPanelWidth, kPanelHeight);
  const double below = panel.y0 + kPanelHeight;
  for (int k = panel.axes.cpu.low; k <= panel.axes.cpu.high; ++k) {
    const double x = panel.x(std::pow(10.0, k));
    text += format_text("<path d=\"M%.1f %.1fV%.1f\" class=\"grid\"/>", x, panel.y0, below);
    if (is_last || k < panel.axes.cpu.high) text += label(x, below + 17.0, "middle", power_of_ten(k));
  }
  const int every = panel.axes.error.width() > 8 ? 2 : 1;
  for (int k = panel.axes.error.low; k <= panel.axes.error.high; ++k) {
    const double y = panel.y(std::pow(10.0, k));
    text += format_text("<path d=\"M%.1f %.1fH%.1f\" class=\"grid\"/>", panel.x0, y, panel.x0 + kPanelWidth);
    if (is_first && k % every == 0) text += label(panel.x0 - 6.0, y + 4.0, "end", power_of_ten(k));
  }
  return text +
         label(panel.x0 + 0.5 * kPanelWidth, below + 36.0, "middle", "CPU time per simulated time [s/s]");
}

/// Returns the runs of one method in the order of its settings. Krylov's method and the
/// integration of points have a step and a tolerance, so only those of their runs are returned that no other
/// run beats in both error and time.
std::vector<const Run*> curve(const Study& study, const std::string& method, std::size_t load) {
  std::vector<const Run*> runs;
  bool is_swept_twice = false;
  for (const Run& run : study.runs)
    if (run.method == method && is_shown(run, load)) {
      runs.push_back(&run);
      is_swept_twice = is_swept_twice || (run.step > 0.0 && run.tolerance > 0.0);
    }
  if (!is_swept_twice) return runs;
  std::sort(runs.begin(), runs.end(),
            [load](const Run* a, const Run* b) { return *a->cpu[load] < *b->cpu[load]; });
  std::vector<const Run*> front;
  for (const Run* run : runs)
    if (front.empty() || run->elastic_error < 0.999 * front.back()->elastic_error) front.push_back(run);
  return front;
}

std::vector<std::string> methods_of(const Report& report) {
  std::vector<std::string> methods;
  for (const Style& style : kStyles)
    for (const Study& study : report.studies)
      if (std::any_of(study.runs.begin(), study.runs.end(),
                      [&](const Run& run) { return run.method == style.method; })) {
        methods.emplace_back(style.method);
        break;
      }
  return methods;
}

std::string curves(const Panel& panel, const Study& study, const std::vector<std::string>& methods,
                   std::size_t load) {
  std::string text;
  // rungs are drawn last, on top of the other methods
  for (auto method = methods.rbegin(); method != methods.rend(); ++method) {
    const std::vector<const Run*> runs = curve(study, *method, load);
    if (runs.empty()) continue;
    const Style& style = style_of(*method);
    std::string line, marks;
    for (const Run* run : runs) {
      const double x = panel.x(*run->cpu[load]), y = panel.y(drawn_error(*run));
      line += format_text("%s%.1f %.1f", line.empty() ? "M" : "L", x, y);
      marks += marker(x, y, style,
                      format_text("%s, %s: elastic error %.2e, %.2e s/s", method->c_str(),
                                  setting_of(*run).c_str(), run->elastic_error, *run->cpu[load]));
    }
    text +=
        "<path d=\"" + line +
        format_text("\" fill=\"none\" stroke=\"%s\" stroke-width=\"%.1f\"%s/>", style.colour, style.width,
                    *style.dash != '\0' ? format_text(" stroke-dasharray=\"%s\"", style.dash).c_str() : "");
    text += marks;
  }
  return text;
}

/// Returns the terms that a rung keeps, as a text, or an empty text for any other method.
std::string explain(const std::string& method) {
  static const std::map<std::string, const char*> kKept{
      {"rigid", "the body alone without deformation, so its elastic error is 1"},
      {"separated", "rigid and elastic motion are computed separately; the default rung"},
      {"spin-loaded", "the equations of separated and the centrifugal load of the spin"},
      {"coupled", "every term in the elastic displacements, between body and deformation in both directions"},
      {"corotational", "the equations of coupled, with springs and bars at their true length and direction"},
      {"corotational, points", "the same equations, integrated in Cartesian points"},
      {"full", "the equations of corotational, with as many substeps per tick as the fastest motion needs"}};
  const auto found = kKept.find(method);
  return found == kKept.end() ? std::string() : found->second;
}

constexpr std::size_t kLegendColumns = 5;

bool is_rung(const std::string& method) { return !explain(method).empty(); }

/// Returns the number of rows of the legend: one row for each rung, then rows with several other methods
/// each.
std::size_t legend_rows(const std::vector<std::string>& methods) {
  const auto num_rungs = static_cast<std::size_t>(std::count_if(methods.begin(), methods.end(), is_rung));
  return num_rungs + (methods.size() - num_rungs + kLegendColumns - 1) / kLegendColumns;
}

std::string legend_entry(const std::string& method, double x, double y) {
  const Style& style = style_of(method);
  const std::string dash =
      *style.dash != '\0' ? format_text(" stroke-dasharray=\"%s\"", style.dash) : std::string();
  const std::string kept = explain(method);
  return format_text("<path d=\"M%.1f %.1fh34\" fill=\"none\" stroke=\"%s\" stroke-width=\"%.1f\"%s/>", x, y,
                     style.colour, style.width, dash.c_str()) +
         marker(x + 17.0, y, style, "") +
         label(x + 42.0, y + 4.0, "start", escaped(kept.empty() ? method : method + ": " + kept));
}

std::string legend(const std::vector<std::string>& methods, double width, double top) {
  std::string text;
  double y = top;
  for (const std::string& method : methods) {
    if (!is_rung(method)) continue;
    text += legend_entry(method, kLeft, y);
    y += kLegendRow;
  }
  std::size_t index = 0;
  for (const std::string& method : methods) {
    if (is_rung(method)) continue;
    const std::size_t column = index % kLegendColumns, row = index / kLegendColumns;
    text += legend_entry(method, kLeft + width / kLegendColumns * static_cast<double>(column),
                         y + kLegendRow * static_cast<double>(row));
    ++index;
  }
  return text;
}

/// Returns a text that names the rungs of a scene that its panels do not show, or show only on the edge.
std::string not_drawn(const Study& study) {
  std::string missing, on_edge;
  for (const RungTraits& rung : kRungs) {
    bool is_drawn = false, is_fine = false;
    for (const Run& run : study.runs) {
      if (run.method != rung.name) continue;
      for (std::size_t load = 0; load < kReadOuts; ++load) is_drawn = is_drawn || is_shown(run, load);
      is_fine = is_fine || (run.failure.empty() && run.elastic_error <= kLeastError);
    }
    if (!is_drawn)
      missing += (missing.empty() ? "; rungs that are not drawn: " : ", ") + std::string(rung.name);
    if (is_fine)
      on_edge += (on_edge.empty() ? "; rungs with errors below the lowest grid line: " : ", ") +
                 std::string(rung.name);
  }
  return missing + on_edge;
}

constexpr const char* kLook =
    "<style>"
    "text{font:12px system-ui,'DejaVu Sans',Helvetica,Arial,sans-serif;fill:#1b1b1b}"
    ".head{font-size:14px;font-weight:600}.sub{font-size:12.5px}"
    ".paper{fill:#ffffff}.frame{fill:none;stroke:#555555}.grid{stroke:#dddddd;fill:none}.hollow{fill:#ffffff}"
    "@media (prefers-color-scheme:dark){text{fill:#e8e8e8}.paper{fill:#14171a}.frame{stroke:#a0a0a0}"
    ".grid{stroke:#33383d}.hollow{fill:#14171a}}"
    "@media print{text{fill:#000}.paper,.hollow{fill:#fff}.frame{stroke:#444}.grid{stroke:#ddd}}"
    "</style>";

}  // namespace

std::string escaped(const std::string& text) {
  std::string out;
  for (const char c : text) switch (c) {
      case '&':
        out += "&amp;";
        break;
      case '<':
        out += "&lt;";
        break;
      case '>':
        out += "&gt;";
        break;
      case '"':
        out += "&quot;";
        break;
      default:
        out += c;
    }
  return out;
}

std::string work_precision_svg(const Report& report) {
  const std::vector<std::string> methods = methods_of(report);
  const double legend_height = kLegendRow * static_cast<double>(legend_rows(methods)) + 14.0;
  const double row = kTitle + kPanelHeight + kBelow;
  const double inside = kReadOuts * kPanelWidth + (kReadOuts - 1) * kBetween;
  const double width = kLeft + inside + kRight;
  const double height = legend_height + 10.0 + row * static_cast<double>(report.studies.size());
  std::string text = format_text(
      "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 %.0f %.0f\" width=\"%.0f\" height=\"%.0f\" "
      "role=\"img\" aria-label=\"elastic error over CPU time\">",
      width, height, width, height);
  text += kLook;
  text += format_text("<rect width=\"%.0f\" height=\"%.0f\" class=\"paper\"/>", width, height);
  text += legend(methods, inside, 16.0);
  double top = legend_height + 10.0;
  for (const Study& study : report.studies) {
    const Scales axes = axes_of(study);
    std::string title = escaped(study.scene) + format_text(": %zu points, %zu links, up to %.3g rad/s",
                                                           study.points, study.links, study.top_frequency);
    if (study.spin > 0.0) title += format_text(", spin %g rad/s", study.spin);
    text += label(
        kLeft, top + 18.0, "start",
        title + "<tspan class=\"sub\" font-weight=\"400\">" + escaped(not_drawn(study)) + "</tspan>", "head");
    const double panel_top = top + kTitle;
    for (std::size_t load = 0; load < kReadOuts; ++load) {
      const Panel panel{axes, kLeft + static_cast<double>(load) * (kPanelWidth + kBetween), panel_top};
      text += label(panel.x0 + 0.5 * kPanelWidth, panel_top - 8.0, "middle", kReadOutNames[load], "sub");
      text += grid(panel, load == 0, load + 1 == kReadOuts) + curves(panel, study, methods, load);
    }
    const double middle = panel_top + 0.5 * kPanelHeight;
    text +=
        format_text("<text transform=\"translate(16 %.1f) rotate(-90)\" text-anchor=\"middle\">", middle) +
        "elastic error at the end [-]</text>";
    top += row;
  }
  return text + "</svg>\n";
}

}  // namespace freeflex::tools
