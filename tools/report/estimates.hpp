// How honest the error estimate is: on random scenes, beside the full system (THEORY X97, X99).
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "core/scene/scene.hpp"
#include "core/step/budget.hpp"
#include "core/validity/judgement.hpp"

namespace freeflex::tools {

/// Scene `number` of a seed: a cloud with every pair joined, a square truss or a mast of tetrahedra, 4 to 20
/// points of 0.1 to 10 kg, springs of 1e3 to 1e9 N/m, spin of 0 to 5 rad/s and a pulse of 0.1 to 1000 N for
/// 0.1 s, each drawn per decade. The same numbers give the same scene.
Scene random_scene(std::uint64_t seed, int number);

/// A scene at 1 s and 1 kHz.
struct EstimateRow {
  int number = 0;
  std::string shape;
  double stiffness = 0.0, spin = 0.0, force = 0.0;  // [N/m], [rad/s], [N]
  ErrorSize truth, estimate;                        // of the separated rung, from the full system
  Verdict verdict;
  std::string cause;
  bool is_lost = false;  // the shadow left the numbers: no estimate, the verdict is outside
  // fidelity: auto, asked for `tolerance` of elastic error over the second
  double tolerance = 0.0;
  std::string chosen, cheapest;  // rung; "none" when none meets it
  double chosen_error = 0.0;     // [-] its true elastic error, largest over the samples
  std::string error;             // why the full system has no answer
};

/// \param keep_going  told the share that is done; false ends the study
std::vector<EstimateRow> study_estimates(std::uint64_t seed, int count,
                                         const std::function<bool(double)>& keep_going);

/// What the rows come to.
struct EstimateSummary {
  int num_scenes = 0, num_failed = 0;  // scenes with an answer of the full system, and without
  // shares of the scenes with an answer
  double inside_position = 0.0, inside_elastic = 0.0;  // the truth is at most the estimate
  double lower_position = 0.0,
         lower_elastic = 0.0;  // 95 % lower confidence bounds of these (Clopper-Pearson)
  double close_position = 0.0, close_elastic = 0.0;  // within a factor of 3
  double good = 0.0, watch = 0.0, outside = 0.0;
  double auto_meets = 0.0, auto_cheapest = 0.0;
};
EstimateSummary summarize(const std::vector<EstimateRow>& rows);

/// Estimate over truth, counted in bins of a fifth of a decade from 1/10 to 10: the first and last hold what
/// lies beyond.
inline constexpr int kNumBins = 12;
std::vector<int> histogram(const std::vector<EstimateRow>& rows, double ErrorSize::*which);

}  // namespace freeflex::tools
