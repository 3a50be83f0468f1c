// The rounding error of doubles, and the limit of a collinear shape.
#pragma once

#include <limits>

namespace freeflex {

inline constexpr double kEpsilon = std::numeric_limits<double>::epsilon();

/// A shape is collinear if the distance of every point from the line is at most this number times kEpsilon
/// times the largest coordinate   (THEORY 2.9).
inline constexpr double kCollinearRoundings = 64.0;

}  // namespace freeflex
