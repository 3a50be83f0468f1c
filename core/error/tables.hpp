// The part of a plan that only the verdict reads. The step does not read it.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "core/step/plan.hpp"

namespace freeflex {

/// Maps the elastic coordinates of a plan to those of its shadow   (THEORY 15.3).
struct ShadowModes {
  std::vector<std::int32_t> numbers;  // index in the shadow of each mode of the plan, if they are the same
  // [-] (num_elastic of the plan x num_padded of the shadow) sum m b_shadow . b / M, if the modes differ
  Array projection;
};

/// Holds a shadow: a better plan of the same scene, and how it is stepped beside the plan that it accompanies
/// (THEORY 15.1).
struct PlanShadow {
  /// The largest values of `ticks`, `every` and `horizon_ticks`. Sums and products of them fit into 64 bits.
  static constexpr std::int32_t kMostTicks = 64;
  static constexpr std::int64_t kMostHorizons = 1'000'000, kMostHorizonTicks = std::int64_t{1} << 36;

  StepPlan plan;
  // A step of the shadow spans `ticks` ticks, or each tick has `substeps` of them. At least one of the two
  // is 1.
  std::int32_t ticks = 1, substeps = 1;
  std::int64_t horizon_ticks = 1;    // length of a horizon, a multiple of `ticks`
  std::int64_t every = 1;            // one in this many horizons is judged
  std::int64_t delay_ticks = 0;      // a daemon publishes the result for tick k at tick k + delay_ticks
  std::array<ShadowModes, 2> modes;  // of the plan, and of its fallback plan
};

/// Returns whether a shadow takes the loads as the scene gives them. If its plan divides its steps because of
/// spin or wheels, or is below the coupled rungs, it takes them as its plan samples them   (THEORY 15.2).
inline bool takes_scene_loads(const PlanShadow& shadow) noexcept {
  return is_coupled(shadow.plan) && shadow.plan.coupled.num_substeps == 1;
}

/// Names the errors that a shadow shares with the state, so that the distance between them does not show
/// them.
enum class SharedError : std::int32_t {
  kNone = 0,
  kInside = 1,      // the inside of matrices, flexibilities and superelements, which is not known
  kTruncation = 2,  // the modes that neither the plan nor the shadow has
  kRung = 3,        // no rung with true geometry supports the scene
  kNoShadow = 4,    // no better plan supports the scene, so nothing is judged
  kInsideMass = 5,  // as kInside, of superelements with mass at inner coordinates
};

/// Holds what the verdict on a motion needs   (THEORY section 15).
struct PlanVerdict {
  bool is_off = true;               // true: nothing is judged
  double horizon = 0.0;             // [s] length of a horizon; 0: automatic
  double share = 0.0;               // [-] of a processor that the shadow may take
  double longest_step = 0.0;        // [s] of the shadow; 0: automatic
  std::vector<PlanShadow> shadows;  // one, or none if nothing is judged
  double tolerance = 0.0;           // [m] tolerance of the scene for displacements; 0: none given
  SharedError shared = SharedError::kNone;
  std::string shared_text;  // why, or the name of the item
  // indices of histories that change faster than the steps of the shadow resolve
  std::vector<std::int32_t> fast_loads;
  // [rad/s] lowest elastic frequency of the structure; 0: none
  double lowest_omega = 0.0;
};

}  // namespace freeflex
