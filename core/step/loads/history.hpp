// Amplitudes of built-in loads over ticks since the epoch began (THEORY 8.10 to 8.13).
#pragma once

#include <cstdint>

#include "core/step/plan.hpp"

namespace freeflex {

/// Returns sin(2 pi x) for x in [-1/2, 1/2] cycles, within 3e-16, computed with sums and products only
/// (THEORY 8.12).
double sine_of_cycles(double cycles) noexcept;

/// Return the amplitude just after a tick, just before it, and half a period after it [-]. The amplitudes
/// just after and just before a tick differ only for pulses.
double amplitude_right(const PlanHistory& history, double period, std::int64_t tick) noexcept;
double amplitude_left(const PlanHistory& history, double period, std::int64_t tick) noexcept;
double amplitude_middle(const PlanHistory& history, double period, std::int64_t tick) noexcept;
/// Returns the amplitude at a fraction of a period after a tick, or before it, if no pulse begins or ends
/// between [-].
double amplitude_at(const PlanHistory& history, double period, std::int64_t tick, double fraction) noexcept;
/// Returns whether the slope of a table changes at a tick.
bool bends_at(const PlanHistory& history, double period, std::int64_t tick) noexcept;

}  // namespace freeflex
