// Forces and energies of links at true geometry.
#pragma once

#include <span>

#include "core/step/state.hpp"

namespace freeflex {

/// Writes the forces of a link at true geometry, as LinkForceRows lists them, in local axes that turn with
/// the link: those of the chord of a beam or of the plane of a plate. Returns false and writes nothing if the
/// link is neither a beam nor a plate nor an angle spring.
bool read_true_link(const StepPlan& plan, const MotionState& state, std::int32_t link,
                    std::span<double> out) noexcept;

/// Holds the displacement of the second point of a bar relative to the first, and its rate, body axes.
struct BarMotion {
  Vec3 d, d_dot;  // [m], [m/s]
};
BarMotion read_bar(const StepPlan& plan, const MotionState& state, const PlanBar& bar) noexcept;

/// Returns the strain energy of all links at true geometry minus that of the linear ones [J].
double strain_energy_beyond_linear(const StepPlan& plan, const MotionState& state) noexcept;

}  // namespace freeflex
