// The loads that may act on a structure, and its static responses to them.
#pragma once

#include <Eigen/Core>
#include <array>
#include <vector>

#include "core/scene/scene.hpp"

namespace freeflex {

/// The symmetric pairs of axes, in the order in which fields and products of the spin are stored.
inline constexpr std::array<std::array<int, 2>, 6> kAxisPairs{
    {{0, 0}, {1, 1}, {2, 2}, {0, 1}, {0, 2}, {1, 2}}};

/// A load of size one that may act: a field of accelerations S r, a built-in load at amplitude 1, or one
/// component of a command (THEORY 8.49).
struct ReferenceLoad {
  enum class Kind { kField, kBuiltIn, kForce, kTorque, kGroupForce, kGroupTorque, kMotor };
  static constexpr int kMotorsOnly = 9;  // component: the motors of a load in world axes
  Kind kind = Kind::kField;
  // index into Scene::loads (kBuiltIn), points (kForce, kTorque), groups (kGroupForce, kGroupTorque) or
  // wheels (kMotor); field: -1
  int item = -1;
  // field: index into kAxisPairs of the components S_ab = S_ba. Built-in load in world axes: 3 a + b,
  // component a of each force and torque, acting along axis b of the body, or kMotorsOnly. Command: axis of
  // the body, with 1 N or 1 N m. Others: 0
  int component = 0;

  bool is_field() const { return kind == Kind::kField; }
  bool is_command() const { return kind != Kind::kField && kind != Kind::kBuiltIn; }
};

/// The most components of commands that have a stiffness, 64 points without inertia. A scene with more has no
/// stiffness by commands: the set-up computes one static response for each component.
inline constexpr std::size_t kMostCommandComponents = 192;

/// Returns the components of the loads that commands may have: forces on Scene::pushable, torques on those
/// with an attitude, wrenches on groups and motors of wheels on pushable points.
std::vector<ReferenceLoad> command_components(const Scene& scene);

/// Returns the loads whose geometric stiffness some rung takes.
/// \param is_large  true: only those that the rung of the scene takes
std::vector<ReferenceLoad> reference_loads(const Scene& scene, bool is_large);

class Freedoms;
/// Returns the forces [N] and torques [N m] of a reference load over all freedoms.  \pre it is no field
/// \param r  [m] (3 x N) rest positions from the centre of mass
Eigen::VectorXd forces_of(const Scene& scene, const Freedoms& freedoms, const Eigen::Matrix3Xd& r,
                          const ReferenceLoad& reference);

/// Returns the frequency [rad/s] above which modes take part in the static response to a load, five times the
/// lowest one. A load moves softer modes far, and they answer late: the change of stiffness by their motion
/// would act on this motion again, and count it twice   (THEORY 8.50).
double softest_of_load(const Eigen::VectorXd& omega);

/// Static responses of a free structure to reference loads. The inertia forces of the rigid motion that a
/// load causes balance it, so the responses have no rigid part   (THEORY 8.50).
struct StaticResponses {
  std::vector<ReferenceLoad> loads;
  Eigen::MatrixXd shapes;     // [m] (3N x loads) displacements of the points
  Eigen::MatrixXd rotations;  // [rad] (num_rotations x loads); empty in scenes of point masses
};

struct Structure;
struct SparseSystem;
class ShiftedInverse;

/// Returns the responses of a structure that has all of its modes.
StaticResponses static_responses(const Scene& scene, const Structure& structure);
/// Returns the responses by the sparse factor (THEORY 8.51). On failure the result has no columns.
/// \param x      mass-orthonormal modes (num_all x n)  \param omega  [rad/s] (n); 0: a mechanism
/// \param inverse  inverse near zero frequency
StaticResponses static_responses(const Scene& scene, const Freedoms& freedoms, const SparseSystem& system,
                                 const Eigen::Matrix3Xd& r, const Eigen::MatrixXd& x,
                                 const Eigen::VectorXd& omega, ShiftedInverse& inverse);

}  // namespace freeflex
