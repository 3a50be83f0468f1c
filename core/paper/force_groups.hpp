// Self-equilibrated groups of forces, the raw material of unit elastic displacements (Alekseev 1970, sections
// 3 and 7).
#pragma once

#include <vector>

#include "core/structure/structure.hpp"

namespace freeflex {

/// What the points span, rounding apart; masses take no part   (THEORY X42, X80).
enum class ShapeClass { kPoint, kCollinear, kPlanar, kSpatial };

/// What the points of a scene span   (THEORY X42, X80).
ShapeClass shape_class(const std::vector<PointMass>& points, const MassProperties& properties);

/// How unit elastic displacements are made: three explicit recipes, each for its shape, the formal one for
/// any, the complement of the rigid motions by reflectors, the normal modes.
enum class Recipe { kCollinear, kPlanar, kSpatial, kFormal, kHouseholder, kModes };

/// "collinear", "planar", ... as the command line takes them.
const char* name_of(Recipe recipe);
const char* name_of(ShapeClass shape);

/// The explicit recipe of a shape   (THEORY X81-X83); formal for one point, which has no group.
Recipe recipe_of(ShapeClass shape);

/// Groups f, one a column, sum f = 0 and sum r x f = 0   (THEORY 3.1, X81-X84): collinear 3N - 5, planar
/// 3N - 6, spatial 3N - 6, formal 3N.
/// \param numbering  order in which an explicit recipe takes the points; the formal one takes unit loads in
///                   it, x, y and z of a point in turn
/// \return [N] (3N x num_groups); zero columns where a group has no direction, between points in one place
/// \pre collinear: the shape is; planar: it is planar; not kHouseholder, kModes
Eigen::MatrixXd force_groups(Recipe recipe, const std::vector<PointMass>& points,
                             const MassProperties& properties, const std::vector<int>& numbering);

/// Points in succession that decide whether an explicit recipe is complete: two in different places
/// (collinear), three off one line (planar), four off one plane (spatial)   (THEORY X85).
int window_size(Recipe recipe);

/// How far points in succession are from one place, line or plane: volume of the box on the steps from each
/// to the next over the product of their lengths [-] 0 to 1; 0 where two are in one place   (THEORY X85).
double window_spread(const MassProperties& properties, const std::vector<int>& window);

/// Below this spread [-] points count as on one line, in one plane.
inline constexpr double kFlatWindow = 1e-9;

/// The points in succession with the least spread   (THEORY X85); empty when there are fewer than a window.
std::vector<int> flattest_window(Recipe recipe, const MassProperties& properties,
                                 const std::vector<int>& numbering);

/// A numbering with few flat windows, none when one is found within a bounded number of tries: points sorted
/// along axes, each inserted where its flattest window is least flat, then the same from seeded random
/// orders   (THEORY X85). O(tries N^2).
std::vector<int> find_numbering(Recipe recipe, const MassProperties& properties);

}  // namespace freeflex
