// The full system of a scene: points in space, springs and bars at true length and direction (THEORY
// X30-X35). Nothing is linearised and no mode is used, so it checks the separated equations independently.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "core/reference/true_geometry.hpp"
#include "core/scene/scene.hpp"

namespace freeflex {

inline constexpr double kNoMoment =
    1e-13;  // [-] of the largest moment of inertia: that of a collinear set, rounded

/// One load of the scene, its wrenches spread over the points of their groups.
struct CartesianLoad {
  Axes axes = Axes::kWorld;
  std::vector<PointLoad> forces;  // [N] forces in `axes`
  /// A torque in `axes` becomes F_i = m_i (J_g^-1 T_g) x d_i in body axes (THEORY X12 without the force
  /// part).
  struct Torque {
    Eigen::Vector3d torque = Eigen::Vector3d::Zero();  // [N m]
    std::vector<int> points;
    std::vector<Eigen::Matrix3d> force_per_torque;  // [1/m] -m_i [d_i x] J_g^-1
  };
  std::vector<Torque> torques;
  History history;
};

/// An axial link; rest vector from its first to its second point.
struct CartesianLink {
  int link = 0;  // index into Scene::links
  int first = 0, second = 0;
  Eigen::Vector3d rest = Eigen::Vector3d::Zero();  // [m] body axes
  double length = 0.0;                             // [m]
  double stiffness = 0.0;                          // [N/m] 0 for a dashpot
  double damping = 0.0;                            // [N s/m] of a dashpot, or one beside the spring
};

/// Unknowns are e_i [m] and e_i' [m/s] of every point in the carrier frame C: it starts as the body frame,
/// falls with gravity, keeps the initial velocity of the centre of mass and turns at the constant initial
/// angular velocity. Position of point i: p_W,i = p_WC + R_WC (r_i + e_i)   (THEORY X30). While the motion
/// stays near the carrier's, e has the size of the deformation and keeps its digits.
struct CartesianSystem {
  Eigen::VectorXd mass;  // [kg] (N)
  Eigen::Matrix3Xd r;    // [m] (3 x N) rest positions from the centre of mass
  std::vector<CartesianLink> links;
  // the links that are not axial; remembers the rotations found last, so one system belongs to one thread
  std::optional<TrueGeometry> true_geometry;
  std::vector<CartesianLoad> loads;
  Eigen::Vector3d gravity_W = Eigen::Vector3d::Zero();    // [m/s^2] uniform, or an attractor's at the start
  double attractor_mu = 0.0;                              // [m^3/s^2] 0: none   (THEORY X39)
  Eigen::Vector3d attractor_W = Eigen::Vector3d::Zero();  // [m]
  Eigen::Vector3d p_W = Eigen::Vector3d::Zero();          // [m] centre of mass at the start
  Eigen::Vector3d v_W = Eigen::Vector3d::Zero();          // [m/s] its velocity at the start
  Eigen::Quaterniond q_WB = Eigen::Quaterniond::Identity();  // attitude at the start
  Eigen::Vector3d spin = Eigen::Vector3d::Zero();            // [rad/s] of the carrier, body axes
  Eigen::VectorXd initial;                                   // (6N) e then e'
  bool needs_body_axes = false;                              // some load turns with the body
};

/// A scene as a Cartesian system; nullopt and `error` for what it cannot state: beams, matrix links, damping
/// other than stiffness-proportional, initial modes, body-axis loads on a collinear shape.
std::optional<CartesianSystem> make_cartesian_system(const Scene& scene, std::string& error);

/// A scene with links of every kind at true geometry, and damping of every kind (THEORY X150-X157); nullopt
/// and `error` for feedback and initial modes. A shape on a line has the body axes of the smallest turn.
std::optional<CartesianSystem> make_true_geometry(const Scene& scene, std::string& error);

/// Masses, springs, bars, dashpots, loads and the initial state of a scene, whatever else it holds.
CartesianSystem lay_out(const Scene& scene);

/// Accelerations e'' [m/s^2] (3N) at time t [s] (THEORY X31-X34). Pulses are on or off as at
/// `piece_time`, a time strictly inside the smooth piece that holds t, so both ends of the piece have
/// one-sided values.
void accelerations(const CartesianSystem& system, double t, double piece_time, std::span<const double> e,
                   std::span<const double> e_dot, std::span<double> e_ddot);

/// Amplitude [-] of a history at t [s]; a pulse is on when `piece_time` [s] lies inside it.
double amplitude(const History& history, double t, double piece_time);

/// Adds the forces [N] of one load times `scale`, in carrier axes. R_CW, R_CB take world and body vectors to
/// the carrier.  \param force (3 x N)
void add_load(const CartesianLoad& load, double scale, const Eigen::Matrix3d& R_CW,
              const Eigen::Matrix3d& R_CB, Eigen::Map<Eigen::Matrix3Xd>& force);

/// Times in (0, end) where a load or its slope jumps: pulse edges and table rows, ascending.
std::vector<double> discontinuities(const CartesianSystem& system, double end);

/// World positions [m] and velocities [m/s] (3 x N)   (THEORY X30).
struct CartesianState {
  double time = 0.0;  // [s]
  Eigen::Matrix3Xd p_W, v_W;
};
CartesianState to_world(const CartesianSystem& system, double t, std::span<const double> y);

/// Strain energy of the links [J], from relative displacements (THEORY X32).
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
