// The plan of a scene without what the scene does not need.
#pragma once

#include <optional>

#include "core/plan/compile.hpp"

namespace freeflex {

/// The plan that programs run: the rung that `fidelity: auto` chooses, less what the scene does not need,
/// with an account of every part in Plan::parts   (THEORY section 14). What changes nothing beyond rounding
/// goes unless scene.leave_out keeps it; modes of a small share go within its tolerance; what only commands
/// could need goes as its on_need says. nullopt on an error. Cost: up to three times that of compile_plan,
/// and the steps over the horizon.
std::optional<Plan> compile_lean_plan(const Scene& scene, const Structure& structure, Faults& faults);

/// "damping", "gravity", "rotation", "out_of_plane", "unreached_modes", "small_modes", "point_rows".
const char* name_of(Part part);

}  // namespace freeflex
