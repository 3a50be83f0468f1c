// The lowest modes of a large structure, none missing.
#pragma once

#include "core/structure/link_factor.hpp"

namespace freeflex {

/// Which modes are kept: the lowest `count`, or all below a frequency, mechanisms among them; equal
/// frequencies stay together.
struct ModesWanted {
  double below = 0.0;  // [Hz] 0: by number
  int count = 0;       // at most, when `below` is given; 0: no such limit
};

/// What is said where `progress` ends a set-up.
inline constexpr const char* kSetupEnded = "the set-up was ended";

/// Fills omega, shapes, turns, particles, mechanisms, kept and what is stated of them, by shift-and-invert
/// Lanczos in slices   (THEORY X170 to X179). Errors: massless points that nothing holds, more
/// modes or mechanisms than can be taken, memory, a count that inertia does not confirm; `progress` that
/// ends it.
/// \pre structure.mass_properties; factor by factor_links_sparse
void find_sparse_modes(const Scene& scene, const LinkFactor& factor, const ModesWanted& wanted,
                       const SetupProgress& progress, Structure& structure, Faults& faults);

}  // namespace freeflex
