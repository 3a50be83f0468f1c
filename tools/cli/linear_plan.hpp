// Plans for linear models.
#pragma once

#include <optional>
#include <string>

#include "core/plan.hpp"
#include "service/io/scene/input.hpp"
#include "tools/control/state_space.hpp"

namespace freeflex::tools {

/// Returns true if the plan has not all elastic modes of its scene.
bool leaves_modes_out(const Plan& plan);

struct LinearPlan {
  Plan plan;
  bool has_all_modes = true;  // false: the structure keeps only its lowest modes
};
/// Makes the plan of a scene with all its features, and with rows of the points and links that the ports
/// name. Prints the faults, and returns nullopt if one is an error. \param held  point or group that is held;
/// empty: none; the rung then has modes
std::optional<LinearPlan> load_linear_plan(const std::string& path, const io::Settings& settings,
                                           const control::Ports& ports, const std::string& held = {});

}  // namespace freeflex::tools
