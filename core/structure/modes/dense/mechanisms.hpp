// This code finds motions that strain no link and are not rigid. It uses the rank of unit rows, because unit
// rows contain only geometry.
#pragma once

#include <functional>

#include "core/structure/structure.hpp"

namespace freeflex {

/// The mechanisms of a structure over its n freedoms, with a large set of points at rest in all of them.
struct Mechanisms {
  Eigen::MatrixXd motions;  // [-] (n x count) largest component 1
  std::vector<Mechanism> names;
};

/// The sample points, whose displacements determine which points a motion moves.
struct SamplePoints {
  Eigen::Matrix3Xd r;         // [m] (3 x P) from the centre of mass
  Eigen::MatrixXd rows;       // [-] (3P x n) displacements per freedom; empty: freedoms are displacements
  std::vector<int> point_of;  // (P) index of the point of each sample; empty: sample k is point k
};

/// Returns the motions in the null space of the unit rows that contain no rigid motion   (THEORY 4.4 to 4.6).
/// The result depends neither on stiffness nor on mass, so a small frequency is never mistaken for zero.
/// \param unit_rows  [-] (num_rows x n) LinkFactor::unit_rows, then constraints
/// \param rigid      [-] (n x 3..6) rigid motions
/// \param rounding   [-] relative error of the directions in unit_rows
Mechanisms find_mechanisms(const Eigen::MatrixXd& unit_rows, const Eigen::MatrixXd& rigid,
                           const SamplePoints& samples, double rounding);

/// A function that returns the displacements of the sample points in given motions, one column for each
/// motion (3P x count).
using SampleDisplacements = std::function<Eigen::MatrixXd(const Eigen::MatrixXd&)>;

/// Localises motions that strain no link, and lists the points that they move (THEORY 4.4).
/// \param motions  (n x count) independent
/// \param rigid    (n x 3..6)
/// \param samples  only r and point_of are used
Mechanisms name_mechanisms(const Eigen::MatrixXd& motions, const Eigen::MatrixXd& rigid,
                           const SamplePoints& samples, const SampleDisplacements& displacements_of);

}  // namespace freeflex
