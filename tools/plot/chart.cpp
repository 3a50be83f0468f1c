#include "tools/plot/chart.hpp"

#include <cairo/cairo-svg.h>
#include <cairo/cairo.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <utility>

#include "service/io/wire/log.hpp"
#include "tools/terminal/console.hpp"

namespace freeflex::tools {
namespace {

constexpr double kWidth = 900.0, kLeft = 90.0, kRight = 170.0, kTop = 40.0, kPanel = 150.0, kGap = 22.0;
constexpr std::size_t kMostSamples = 2000;  // about three samples per unit of the width of a panel

struct Colour {
  double r, g, b;
};
// the palette of Okabe and Ito, whose colours people with colour blindness can distinguish
constexpr std::array<Colour, 7> kColours{{{0.0, 0.45, 0.70},
                                          {0.84, 0.37, 0.0},
                                          {0.0, 0.62, 0.45},
                                          {0.80, 0.47, 0.65},
                                          {0.90, 0.62, 0.0},
                                          {0.34, 0.71, 0.91},
                                          {0.3, 0.3, 0.3}}};

std::string ending_of(const std::string& path) {
  std::string ending = std::filesystem::path(path).extension().string();
  for (char& c : ending) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return ending;
}

/// Draws a page with cairo and writes it to a file.
class Page {
 public:
  Page(const std::string& path, double width, double height)
      : target_(path), is_svg_(ending_of(path) == ".svg") {
    constexpr double kScale = 2.0;  // pixels per point, for high-resolution screens
    surface_.reset(is_svg_ ? cairo_svg_surface_create(target_.working_path().c_str(), width, height)
                           : cairo_image_surface_create(CAIRO_FORMAT_RGB24, static_cast<int>(kScale * width),
                                                        static_cast<int>(kScale * height)));
    cairo_.reset(cairo_create(surface_.get()));
    if (!is_svg_) cairo_scale(cairo_.get(), kScale, kScale);
    cairo_set_source_rgb(cairo_.get(), 1.0, 1.0, 1.0);
    cairo_paint(cairo_.get());
    cairo_select_font_face(cairo_.get(), "sans-serif", CAIRO_FONT_SLANT_NORMAL, CAIRO_FONT_WEIGHT_NORMAL);
    cairo_set_line_join(cairo_.get(), CAIRO_LINE_JOIN_ROUND);
  }

  cairo_t* get() const { return cairo_.get(); }
  void ink(const Colour& colour, double opacity = 1.0) {
    cairo_set_source_rgba(get(), colour.r, colour.g, colour.b, opacity);
  }
  /// Draws a text.  \param align  fraction of the text's width that is left of x
  void text(double x, double y, const std::string& label, double size, double align = 0.0) {
    cairo_text_extents_t extents;
    cairo_set_font_size(get(), size);
    cairo_text_extents(get(), label.c_str(), &extents);
    cairo_move_to(get(), x - align * extents.x_advance, y);
    cairo_show_text(get(), label.c_str());
  }
  /// Shortens a text to fit a width.
  std::string fitted(std::string label, double size, double width) {
    cairo_text_extents_t extents;
    cairo_set_font_size(get(), size);
    const auto is_too_wide = [&](const std::string& text) {
      cairo_text_extents(get(), text.c_str(), &extents);
      return extents.x_advance > width;
    };
    if (!is_too_wide(label)) return label;
    do {
      // cuts between two UTF-8 characters
      while (label.size() > 1 && (static_cast<unsigned char>(label.back()) & 0xC0U) == 0x80U)
        label.pop_back();
      label.pop_back();
    } while (!label.empty() && is_too_wide(label + "..."));
    return label + "...";
  }
  void line(double x0, double y0, double x1, double y1, double width) {
    cairo_set_line_width(get(), width);
    cairo_move_to(get(), x0, y0);
    cairo_line_to(get(), x1, y1);
    cairo_stroke(get());
  }
  /// Writes the file. Returns an empty text or the error.
  std::string finish() {
    cairo_.reset();
    cairo_status_t status = CAIRO_STATUS_SUCCESS;
    if (is_svg_) {
      cairo_surface_finish(surface_.get());
      status = cairo_surface_status(surface_.get());
    } else {
      status = cairo_surface_write_to_png(surface_.get(), target_.working_path().c_str());
    }
    if (status != CAIRO_STATUS_SUCCESS)
      return "cannot write '" + target_.working_path() + "': " + cairo_status_to_string(status);
    return target_.commit();
  }

 private:
  struct CloseSurface {
    void operator()(cairo_surface_t* surface) const { cairo_surface_destroy(surface); }
  };
  struct CloseCairo {
    void operator()(cairo_t* cairo) const { cairo_destroy(cairo); }
  };
  io::PartialFile target_;
  bool is_svg_;
  std::unique_ptr<cairo_surface_t, CloseSurface> surface_;
  std::unique_ptr<cairo_t, CloseCairo> cairo_;
};

/// Range of an axis and the distance between its tick marks.
struct Axis {
  double low = 0.0, high = 1.0, step = 1.0;

  static Axis over(double low, double high, int num_marks) {
    if (!(high > low)) {
      const double room = low == 0.0 ? 1.0 : 0.1 * std::abs(low);
      low -= room;
      high += room;
    }
    const double rough = (high - low) / num_marks, power = std::pow(10.0, std::floor(std::log10(rough)));
    double step = 10.0 * power;
    for (const double nice : {1.0, 2.0, 5.0})
      if (rough <= nice * power) {
        step = nice * power;
        break;
      }
    return {low, high, step};
  }
  std::vector<double> marks() const {
    std::vector<double> all;
    for (double k = std::ceil(low / step - 1e-9); k * step <= high + 1e-9 * step; ++k)
      all.push_back(k == 0.0 ? 0.0 : k * step);
    return all;
  }
};

/// Returns the number at a tick mark, with enough digits to differ from the neighbouring numbers.
std::string number(double value, const Axis& axis) {
  const double largest = std::max(std::abs(axis.low), std::abs(axis.high));
  const int digits = static_cast<int>(std::floor(std::log10(largest / axis.step))) + 2;
  return format_text("%.*g", std::clamp(digits, 4, 12), value);
}

void draw_curve(Page& page, const std::vector<double>& x, const std::vector<double>& y) {
  bool is_down = false;
  cairo_set_line_width(page.get(), 1.2);
  for (std::size_t k = 0; k < x.size(); ++k) {
    if (!std::isfinite(y[k])) {
      is_down = false;
      continue;
    }
    is_down ? cairo_line_to(page.get(), x[k], y[k]) : cairo_move_to(page.get(), x[k], y[k]);
    is_down = true;
  }
  cairo_stroke(page.get());
}

constexpr Colour kInk{0.15, 0.15, 0.15}, kGrid{0.86, 0.86, 0.86};
constexpr double kText = 11.0, kSmall = 10.0;

/// Returns the smallest and the largest of the values, or 0 and 0 if there are none.
std::array<double, 2> range_of(const std::vector<const std::vector<double>*>& all) {
  double low = HUGE_VAL, high = -HUGE_VAL;
  for (const std::vector<double>* values : all)
    for (const double value : *values)
      if (std::isfinite(value)) low = std::min(low, value), high = std::max(high, value);
  return low <= high ? std::array{low, high} : std::array{0.0, 0.0};
}

void draw_legend(Page& page, const Panel& panel, double top) {
  constexpr double kLine = 16.0, kRow = 15.0, kRoom = 6.0;
  const double left = kWidth - kRight + 10.0;
  for (std::size_t k = 0; k < panel.series.size(); ++k) {
    const double at = top + 12.0 + kRow * static_cast<double>(k);
    page.ink(kColours[k % kColours.size()]);
    page.line(left, at - 4.0, left + kLine, at - 4.0, 2.0);
    page.ink(kInk);
    const double text = left + kLine + 5.0;
    page.text(text, at, page.fitted(panel.series[k].name, kSmall, kWidth - kRoom - text), kSmall);
  }
}

void draw_panel(Page& page, const Panel& panel, const Axis& across, double top, bool is_last) {
  std::vector<const std::vector<double>*> all{&panel.levels};
  for (const Series& series : panel.series) all.push_back(&series.y);
  const auto [low, high] = range_of(all);
  const double margin = 0.04 * (high - low);  // keeps curves off the edge of the panel
  const Axis up = Axis::over(low - margin, high + margin, 6);
  const double width = kWidth - kLeft - kRight;
  const auto x_of = [&](double t) { return kLeft + (t - across.low) / (across.high - across.low) * width; };
  const auto y_of = [&](double v) { return top + kPanel * (1.0 - (v - up.low) / (up.high - up.low)); };
  for (const double mark : up.marks()) {
    page.ink(kGrid);
    page.line(kLeft, y_of(mark), kLeft + width, y_of(mark), 0.6);
    page.ink(kInk);
    page.text(kLeft - 6.0, y_of(mark) + 3.5, number(mark, up), kSmall, 1.0);
  }
  for (const double mark : across.marks()) {
    page.ink(kGrid);
    page.line(x_of(mark), top, x_of(mark), top + kPanel, 0.6);
    if (!is_last) continue;
    page.ink(kInk);
    page.text(x_of(mark), top + kPanel + 14.0, number(mark, across), kSmall, 0.5);
  }
  page.ink(kInk);
  page.text(kLeft, top - 6.0, page.fitted(panel.label, kText, width), kText);
  page.ink(kInk, 0.7);
  constexpr double kDash = 5.0;
  cairo_set_dash(page.get(), &kDash, 1, 0.0);
  for (const double level : panel.levels) page.line(kLeft, y_of(level), kLeft + width, y_of(level), 0.9);
  cairo_set_dash(page.get(), nullptr, 0, 0.0);
  for (std::size_t k = 0; k < panel.series.size(); ++k) {
    const std::vector<double>& values = panel.series[k].y;
    std::vector<double> x(panel.x.size()), y(values.size());
    std::transform(panel.x.begin(), panel.x.end(), x.begin(), x_of);
    std::transform(values.begin(), values.end(), y.begin(), y_of);
    page.ink(kColours[k % kColours.size()]);
    draw_curve(page, x, y);
  }
  draw_legend(page, panel, top);
}

/// Returns the isometric projection of a position, as coordinates to the right and up. The z axis points up.
std::array<double, 2> seen(const std::array<float, 3>& x) {
  constexpr double kCos = 0.8660254037844387;
  const double a = x[0], b = x[1], c = x[2];
  return {kCos * (b - a), c - 0.5 * (a + b)};
}

}  // namespace

bool is_picture(const std::string& path) {
  const std::string ending = ending_of(path);
  return ending == ".svg" || ending == ".png";
}

std::string plot_panels(const std::string& path, const std::string& title, const std::string& x_label,
                        const std::vector<Panel>& panels) {
  std::vector<const std::vector<double>*> all;
  all.reserve(panels.size());
  for (const Panel& panel : panels) all.push_back(&panel.x);
  if (std::all_of(all.begin(), all.end(), [](const auto* x) { return x->empty(); }))
    return "there is nothing to plot";
  const auto [low, high] = range_of(all);
  const Axis across = Axis::over(low, high, 8);
  const double height = kTop + static_cast<double>(panels.size()) * (kPanel + kGap) + 40.0;
  Page page(path, kWidth, height);
  page.ink(kInk);
  page.text(kLeft, 20.0, page.fitted(title, 13.0, kWidth - kLeft - 10.0), 13.0);
  double top = kTop + 8.0;
  for (const Panel& panel : panels) {
    draw_panel(page, panel, across, top, &panel == &panels.back());
    top += kPanel + kGap;
  }
  page.ink(kInk);
  page.text(kWidth - kRight, top - kGap + 30.0, x_label, kText, 1.0);
  return page.finish();
}

std::string plot_shapes(const std::string& path, const std::string& title,
                        const std::vector<std::array<float, 3>>& rest,
                        const std::vector<std::array<std::size_t, 2>>& lines,
                        const std::vector<Shape>& shapes) {
  constexpr std::size_t kColumns = 4;
  // kShown: largest drawn displacement, as a fraction of the size
  constexpr double kCell = 220.0, kLabel = 24.0, kShown = 0.12;
  constexpr Colour kGhost{0.7, 0.7, 0.7}, kBody{0.0, 0.3, 0.55}, kInk{0.1, 0.1, 0.1};
  if (shapes.empty()) return "there are no modes to plot";
  std::array<double, 2> low{HUGE_VAL, HUGE_VAL}, high{-HUGE_VAL, -HUGE_VAL};
  for (const auto& point : rest)
    for (std::size_t k = 0; k < 2; ++k) {
      low[k] = std::min(low[k], seen(point)[k]);
      high[k] = std::max(high[k], seen(point)[k]);
    }
  const double size = std::max({high[0] - low[0], high[1] - low[1], 1e-300}), scale = (kCell - 60.0) / size;
  const std::size_t rows = (shapes.size() + kColumns - 1) / kColumns;
  Page page(path, kColumns * kCell + 20.0, static_cast<double>(rows) * (kCell + kLabel) + kTop);
  page.ink(kInk);
  page.text(16.0, 22.0, title, 13.0);
  for (std::size_t s = 0; s < shapes.size(); ++s) {
    const std::size_t row = s / kColumns;
    const double left = 10.0 + kCell * static_cast<double>(s % kColumns),
                 top = kTop + (kCell + kLabel) * static_cast<double>(row);
    const auto position = [&](std::size_t point, double amplitude) {
      std::array<float, 3> at = rest[point];
      for (std::size_t k = 0; k < 3; ++k)
        at[k] += static_cast<float>(amplitude * size) * shapes[s].displacement[point][k];
      const auto [x, y] = seen(at);
      return std::array<double, 2>{left + kCell / 2 + (x - 0.5 * (low[0] + high[0])) * scale,
                                   top + kLabel + kCell / 2 - (y - 0.5 * (low[1] + high[1])) * scale};
    };
    for (const auto& [amplitude, colour, width] :
         {std::tuple{0.0, kGhost, 0.6}, std::tuple{kShown, kBody, rest.size() > 500 ? 0.5 : 1.2}}) {
      page.ink(colour);
      cairo_set_line_width(page.get(), width);
      for (const auto& [a, b] : lines) {
        const auto from = position(a, amplitude), to = position(b, amplitude);
        cairo_move_to(page.get(), from[0], from[1]);
        cairo_line_to(page.get(), to[0], to[1]);
      }
      cairo_stroke(page.get());
    }
    page.ink(kInk);
    page.text(left + 8.0, top + 14.0, shapes[s].label, 11.0);
  }
  return page.finish();
}

void Samples::take(double time, const std::vector<double>& values) {
  // fmin and fmax ignore NaN
  if (num_in_last_ < every_ && !time_.empty()) {
    ++num_in_last_;
    for (std::size_t k = 0; k < values.size(); ++k) {
      least_[k].back() = std::fmin(least_[k].back(), values[k]);
      largest_[k].back() = std::fmax(largest_[k].back(), values[k]);
    }
    return;
  }
  if (time_.size() == kMostSamples) {
    for (std::size_t at = 0; at < kMostSamples; at += 2) {
      time_[at / 2] = time_[at];
      for (std::size_t k = 0; k < values.size(); ++k) {
        least_[k][at / 2] = std::fmin(least_[k][at], least_[k][at + 1]);
        largest_[k][at / 2] = std::fmax(largest_[k][at], largest_[k][at + 1]);
      }
    }
    time_.resize(kMostSamples / 2);
    for (auto* columns : {&least_, &largest_})
      for (std::vector<double>& column : *columns) column.resize(kMostSamples / 2);
    every_ *= 2;
  }
  num_in_last_ = 1;
  time_.push_back(time);
  for (std::size_t k = 0; k < values.size(); ++k) {
    least_[k].push_back(values[k]);
    largest_[k].push_back(values[k]);
  }
}

std::vector<double> Samples::time() const {
  if (every_ == 1) return time_;
  std::vector<double> times;
  times.reserve(2 * time_.size());
  for (const double time : time_) times.insert(times.end(), {time, time});
  return times;
}

std::vector<double> Samples::column(std::size_t k) const {
  if (every_ == 1) return least_[k];
  std::vector<double> values;
  values.reserve(2 * time_.size());
  for (std::size_t at = 0; at < time_.size(); ++at)
    values.insert(values.end(), {least_[k][at], largest_[k][at]});
  return values;
}

}  // namespace freeflex::tools
