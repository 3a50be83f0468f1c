// Choice of the features that a plan omits, with a report on each   (THEORY section 14).
#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "core/plan/omit/motion_scope.hpp"
#include "core/plan/omit/small_modes.hpp"
#include "core/plan/spec.hpp"

namespace freeflex {

/// Holds the spec of a plan that omits features, and a report on every feature. The spec omits a feature if
/// the omission changes the motion by no more than rounding errors, unless scene.leave_out keeps the feature.
/// The spec also omits modes that are small within the tolerance of scene.leave_out. Whether it omits a
/// feature that only commands could need depends on scene.leave_out.on_need.
struct ReducedSpec {
  PlanSpec spec;
  // structure of the scene, or a copy if modes of equal frequency were rotated so that few are excited
  // (THEORY 14.3)
  std::shared_ptr<const Structure> structure;
  MotionScope motion;                 // possible motions; includes those due to commands if on_need is keep
  std::vector<PlanFeature> features;  // by Feature
  double horizon = 0.0;               // [s] horizon of the estimated errors of omitting small modes
};

/// Returns true for a scene of point masses on the rung `separated` or `spin-loaded`. Plans of such scenes
/// may omit features.
bool may_leave_out(const Structure& structure, Fidelity rung);

/// Returns true if a plan on the rung `coupled` may omit small modes. No other feature may be omitted by such
/// a plan. The scene must consist of point masses that do not lie on a line, because for points on a line
/// modes come in pairs about the line.
bool may_leave_out_modes(const Scene& scene, const Structure& structure, Fidelity rung);

/// Returns a spec that omits nothing, for leave_out_small_modes.
/// \pre may_leave_out_modes(scene, structure, rung)
ReducedSpec keep_all(const Scene& scene, const Structure& structure, const PlanSpec& spec);

/// Returns the report on the features of a plan that omits nothing. Warns if the scene gives a tolerance,
/// because the tolerance then has no effect.
std::vector<PlanFeature> report_on_full_plan(const Scene& scene, const Structure& structure, Fidelity rung,
                                             Faults& faults);

/// Returns `spec` without the features that the scene does not need   (THEORY 14.2 to 14.5).
/// \param full  plan compiled from `spec`, with all features
/// \pre may_leave_out(structure, spec.rung)
ReducedSpec leave_out_unneeded(const Scene& scene, const Structure& structure, const PlanSpec& spec,
                               const Plan& full);

/// Omits small modes from `reduced`, in addition to what it already omits (THEORY 14.10). If there are no
/// small modes, returns false and leaves the spec unchanged.
/// \param plan  The plan compiled from reduced.spec. The function steps this plan over the horizon.
bool leave_out_small_modes(const Scene& scene, const Plan& plan, ReducedSpec& reduced);

/// Returns the spec of the fallback plan, which has the modes of the reduced plan and all modes that commands
/// can excite (THEORY 14.16). Returns nullopt unless on_need is replan and commands may need an omitted
/// feature.
std::optional<PlanSpec> fallback_spec(const Scene& scene, const ReducedSpec& reduced);

}  // namespace freeflex
