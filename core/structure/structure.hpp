// Scene -> structure: mass properties, links in factor form, rigid freedoms, mechanisms, elastic modes.
#pragma once

#include <Eigen/Core>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "core/scene/scene.hpp"
#include "core/structure/prestress.hpp"

namespace freeflex {

/// Mass properties of the rest shape (THEORY 1.1, 1.3, 1.4, X40, X41).
struct MassProperties {
  double mass = 0.0;          // [kg]
  Eigen::Vector3d p_SB;       // [m] centre of mass in scene axes
  Eigen::Matrix3Xd r;         // [m] (3 x N) rest positions from the centre of mass, body axes
  Eigen::Matrix3Xd centres;   // [m] (3 x (N + parts)) of the centres of mass of bodies, then spread_masses
  Eigen::Matrix3d inertia;    // [kg m^2] about the centre of mass, body axes
  Eigen::Vector3d principal;  // [kg m^2] ascending
  Eigen::Matrix3d principal_axes;  // columns, right-handed
  int rigid_freedoms = 6;          // 6; 5 collinear; 3 for one point
  Eigen::Vector3d line;            // [-] unit vector along a collinear shape, else zero
};

/// A motion that strains no link (zero frequency, not rigid).
struct Mechanism {
  std::vector<int> moved_points;  // points that move by more than 1e-6 of the largest, most first
};

/// Rows that turn elastic coordinates into the forces of one published link   (THEORY X48, X49, X62, X67):
/// force = rows q + rate_rows q' + load_rows (generalized forces of the constraint shapes).
/// Spring, bar, dashpot, rigid link: tension [N]. Bending and torsion spring: moment [N m], two for a
/// straight bending spring. Beam: 12, forces and moments that the joints exert on it at its first, then its
/// second point, local axes [N], [N m]. Plate: Nxx Nyy Nxy [N/m], Mxx Myy Mxy [N]. Matrix and rigid body:
/// forces on its points, body axes [N].
struct LinkForceRows {
  int link = -1;
  Eigen::MatrixXd rows;       // (num_values x n)
  Eigen::MatrixXd rate_rows;  // (num_values x n), no rows when the link dissipates nothing
  Eigen::MatrixXd load_rows;  // (num_values x num_constraint_shapes), no rows but for rigid links
};

/// What sums over the mass run over where points are more than point masses: particles that move with them
/// (THEORY X160).
struct Particles {
  Eigen::VectorXd mass;    // [kg] (P)
  Eigen::Matrix3Xd r;      // [m] (3 x P) rest positions from the centre of mass, body axes
  Eigen::MatrixXd shapes;  // [-] (3P x n) their unit elastic displacements, sum m b.b = M
};

/// What sums over the mass take from mass matrices, for it is no particles': per unit displacement   (THEORY
/// X166).
struct MatrixSums {
  Eigen::MatrixXd momenta;  // [kg], [kg m] (6 x n) momentum, then that about the centre of mass
  Eigen::MatrixXd field;    // [kg m] (6 x n) Y_l as in X70, of accelerations at its points
};

/// Which of all elastic modes a structure has.
struct KeptModes {
  bool is_part = false;        // the lowest of them; others exist
  double counted_below = 0.0;  // [Hz] below which none is missing, counted by inertia; 0: all are there
};

struct Structure {
  MassProperties mass_properties;
  Eigen::VectorXd omega;  // [rad/s] (n) ascending; exact 0 for mechanisms
  // [-] (3N x n) unit elastic displacements b of the points; of point masses sum m b.b = M   (THEORY 3.3)
  Eigen::MatrixXd shapes;
  // of scenes with bodies, else empty: [1/m] (num_rotations x n) rotations of joints in the order of Freedoms
  Eigen::MatrixXd turns;
  Particles particles;
  MatrixSums matrix_sums;  // of superelements with mass, else empty
  std::vector<Mechanism> mechanisms;
  double frequency_accuracy = 0.0;  // [-] stated relative accuracy of the lowest nonzero frequency
  double conditioning = 0.0;        // [-] omega_max / omega_min over nonzero modes
  KeptModes kept;
  int num_constraints = 0;           // freedoms that rigid links remove
  Eigen::MatrixXd damping_rows;      // [sqrt(N s/m)] (num x n) R = A_d b, R^T R acts on q'   (THEORY X65)
  Eigen::VectorXd structural_ratio;  // [-] (n) damping ratio of the loss factors of links   (THEORY X66)
  std::vector<LinkForceRows> link_forces;  // for Scene::publication.links, in that order
  // displacements whose generalized forces give the forces of published rigid links   (THEORY X67)
  Eigen::MatrixXd constraint_shapes;  // [1/kg] (3N x num)
  // [1/m] (3 x n) elastic rotation of the surroundings of each point of a follower force, body axes   (THEORY
  // X73)
  std::map<int, Eigen::Matrix3Xd> local_rotations;
  Prestress prestress;
  std::vector<FollowerStiffness> follower_stiffness;  // of loads in local axes
};

/// What carries the mass is not the points themselves. Of masses that matrices alone have there are no
/// particles (0 x n).
inline bool has_particles(const Structure& structure) {
  return structure.particles.shapes.rows() == 3 * structure.particles.mass.size();
}
/// Displacements of what carries the mass: Structure::particles, or the points themselves.
inline const Eigen::MatrixXd& particle_shapes(const Structure& structure) {
  return has_particles(structure) ? structure.particles.shapes : structure.shapes;
}

/// Checks the physics of a scene as far as that needs no modes: values, references, mass properties and,
/// beside other errors, matrices. Faults are appended; the mass properties are those of a scene without
/// error.
MassProperties check_physics(const Scene& scene, Faults& faults);

/// How a set-up says how far it has come, and may be ended; and what it may take.
struct SetupProgress {
  /// \param what  what is being done  \param done  share of it, 0 to 1
  /// \return false to end the set-up with an error
  std::function<bool(const std::string& what, double done)> say = {};
  double memory_MB = 0.0;  // that there is for it; 0: not known, and not counted
};

/// Checks the physics of a scene and computes its structure   (THEORY X41-X67). Faults are appended; nullopt
/// on an error. All modes by a dense factor, O(rows n^2), up to kMaxDensePoints points; of larger scenes, and
/// of those of more than kMostDenseOfPart freedoms that ask for some of their modes, those alone by a sparse
/// one   (THEORY X170-X176). See tests/bench for times.
std::optional<Structure> build_structure(const Scene& scene, Faults& faults,
                                         const SetupProgress& progress = {});

/// True when build_structure() takes the sparse path.
bool takes_sparse_path(const Scene& scene);

enum class SetupPath { kDense, kSparse };
/// The same by a path that the caller chooses: to compare them.
std::optional<Structure> build_structure_by(const Scene& scene, SetupPath path, Faults& faults,
                                            const SetupProgress& progress = {});

/// Neighbouring modes whose frequencies agree: their shapes are one choice among many.
struct FrequencyCluster {
  int first = 0;  // mode index from 0
  int count = 1;
};

/// Groups ascending frequencies; a mode joins the one before when they differ by at most relative_gap.
std::vector<FrequencyCluster> frequency_clusters(const Eigen::VectorXd& omega, double relative_gap);

}  // namespace freeflex
