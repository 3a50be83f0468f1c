// Beams, plates, angles, matrices and rigid bodies at true geometry between points in space (THEORY 10.12 to
// 10.25). CartesianSystem itself contains the springs, bars and dashpots. This code shares no model with
// core/structure, so it can check core/structure.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <span>
#include <utility>
#include <vector>

#include "core/scene/scene.hpp"
#include "tools/verification/reference/fitted_frame.hpp"
#include "tools/verification/reference/rotating_links.hpp"
#include "tools/verification/reference/rotation_factor.hpp"

namespace freeflex {

/// A rotation without inertia, which ends of beams and corners of plates share at a point.
struct TrueJoint {
  int body = -1;  // rigid body that rotates the joint, index into bodies_; -1: no body
  int first = 0;  // index of the first unknown rotation of the joint
  int num = 3;    // number of unknown rotations: 3; on a body 0, or 1 about the line of a collinear body
};

/// An end of a link at a joint, with the rotations about its own axes that are released from the joint.
struct LinkEnd {
  int joint = -1;
  Eigen::Matrix3d rest = Eigen::Matrix3d::Identity();  // local axes of the undeformed link as columns
  std::vector<int> released;                           // axes about which the rotation is released
  int first = 0;  // index of the unknown rotation about the first released axis
};

/// A beam or plate with its points and its ends at joints.
template <typename Kind>
struct RotatingLink {
  int link = -1;
  Kind kind;
  std::vector<int> points;
  std::vector<LinkEnd> ends;
};

/// A spring on the true angle of three points, or on the true dihedral angle of four points
/// (THEORY 10.20, 10.21).
struct TrueAngle {
  int link = -1;
  std::vector<int> points;
  double stiffness = 0.0;    // [N m]
  double rest = 0.0;         // [rad]
  bool is_straight = false;  // true: the three points are on a line in the rest shape
  bool is_folded = false;    // true: both arms of the straight angle point to the same side
};

/// A stiffness matrix over the displacements of some points, in the axes that fit these points best
/// (THEORY 10.22).
struct TrueMatrix {
  int link = -1;
  FittedFrame frame;
  Eigen::MatrixXd K;  // [N/m] (3n x 3n)
};

/// A rigid link, which keeps the distances between n points constant   (THEORY 10.23).
struct TrueBody {
  FittedFrame frame;
  // [-] T_o (3n x constraints), orthonormal basis of the motions orthogonal to rigid motions
  Eigen::MatrixXd forbidden;
};

class TrueGeometry {
 public:
  /// Makes the beams, plates, angles, matrices and rigid links of a scene.
  /// \param mass [kg] (N)  \param rest [m] (3 x N) from the centre of mass
  TrueGeometry(const Scene& scene, const Eigen::VectorXd& mass, const Eigen::Matrix3Xd& rest);

  using PointVectors = Eigen::Ref<const Eigen::Matrix3Xd>;
  using Forces = Eigen::Ref<Eigen::Matrix3Xd>;

  /// Adds the forces [N] of links on the points, and finds the rotations of joints with the least energy. If
  /// these rotations are not found, the forces are not finite.
  /// \param e [m] (3 x N) displacements from rest, in axes that do not rotate
  /// \return strain energy [J]
  double add_forces(const PointVectors& e, Forces force) const;
  /// Returns the strain energy [J] of each link of the scene. The energy is zero for axial and rigid links.
  Eigen::VectorXd energies(const PointVectors& e) const;

  /// Adds `scale` times forces that rotate with the surroundings of their points. Uses the rotations of
  /// joints that add_forces() found last   (THEORY 8.24).
  void add_followers(const std::vector<PointLoad>& loads, double scale, const PointVectors& e,
                     Forces force) const;

  /// Adds the forces [N] of damping, s = -C_d V' on the elastic velocities V' in body axes   (THEORY 10.24).
  void add_damping(const PointVectors& e, const PointVectors& e_dot, const Forces& force) const;

  /// Changes accelerations [m/s^2] so that they meet the constraints of rigid links. Of all such changes it
  /// makes the one with the least sum of mass times change squared   (THEORY 10.23).
  void constrain(const PointVectors& e, const PointVectors& e_dot, Forces acceleration) const;
  /// Projects displacements and velocities onto the motions that rigid links allow.
  void project(Forces e, Forces e_dot) const;
  /// Returns the rows G m^-1/2 [1/sqrt(kg)] (num x 3N) of the constraints of rigid links, which act on
  /// sqrt(m) v.
  Eigen::MatrixXd forbidden(const PointVectors& e) const;
  bool has_rigid_links() const { return !bodies_.empty(); }

  /// Sets the damping matrix C_d over elastic velocities in body axes.  \param C [N s/m] (3N x 3N)
  void set_damping(Eigen::MatrixXd C) { damping_ = std::move(C); }
  /// Sets the rate kappa [1/s] at which errors of rigid links decay. The correction does not change a motion
  /// that meets the constraints   (THEORY 10.23).
  void set_correction(double rate) { correction_ = rate; }

  /// Sets the estimated error [rad] of the rotations of joints at which Newton's method stops (THEORY 13.19).
  /// Without it, Newton's method stops at rounding errors.
  void set_tolerance(double angle) { tolerance_ = angle; }
  /// Returns whether the forces or the constraints depend on velocities.
  bool depends_on_velocities() const { return damping_.size() > 0 || has_rigid_links(); }
  bool is_damped() const { return damping_.size() > 0; }

  int num_bodies() const { return static_cast<int>(bodies_.size()); }
  const FittedFrame& body_frame(int body) const { return bodies_[static_cast<std::size_t>(body)].frame; }
  /// Sets the rotations of all bodies, which are fitted to their points otherwise. The moments of joints on
  /// bodies are then left to body_moments()   (THEORY 13.22).
  void set_body_rotations(std::span<const Eigen::Matrix3d> R) { given_.assign(R.begin(), R.end()); }
  /// Returns the moment [N m] of the joints on a body that add_forces() found last.
  Eigen::Vector3d body_moment(int body) const {
    return joints_.empty() ? Eigen::Vector3d(Eigen::Vector3d::Zero())
                           : rotations_.body_moment[static_cast<std::size_t>(body)];
  }

  std::size_t memory() const;  // [bytes] memory that the forces read

  int num_links() const { return num_links_; }
  /// Returns the rotation from rest axes to present axes of the point's joint or, if the point has no joint,
  /// the mean rotation of its surroundings   (THEORY 8.24).
  Eigen::Matrix3d local_rotation(int point, const PointVectors& e) const;
  /// Returns stiffnesses [N/m] of single links, from which scales of a motion are estimated. Each link gives
  /// its largest stiffness, then its smallest.
  const std::vector<double>& stiffnesses() const { return stiffnesses_; }

 private:
  /// Present axes of an end, and the axes [-] about which unknown rotations rotate the end.
  struct Frame {
    Eigen::Matrix3d axes;
    // index and axis of each rotation: at most three of a joint and two of a release
    std::array<std::pair<int, Eigen::Vector3d>, 5> spins;
    std::size_t num_spins = 0;
    void add(int index, const Eigen::Vector3d& spin) { spins[num_spins++] = {index, spin}; }
  };
  /// Second derivative of the energy with respect to rotations: none, in closed form for the rest shape, or
  /// by differences of moments at the present rotations.
  enum class Tangent { kNone, kAtRest, kPresent };
  void add_beam(const Scene& scene, int index, const Beam& beam);
  void add_plate(const Scene& scene, int index, const Plate& plate);
  int add_joint(int point);
  LinkEnd make_end(int point, const Eigen::Matrix3d& axes, const std::array<bool, 3>& released);
  void add_bend(const Scene& scene, int index, double stiffness);
  void add_twist(const Scene& scene, int index, double stiffness);
  void add_matrix(const Scene& scene, int index, const MatrixLink& given);
  void add_body(const std::vector<int>& points);
  void find_idle_rotations();
  void find_surroundings(const Scene& scene);

  Frame frame_of_end(const LinkEnd& end) const;
  void follow_bodies(const PointVectors& e) const;
  /// Adds the forces of beams and plates and computes the gradient of their energy over the unknown rotations
  /// and, on request, its second derivative. Returns the energy [J].
  double assemble(const PointVectors& e, Tangent tangent, Forces force, Eigen::VectorXd* energies) const;
  template <typename Kind>
  double assemble(const RotatingLink<Kind>& link, const PointVectors& e, Tangent tangent, Forces force) const;
  void factor() const;
  std::vector<std::pair<int, int>> pairs_of_rotations() const;
  /// Computes the next step of Newton's method, in rotations_.step.  \param R_body  rotation of the body
  void newton_step(const Eigen::Matrix3d& R_body) const;
  void rotate() const;
  bool relax(const PointVectors& e) const;
  double add_angles(const PointVectors& e, const Forces& force, Eigen::VectorXd* energies) const;
  double add_matrices(const PointVectors& e, const Forces& force, Eigen::VectorXd* energies) const;
  std::vector<FittedFrame::Fit> fit_bodies(const PointVectors& e) const;

  Eigen::VectorXd mass_;
  Eigen::Matrix3Xd r_;
  FittedFrame body_;
  std::vector<TrueJoint> joints_;
  std::vector<int> joint_of_;  // (N) joint of each point; -1: no joint
  std::vector<RotatingLink<TrueBeam>> beams_;
  std::vector<RotatingLink<TruePlate>> plates_;
  std::vector<TrueAngle> angles_, dihedrals_;
  std::vector<TrueMatrix> matrices_;
  std::vector<TrueBody> bodies_;
  std::vector<FittedFrame> surroundings_;  // (N) of points with follower forces, used if a point has no joint
  std::vector<double> stiffnesses_;
  int num_links_ = 0;
  int num_rotations_ = 0;
  Eigen::VectorXd scale_;  // (num_rotations) square roots of the diagonal of the stiffness in the rest shape
  Eigen::MatrixXd idle_;   // (num_rotations x k) orthonormal, scaled rotations that strain no link
  Eigen::MatrixXd damping_;
  std::vector<Eigen::Matrix3d> given_;  // rotations of bodies, or empty
  double correction_ = 0.0;
  double tolerance_ = 0.0;  // [rad]

  // the last rotations found, from which Newton's method starts the next time, and work arrays
  struct Rotations {
    std::vector<Eigen::Quaterniond> quaternion;  // of joints
    std::vector<Eigen::Matrix3d> matrix;         // of joints
    Eigen::VectorXd angle;                       // [rad] (num_rotations) of released ends
    Eigen::VectorXd gradient;
    Eigen::MatrixXd stiffness;
    RotationFactor factor;
    Eigen::VectorXd right, step;  // of Newton's method, scaled; [rad] (num_rotations)
    double ratio = 0.0;           // [-] largest of two steps since the last factor; 0: not known
    Eigen::Matrix3Xd force;       // [N] forces that are not used
    std::vector<Eigen::Vector3d> body_moment;
    std::vector<FittedFrame::Fit> body_fit;
  };
  mutable Rotations rotations_;
};

}  // namespace freeflex
