// Motions that strain no link and are not rigid, from the rank of the geometry.
#pragma once

#include "core/structure/structure.hpp"

namespace freeflex {

/// The mechanisms of a structure as displacements, each freed of rigid motion that would only blur which
/// points move.
struct Mechanisms {
  Eigen::MatrixXd motions;  // [-] (3N x count) largest component 1
  std::vector<Mechanism> names;
};

/// Null space of the unit rows besides rigid motion   (THEORY X50). Stiffnesses and masses take no part, so
/// no small frequency is ever taken for zero. \param unit_rows  [-] (num_rows x 3N) LinkFactor::unit_rows
/// \param rounding   [-] relative error of the directions in unit_rows
Mechanisms find_mechanisms(const Eigen::MatrixXd& unit_rows, const MassProperties& properties,
                           double rounding);

}  // namespace freeflex
