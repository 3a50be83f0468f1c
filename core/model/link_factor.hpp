// Elastic links in factor form: K = A'A with A = sqrt(D) B, never assembled.
#pragma once

#include <array>
#include <utility>
#include <vector>

#include "core/model/structure.hpp"

namespace freeflex {

/// One natural deformation of a link, e = sum coefficient * freedom, and its stiffness   (THEORY X44-X46).
/// Freedoms 3*point+axis are displacements [m]; rotations of beam joints follow after 3N.
struct DeformationRow {
  std::vector<std::pair<int, double>> coefficients;  // (freedom, coefficient)
  double root_stiffness = 0.0;                       // square root of the stiffness of e
  double unit_scale =
      1.0;  // makes the displacement coefficients of order one: unit row = unit_scale * coefficients
};

/// Axial stiffness of a spring, k, or bar, EA / L   [N/m].  \pre the link is one of these
double axial_stiffness(const Scene& scene, const Link& link);

/// Axial deformation of a spring or bar between two points   (THEORY X44).
DeformationRow axial_row(const Scene& scene, const Link& link, double stiffness);

/// Local axes of a beam as columns, scene axes   (THEORY X45).
Eigen::Matrix3d beam_axes(const Eigen::Vector3d& span, const Eigen::Vector3d& y_axis);

/// The six natural deformations of an Euler-Bernoulli beam   (THEORY X45): axial, torsion, then bending
/// symmetric and antisymmetric about local z and about local y. first_rotation: freedom of the first rotation
/// of each of its points.
std::vector<DeformationRow> beam_rows(const Scene& scene, const Link& link,
                                      const std::array<int, 2>& first_rotation);

/// Rows of a matrix link from its own matrix, freed of rigid motion and of its null space   (THEORY X46).
/// Errors: size, symmetry, rigid motion, negative eigenvalues.
/// \param accuracy  raised to the relative accuracy of the link's lowest eigenvalue that was kept
std::vector<DeformationRow> matrix_rows(const Scene& scene, const Link& link, int link_index,
                                        double& accuracy, Faults& faults);

/// The links of a scene over the displacements of its points, rotations of beam joints condensed   (THEORY
/// X47).
struct LinkFactor {
  Eigen::MatrixXd rows;          // A, [sqrt(N/m)] (num_rows x 3N)
  Eigen::MatrixXd unit_rows;     // B, [-] (num_unit_rows x 3N) geometry alone: no stiffness in it
  double matrix_accuracy = 0.0;  // [-] stated relative accuracy that matrix links limit frequencies to
  // rotations of beam joints that go with displacements, rotation = recovery V, of joint_points[k] in rows
  // 3k..3k+2
  std::vector<int> joint_points;  // points that beams meet at
  Eigen::MatrixXd recovery;       // [1/m] (3 num_joints x 3N); empty unless asked for
};

/// \param with_recovery  fill LinkFactor::recovery, which beam end forces need
LinkFactor factor_links(const Scene& scene, bool with_recovery, Faults& faults);

/// Rows of forces of the published links, in order   (THEORY X48, X49).
std::vector<LinkForceRows> link_force_rows(const Scene& scene, const LinkFactor& factor);

}  // namespace freeflex
