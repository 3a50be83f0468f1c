// Massless links in factor form: K = A^T A with A = sqrt(D) B, never assembled.
#pragma once

#include <array>
#include <map>
#include <utility>
#include <vector>

#include "core/scene/link_kinds.hpp"
#include "core/structure/structure.hpp"

namespace freeflex {

/// One natural deformation of a link, e = sum coefficient * freedom, and its stiffness   (THEORY X44-X46).
/// Freedoms are numbered by Freedoms: displacements [m] first, then rotations [rad].
struct DeformationRow {
  std::vector<std::pair<int, double>> coefficients;  // (freedom, coefficient)
  double root_stiffness = 0.0;                       // square root of the stiffness of e
  double unit_scale =
      1.0;  // makes the displacement coefficients of order one: unit row = unit_scale * coefficients
};
using DeformationRows = std::vector<DeformationRow>;

/// Adds scale * direction . u of the three freedoms that start at first.
void add_vector(DeformationRow& row, int first, double scale, const Eigen::Vector3d& direction);

/// Rows as a matrix, with stiffnesses or, unit rows, without   (num_rows x num_columns).
Eigen::MatrixXd dense_rows(const DeformationRows& rows, Eigen::Index num_columns, bool unit);
/// Rows times columns, rows with stiffnesses (num_rows x columns.cols()).
Eigen::MatrixXd rows_times(const DeformationRows& rows, const Eigen::MatrixXd& columns);

/// The first of a rigid link's points that has an attitude, with which the others turn; -1 without one
/// (THEORY X161).
int hub_of(const Scene& scene, const Link& link);

/// Numbers of the freedoms that rows act on: 3 * point + axis, then three rotations for each joint, then one
/// for each released rotation of a beam end, then one for each rigid body on a line that turns a joint, then
/// the inner coordinates of superelements. A joint is a point that beams or plates meet at, or one that has
/// an attitude.
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
  /// First rotation of the joint at a point.  \pre has_joint(point)
  int rotation(int point) const;
  /// The rotation of a beam's end about its local axis where the joint does not hold it; -1 where it does.
  int released(int link, int end, int axis) const {
    return released_.empty() ? -1
                             : released_[static_cast<std::size_t>(link)]
                                        [3 * static_cast<std::size_t>(end) + static_cast<std::size_t>(axis)];
  }

  /// First inner coordinate of a superelement.  \pre it has some
  int inner(int link) const { return inner_.at(link); }

  /// The rigid body, a link, that what is joined to a point turns with: of several the first named that is
  /// not on a line, else the first; -1 without one, and where a hub turns them   (THEORY X64).
  int body_of(int point) const;
  /// The rotation of a rigid body on a line about that line, which its points do not tell; -1 for all other
  /// links and where the body turns no joint   (THEORY X64).
  int about_line(int link) const;

 private:
  void add_releases(const Scene& scene);
  void add_bodies(const Scene& scene);

  int num_displacements_;
  int num_released_ = 0;
  std::vector<int> joints_;                   // points, ascending
  std::vector<std::array<int, 6>> released_;  // (num_links) freedom or -1; empty when nothing is released
  std::map<int, int> body_of_;                // link by point
  std::map<int, int> about_line_;             // freedom by link
  int num_inner_ = 0;
  std::map<int, int> inner_;  // first freedom by link
};

/// Axial deformation between a link's two points, e = u . (V_2 - V_1)   (THEORY X44).
DeformationRow axial_row(const Scene& scene, const Link& link, double stiffness);

/// Local axes of a beam as columns, scene axes: x along it, z = x cross y_axis, y = z cross x   (THEORY X45).
Eigen::Matrix3d beam_axes(const Eigen::Vector3d& span, const Eigen::Vector3d& y_axis);

/// The six natural deformations of a beam   (THEORY X45): axial x . (V_2 - V_1), torsion x . (theta_2 -
/// theta_1), then about local z and about local y bending, symmetric theta_2 - theta_1 and antisymmetric
/// theta_1 + theta_2 - 2 psi, psi the turn of the chord.
DeformationRows beam_rows(const Scene& scene, int link_index, const Freedoms& freedoms);

/// Change of the angle at the middle of three points [rad], t_i . (V_i - V_j) / l_i + t_k . (V_k - V_j) /
/// l_k, in two planes when they lie on a line   (THEORY X60).
DeformationRows bending_rows(const Scene& scene, const Link& link);

/// Change of the dihedral angle of four points [rad]   (THEORY X61).
DeformationRows torsion_rows(const Scene& scene, const Link& link);

/// Natural deformations of a triangular plate   (THEORY X62): rows 0 to 2 are the membrane's exx + eyy, exx -
/// eyy, gxy, rows 3 to 11 the same of the curvature at the middle of the side opposite to each point, rows 12
/// to 14 the turn of each corner about the normal, less the membrane's.
DeformationRows plate_rows(const Scene& scene, const Link& link, const Freedoms& freedoms);

/// Forces and moments of a plate per length, from its natural forces: Nxx Nyy Nxy [N/m], positive in tension,
/// and mean Mxx Myy Mxy [N], M the integral of the stress times z, positive where the face at +z is
/// stretched. Local axes: x from the first point to the second, z the normal about which the points run
/// counterclockwise   (THEORY X62).
/// \return (6 x num_rows of plate_rows)
Eigen::MatrixXd plate_resultants(const Scene& scene, const Link& link);

/// [-] of the largest entry: entries of a matrix link across the diagonal may differ by this, and count as
/// their mean. Matrices travel as decimal text: tables with seven digits pass   (THEORY X46).
inline constexpr double kSymmetryTolerance = 1e-6;

/// What a matrix link resisted of rigid motion of its points, and no longer does: K_o = T G^T + G T^T
/// (THEORY X127).
struct TakenOut {
  int link = -1;
  Eigen::MatrixXd rigid;          // T, [-] (3 N_link x 3..6)
  Eigen::MatrixXd forces;         // G, [N/m] (3 N_link x 3..6)
  bool is_within_digits = false;  // no more than the last digits of the matrix as printed explain
};

/// What matrix links that are not exact leave open.
struct MatrixLimits {
  double accuracy = 0.0;  // [-] relative, of the lowest eigenvalue that was kept   (THEORY X46)
  std::vector<TakenOut> taken_out;
};

/// Rows of a matrix link from its own matrix, freed of rigid motion and of its null space   (THEORY X46,
/// X63). Errors: size, symmetry, rigid motion, eigenvalues that are negative or, of a flexibility, zero.
/// \param limits  accuracy is raised to the link's; what was taken out is added
DeformationRows matrix_rows(const Scene& scene, const Link& link, int link_index, MatrixLimits& limits,
                            Faults& faults);

/// Rigid motions of some points alone, orthonormal columns: six, five on a line, three in one place
/// (THEORY X43, X46) [-] (3 N_link x 3..6).
Eigen::MatrixXd rigid_basis(const Scene& scene, const std::vector<int>& points);

/// Displacements that a rigid link or body forbids, unit rows: u . (V_2 - V_1) for two points, 3 N_link - 6
/// for a body (3 N_link - 5 on a line), all that is orthogonal to its rigid motions   (THEORY X64). With a
/// hub V_k - V_hub - theta_hub x d_k, and theta_k - theta_hub of other joints   (THEORY X161).
DeformationRows rigid_rows(const Scene& scene, const Link& link, const Freedoms& freedoms);

/// Unit vector along the line that points stand on, to 64 roundings of their coordinates; zero where they do
/// not   (THEORY X42, X64).
Eigen::Vector3d line_of(const Scene& scene, const std::vector<int>& points);

/// Mean rotation of some points per displacement, J^-1 sum d_k x V_k   (THEORY X14 with equal weights) [1/m]
/// (3 x 3 N_link). None about the line of points whose width is below least_width [-] times their length.
Eigen::MatrixXd mean_rotation(const Scene& scene, const std::vector<int>& points, double least_width);
/// The same of the points of a rigid body: all of it, but for the turn about the line of a body on one.
Eigen::MatrixXd body_rotation(const Scene& scene, const std::vector<int>& points);

/// Where a link's natural deformations stand in LinkFactor::natural; none for rigid links and dashpots.
struct RowRange {
  int first = 0;
  int count = 0;
};

/// The links of a scene over the displacements of its points, rotations condensed   (THEORY X47).
struct LinkFactor {
  Eigen::MatrixXd rows;       // A, [sqrt(N/m)] (num_rows x 3N)
  Eigen::MatrixXd unit_rows;  // B, [-] (num_unit_rows x 3N) geometry alone: no stiffness in it
  MatrixLimits matrices;
  // not condensed: natural deformations of all links over all freedoms
  DeformationRows natural;
  std::vector<RowRange> natural_of;  // (num_links)
  int num_freedoms = 0;              // displacements and rotations
  Eigen::MatrixXd recovery;  // [1/m] (num_rotations x 3N) rotations = recovery V; empty unless asked for
  // rigid links: what they forbid, and what they forbid once only
  // C, [-] (num_constraints x 3N, of scenes with bodies x num_freedoms) C V = 0, independent rows
  Eigen::MatrixXd constraints;
  std::vector<int> constraint_link;  // (num_constraints) index into Scene::links
  Eigen::MatrixXd
      damping_rows;  // [sqrt(N s/m)] (num x 3N) A_d, of dashpots and viscous links: force A_d^T A_d V'
  // of the sparse set-up, which condenses nothing: rows, unit_rows and recovery stay empty, and what C and
  // A_d are stands here, over all freedoms
  bool is_sparse = false;
  DeformationRows constraint_rows;  // unit rows
  DeformationRows damping;
};

/// Natural deformation k of a link.  \pre 0 <= k < count of its range
inline const DeformationRow& natural_row(const LinkFactor& factor, RowRange range, int k) {
  return factor.natural[static_cast<std::size_t>(range.first) + static_cast<std::size_t>(k)];
}

/// Relative error of the directions in unit rows: one rounding of a coordinate over the shortest link (THEORY
/// X50).
double direction_rounding(const Scene& scene);

/// Every link of a scene in factor form   (THEORY X44-X47, X60-X65).
/// \param with_recovery  fill LinkFactor::recovery, which forces of links with rotations need
LinkFactor factor_links(const Scene& scene, bool with_recovery, Faults& faults);

/// The same of a large scene, nothing dense. Rigid links that share points are told apart set by set: errors
/// of sets of more than kMostJoinedRows rows (core/limits.hpp).
LinkFactor factor_links_sparse(const Scene& scene, Faults& faults);

/// Natural forces s = D e of a link per displacement V   [N/m] (count x 3N)   (THEORY X49).
Eigen::MatrixXd natural_forces(const LinkFactor& factor, int link);
/// The same per elastic coordinate (count x n).  \pre structure.shapes, and turns of a scene with bodies
Eigen::MatrixXd natural_forces(const LinkFactor& factor, const Structure& structure, int link);

/// The last rows of some motions, each motion times a factor.
Eigen::MatrixXd turns_of(const Eigen::MatrixXd& motions, int num_rotations, const Eigen::VectorXd& factors);

/// Puts in the rotations of joints on rigid bodies, which turn with the points of those   (THEORY X64).
/// \param shapes  (3N x n) displacements  \param turns  (num_rotations x n)
void turn_with_bodies(const Scene& scene, const Freedoms& freedoms, const Eigen::MatrixXd& shapes,
                      Eigen::MatrixXd& turns);
/// The same in rows over all freedoms: rotations of such joints by the displacements of the points.
void turn_with_bodies(const Scene& scene, const Freedoms& freedoms, DeformationRows& rows);

/// Structure::local_rotations: of the joint at a point, of the rigid body it belongs to, or the mean rotation
/// of it and its neighbours   (THEORY X73).  \pre structure.shapes
std::map<int, Eigen::Matrix3Xd> local_rotations(const Scene& scene, const LinkFactor& factor,
                                                const Structure& structure);

/// Fills Structure::link_forces and constraint_shapes for the published links, in order   (THEORY X48, X49,
/// X67). \pre structure.shapes and damping_rows are filled
void set_link_forces(const Scene& scene, const LinkFactor& factor, Structure& structure);

}  // namespace freeflex
