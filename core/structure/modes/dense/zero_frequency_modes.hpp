// Finds and lists the mechanisms among the lowest modes of a large structure.
#pragma once

#include "core/structure/modes/sparse/sparse_system.hpp"

namespace freeflex {

/// Separates the mechanisms from the other lowest modes. The strain that unit rows give for a mechanism is a
/// rounding error (THEORY 16.39). The mechanisms become the first modes with omega exactly 0, and
/// Structure::mechanisms lists them.
/// \param rounding  [-] relative error of the directions in unit rows
/// \param x         m-orthonormal motions (num_all x n); the lowest motions are rotated
/// \return          number of mechanisms
Eigen::Index separate_mechanisms(const Scene& scene, const SparseSystem& system, const Freedoms& freedoms,
                                 const MassProperties& body, double rounding, Structure& structure,
                                 Eigen::MatrixXd& x);

}  // namespace freeflex
