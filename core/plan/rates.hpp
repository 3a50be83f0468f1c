// A plan at a rate: what of it depends on the period.
#pragma once

#include <cstdint>
#include <span>
#include <string>

#include "core/step/plan.hpp"

namespace freeflex {

/// The plan, its wide plan and its shadows at another rate [Hz]: propagators, what keeps modes from being
/// independent, ticks of histories, parts of a tick.
/// \pre rate finite, > 0
void set_rate(Plan& plan, double rate);

/// Parts of a tick, a power of two, in which every mode that parts can resolve turns by 1 rad at most, and
/// the stiffest by what exact bars hold to: spin turns what vibrates, and a step that does not resolve the
/// vibration does not see it   (X96).
/// \param omega  [rad/s] of every mode  \param period  [s]
std::int32_t resolving_parts(std::span<const double> omega, double period);

/// Steps a tick of a shadow of a plan on `rung`, when the best one takes `parts`   (X96).
std::int32_t shadow_steps(PlanShadow::Kind kind, Fidelity rung, std::int32_t parts);

/// A horizon [s] in ticks, at least 1.
std::int64_t horizon_in_ticks(double horizon, double period);

/// What to say of a plan whose fastest mode is more than a thousand times as fast as its ticks: masses or
/// stiffnesses are likely to be in another unit. Empty: nothing.
std::string find_fast_modes(const Plan& plan);

}  // namespace freeflex
