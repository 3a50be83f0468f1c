// What a plan may do without: which modes and which code, and the account of it   (THEORY section 14).
#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "core/plan/motion_scope.hpp"
#include "core/plan/small_modes.hpp"
#include "core/plan/spec.hpp"

namespace freeflex {

/// A spec with an account of every part. What changes nothing beyond rounding is left out unless
/// scene.leave_out keeps it; modes of a small share go within its tolerance; what only commands could need
/// goes as its on_need says.
struct LeanSpec {
  PlanSpec spec;
  // that of the scene, or its own with modes of equal frequency turned so that few are reached   (X120)
  std::shared_ptr<const Structure> structure;
  MotionScope motion;           // what the scene, with or without commands, can do
  std::vector<PlanPart> parts;  // by Part
  double horizon = 0.0;         // [s] over which small modes were judged
  double small_size = 0.0;      // [m] rms over all points of small modes that go
};

/// The rungs that lack modes or code only where a scene needs neither; the others are advanced whole.
bool may_leave_out(const Scene& scene, Fidelity rung);

/// The coupled rung may lack small modes, and nothing else: not those of a line, which come in pairs about
/// it, nor of bodies.
bool may_leave_out_modes(const Scene& scene, const Structure& structure, Fidelity rung);

/// A spec with nothing left out, for leave_out_small_modes.  \pre may_leave_out_modes(scene, structure, rung)
LeanSpec keep_all(const Scene& scene, const Structure& structure, const PlanSpec& spec);

/// The account of a plan that is advanced whole. Warns of a tolerance that has no effect.
std::vector<PlanPart> account_of_whole(const Scene& scene, Fidelity rung, Faults& faults);

/// Without what nothing needs.
/// \param whole  compiled from `spec`, with everything in it  \pre may_leave_out(scene, spec.rung)
LeanSpec leave_out_unneeded(const Scene& scene, const Structure& structure, const PlanSpec& spec,
                            const Plan& whole);

/// Without modes of a small share besides. False when there are none, and the spec is as it was.
/// \param plan  compiled from lean.spec; it is stepped over the horizon
bool leave_out_small_modes(const Scene& scene, const Plan& plan, LeanSpec& lean);

/// Everything that commands can reach, where they are refused what `lean` has left out but for on_need:
/// replan. nullopt when nothing is refused.
std::optional<PlanSpec> wide_spec(const Scene& scene, const LeanSpec& lean);

}  // namespace freeflex
