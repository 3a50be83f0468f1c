// Rounding of doubles, and how many of its steps make a shape collinear.
#pragma once

#include <limits>

namespace freeflex {

inline constexpr double kEpsilon = std::numeric_limits<double>::epsilon();

/// A shape is collinear when no point is farther from its line than this many roundings of the largest
/// coordinate   (THEORY X42).
inline constexpr double kCollinearRoundings = 64.0;

}  // namespace freeflex
