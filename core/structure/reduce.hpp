// Structures with a subset of their elastic modes.
#pragma once

#include <Eigen/SparseCore>
#include <memory>
#include <vector>

#include "core/structure/structure.hpp"

namespace freeflex {

/// Returns the structure with some of its modes.  \param modes  modes to keep, ascending
Structure reduce(const Structure& structure, const std::vector<int>& modes);

/// Returns a pointer to a structure without copying it, because the shapes of a large structure need
/// gigabytes.
/// \pre the structure outlives the result
std::shared_ptr<const Structure> share(const Structure& structure);
/// Returns reduce(), or share() if all modes are kept.
std::shared_ptr<const Structure> share_reduced(const Structure& structure, const std::vector<int>& modes);

/// Returns loads^T shapes [N] (loads x n), the generalized forces of loads (3N x loads). For few points the
/// product is dense, so that the order of summation, and therefore every plan, is the same as in earlier
/// versions.
Eigen::MatrixXd on_modes(const Eigen::SparseMatrix<double>& loads, const Eigen::MatrixXd& shapes);

/// Adds the quasi-static response of omitted modes to the forces of published links   (THEORY 14.11). The
/// response is stored as additional columns of constraint_shapes. The additional shapes have no coordinates,
/// because only their generalized forces are used (THEORY 14.12), as for constraints (THEORY 5.7).
/// \param whole     structure with all modes
/// \param left_out  modes of `whole` that `structure` omits
/// \param loads     [N] (3N x loads) all loads that may act
void keep_static_link_forces(const Structure& whole, const std::vector<int>& left_out,
                             const Eigen::SparseMatrix<double>& loads, Structure& structure);

}  // namespace freeflex
