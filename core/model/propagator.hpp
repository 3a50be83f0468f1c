// Exact propagator of one mode over one period, load linear in the step (THEORY X10).
#pragma once

#include "core/step/plan.hpp"

namespace freeflex {

/// Fills mode `index` of `propagator`   (THEORY X10) for q'' + 2 decay q' + omega^2 q = Q / mass over
/// `period`, in extended precision from the exact doubles. omega >= 0, decay >= 0, period > 0, mass > 0.
void set_mode(Propagator& propagator, int index, double omega, double decay, double period, double mass);

}  // namespace freeflex
