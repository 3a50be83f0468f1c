// Amplitudes of built-in loads over ticks since the epoch began (THEORY X13).
#pragma once

#include <cstdint>

#include "core/step/plan.hpp"

namespace freeflex {

/// sin(2 pi x) for x in [-1/2, 1/2] cycles   (THEORY X13), within 3e-16 of it, from + - * alone.
double sine_of_cycles(double cycles) noexcept;

/// Amplitude just after, just before, and half a period after a tick [-]. Only pulses differ between the
/// first two   (THEORY X13).
double amplitude_right(const PlanHistory& history, double period, std::int64_t tick) noexcept;
double amplitude_left(const PlanHistory& history, double period, std::int64_t tick) noexcept;
double amplitude_middle(const PlanHistory& history, double period, std::int64_t tick) noexcept;

}  // namespace freeflex
