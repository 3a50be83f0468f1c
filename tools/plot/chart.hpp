// Pictures in files: curves over time, and shapes.
#pragma once

#include <array>
#include <cstddef>
#include <memory>
#include <string>
#include <vector>

namespace freeflex::tools {

/// True of NAME.svg and NAME.png, capitals do not matter.
bool is_picture(const std::string& path);
inline constexpr const char* kPictures = "NAME.svg or NAME.png";

struct Series {
  std::string name;
  std::vector<double> y;
};
/// Curves with one vertical axis.
struct Panel {
  std::string label;      // with its unit
  std::vector<double> x;  // of the values of every series
  std::vector<Series> series;
  std::vector<double> levels = {};  // drawn across as broken lines
};
/// Panels below each other over one horizontal axis, each with a legend. Empty, or what went wrong.
/// \param x_label  of that axis, with its unit
std::string plot_panels(const std::string& path, const std::string& title, const std::string& x_label,
                        const std::vector<Panel>& panels);

/// A body as lines, at rest and deformed.
struct Shape {
  std::string label;
  std::vector<std::array<float, 3>> displacement;  // [-] of each point, the largest 1
};
/// One picture of each shape, in rows. \param rest  [m] of the points  \param lines  pairs of points
/// Empty, or what went wrong.
std::string plot_shapes(const std::string& path, const std::string& title,
                        const std::vector<std::array<float, 3>>& rest,
                        const std::vector<std::array<std::size_t, 2>>& lines,
                        const std::vector<Shape>& shapes);

/// Values of ticks that come one after another, in no more samples than a picture can show: of so many ticks
/// in turn the least and the largest, so that no peak is lost and nothing looks slower than it is.
class Samples {
 public:
  explicit Samples(std::size_t num_columns) : least_(num_columns), largest_(num_columns) {}
  /// One value for each column.
  void take(double time, const std::vector<double>& values);
  /// Of the values of a curve.
  std::vector<double> time() const;
  /// One for each tick; of several ticks the least, then the largest.
  std::vector<double> column(std::size_t k) const;

 private:
  std::size_t every_ = 1, num_in_last_ = 1;  // ticks of a sample, of the last one
  std::vector<double> time_;
  std::vector<std::vector<double>> least_, largest_;
};

}  // namespace freeflex::tools
