// The full system of a scene. It consists of points in space, with springs and bars at their true length and
// direction. Nothing is linearised and no mode is used, so the system is an independent check of the
// separated equations. THEORY 10.1 to 10.7
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "core/faults.hpp"
#include "core/scene/scene.hpp"
#include "tools/verification/reference/point_copy.hpp"
#include "tools/verification/reference/true_geometry.hpp"

namespace freeflex {

/// [-] If the smallest moment of inertia of some points, divided by the largest, is at most this limit, the
/// points are treated as collinear. Rounding errors alone can make the ratio this large.
inline constexpr double kNoMoment = 1e-13;

/// One load of the scene, with its wrenches distributed over the points of their groups.
struct CartesianLoad {
  Axes axes = Axes::kWorld;
  std::vector<PointLoad> forces;  // [N] forces in `axes`
  /// A torque T_g in `axes`. It exerts on each point i of its group the force F_i = m_i (J_g^-1 T_g) x d_i in
  /// body axes. Here d_i [m] is the position from the centre of mass of the group, and J_g [kg m^2] is the
  /// inertia of the group (THEORY 8.8, 8.9).
  struct Torque {
    Eigen::Vector3d torque = Eigen::Vector3d::Zero();  // [N m]
    std::vector<int> points;
    std::vector<Eigen::Matrix3d> force_per_torque;  // [1/m] -m_i [d_i x] J_g^-1
  };
  std::vector<Torque> torques;
  std::vector<std::pair<int, Eigen::Vector3d>> body_torques;  // body and torque [N m] in `axes`
  std::vector<std::pair<int, double>> wheel_torques;          // wheel and torque of its motor [N m]
  History history;
};

/// A wheel on a body, which is an index into the bodies of TrueGeometry   (THEORY 10.29).
struct CartesianWheel {
  int body = -1;
  Eigen::Vector3d axis = Eigen::Vector3d::Zero();  // [-] in the rest axes of the body
  double momentum = 0.0;                           // [N m s] at the start
};

/// An axial link from its first to its second point.
struct CartesianLink {
  int link = 0;  // index into Scene::links
  int first = 0, second = 0;
  Eigen::Vector3d rest = Eigen::Vector3d::Zero();  // [m] L u, from the first point to the second, body axes
  double length = 0.0;                             // [m]
  double stiffness = 0.0;                          // [N/m] 0 for a dashpot
  // [N s/m] c of a dashpot, or of the damping in parallel with the spring (THEORY 10.5)
  double damping = 0.0;
};

/// Points without mass, at which the forces of links and loads balance   (THEORY 10.28). The displacements
/// and the inverse of the stiffness that were found last are kept, from which Newton's method starts.
struct CartesianMassless {
  std::vector<int> points;
  Eigen::VectorXd e;        // [m] (3 points)
  Eigen::MatrixXd inverse;  // [m/N] (3 points x 3 points); empty: not known
};

/// The unknowns are the displacements e_i [m] of every point in the carrier frame C and their rates e_i'
/// [m/s]. The carrier starts as the body frame, falls with gravity, keeps the initial velocity of the centre
/// of mass and rotates at the constant initial angular velocity w_C. While the motion stays near the motion
/// of the carrier, e has the size of the deformation and keeps its digits   (THEORY 10.1):
///   p_W,i = p_WC + R_WC (r_i + e_i)
///   p_WC = p_WB(0) + v_WB(0) t + g_W t^2 / 2,   R_WC = R_WB(0) exp([w_C x] t)
struct CartesianSystem {
  Eigen::VectorXd mass;  // [kg] (N)
  Eigen::Matrix3Xd r;    // [m] (3 x N) rest positions from the centre of mass
  std::vector<CartesianLink> links;
  // The links that are not axial. TrueGeometry keeps the rotations that it found last, so only one thread at
  // a time may use a system
  std::optional<TrueGeometry> true_geometry;
  std::vector<CartesianLoad> loads;
  std::vector<CartesianWheel> wheels;
  // the last points, which copy the inertia of bodies; the other points are those of the scene
  std::vector<CarriedPoint> carried;
  Eigen::Vector3d gravity_W = Eigen::Vector3d::Zero();    // [m/s^2] uniform, or the attraction at the start
  double attractor_mu = 0.0;                              // [m^3/s^2] 0: no attractor   (THEORY 10.7)
  Eigen::Vector3d attractor_W = Eigen::Vector3d::Zero();  // [m]
  Eigen::Vector3d p_WB = Eigen::Vector3d::Zero();         // [m] centre of mass at the start
  Eigen::Vector3d v_WB = Eigen::Vector3d::Zero();         // [m/s] velocity of the centre of mass at the start
  Eigen::Quaterniond q_WB = Eigen::Quaterniond::Identity();  // attitude at the start
  Eigen::Vector3d spin = Eigen::Vector3d::Zero();            // [rad/s] w_C of the carrier, body axes
  Eigen::VectorXd initial;                                   // (6N) e then e'
  mutable CartesianMassless massless;
  bool needs_body_axes = false;  // true: at least one load rotates with the body
  // Changes the forces on the points [N] (3 x N) at time t [s], in carrier axes, after all links and loads;
  // empty: nothing. Positions x [m] and velocities v [m/s] are those in space, along the axes of the carrier,
  // from the origin of the carrier. Tests add what scenes of the reference cannot have.
  std::function<void(double t, const Eigen::Matrix3Xd& x, const Eigen::Matrix3Xd& v,
                     Eigen::Ref<Eigen::Matrix3Xd> force)>
      change_forces;
};

/// Makes the Cartesian system of a scene of point masses, springs, bars and dashpots. Returns nullopt and
/// sets `error` for other links, damping other than stiffness-proportional, feedback, loads in local axes,
/// initial modes, and loads in body axes on a collinear shape.
std::optional<CartesianSystem> make_cartesian_system(const Scene& scene, std::string& error);

/// Makes the system of a scene with links of every kind at true geometry and damping of every kind
/// (THEORY 10.12 to 10.25, 10.29). Returns nullopt and sets `error` for feedback, initial modes and bodies
/// that copy_bodies() refuses. If all points are on a line, the body axes are those of the rest shape, turned
/// by the smallest rotation that takes the rest line to this line.
std::optional<CartesianSystem> make_true_geometry(const Scene& scene, std::string& error);

/// Returns the reason why a scene has no full system with which `freeflex report` compares, or nullopt.
/// Bodies that copy_bodies() refuses, points without mass off bodies, distributed mass, feedback, initial
/// modes and more than kMostTruePoints at true geometry are refused.
std::optional<Fault> find_no_full_system(const Scene& scene);
/// Makes the system with which `freeflex report` compares: make_cartesian_system for springs and bars without
/// dissipation and attractor, else make_true_geometry.  \pre find_no_full_system(scene) is empty
CartesianSystem make_full_system(const Scene& scene);

/// Largest number of points at true geometry. Up to it, the set-up computes all frequencies, and the highest
/// frequency limits the steps of the other methods.
inline constexpr std::size_t kMostTruePoints = 150;

/// Makes a system from the masses, springs, bars, dashpots, loads and initial state of a scene. The other
/// links of the scene are ignored.
CartesianSystem make_axial_system(const Scene& scene);

/// Computes the accelerations e'' [m/s^2] (3N) in the carrier's axes at time t [s]   (THEORY 10.6):
///   m (e'' + 2 w_C x e' + w_C x (w_C x (r + e))) = F
/// At t a pulse acts if it acts at `piece_time`, a time strictly inside the smooth piece that contains t. So
/// at both ends of the piece the loads are the limits from inside the piece.
void accelerations(const CartesianSystem& system, double t, double piece_time, std::span<const double> e,
                   std::span<const double> e_dot, std::span<double> e_ddot);

/// Sets the displacements of massless points to those at which the forces on them are zero, or to NaN if none
/// are found. Their accelerations are zero in accelerations(), and the given ones have no effect.
void place_massless(const CartesianSystem& system, double t, double piece_time, std::span<double> e);

/// Returns the amplitude [-] of a history at t [s]. A pulse is on if `piece_time` [s] lies inside the pulse.
double amplitude(const History& history, double t, double piece_time);

/// Returns the integral of amplitude() from the start to t [s].
double impulse(const History& history, double t, double piece_time);

/// Angular momentum [N m s] of the wheels of a body, the torque [N m] of their motors, and the torque of
/// loads on the body, all in the axes of the body   (THEORY 10.29).
struct BodyMoments {
  Eigen::Vector3d momentum = Eigen::Vector3d::Zero(), motor = Eigen::Vector3d::Zero(),
                  load = Eigen::Vector3d::Zero();
};
/// \param R  rotation of the body, from its rest axes to the carrier  \param R_CW, R_CB  see add_load()
BodyMoments moments_on_body(const CartesianSystem& system, int body, double t, double piece_time,
                            const Eigen::Matrix3d& R, const Eigen::Matrix3d& R_CW,
                            const Eigen::Matrix3d& R_CB);
/// Returns whether wheels or torques act on bodies.
bool has_body_moments(const CartesianSystem& system);

/// Computes the forces of links and loads [N] (3N), without the constraints of rigid links. Moments on
/// bodies are added as forces on their points, unless `leaves_moments` is true.
void set_forces(const CartesianSystem& system, double t, double piece_time, std::span<const double> e,
                std::span<const double> e_dot, bool leaves_moments, std::span<double> result);
/// Accelerations [m/s^2] of the points towards the attractor, less that of the carrier   (THEORY 10.7).
Eigen::Matrix3Xd attractions(const CartesianSystem& system, double t,
                             const Eigen::Ref<const Eigen::Matrix3Xd>& e);
/// Rotation from the carrier's axes to the world, R_WC = R_WB(0) exp([w_C x] t)   (THEORY 10.1).
Eigen::Matrix3d carrier_rotation(const CartesianSystem& system, double t);
/// Rotation from body axes to the carrier, or the identity if no load needs it.
Eigen::Matrix3d body_rotation(const CartesianSystem& system, const Eigen::Ref<const Eigen::Matrix3Xd>& e);

/// Adds the forces [N] of one load times `scale`, in carrier axes. R_CW and R_CB rotate world and body
/// vectors into the carrier.  \param force (3 x N)
void add_load(const CartesianLoad& load, double scale, const Eigen::Matrix3d& R_CW,
              const Eigen::Matrix3d& R_CB, Eigen::Map<Eigen::Matrix3Xd>& force);

/// Returns the times in (0, end) at which a load or its slope jumps, in ascending order: the edges of pulses
/// and the rows of tables.
std::vector<double> discontinuities(const CartesianSystem& system, double end);

/// World positions [m] and velocities [m/s] (3 x N) of the points.
struct CartesianState {
  double time = 0.0;  // [s]
  Eigen::Matrix3Xd p_W, v_W;
};
/// Computes the world state from y = (e, e')   (THEORY 10.1).
CartesianState to_world(const CartesianSystem& system, double t, std::span<const double> y);

/// Returns the strain energy [J] of the links: the sum of D elongation^2 / 2 over the axial links, with
/// elongations computed from relative displacements, and the energies of the links at true geometry
/// (THEORY 10.3, 10.4).
double strain_energy(const CartesianSystem& system, std::span<const double> e);

/// Kinetic energy [J], linear momentum [kg m/s] and angular momentum about the centre of mass [kg m^2/s],
/// world axes.
struct CartesianInvariants {
  double kinetic = 0.0;
  Eigen::Vector3d linear_momentum = Eigen::Vector3d::Zero();
  Eigen::Vector3d angular_momentum = Eigen::Vector3d::Zero();
};
CartesianInvariants invariants(const CartesianSystem& system, const CartesianState& state);

}  // namespace freeflex
