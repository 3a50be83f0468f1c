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
  std::string label;  // with its unit
  std::vector<Series> series;
};
/// Panels below each other over one time axis [s]. Empty, or what went wrong.
std::string plot_panels(const std::string& path, const std::string& title, const std::vector<double>& time,
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

/// Values of ticks that come one after another, no more of them than a picture can show: when there are too
/// many every other one goes.
class Samples {
 public:
  explicit Samples(std::size_t num_columns) : columns_(num_columns) {}
  /// True when a tick is to be taken.
  bool is_due() { return count_++ % every_ == 0; }
  /// \pre is_due() just said so; one value for each column
  void take(double time, const std::vector<double>& values);
  const std::vector<double>& time() const { return time_; }
  const std::vector<double>& column(std::size_t k) const { return columns_[k]; }

 private:
  std::size_t every_ = 1, count_ = 0;
  std::vector<double> time_;
  std::vector<std::vector<double>> columns_;
};

}  // namespace freeflex::tools
