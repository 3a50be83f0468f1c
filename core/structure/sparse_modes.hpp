// The lowest modes of a large structure, with a verified count.
#pragma once

#include "core/structure/link_factor.hpp"

namespace freeflex {

/// Modes to keep: the lowest `count`, or all below a frequency, including mechanisms. Modes of equal
/// frequency are kept together.
struct ModesWanted {
  double below = 0.0;  // [Hz] 0: no frequency limit
  int count = 0;       // largest number if `below` is given; 0: unlimited
};

/// Message if `progress` ends a set-up.
inline constexpr const char* kSetupEnded = "the set-up was ended";

/// Fills omega, shapes, rotations, particles, matrix_sums, mechanisms, kept, frequency_accuracy and
/// conditioning by shift-and-invert Lanczos in slices   (THEORY 16.33 to 16.45). Errors: massless points that
/// no link holds, too many modes or mechanisms, lack of memory, a number of modes that the Sturm sequence
/// does not verify, an end requested by `progress`.
/// \pre structure.mass_properties is filled; factor is from factor_links_sparse()
void find_sparse_modes(const Scene& scene, const LinkFactor& factor, const ModesWanted& wanted,
                       const SetupProgress& progress, Structure& structure, Faults& faults);

}  // namespace freeflex
