// Computes the displacements that remain after the best-fitting rigid motion is removed, and the error of
// these displacements. THEORY 10.8, 10.9, 10.11
#pragma once

#include <Eigen/Core>

namespace freeflex {

/// Returns the rotation R from body axes to world axes that brings the rest positions r_i closest to the
/// positions p_i (THEORY 10.8; Kabsch 1976):
///   R = argmin sum m_i |p_i - R r_i|^2 = U diag(1, 1, det U det Y) Y^T,   U Sigma Y^T = sum m_i p_i r_i^T
/// In the axes of this rotation, the displacements V meet Eckart's condition sum m r x V = 0 exactly, however
/// large they are (Eckart 1935). If the shape is collinear, the rotation about the line is undetermined, and
/// R is the smallest rotation that takes the rest line to the fitted line.
/// \param mass [kg] (N)  \param r [m] (3 x N) from the rest centre of mass
/// \param p [m] (3 x N) from the centre of mass
Eigen::Matrix3d fit_rotation(const Eigen::VectorXd& mass, const Eigen::Matrix3Xd& r,
                             const Eigen::Matrix3Xd& p);

/// Returns the elastic displacements in body axes [m] (3 x N), with R from fit_rotation   (THEORY 10.9):
///   V_i = R^T (p_i - p_c) - r_i
/// \param rest [m] (3 x N) rest positions, any origin  \param p_W [m] (3 x N) positions
Eigen::Matrix3Xd elastic_displacements(const Eigen::VectorXd& mass, const Eigen::Matrix3Xd& rest,
                                       const Eigen::Matrix3Xd& p_W);

/// Returns the elastic error |V - V_ref| / |V_ref| [-], with Euclidean norms over all points. If V equals
/// V_ref, the error is 0, even if both are zero (THEORY 10.11).
/// \param V, V_ref [m] (3 x N) elastic displacements
double elastic_error(const Eigen::Matrix3Xd& V, const Eigen::Matrix3Xd& V_ref);

}  // namespace freeflex
