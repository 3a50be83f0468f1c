// Links of every kind at true geometry: beams, plates, angles, matrices and rigid bodies between points in
// space (THEORY X150-X157). It shares no model with core/structure, so it can say whether that is right.
// Springs, bars and dashpots are those of CartesianSystem.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <Eigen/LU>
#include <array>
#include <utility>
#include <vector>

#include "core/reference/fitted_frame.hpp"
#include "core/reference/turning_links.hpp"
#include "core/scene/scene.hpp"

namespace freeflex {

/// Where ends of beams and corners of plates share a rotation without inertia.
struct TurnJoint {
  int body = -1;  // rigid body that turns it, index into TrueGeometry::bodies; -1: none
  int first = 0;  // its first unknown turn
  int num = 3;    // unknown turns: 3; 1 about the line of a body whose points are on one; 0 of another body
};

/// An end at a joint, and the turns about its own axes that the joint does not hold.
struct TurnEnd {
  int joint = -1;
  Eigen::Matrix3d rest = Eigen::Matrix3d::Identity();  // local axes at rest as columns
  std::vector<int> released;                           // axes
  int first = 0;                                       // unknown turn of the first of them
};

/// Two or three points and their ends.
template <typename Kind>
struct TurningLink {
  int link = -1;
  Kind kind;
  std::vector<int> points;
  std::vector<TurnEnd> ends;
};

/// Angle of three points, or dihedral of four, at its true value   (THEORY X154).
struct TrueAngle {
  int link = -1;
  std::vector<int> points;
  double stiffness = 0.0;                       // [N m]
  double rest = 0.0;                            // [rad]
  bool is_straight = false, is_folded = false;  // at rest three points on a line, on either or one side
};

/// Stiffness over the displacements of some points in the axes that fit them best   (THEORY X155).
struct TrueMatrix {
  int link = -1;
  FittedFrame frame;
  Eigen::MatrixXd K;  // [N/m] (3n x 3n)
};

/// Points whose distances stay   (THEORY X156).
struct TrueBody {
  FittedFrame frame;
  Eigen::MatrixXd forbidden;  // [-] (3n x constraints) orthonormal, across the rigid motions
};

class TrueGeometry {
 public:
  /// Beams, plates, angles, matrices and rigid links of a scene.  \param rest [m] (3 x N) from the centre of
  /// mass \param mass [kg] (N)
  TrueGeometry(const Scene& scene, const Eigen::VectorXd& mass, const Eigen::Matrix3Xd& rest);

  using Places = Eigen::Ref<const Eigen::Matrix3Xd>;
  using Forces = Eigen::Ref<Eigen::Matrix3Xd>;

  /// Adds the forces [N] of links on the points at displacements e [m] (3 x N) from rest, in any axes that do
  /// not turn; finds the rotations of joints that make the energy least. Not finite when there are none.
  /// \return strain energy [J]
  double add_forces(const Places& e, Forces force) const;
  /// The strain energy [J] of each link of the scene, zero for those that are not here.
  Eigen::VectorXd energies(const Places& e) const;

  /// Adds forces that turn with the surroundings of their points, of joints as add_forces left them
  /// (THEORY X73).
  void add_followers(const std::vector<PointLoad>& loads, double scale, const Places& e, Forces force) const;

  /// Adds the forces [N] of damping that acts on the elastic velocities in body axes   (THEORY X157).
  void add_damping(const Places& e, const Places& e_dot, const Forces& force) const;

  /// Changes accelerations [m/s^2] by the least, mass times square, that rigid links need   (THEORY X156).
  void constrain(const Places& e, const Places& e_dot, Forces acceleration) const;
  /// Moves places and velocities onto what rigid links allow.
  void project(Forces e, Forces e_dot) const;
  /// [-] rows of G M^-1/2, what rigid links forbid of sqrt(m) v (num x 3N).
  Eigen::MatrixXd forbidden(const Places& e) const;
  bool has_rigid_links() const { return !bodies_.empty(); }

  /// Elastic velocities V' in body axes meet forces -C V'.  \param C [N s/m] (3N x 3N)
  void set_damping(Eigen::MatrixXd C) { damping_ = std::move(C); }
  /// What is wrong with rigid links dies out at this rate [1/s], without effect on what is right.
  void set_correction(double rate) { correction_ = rate; }

  int num_links() const { return num_links_; }
  /// Rotation of a joint, or the mean rotation of a point's surroundings, rest axes to present ones (X73).
  Eigen::Matrix3d local_rotation(int point, const Places& e) const;
  /// Stiffnesses [N/m] of single links, the stiffest and the softest of each, to guess scales of a motion
  /// from.
  const std::vector<double>& stiffnesses() const { return stiffnesses_; }

 private:
  struct Frame {  // an end as it stands, and the spins that unknown turns give it
    Eigen::Matrix3d axes;
    std::array<std::pair<int, Eigen::Vector3d>, 5> spins;  // three of a joint, or one, and two of a release
    std::size_t num_spins = 0;
    void add(int turn, const Eigen::Vector3d& spin) { spins[num_spins++] = {turn, spin}; }
  };
  void add_turning(const Scene& scene, int index);
  int add_joint(int point);
  TurnEnd make_end(int point, const Eigen::Matrix3d& axes, const std::array<bool, 3>& released);
  void add_angle(const Scene& scene, int index);
  void add_matrix(const Scene& scene, int index);
  void add_body(const std::vector<int>& points);
  void find_idle_turns();
  void find_surroundings(const Scene& scene);

  Frame stand(const TurnEnd& end) const;
  void follow_bodies(const Places& e) const;
  /// Energy, gradient over unknown turns and, when asked for, their stiffness; forces of turning links.
  double assemble(const Places& e, bool with_stiffness, Forces force, Eigen::VectorXd* energies) const;
  template <typename Kind>
  double assemble(const TurningLink<Kind>& link, const Places& e, bool with_stiffness, Forces force) const;
  void factor() const;
  Eigen::VectorXd newton_step(const Places& e) const;
  void turn(const Eigen::VectorXd& step) const;
  bool relax(const Places& e) const;
  double add_angles(const Places& e, const Forces& force, Eigen::VectorXd* energies) const;
  double add_matrices(const Places& e, const Forces& force, Eigen::VectorXd* energies) const;
  std::vector<FittedFrame::Fit> fit_bodies(const Places& e) const;

  Eigen::VectorXd mass_;
  Eigen::Matrix3Xd r_;
  FittedFrame body_;
  std::vector<TurnJoint> joints_;
  std::vector<int> joint_of_;  // (N) or -1
  std::vector<TurningLink<TrueBeam>> beams_;
  std::vector<TurningLink<TruePlate>> plates_;
  std::vector<TrueAngle> angles_, dihedrals_;
  std::vector<TrueMatrix> matrices_;
  std::vector<TrueBody> bodies_;
  std::vector<FittedFrame> surroundings_;  // (N) of points, to follow where there is no joint
  std::vector<double> stiffnesses_;
  int num_links_ = 0;
  int num_turns_ = 0;
  Eigen::VectorXd scale_;  // (num_turns) square roots of the diagonal of the stiffness at rest
  Eigen::MatrixXd idle_;   // (num_turns x k) scaled turns that strain nothing, orthonormal
  Eigen::MatrixXd damping_;
  double correction_ = 0.0;

  // the rotations found last, from which the next are sought, and scratch
  struct Turns {
    std::vector<Eigen::Quaterniond> joint;
    std::vector<Eigen::Matrix3d> rotation;
    Eigen::VectorXd angle;  // (num_turns) of released ends
    Eigen::VectorXd gradient;
    Eigen::MatrixXd stiffness;
    Eigen::PartialPivLU<Eigen::MatrixXd> factor;
    std::vector<Eigen::Vector3d> body_moment;
    std::vector<FittedFrame::Fit> body_fit;
  };
  mutable Turns turns_;
};

}  // namespace freeflex
