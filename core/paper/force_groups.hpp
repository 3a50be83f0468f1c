// Self-equilibrated groups of forces, from which unit elastic displacements are made (Alekseev 1970, sections
// 3 and 7). THEORY 4.1, 11.1 to 11.10
#pragma once

#include <vector>

#include "core/structure/structure.hpp"

namespace freeflex {

/// Lists the classes of shape. The class names the smallest of a point, a line, a plane and space that
/// contains all points, except for rounding errors. The masses of the points do not matter
/// (THEORY 2.9, 2.10, 11.5).
enum class ShapeClass { kPoint, kCollinear, kPlanar, kSpatial };

/// Returns the class of the points of a scene. Points that are not collinear are planar if there are three of
/// them, or if no point is farther than 64 rounding errors of the largest coordinate from the plane that fits
/// them best, which has the normal n: max |n.r_i| <= 64 eps max |p_i|   (THEORY 11.5)
ShapeClass shape_class(const std::vector<PointMass>& points, const MassProperties& properties);

/// Lists the ways to make unit elastic displacements: an explicit recipe for each of three shapes, the formal
/// recipe for any shape, the complement of the rigid motions by Householder reflectors, and the normal modes.
enum class Recipe { kCollinear, kPlanar, kSpatial, kFormal, kHouseholder, kModes };

/// Returns the name that the command line accepts: "collinear", "planar", ...
const char* name_of(Recipe recipe);
const char* name_of(ShapeClass shape);

/// Returns the explicit recipe for a class of shape (THEORY 11.7 to 11.9). For one point, returns the formal
/// recipe, from which no force group is kept.
Recipe recipe_of(ShapeClass shape);

/// Makes groups f, one in each column, with sum f = 0 and sum r x f = 0   (THEORY 4.1, 11.4, 11.6 to 11.9).
/// The collinear recipe has 3N - 5 groups, the planar and the spatial recipe 3N - 6, the formal recipe 3N.
/// \param numbering  order in which a recipe takes the points; the formal recipe applies unit loads along x,
/// y and z to each point
/// \return [N] (3N x num_groups), with zero columns for pairs of points at one position, which have no
/// direction
/// \pre the shape is collinear for kCollinear and planar for kPlanar; recipe is not kHouseholder or kModes
Eigen::MatrixXd force_groups(Recipe recipe, const std::vector<PointMass>& points,
                             const MassProperties& properties, const std::vector<int>& numbering);

/// Returns the number of points in a window. An explicit recipe is complete if in every window of successive
/// points the two points are at different positions (collinear), the three points are not on one line
/// (planar), or the four points are not in one plane (spatial) (THEORY 11.10).
int window_size(Recipe recipe);

/// Returns the spread of a window of successive points, 0 to 1 [-], where d are the vectors from each point
/// to the next (THEORY 11.10):
///   |d_1.(d_2 x d_3)| / (|d_1| |d_2| |d_3|) (spatial),   |d_1 x d_2| / (|d_1| |d_2|) (planar),   1 (line)
/// It is 0 if two successive points are at one position.
double window_spread(const MassProperties& properties, const std::vector<int>& window);

/// A window with a smaller spread [-] is flat: its points are treated as on one line or in one plane.
inline constexpr double kFlatWindow = 1e-9;

/// Returns the window with the least spread   (THEORY 11.10). Returns an empty window if there are fewer
/// points than window_size(recipe).
std::vector<int> flattest_window(Recipe recipe, const MassProperties& properties,
                                 const std::vector<int>& numbering);

/// Tries a bounded number of numberings, and returns the one with the fewest flat windows. Most tries insert
/// the points one by one, each where the windows that contain it are least flat. The points are inserted in
/// the order of the scene, in the order along an axis, or in seeded random orders (THEORY 11.10). The cost is
/// O(tries N^2).
std::vector<int> find_numbering(Recipe recipe, const MassProperties& properties);

}  // namespace freeflex
