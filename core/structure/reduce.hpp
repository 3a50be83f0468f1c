// A structure with fewer of its elastic modes.
#pragma once

#include <Eigen/SparseCore>
#include <memory>
#include <vector>

#include "core/structure/structure.hpp"

namespace freeflex {

/// \param modes  those that stay, ascending
Structure reduce(const Structure& structure, const std::vector<int>& modes);

/// A structure that stays where it is: of large ones the shapes take gigabytes.  \pre it outlives the result
std::shared_ptr<const Structure> share(const Structure& structure);
/// reduce(), or share() where every mode stays.
std::shared_ptr<const Structure> share_reduced(const Structure& structure, const std::vector<int>& modes);

/// loads^T shapes: what loads [N] (3N x loads) do to each mode (loads x n). Of few points by a dense product,
/// whose sums have an order that plans of before rest on.
Eigen::MatrixXd on_modes(const Eigen::SparseMatrix<double>& loads, const Eigen::MatrixXd& shapes);

/// Adds what modes left out answer to loads statically to the forces of published links   (X123). It enters
/// as shapes without coordinates, of which only the generalized forces count, as those of rigid links do
/// (X67).
/// \param whole     structure with all modes
/// \param left_out  modes of `whole` that `structure` does not have
/// \param loads     [N] (3N x loads) what may act
void keep_static_link_forces(const Structure& whole, const std::vector<int>& left_out,
                             const Eigen::SparseMatrix<double>& loads, Structure& structure);

}  // namespace freeflex
