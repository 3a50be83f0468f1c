// Displacements left after the best rigid motion, and the error measure built on them (THEORY X36, X37).
#pragma once

#include <Eigen/Core>

namespace freeflex {

/// Rotation A, body to world, that minimises sum m_i |p_i - p_c - A r_i|^2   (X36): the axes that meet the
/// Eckart condition sum m r x V = 0 exactly, also for large displacements (Kabsch 1976; Eckart 1935). For a
/// collinear shape, whose turn about its own line is free, the smallest rotation that carries the rest line
/// to the fitted one. \param mass [kg] (N)  \param r [m] (3 x N) from the rest centre of mass  \param p [m]
/// (3 x N) from the centre of mass
Eigen::Matrix3d fit_rotation(const Eigen::VectorXd& mass, const Eigen::Matrix3Xd& r,
                             const Eigen::Matrix3Xd& p);

/// Elastic displacements V_i = A^T (p_i - p_c) - r_i in body axes [m] (3 x N), A from fit_rotation   (X36).
/// \param rest [m] (3 x N) rest positions, any origin  \param p_W [m] (3 x N) positions
Eigen::Matrix3Xd elastic_displacements(const Eigen::VectorXd& mass, const Eigen::Matrix3Xd& rest,
                                       const Eigen::Matrix3Xd& p_W);

/// |V - V_ref| / |V_ref|, V elastic displacements, Euclidean norms over all points   (THEORY X37); 0 when
/// both vanish.
double elastic_error(const Eigen::Matrix3Xd& u, const Eigen::Matrix3Xd& u_ref);

}  // namespace freeflex
