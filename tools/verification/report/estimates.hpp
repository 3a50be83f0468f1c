// Studies how reliable the error estimate is, by comparing it with the true error relative to the full system
// on random scenes (THEORY 15.5, 12.28).
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "core/error/verdict.hpp"
#include "core/scene/scene.hpp"

namespace freeflex::tools {

/// Returns scene `number` of a seed: a cloud of points with every pair joined, a square truss or a mast of
/// tetrahedra. The scene has 4 to 20 points of 0.1 to 10 kg, springs of some 1e3 to 1e9 N/m, a spin of 0 or
/// of 1e-3 to 5 rad/s, and a pulse of 0.1 to 1000 N that lasts 0.1 s. Masses, stiffnesses, spins and forces
/// are drawn uniformly per decade. The same seed and number give the same scene.
Scene random_scene(std::uint64_t seed, int number);

/// Holds the error of a motion.
struct ErrorSize {
  double attitude = 0.0;  // [rad]
  double elastic = 0.0;   // [-] of the elastic displacements, rms over the mass, over that of the true ones
};

/// Result for a scene after 1 s at 1 kHz.
struct EstimateRow {
  int number = 0;
  std::string shape;
  double stiffness = 0.0, spin = 0.0, force = 0.0;  // [N/m], [rad/s], [N]
  ErrorSize truth, estimate;                        // errors of the rung `separated`, relative to the full
                                                    // system
  Verdict verdict;
  std::string cause;
  bool is_lost = false;  // true if the shadow diverged, so there is no estimate and the verdict is `outside`
  // result of `fidelity: auto` with `tolerance` for the elastic error over the 1 s
  double tolerance = 0.0;
  std::string chosen, cheapest;  // rung, or "none" if no rung meets the tolerance
  // [-] largest true elastic error of the chosen rung at any tick, divided by the largest true displacement
  double chosen_error = 0.0;
  std::string error;  // reason why the full system gives no result, else empty
};

/// Studies `count` scenes of a seed.
/// \param keep_going  called with the finished fraction of the study; returns false to end the study
std::vector<EstimateRow> study_estimates(std::uint64_t seed, int count,
                                         const std::function<bool(double)>& keep_going);

/// Summarises the rows.
struct EstimateSummary {
  // number of scenes for which the full system gives a result, and for which it gives none
  int num_scenes = 0, num_failed = 0;
  // fractions of the estimates that are within a factor of 1.3 of the true error, their 95 % lower confidence
  // bounds (Clopper-Pearson), and the fractions within a factor of 3. Not counted: motions whose shadow
  // diverged, and true errors below kLeastAttitude and kLeastElastic
  double close_attitude = 0.0, close_elastic = 0.0;
  double lower_attitude = 0.0, lower_elastic = 0.0;
  double near_attitude = 0.0, near_elastic = 0.0;
  // fractions of num_scenes
  double good = 0.0, watch = 0.0, outside = 0.0;
  double auto_meets = 0.0, auto_cheapest = 0.0;
};
EstimateSummary summarize(const std::vector<EstimateRow>& rows);

/// True errors below these limits are not compared, because the reference has an error too.
inline constexpr double kLeastAttitude = 1e-9;  // [rad]
inline constexpr double kLeastElastic = 1e-6;

/// Number of bins of a histogram of the estimate divided by the true error. Ten bins are a fifth of a decade
/// wide each, from 1/10 to 10. The first bin contains all smaller ratios, and the last bin contains all
/// larger ratios.
inline constexpr int kNumBins = 12;
std::vector<int> histogram(const std::vector<EstimateRow>& rows, double ErrorSize::*which);

}  // namespace freeflex::tools
