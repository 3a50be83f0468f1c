// This code makes the structure of a scene. The structure has mass properties, links in factor form, rigid
// freedoms, mechanisms and elastic modes.
#pragma once

#include <Eigen/Core>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "core/scene/scene.hpp"
#include "core/structure/prestress/load_stiffness.hpp"
#include "core/structure/resolved_scene.hpp"

namespace freeflex {

/// The mass properties of the rest shape   (THEORY 2.1 to 2.10).
struct MassProperties {
  double mass = 0.0;          // [kg]
  Eigen::Vector3d p_SB;       // [m] centre of mass in scene axes
  Eigen::Matrix3Xd r;         // [m] (3 x N) rest positions from the centre of mass, body axes
  Eigen::Matrix3Xd centres;   // [m] (3 x (N + parts)) centres of mass of points, then of distributed_masses()
  Eigen::Matrix3d inertia;    // [kg m^2] about the centre of mass, body axes
  Eigen::Vector3d principal;  // [kg m^2] ascending
  Eigen::Matrix3d principal_axes;  // columns, right-handed
  int rigid_freedoms = 6;          // 6; 5 if collinear; 3 for one point   (THEORY 2.10)
  Eigen::Vector3d line;            // [-] unit vector along a collinear shape; zero for other shapes
};

/// A motion that strains no link and is not rigid. The frequency of this motion is zero   (THEORY 4.4).
struct Mechanism {
  // points that move by more than 1e-6 of the largest displacement, in descending order of displacement
  std::vector<int> moved_points;
};

/// Output rows for the forces of one published link   (THEORY 5.1 to 5.6, 3.37): force = rows q + rate_rows
/// q' + load_rows Q_c, where Q_c are the generalized forces of the constraint shapes. Values: spring, bar,
/// dashpot, rigid link of two points: tension [N]. Bending and torsion spring: moment [N m], two for a
/// straight bending spring. Beam: 12 values in local axes [N], [N m]: the force and the moment that the joint
/// at its first point exerts on it, then the force and the moment of the joint at its second point. Plate:
/// Nxx Nyy Nxy [N/m], Mxx Myy Mxy [N]. Matrix link and rigid body: forces on its points, body axes [N].
struct LinkForceRows {
  int link = -1;
  Eigen::MatrixXd rows;       // (num_values x n)
  Eigen::MatrixXd rate_rows;  // (num_values x n); no rows if the link does not dissipate
  Eigen::MatrixXd load_rows;  // (num_values x num_constraint_shapes); no rows if loads have no direct effect
};

/// Particles over which sums over the mass are taken if not all mass is in point masses (THEORY 16.4, 16.10).
struct Particles {
  Eigen::VectorXd mass;    // [kg] (P)
  Eigen::Matrix3Xd r;      // [m] (3 x P) rest positions from the centre of mass, body axes
  Eigen::MatrixXd shapes;  // [-] (3P x n) unit elastic displacements, sum m b.b = M   (THEORY 16.9)
};

/// The contributions of mass matrices to sums over the mass, per elastic coordinate. Mass matrices have no
/// particles. The sums are linear in the elastic coordinates (THEORY 16.19, 16.20).
struct MatrixSums {
  Eigen::MatrixXd momenta;  // [kg], [kg m] (6 x n) linear, then angular momentum about the centre of mass
  Eigen::MatrixXd field;    // [kg m] (6 x n) field moments Y_l (THEORY 8.15) of accelerations at the points
};

/// The subset of elastic modes that a structure has.
struct KeptModes {
  bool is_subset = false;  // true: modes were limited, or found by the sparse set-up
  // [Hz] no mode below this frequency is missing, as a Sturm count or the dense set-up of all modes shows; 0
  // if is_subset is false
  double verified_below = 0.0;
};

struct Structure {
  ResolvedScene resolved;
  MassProperties mass_properties;
  Eigen::VectorXd omega;  // [rad/s] (n) ascending; exactly 0 for mechanisms
  // [-] (3N x n) unit elastic displacements b of the points; for point masses sum m b.b = M   (THEORY 4.3)
  Eigen::MatrixXd shapes;
  // [1/m] (num_rotations x n) rotations of joints in the order of Freedoms; empty in scenes of point masses
  Eigen::MatrixXd rotations;
  Particles particles;
  MatrixSums matrix_sums;  // sums of superelements with mass; empty if there is none
  std::vector<Mechanism> mechanisms;
  double frequency_accuracy = 0.0;  // [-] stated relative accuracy of the lowest nonzero frequency
  double conditioning = 0.0;        // [-] omega_max / omega_min over nonzero modes
  // true: the rotations of joints are those of least energy in every motion, so that the mass of links moves
  // with the displacements of points alone   (THEORY 12.107)
  bool has_static_joints = false;
  KeptModes kept;
  int num_constraints = 0;           // number of freedoms that rigid links remove
  Eigen::MatrixXd damping_rows;      // [sqrt(N s/m)] (num x n) R = A_d b   (THEORY 3.49)
  Eigen::VectorXd structural_ratio;  // [-] (n) damping ratio due to loss factors of links   (THEORY 4.24)
  std::vector<LinkForceRows> link_forces;  // rows for the links in Scene::publication.links, in that order
  // displacements whose generalized forces give the forces of published rigid links (THEORY 5.7) and the
  // quasi-static forces of omitted modes (THEORY 14.12)
  Eigen::MatrixXd constraint_shapes;  // [1/kg] (3N x num)
  // [1/m] (3 x n) by point with a follower force: elastic rotation of the surroundings of the point, body
  // axes (THEORY 8.24)
  std::map<int, Eigen::Matrix3Xd> local_rotations;
  std::vector<LoadStiffness> load_stiffness;  // geometric stiffness of loads and fields
};

/// Returns whether particles have displacements of their own. If not, the points are the particles. If only
/// matrices have mass, the result is true, but there are no particles (0 x n).
inline bool has_particles(const Structure& structure) {
  return structure.particles.shapes.rows() == 3 * structure.particles.mass.size();
}
/// Returns the unit displacements of the particles, or of the points if the points are the particles.
inline const Eigen::MatrixXd& particle_shapes(const Structure& structure) {
  return has_particles(structure) ? structure.particles.shapes : structure.shapes;
}

/// Checks the physics of a scene without computing modes: values, references, mass properties and, if there
/// are other errors, matrices. Faults are appended. The returned mass properties are valid if there is no
/// error.
MassProperties check_physics(const Scene& scene, Faults& faults);

/// The progress report and the memory limit of a set-up. The progress report can also end the set-up.
struct SetupProgress {
  /// \param what  name of the stage  \param done  completed fraction of the stage, 0 to 1
  /// \return false to end the set-up with an error
  std::function<bool(const std::string& what, double done)> report = {};
  double memory_MB = 0.0;  // available memory; 0: unknown, no limit
  /// Calls work(k) for k from 0 to count - 1, which do not depend on one another, for example on several
  /// threads. Empty: they are called one after another. The structure has the same bits.
  std::function<void(int count, const std::function<void(int)>& work)> share = {};
};

/// Checks the physics of a scene and computes its structure   (THEORY sections 2 to 5). Faults are appended,
/// and the result is nullopt on an error. Up to kMaxDensePoints points a dense factor gives all modes at a
/// cost of O(rows n^2). For larger scenes, and for scenes of more than kMostDenseForSomeModes freedoms that
/// request a subset of the modes, a sparse factor gives that subset   (THEORY 16.33 to 16.45). See
/// tests/bench for times.
std::optional<Structure> build_structure(const Scene& scene, Faults& faults,
                                         const SetupProgress& progress = {});

/// Returns whether build_structure() takes the sparse path.
bool takes_sparse_path(const Scene& scene);

enum class SetupPath { kDense, kSparse };
/// Builds the structure by a given path, for comparisons.
std::optional<Structure> build_structure_by(const Scene& scene, SetupPath path, Faults& faults,
                                            const SetupProgress& progress = {});

/// Consecutive modes of equal frequency. The shapes of these modes are not unique.
struct FrequencyCluster {
  int first = 0;  // mode index from 0
  int count = 1;
};

/// Groups ascending frequencies into clusters. Neighbours in a cluster differ by at most relative_gap.
std::vector<FrequencyCluster> frequency_clusters(const Eigen::VectorXd& omega, double relative_gap);

}  // namespace freeflex
