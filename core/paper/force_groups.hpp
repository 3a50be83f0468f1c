// Self-equilibrated groups of forces, from which unit elastic displacements are made (Alekseev 1970, sections
// 3 and 7). THEORY 4.1, 11.1 to 11.10
#pragma once

#include <vector>

#include "core/structure/structure.hpp"

namespace freeflex {

/// The classes of shape. A class says what the points span, except for rounding errors, and masses have no
/// influence (THEORY 2.9, 2.10, 11.5).
enum class ShapeClass { kPoint, kCollinear, kPlanar, kSpatial };

/// Returns the class of the points of a scene. Points are planar if there are three of them, or if no point
/// is farther from the best plane, with normal n, than 64 rounding errors of the largest coordinate
/// (THEORY 11.5): max |n.r_i| <= 64 eps max |p_i|
ShapeClass shape_class(const std::vector<PointMass>& points, const MassProperties& properties);

/// The ways to make unit elastic displacements. They are three explicit recipes, each for its shape, the
/// formal recipe for any shape, the complement of the rigid motions by reflectors, and the normal modes.
enum class Recipe { kCollinear, kPlanar, kSpatial, kFormal, kHouseholder, kModes };

/// Returns the name that the command line accepts: "collinear", "planar", ...
const char* name_of(Recipe recipe);
const char* name_of(ShapeClass shape);

/// Returns the explicit recipe of a shape   (THEORY 11.7 to 11.9). For one point, returns the formal recipe,
/// which has no force group.
Recipe recipe_of(ShapeClass shape);

/// Makes groups f, one in each column, with sum f = 0 and sum r x f = 0   (THEORY 4.1, 11.4, 11.6 to 11.9).
/// The collinear recipe has 3N - 5 groups, the planar and the spatial recipe 3N - 6, the formal recipe 3N.
/// \param numbering  order in which a recipe takes the points; the formal recipe takes unit loads along x, y
/// and z of each point
/// \return [N] (3N x num_groups), with zero columns for pairs of points at one position, which have no
/// direction
/// \pre the shape is collinear for kCollinear and planar for kPlanar; recipe is not kHouseholder or kModes
Eigen::MatrixXd force_groups(Recipe recipe, const std::vector<PointMass>& points,
                             const MassProperties& properties, const std::vector<int>& numbering);

/// Returns the number of successive points that decide whether an explicit recipe is complete. The number is
/// two at different positions (collinear), three that are not on one line (planar), four that are not in one
/// plane (spatial) (THEORY 11.10).
int window_size(Recipe recipe);

/// Returns the spread of a window of successive points, 0 to 1 [-], where d are the vectors from each point
/// to the next (THEORY 11.10):
///   |d_1.(d_2 x d_3)| / (|d_1| |d_2| |d_3|) (spatial),   |d_1 x d_2| / (|d_1| |d_2|) (planar),   1 (line)
/// It is 0 if two successive points are at one position.
double window_spread(const MassProperties& properties, const std::vector<int>& window);

/// If the spread [-] is smaller, points are treated as on one line or in one plane.
inline constexpr double kFlatWindow = 1e-9;

/// Returns the window with the least spread   (THEORY 11.10). The window is empty if there are fewer points
/// than in a window.
std::vector<int> flattest_window(Recipe recipe, const MassProperties& properties,
                                 const std::vector<int>& numbering);

/// Tries a bounded number of numberings, and returns the one with the fewest flat windows. Some tries sort
/// the points along axes and insert each point where its flattest window is least flat, but the other tries
/// start from seeded random orders (THEORY 11.10). The cost is O(tries N^2).
std::vector<int> find_numbering(Recipe recipe, const MassProperties& properties);

}  // namespace freeflex
