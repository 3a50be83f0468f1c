// Plots a motion as curves over time.
#pragma once

#include <string>
#include <vector>

#include "core/step/state.hpp"
#include "tools/plot/chart.hpp"

namespace freeflex::tools {

/// Plots the displacements of points, the coordinates and energies of the modes with the largest peak energy,
/// the position of the centre of mass, the attitude and pointing error relative to the initial attitude, the
/// angular velocity, and the momenta of wheels.
class MotionPlot {
 public:
  explicit MotionPlot(const Plan& plan);
  /// Adds a state. Must be called at the start and after every tick. Of all states, only the samples that a
  /// picture can show are kept.
  void take(const State& state);
  /// Returns the curves with their labels.
  std::vector<Panel> panels() const;
  /// Writes the picture. Returns an empty text or the error.
  std::string write(const std::string& path) const;

 private:
  void take_modes(const State& state);

  const Plan& plan_;
  const StepPlan& modal_plan_;  // plan whose modes are shown: the fallback plan if there is one, else plan_
  std::vector<std::int32_t> points_;  // points whose displacements are shown
  std::vector<double> q_, energy_;    // [m], [J] for each mode of modal_plan_
  std::vector<double> most_energy_;   // [J] largest energy of each mode so far
  Quat first_{1.0, 0.0, 0.0, 0.0};    // attitude at the start
  bool has_first_ = false;
  std::vector<double> values_;
  Samples samples_;
};

/// Returns the rotation vector [rad] from one attitude to another, in the body axes of the first attitude.
/// The length of the rotation vector is at most pi.
Vec3 rotation_between(const Quat& from, const Quat& to);

}  // namespace freeflex::tools
