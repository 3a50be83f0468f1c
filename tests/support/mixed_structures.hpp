// Random structures with links of every kind, as Scene values.
#pragma once

#include <cstdint>

#include "core/scene/scene.hpp"

namespace freeflex::testing {

/// Kinds of link that a random structure may have in addition to springs, bars and beams.
struct Mixture {
  bool plates = true, angles = true, matrices = true, rigid = true, releases = true;
};

/// Returns random points of 0.3 to 3 kg in a box of some 3 m, no two closer than 0.5 m. A tree of beams joins
/// all points, and there are links of every kind that the mixture allows. The highest frequency is some 100
/// times the lowest. The same seed gives the same scene.  \pre 6 <= num_points <= 20
Scene random_mixture(std::uint64_t seed, int num_points, const Mixture& mixture = {});

}  // namespace freeflex::testing
