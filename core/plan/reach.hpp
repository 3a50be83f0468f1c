// Which modes anything can set in motion.
#pragma once

#include <Eigen/Core>
#include <Eigen/SparseCore>
#include <memory>
#include <vector>

#include "core/plan/motion_scope.hpp"
#include "core/plan/spec.hpp"
#include "core/structure/structure.hpp"

namespace freeflex {

/// A mode that takes less than this share of a load is not set in motion by it: rounding of the shapes [-].
inline constexpr double kUnreached = 1e-11;

/// Directions in which the modes may be loaded: (loads x n), one row for each force that a command, history,
/// field or feedback can exert, as a share of the force's whole, g_kl = sum_i f_ki . b_il / sqrt(sum_i M
/// f_ki^2 / m_i)   (X120); and rows of the initial state. What commands do is held to the scope where it says
/// that they are bound.
Eigen::MatrixXd reach_rows(const Scene& scene, const Structure& structure, const MotionScope& scope,
                           const InitialModes& initial);

/// Forces [N] (3N x forces) of one newton and one newton metre that commands can exert: on each pushable
/// point along each axis, then on each group forces and torques.
Eigen::SparseMatrix<double> command_directions(const Scene& scene, const Structure& structure,
                                               const MotionScope& scope);

/// Forces [N] (3N x loads) that commands, built-in loads at amplitude 1, feedback and fields can exert.
Eigen::SparseMatrix<double> load_directions(const Scene& scene, const Structure& structure,
                                            const MotionScope& scope);

/// Turns modes of equal frequency among themselves so that as few as possible are reached   (X120). Equal:
/// within the accuracy of frequencies (1e-12 to 1e-9), with equal damping, not mechanisms, and not named by
/// the scene. The structure itself where none turns.
std::shared_ptr<const Structure> align_modes(const Scene& scene, const Eigen::MatrixXd& reach,
                                             std::shared_ptr<const Structure> shared, InitialModes& initial);

/// Modes that something reaches, directly or through dashpots, ascending.
std::vector<int> reached_modes(const Eigen::MatrixXd& reach, const Structure& structure);

}  // namespace freeflex
