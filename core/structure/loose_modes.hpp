// Which of the lowest modes of a large structure are mechanisms, and what they are called.
#pragma once

#include "core/structure/sparse_system.hpp"

namespace freeflex {

/// Modes whose strain by geometry alone is rounding   (THEORY X50, X173): their omega becomes exactly 0, they
/// come first, Structure::mechanisms names them.
/// \param rounding  [-] of the directions in unit rows
/// \param x         M-orthonormal motions (num_all x n), rotated among the lowest
/// \return          how many
Eigen::Index take_out_mechanisms(const Scene& scene, const SparseSystem& system, const Freedoms& freedoms,
                                 const MassProperties& body, double rounding, Structure& structure,
                                 Eigen::MatrixXd& x);

}  // namespace freeflex
