// Exact propagator of one mode over one period, load linear in the step (THEORY X10).
#pragma once

#include "core/step/plan.hpp"

namespace freeflex {

/// Fills mode `index` of `propagator`   (THEORY X10) for q'' + 2 decay q' + omega^2 q = Q / M over
/// `period`, in extended precision from the exact doubles. omega >= 0, decay >= 0, period > 0, mass > 0.
void set_mode(Propagator& propagator, int index, double omega, double decay, double period, double mass);

/// Lanes to undamped ones, of which the step reads a sixth less.  \pre no mode has decay
void drop_damping(Propagator& propagator);

/// Rows of PlanCoupled::functions for one mode, phi_k(h L) with L = [0 1; -omega^2, -2 decay], in extended
/// precision (THEORY X93).
using ModeFunctions = std::array<double, std::size_t{PlanCoupled::kNumFunctions} * PlanCoupled::kNumEntries>;
ModeFunctions mode_functions(double omega, double decay, double period);

}  // namespace freeflex
