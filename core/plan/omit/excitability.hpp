// Excitability of modes by loads and by the initial state   (THEORY 14.1 to 14.3).
#pragma once

#include <Eigen/Core>
#include <Eigen/SparseCore>
#include <memory>
#include <vector>

#include "core/plan/omit/motion_scope.hpp"
#include "core/plan/spec.hpp"
#include "core/structure/structure.hpp"

namespace freeflex {

/// A load excites a mode if the excitability is above this value [-]. The value is the rounding error of the
/// mode shapes   (THEORY 14.2).
inline constexpr double kLeastExcitability = 1e-11;

/// Returns the excitability of the modes ((loads + 2) x n), with a row for each force k that a command,
/// history, field or feedback can exert: chi_kl = sum_i f_ki . b_il / sqrt(sum_i M f_ki . f_ki / m_i)
/// (THEORY 14.1). Two further rows are the initial q and q_dot, each divided by its norm. If the scope binds
/// commands, only commands within the scope are included.
Eigen::MatrixXd excitability_rows(const Scene& scene, const Structure& structure, const MotionScope& scope,
                                  const InitialModes& initial);

/// Returns the forces [N] (3N x forces) of unit commands: 1 N on each pushable point along each axis, then 1
/// N along and 1 N m about each axis for each group.
Eigen::SparseMatrix<double> command_directions(const Scene& scene, const Structure& structure,
                                               const MotionScope& scope);

/// Returns the forces [N] (3N x loads) of commands, built-in loads at amplitude 1, feedback and fields.
Eigen::SparseMatrix<double> load_directions(const Scene& scene, const Structure& structure,
                                            const MotionScope& scope);

/// Returns the structure with modes of equal frequency rotated among themselves so that as few as possible
/// are excited: chi_c = U Sigma Y^T, b_c <- b_c Y   (THEORY 14.3). Modes are treated as modes of equal
/// frequency if their frequencies agree within the accuracy of frequencies (1e-12 to 1e-9) and their damping
/// is equal. Mechanisms and modes that the scene names are not rotated. If no modes are rotated, returns the
/// given structure.
std::shared_ptr<const Structure> align_modes(const Scene& scene, const Eigen::MatrixXd& excitability,
                                             std::shared_ptr<const Structure> shared, InitialModes& initial);

/// Returns the indices of the excited modes in ascending order. A mode is excited if max_k |chi_kl| > 1e-11
/// or if a dashpot couples it to an excited mode (THEORY 14.2).
std::vector<int> excited_modes(const Eigen::MatrixXd& excitability, const Structure& structure);

}  // namespace freeflex
