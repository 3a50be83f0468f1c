// A motion as curves over time.
#pragma once

#include <string>
#include <vector>

#include "core/step/state.hpp"
#include "tools/plot/chart.hpp"

namespace freeflex::tools {

/// What of a motion is plotted: displacements, coordinates and energies of the modes that had the most
/// energy, place of the centre of mass, attitude and pointing error from the attitude at the start, rates,
/// and momenta of the wheels where there are any.
class MotionPlot {
 public:
  explicit MotionPlot(const Plan& plan);
  /// The state at the start and after every tick; it keeps what a picture can show.
  void take(const State& state);
  /// The curves with their labels.
  std::vector<Panel> panels() const;
  /// Empty, or what went wrong.
  std::string write(const std::string& path) const;

 private:
  void take_modes(const State& state);

  const Plan& plan_;
  const Plan& modal_plan_;            // whose modes are shown: the fallback plan where there is one
  std::vector<std::int32_t> points_;  // whose displacements are shown
  std::vector<double> q_, energy_;    // [m], [J] of each mode of that plan
  std::vector<double> most_energy_;   // [J] of each mode so far
  Quat first_{1.0, 0.0, 0.0, 0.0};    // attitude at the start
  bool has_first_ = false;
  std::vector<double> values_;
  Samples samples_;
};

/// Rotation vector from one attitude to another, axes of the first body: the shorter way round.  [rad]
Vec3 rotation_between(const Quat& from, const Quat& to);

}  // namespace freeflex::tools
