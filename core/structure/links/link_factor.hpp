// Links in factor form. The stiffness matrix is K = A^T A with A = sqrt(D) B, but K is never assembled
// (THEORY 3.2).
#pragma once

#include <array>
#include <cassert>
#include <map>
#include <utility>
#include <vector>

#include "core/scene/link_kinds.hpp"
#include "core/structure/structure.hpp"

namespace freeflex {

/// One natural deformation of a link, e = sum coefficient * freedom, and its stiffness   (THEORY 3.1). The
/// class Freedoms numbers the freedoms: displacements [m], then rotations [rad].
struct DeformationRow {
  std::vector<std::pair<int, double>> coefficients;  // (freedom, coefficient)
  double root_stiffness = 0.0;                       // square root of the stiffness of e
  // The unit row is unit_scale * coefficients. Its displacement coefficients are of order one
  double unit_scale = 1.0;
};
using DeformationRows = std::vector<DeformationRow>;

/// Adds scale * direction . u to a row, where u are the three freedoms from `first` on.
void add_vector(DeformationRow& row, int first, double scale, const Eigen::Vector3d& direction);

/// Returns rows as a dense matrix: rows of A, or unit rows if `unit` is true   (num_rows x num_columns).
Eigen::MatrixXd dense_rows(const DeformationRows& rows, Eigen::Index num_columns, bool unit);
/// Returns the product of rows of A and columns (num_rows x columns.cols()).
Eigen::MatrixXd rows_times(const DeformationRows& rows, const Eigen::MatrixXd& columns);

/// Returns the hub of a rigid link. The hub is the first point of the link that has an attitude, and the
/// other points rotate with the hub. Returns -1 if no point has an attitude   (THEORY 16.5).
int hub_of(const Scene& scene, const Link& link);

/// This class numbers the freedoms on which rows act. The order is: displacements 3 * point + axis; three
/// rotations for each joint; one rotation for each released axis of a beam end; one rotation for each rigid
/// body that is on a line and has a joint; inner coordinates of superelements. A joint is a point of a beam
/// or plate, or a point with an attitude.
class Freedoms {
 public:
  explicit Freedoms(const Scene& scene);
  int num_displacements() const { return num_displacements_; }
  int num_rotations() const {
    return 3 * static_cast<int>(joints_.size()) + num_released_ + static_cast<int>(about_line_.size()) +
           num_inner_;
  }
  int num_all() const { return num_displacements_ + num_rotations(); }
  bool has_joint(int point) const;
  /// Returns the first rotation of the joint at a point.  \pre has_joint(point)
  int rotation(int point) const;
  /// Returns the freedom of the rotation that a beam end releases about a local axis. Returns -1 if the beam
  /// end does not release this rotation.
  int released(int link, int end, int axis) const {
    return released_.empty() ? -1 : released_[index(link)][3 * index(end) + index(axis)];
  }

  /// Returns the first inner coordinate of a superelement.  \pre the superelement has inner coordinates
  int inner(int link) const { return inner_.at(link); }

  /// Returns the index of the rigid body (a link) that determines the rotation of the joint at a point. Of
  /// the bodies that contain the point, this is the first whose points are not on a line, or, if there is
  /// none, the first whose points are on a line. Bodies with a hub are ignored. Returns -1 if no other body
  /// contains the point (THEORY 3.43).
  int body_of(int point) const;
  /// Returns the freedom for the rotation of a rigid body about the line of its points. The displacements of
  /// the points do not determine this rotation. Returns -1 for other links and for bodies without a joint
  /// (THEORY 3.44).
  int about_line(int link) const;

 private:
  void add_releases(const Scene& scene);
  void add_bodies(const Scene& scene);

  int num_displacements_;
  int num_released_ = 0;
  std::vector<int> joints_;                   // points with a joint, ascending
  std::vector<std::array<int, 6>> released_;  // (num_links) freedom or -1; empty if nothing is released
  std::map<int, int> body_of_;                // point -> link
  std::map<int, int> about_line_;             // link -> freedom
  int num_inner_ = 0;
  std::map<int, int> inner_;  // link -> first freedom
};

/// Returns the row of the axial deformation of a link, e = u . (V_2 - V_1)   (THEORY 3.3).
DeformationRow axial_row(const Scene& scene, const Link& link, double stiffness);

/// Returns the six natural deformations of a beam   (THEORY 3.6 to 3.9): axial; torsion; symmetric, then
/// antisymmetric bending about local z; symmetric, then antisymmetric bending about local y.
DeformationRows beam_rows(const Scene& scene, int link_index, const Freedoms& freedoms);

/// Returns the row of the change [rad] of the angle at the second of three points. If the points are on a
/// line, returns two rows, one in each of two planes   (THEORY 3.23 to 3.25).
DeformationRows bending_rows(const Scene& scene, const Link& link);

/// Returns the row of the change of the dihedral angle of four points [rad]   (THEORY 3.26).
DeformationRows torsion_rows(const Scene& scene, const Link& link);

/// Returns the natural deformations of a triangular plate. Rows 0 to 2 are the membrane strains exx + eyy,
/// exx - eyy, gxy (THEORY 3.30). Rows 3 to 11 are the same three measures of the curvature, at the middles of
/// the sides opposite to points 0, 1 and 2 in turn (THEORY 3.33). Rows 12 to 14 are the rotation of each
/// corner about the normal minus the rotation of the membrane (THEORY 3.36).
DeformationRows plate_rows(const Scene& scene, const Link& link, const Freedoms& freedoms);

/// Returns the matrix that maps the natural forces of a plate to its resultants per length   (THEORY 3.37).
/// The resultants are Nxx Nyy Nxy [N/m], positive in tension, and the mean moments Mxx Myy Mxy [N]. The
/// moments are integrals of stress times z and are positive if the face at +z is stretched. The local axes
/// are x from the first point to the second, and z, the normal about which the points run counterclockwise.
/// \return (6 x num_rows of plate_rows)
Eigen::MatrixXd plate_resultants(const Scene& scene, const Link& link);

/// [-] allowed difference of two entries of a matrix link across the diagonal, as a fraction of the largest
/// entry. Within this limit the two entries are replaced by their mean (THEORY 3.11). Tables with seven
/// digits are within this limit.
inline constexpr double kSymmetryTolerance = 1e-6;

/// The rigid-body residual of a matrix link. It is the removed resistance of the link to rigid motion of its
/// points, K_o = T G^T + G T^T   (THEORY 3.15).
struct RigidResidual {
  int link = -1;
  Eigen::MatrixXd rigid;          // T, [-] (3 N_link x 3..6)
  Eigen::MatrixXd forces;         // G, [N/m] (3 N_link x 3..6)
  bool is_within_digits = false;  // true: the rounding of the printed digits explains K_o   (THEORY 3.18)
};

/// The effects that inexact matrix links have on the result.
struct MatrixLimits {
  double accuracy = 0.0;  // [-] largest relative error of the lowest kept eigenvalue   (THEORY 3.14)
  std::vector<RigidResidual> rigid_residuals;
};

/// Returns the rows of a matrix link. They contain neither rigid motions nor the null space of the matrix
/// (THEORY 3.11 to 3.13, 3.39). The function adds an error for asymmetry, resistance to rigid motion,
/// negative eigenvalues, and zero eigenvalues of a flexibility.
/// \param limits  accuracy is raised to the error of the link; a residual above rounding errors is appended
DeformationRows matrix_rows(const Scene& scene, const Link& link, int link_index, MatrixLimits& limits,
                            Faults& faults);

/// Returns the rigid motions T_link of some points as orthonormal columns. There are three columns if the
/// points coincide, five if they are on a line, else six   (THEORY 2.11, 3.11) [-] (3 N_link x 3..6).
Eigen::MatrixXd rigid_basis(const Scene& scene, const std::vector<int>& points);

/// Returns the rows of the constraints of a rigid link or body. The rows are not normalised. There is one row
/// for two points (THEORY 3.40). There are 3 N_link - 6 rows for a body, or 3 N_link - 5 if its points are on
/// a line (THEORY 3.41). If the link has a hub, there are three rows for each other point and three for each
/// other joint (THEORY 16.5).
DeformationRows rigid_rows(const Scene& scene, const Link& link, const Freedoms& freedoms);

/// Returns the unit vector along the line on which some points are, within 64 rounding errors of their
/// coordinates. Returns zero if the points are not on a line   (THEORY 2.9, 3.44).
Eigen::Vector3d line_of(const Scene& scene, const std::vector<int>& points);

/// Returns the mean rotation of some points per displacement, J^-1 sum d_k x V_k
/// (THEORY 9.6 with equal weights) [1/m] (3 x 3 N_link). If the width of the points is below least_width [-]
/// times their length, the rotation has no component about their line.
Eigen::MatrixXd mean_rotation(const Scene& scene, const std::vector<int>& points, double least_width);
/// Returns the rotation of a rigid body per displacement of its points. If the points are on a line, the
/// rotation about the line is omitted   (THEORY 3.43, 3.44).
Eigen::MatrixXd body_rotation(const Scene& scene, const std::vector<int>& points);

/// The range of a link in LinkFactor::natural. It is empty for rigid links and dashpots.
struct RowRange {
  int first = 0;
  int count = 0;
};

/// The links of a scene as rows over the displacements of the points. Rotations are condensed
/// (THEORY 3.2, 3.21).
struct LinkFactor {
  Eigen::MatrixXd rows;       // A, [sqrt(N/m)] (num_rows x 3N)
  Eigen::MatrixXd unit_rows;  // B, [-] (num_unit_rows x 3N) geometry without stiffness
  MatrixLimits matrices;
  // natural deformations of all links over all freedoms, not condensed
  DeformationRows natural;
  std::vector<RowRange> natural_of;  // (num_links)
  int num_freedoms = 0;              // displacements and rotations
  // [1/m] (num_rotations x 3N) theta = recovery V (THEORY 3.22); empty unless requested
  Eigen::MatrixXd recovery;
  // C, [-] (num_constraints x 3N, or x num_freedoms with bodies) independent constraints, C V = 0
  // (THEORY 3.42)
  Eigen::MatrixXd constraints;
  std::vector<int> constraint_link;  // (num_constraints) index into Scene::links
  // A_d, [sqrt(N s/m)] (num x 3N) damping rows of dashpots and viscous links: the force is A_d^T A_d V'
  // (THEORY 3.47)
  Eigen::MatrixXd damping_rows;
  // If this flag is true, nothing is condensed. Then rows, unit_rows, recovery, constraints and damping_rows
  // stay empty, and C and A_d are the two members below, over all freedoms.
  bool is_sparse = false;
  DeformationRows constraint_rows;  // C, unit rows
  DeformationRows damping;          // A_d
};

/// Returns natural deformation k of a link.  \pre 0 <= k < range.count
inline const DeformationRow& natural_row(const LinkFactor& factor, RowRange range, int k) {
  assert(k >= 0 && k < range.count);
  return factor.natural[index(range.first) + index(k)];
}

/// Returns the relative error of the directions in unit rows. This error is eps times the ratio of the
/// largest coordinate to the length of the shortest link, but at least eps   (THEORY 4.5).
double direction_rounding(const Scene& scene);

/// Returns every link of a scene in factor form   (THEORY section 3).
/// \param with_recovery  true: fills LinkFactor::recovery, which forces of links with rotations need
LinkFactor factor_links(const Scene& scene, bool with_recovery, Faults& faults);

/// Returns every link of a large scene in factor form, without dense matrices. Independent constraints are
/// found separately for each set of rigid links that share points. A set of more than kMostJoinedConstraints
/// rows (core/limits.hpp) is an error.
LinkFactor factor_links_sparse(const Scene& scene, Faults& faults);

/// Returns the natural forces s = D e of a link per displacement V   (THEORY 5.2) [N/m] (count x 3N).
Eigen::MatrixXd natural_forces(const LinkFactor& factor, int link);
/// Returns the natural forces per elastic coordinate (count x n).  \pre structure.shapes is filled;
/// structure.rotations is filled if the scene has bodies or the factor is sparse
Eigen::MatrixXd natural_forces(const LinkFactor& factor, const Structure& structure, int link);

/// Returns the last num_rotations rows of some motions, each motion times its factor.
Eigen::MatrixXd scaled_rotations(const Eigen::MatrixXd& motions, int num_rotations,
                                 const Eigen::VectorXd& factors);

/// Sets the rotations of joints on rigid bodies to the rotations of the bodies   (THEORY 3.43, 3.44).
/// \param shapes  (3N x n) displacements  \param rotations  (num_rotations x n)
void rotate_with_bodies(const Scene& scene, const Freedoms& freedoms, const Eigen::MatrixXd& shapes,
                        Eigen::MatrixXd& rotations);
/// In rows over all freedoms, replaces the rotations of joints on rigid bodies by the displacements of the
/// points of the bodies.
void rotate_with_bodies(const Scene& scene, const Freedoms& freedoms, DeformationRows& rows);

/// Returns the mean rotation of a point and the points that links join to it, per displacement (3 x 3N)
/// (THEORY 8.24). If they are on a line, the rotation about it is left out.
Eigen::MatrixXd rotation_of_neighbours(const Scene& scene, int point);

/// Returns Structure::local_rotations   (THEORY 8.24): for each point with a follower force, the rotation of
/// its joint. A point without a joint has the rotation of its rigid body. A point with neither a joint nor a
/// rigid body has the mean rotation of the point and its neighbours.  \pre structure.shapes is filled
std::map<int, Eigen::Matrix3Xd> local_rotations(const Scene& scene, const LinkFactor& factor,
                                                const Structure& structure);

/// Fills Structure::link_forces and constraint_shapes for the published links   (THEORY 5.1 to 5.7).
/// \pre structure.shapes and damping_rows are filled
void set_link_forces(const Scene& scene, const LinkFactor& factor, Structure& structure);

}  // namespace freeflex
