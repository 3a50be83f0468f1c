// Measures what each omission of a plan saves (THEORY section 14): the CPU time of a tick and the size of the
// plan, with and without the feature.
#pragma once

#include <cmath>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "core/plan.hpp"
#include "core/scene/scene.hpp"

namespace freeflex::tools {

/// Result for one feature of one scene.
struct OmissionRow {
  std::string scene;
  std::optional<Feature> feature;  // nullopt: the second plan, which is stepped when a command needs it
  bool is_default = false;         // true: the plan of the scene as it is written omits the feature
  std::int32_t count = 0;          // number of modes or points that are omitted
  double ns_with = NAN;            // [ns] median CPU time of a tick with the feature; NaN: not omitted
  double ns_without = NAN;         // [ns] the same without the feature
  double ratio = NAN;              // [-] median of without / with over the turns in which both were timed
  double bytes_with = NAN, bytes_without = NAN;  // size of the plan file
  std::string why;                               // reason why the feature is kept, or a failure
};

/// Times each omission of a scene. The scene is taken with `on_need: refuse`, so that the plan omits as much
/// as it can, and with a tolerance of 1e-3 for small modes if it gives none. Each omission is then undone
/// alone. The second plan is timed with `on_need: replan` against `keep`. Returns an empty list if the scene
/// has no structure. \param keep_going  called with the finished fraction; returns false to end the study
std::vector<OmissionRow> study_omissions(const Scene& scene, const std::function<bool(double)>& keep_going);

/// Returns the name of the omission in tables: that of the feature, or "second_plan".
std::string omission_name(const OmissionRow& row);

}  // namespace freeflex::tools
