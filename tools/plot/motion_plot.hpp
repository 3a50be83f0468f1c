// A motion as curves over time.
#pragma once

#include <string>
#include <vector>

#include "core/step/state.hpp"
#include "tools/plot/chart.hpp"

namespace freeflex::tools {

/// What of a motion is plotted: displacements, the lowest elastic coordinates, place of the centre of mass,
/// spin, and momenta of the wheels where there are any.
class MotionPlot {
 public:
  explicit MotionPlot(const Plan& plan);
  /// The state at the start and after every tick; it keeps what a picture can show.
  void take(const State& state);
  /// Empty, or what went wrong.
  std::string write(const std::string& path) const;

 private:
  struct Curve {
    std::size_t panel;
    std::string name;
  };

  const Plan& plan_;
  std::vector<std::int32_t> points_;  // whose displacements are shown
  std::size_t num_modes_;
  std::vector<std::string> panels_;
  std::vector<Curve> curves_;
  std::vector<double> values_;
  Samples samples_;
};

}  // namespace freeflex::tools
