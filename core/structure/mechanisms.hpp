// Motions that strain no link and are not rigid, from the rank of the geometry.
#pragma once

#include <functional>

#include "core/structure/structure.hpp"

namespace freeflex {

/// The mechanisms of a structure over its n freedoms, each freed of rigid motion that would only blur which
/// points move.
struct Mechanisms {
  Eigen::MatrixXd motions;  // [-] (n x count) largest component 1
  std::vector<Mechanism> names;
};

/// Places whose displacements tell which points a motion moves.
struct Places {
  Eigen::Matrix3Xd r;         // [m] (3 x P) from the centre of mass
  Eigen::MatrixXd rows;       // [-] (3P x n) displacements per motion; empty: motions are displacements
  std::vector<int> point_of;  // (P) point that a place belongs to; empty: in order
};

/// Null space of the unit rows besides rigid motion   (THEORY X50). Stiffnesses and masses take no part, so
/// no small frequency is ever taken for zero. \param unit_rows  [-] (num_rows x n) LinkFactor::unit_rows
/// \param rigid      [-] (n x 3..6) rigid motions
/// \param rounding   [-] relative error of the directions in unit_rows
Mechanisms find_mechanisms(const Eigen::MatrixXd& unit_rows, const Eigen::MatrixXd& rigid,
                           const Places& places, double rounding);

/// Displacements at the places of motions, a column each (3P x count).
using AtPlaces = std::function<Eigen::MatrixXd(const Eigen::MatrixXd&)>;

/// Localises motions that strain nothing and names the points that they move.
/// \param motions  (n x count) independent  \param rigid  (n x 3..6)  \param places  r and point_of
Mechanisms name_mechanisms(const Eigen::MatrixXd& motions, const Eigen::MatrixXd& rigid, const Places& places,
                           const AtPlaces& at_places);

}  // namespace freeflex
