// A structure with fewer of its elastic modes.
#pragma once

#include <vector>

#include "core/structure/structure.hpp"

namespace freeflex {

/// \param modes  those that stay, ascending
Structure reduce(const Structure& structure, const std::vector<int>& modes);

/// Adds what modes left out answer to loads statically to the forces of published links   (X123). It enters
/// as shapes without coordinates, of which only the generalized forces count, as those of rigid links do
/// (X67).
/// \param whole     structure with all modes
/// \param left_out  modes of `whole` that `structure` does not have
/// \param loads     [N] (3N x loads) what may act
void keep_static_link_forces(const Structure& whole, const std::vector<int>& left_out,
                             const Eigen::MatrixXd& loads, Structure& structure);

}  // namespace freeflex
