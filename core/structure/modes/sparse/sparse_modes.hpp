// Computes the lowest modes of a large structure and verifies their number.
#pragma once

#include "core/structure/links/link_factor.hpp"

namespace freeflex {

/// The choice of modes to keep. These modes are the lowest `count` modes or all modes below a frequency, and
/// mechanisms are included. Modes of equal frequency are kept together.
struct ModesWanted {
  double below = 0.0;  // [Hz] 0: no frequency limit
  int count = 0;       // number of modes, the largest if `below` is given; 0: no limit
};

/// The message that is reported if `progress` ends a set-up.
inline constexpr const char* kSetupEnded = "the set-up was ended";

/// Fills omega, shapes, rotations, particles, matrix_sums, mechanisms, kept, frequency_accuracy and
/// conditioning by shift-and-invert Lanczos in slices   (THEORY 16.33 to 16.45). The function adds an error
/// if links do not hold a massless point in every direction, if there are too many modes or mechanisms, if
/// memory is insufficient, if the Sturm sequence does not verify the number of modes, or if `progress`
/// requests the end.
/// \pre structure.mass_properties is filled; factor is from factor_links_sparse()
/// \return the static responses to the reference loads of the scene
StaticResponses find_sparse_modes(const Scene& scene, const LinkFactor& factor, const ModesWanted& wanted,
                                  const SetupProgress& progress, Structure& structure, Faults& faults);

}  // namespace freeflex
