// This code computes the second-order elongations of many springs, bars and dashpots at once, along pairs of
// modes.
#pragma once

#include <span>

#include "core/structure/links/link_factor.hpp"

namespace freeflex {

/// The elongations of axial links, with one row for each link   (THEORY 3.3, 16.46).
struct AxialOrders {
  Eigen::MatrixXd first;   // [-] (links x n) u . (b_2 - b_1) of every mode
  Eigen::MatrixXd second;  // [1/m] (links x pairs) h_lu
};

/// Returns the elongations u . (b_2 - b_1) of every mode and their second derivatives along pairs of modes,
/// in closed form   (THEORY 16.46).  \pre every link is axial; both modes of a pair are columns of shapes
AxialOrders axial_orders(const Scene& scene, std::span<const int> links, const Eigen::MatrixXd& shapes,
                         const std::vector<Prestress::Pair>& pairs);

}  // namespace freeflex
