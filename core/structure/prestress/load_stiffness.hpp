// The geometric stiffness of the lowest modes due to the static internal forces under loads that may act.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "core/structure/prestress/static_responses.hpp"

namespace freeflex {

struct LinkFactor;
struct Structure;

/// The geometric stiffness of the lowest modes due to the internal forces under one reference load
/// (THEORY 8.49).
struct LoadStiffness {
  ReferenceLoad reference;
  std::vector<int> modes;  // ascending
  // [N/m] per newton of a load, [kg] per rad^2/s^2 of a field (modes x modes), due to all links except
  // matrices, rigid links and dashpots
  Eigen::MatrixXd rows;
};

/// Returns the geometric stiffness due to each reference load.  \pre structure.omega and shapes are filled;
/// factor.recovery is filled
std::vector<LoadStiffness> find_load_stiffness(const Scene& scene, const LinkFactor& factor,
                                               const Structure& structure, const StaticResponses& responses);

/// Transforms the stiffness for new modes b <- b rotation, which replace the modes from `first` on.
void rotate_load_stiffness(const Eigen::MatrixXd& rotation, int first, LoadStiffness& stiffness);
/// Restricts the stiffness to some modes, in ascending order, and renumbers them.
void reduce_load_stiffness(const std::vector<int>& kept, LoadStiffness& stiffness);

}  // namespace freeflex
