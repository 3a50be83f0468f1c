// The forces of links at true geometry, with joints that have no inertia and take the rotations of least
// energy.
#pragma once

#include <span>

#include "core/step/links/beam_batch.hpp"
#include "core/step/links/joint_factor.hpp"
#include "core/step/links/rotations.hpp"
#include "core/step/massless/massless.hpp"
#include "core/step/plan/links.hpp"

namespace freeflex {

struct JointWorkspace {
  Array theta;  // [rad] (num_rotations) linear rotations
  // (num_joints + num_bodies) present rotations; the caller of relax_joints() sets those of bodies
  std::vector<Mat3> R;
  // [N m] (num_joints + num_bodies) derivatives of the energy of links by small rotations, in body axes
  std::vector<Vec3> moment;
  BeamBatch beams;
  std::vector<Vec3> body_theta;  // [rad] (num_bodies) linear rotations of bodies
  // [N m] (num_bodies) moments that links exert on bodies, in the axes of the body, and those of linear links
  std::vector<Vec3> on_body, linear_on_body;
  std::vector<FiniteRotation> turn;  // (num_joints) exp(theta)
  Array gradient, step;              // [N m], [rad] (num_rotations)
  JointState before;                 // rotations before the last step
  // unknown that changed most in the last sweep, if relax_joints() failed in this step
  std::int32_t unsolved = -1;
  MasslessPoints massless;
  JointFactor factor;  // of the rest shape at the start of each step
};

/// Holds the present axes of an end: the axes of the link as columns, and the axes about which its released
/// rotations turn it.
struct PresentEnd {
  Mat3 axes;
  std::array<Vec3, 3> spins;
};
/// \param R  present rotation of the joint or body  \param angles  [rad] of released rotations, as numbered
/// by the end  \param rest  rest axes of the link as columns
template <typename AngleOf>
PresentEnd present(const PlanLinkEnd& end, const Mat3& rest, const Mat3& R,
                   const AngleOf& angle_of) noexcept {
  PresentEnd result{multiply(R, rest), {}};
  for (std::size_t a = 0; a < 3; ++a) {
    if (end.released[a] < 0) continue;
    result.spins[a] = {result.axes[a], result.axes[3 + a], result.axes[6 + a]};
    Vec3 about{};
    about[a] = angle_of(index(end.released[a]));
    result.axes = multiply(result.axes, matrix_of(rotation_of(about).q));
  }
  return result;
}
inline BeamEnd beam_end(const PresentEnd& end) noexcept {
  return {{end.axes[0], end.axes[3], end.axes[6]}, {end.axes[1], end.axes[4], end.axes[7]}};
}

inline PresentEnd present(const PlanLinkEnd& end, const Mat3& rest, const PlanJoints& joints,
                          const JointState& state, const JointWorkspace& w) noexcept {
  return present(end, rest, w.R[index(end.joint)], [&](std::size_t unknown) {
    return w.theta[unknown] + state.angle[unknown - 3 * index(joints.num_joints)];
  });
}

JointState make_joint_state(const PlanJoints& joints);
JointWorkspace make_joint_workspace(const PlanTrueLinks& links, std::size_t num_bodies,
                                    MasslessPoints massless = {});

/// Starts a step: the factor is that of the rest shape, and no joint has failed.
inline void begin_joints(JointWorkspace& workspace) noexcept {
  workspace.factor.is_renewed = false;
  workspace.unsolved = -1;
}
/// Returns the massless point, or the first point of the joint, that has not found its equilibrium, or -1.
std::int32_t unsolved_point(const PlanJoints& joints, const JointWorkspace& workspace) noexcept;

/// Sums the stiffness of all links over the unknowns, at the present shape, and factors the sum.
/// \param bars  those of the plan, which matter at massless points only  \param rest  [m] (num_points) rest
/// positions
void renew_factor(const PlanTrueLinks& links, std::span<const PlanBar> bars, std::span<const Vec3> rest,
                  std::span<const Vec3> V, const JointState& state, JointWorkspace& workspace) noexcept;

/// Adds the stiffness over the displacements of massless points and between them and the rotations of joints,
/// by differences of forces and moments   (THEORY 12.116).
void add_massless_stiffness(const PlanTrueLinks& links, std::span<const PlanBar> bars,
                            std::span<const Vec3> rest, std::span<const Vec3> V, const JointState& state,
                            JointWorkspace& workspace) noexcept;

/// Finds the rotations of the joints and the displacements of massless points at the coordinates q and the
/// displacements V of the other points, from those in `state`:
///   R_j = exp([theta_j x]) C_j,   C_j <- C_j exp(delta_j),   delta = -K_tt^-1 [R_j^T m_j]
///   (THEORY 12.72, 12.73, 12.115)
/// \param q  [m] (num_padded) elastic coordinates  \param V  [m] (num_points); sets those of massless points
/// \pre workspace.massless.load is set
/// \return  [rad] largest component of the last delta; NaN if the joints have not found their equilibrium
double relax_joints(const PlanTrueLinks& links, std::span<const PlanBar> bars, std::span<const Vec3> rest,
                    std::size_t num_padded, const double* q, std::span<Vec3> V, JointState& state,
                    JointWorkspace& workspace) noexcept;

/// Adds to `force` and `linear` [N], body axes   (THEORY 12.75), the forces on points of links at true
/// geometry and those of the linear links. Sets w.on_body and w.linear_on_body to the moments on bodies. Adds
/// to Q [N] (num_padded) the work of the moments that joints still carry, -rows^T T(theta)^T m
/// (THEORY 12.74). \param linear_V  [m] (num_points) displacements of the linear structure, which differ from
/// V on bodies \param rest  [m] (num_points) rest positions \pre relax_joints() was called with the same V
void add_true_links(const PlanTrueLinks& links, std::size_t num_padded, std::span<const Vec3> V,
                    std::span<const Vec3> linear_V, std::span<const Vec3> rest, const JointState& state,
                    JointWorkspace& workspace, std::span<Vec3> force, std::span<Vec3> linear,
                    double* Q) noexcept;

}  // namespace freeflex
