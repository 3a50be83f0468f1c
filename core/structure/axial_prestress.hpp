// Second order of springs and bars along pairs of modes, many links at once.
#pragma once

#include <span>

#include "core/structure/link_factor.hpp"

namespace freeflex {

/// Elongations of axial links of unit stiffness, a row a link   (THEORY X44, X140, X178).
struct AxialOrders {
  Eigen::MatrixXd first;   // [-] (links x n) u . (b_2 - b_1) of every mode
  Eigen::MatrixXd second;  // [1/m] (links x pairs) h_lu
};

/// h_lu in closed form, the parts of b_2 - b_1 across the link multiplied, over its length.
/// \pre every link is axial; pairs are of the first modes
AxialOrders axial_orders(const Scene& scene, std::span<const int> links, const Eigen::MatrixXd& shapes,
                         const std::vector<Prestress::Pair>& pairs);

}  // namespace freeflex
