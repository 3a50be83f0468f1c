// Draws pictures and writes them to files: curves over time, and shapes.
#pragma once

#include <array>
#include <cstddef>
#include <memory>
#include <string>
#include <vector>

namespace freeflex::tools {

/// Returns true if a path ends in .svg or .png, in small letters or capitals.
bool is_picture(const std::string& path);
inline constexpr const char* kPictures = "NAME.svg or NAME.png";

struct Series {
  std::string name;
  std::vector<double> y;
};
/// Curves with a common vertical axis.
struct Panel {
  std::string label;      // with unit
  std::vector<double> x;  // abscissas of the values of all series
  std::vector<Series> series;
  std::vector<double> levels = {};  // values at which horizontal broken lines are drawn
};
/// Draws panels below each other with a common horizontal axis, each with a legend. Returns an empty text or
/// the error.  \param x_label  label of the horizontal axis, with unit
std::string plot_panels(const std::string& path, const std::string& title, const std::string& x_label,
                        const std::vector<Panel>& panels);

/// Label and displacements of a body that is drawn as lines, undeformed and deformed.
struct Shape {
  std::string label;
  // [-] displacement of each point, scaled so that the largest has length 1
  std::vector<std::array<float, 3>> displacement;
};
/// Draws one picture of each shape, in rows. Returns an empty text or the error.  \param rest  [m] positions
/// of the points
/// \param lines  pairs of points
std::string plot_shapes(const std::string& path, const std::string& title,
                        const std::vector<std::array<float, 3>>& rest,
                        const std::vector<std::array<std::size_t, 2>>& lines,
                        const std::vector<Shape>& shapes);

/// Reduces the values at successive ticks to the number of samples that a picture can show. Keeps the
/// smallest and the largest value of each group of ticks, so that no peak is lost and no aliasing occurs.
class Samples {
 public:
  explicit Samples(std::size_t num_columns) : least_(num_columns), largest_(num_columns) {}
  /// Adds one value for each column.
  void take(double time, const std::vector<double>& values);
  /// Returns the times that belong to the values of column().
  std::vector<double> time() const;
  /// Returns one value for each tick or, if ticks are grouped, the smallest and the largest value of each
  /// group, in this order.
  std::vector<double> column(std::size_t k) const;

 private:
  std::size_t every_ = 1, num_in_last_ = 1;  // number of ticks in each sample, and in the last sample
  std::vector<double> time_;
  std::vector<std::vector<double>> least_, largest_;
};

}  // namespace freeflex::tools
