// A scene with fewer of its elastic modes.
#pragma once

#include <vector>

#include "core/plan/reach.hpp"

namespace freeflex {

/// A scene and its structure over some of the modes; what names modes by number names the kept ones.
struct Reduced {
  Scene scene;
  Structure structure;
};

/// \param kept     modes of the structure, ascending
/// \param initial  elastic state of all its modes; it replaces what the scene says
Reduced reduce(const Scene& scene, const Structure& structure, const InitialModes& initial,
               const std::vector<int>& kept);

/// Adds what modes left out answer to loads statically, sum rows_l Q_l / (M omega_l^2), to the forces of
/// published links   (X123). It enters as shapes without coordinates, of which only the generalized forces
/// count, as those of rigid links do (X67). \param whole     structure with all modes \param left_out  modes
/// of `whole` that `structure` does not have \param loads     [N] (3N x loads) what may act
void keep_static_link_forces(const Structure& whole, const std::vector<int>& left_out,
                             const Eigen::MatrixXd& loads, Structure& structure);

}  // namespace freeflex
