// The part of a plan with links at true geometry and the joints that they share.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <vector>

#include "core/step/array.hpp"
#include "core/step/links/angle.hpp"
#include "core/step/links/beam.hpp"
#include "core/step/links/matrix_link.hpp"
#include "core/step/links/plate.hpp"
#include "core/step/vector.hpp"

namespace freeflex {

/// Holds where one end of a link is joined.
struct PlanLinkEnd {
  // number of the joint; from PlanJoints::num_joints on, that of a body, which turns the end
  std::int32_t joint = -1;
  // number of the unknown rotation about each local axis that the end releases from the joint; -1: not
  // released
  std::array<std::int32_t, 3> released{-1, -1, -1};
};

struct PlanTrueBeam {
  std::int32_t link = -1;  // index into Plan::links
  std::array<std::int32_t, 2> points{-1, -1};
  std::array<PlanLinkEnd, 2> ends;
  Vec3 span{};  // [m] rest vector from the first to the second point
  Mat3 axes{};  // rest axes of the beam as columns
  BeamConstants constants;
};

struct PlanTruePlate {
  std::int32_t link = -1;
  std::array<std::int32_t, 3> points{-1, -1, -1};
  std::array<PlanLinkEnd, 3> ends;
  Mat3 axes{};
  PlateConstants constants;
};

struct PlanTrueAngle {
  std::int32_t link = -1;
  std::array<std::int32_t, 4> points{-1, -1, -1, -1};
  AngleConstants constants;
  // [sqrt(N/m)] rows of the linear spring over the displacements of its points: force = -row (row . V)
  std::int32_t num_rows = 1;
  std::array<std::array<Vec3, 4>, 2> rows{};
  double sign =
      1.0;  // of the change of the angle for a positive published moment, except for straight angles
};

struct PlanTrueMatrix {
  std::int32_t link = -1;
  std::vector<std::int32_t> points;
  std::vector<PlanLinkEnd> ends;  // (num_points) empty if the matrix has no rotations
  MatrixConstants constants;
};

/// Holds the joints at which beams and plates meet. A joint has no inertia. Its unknown rotations, numbered
/// 3 * joint + axis, are followed by those of released ends   (THEORY 12.72 to 12.76), then by the
/// displacements of massless points over their lengths, in the order of the points   (THEORY 12.115).
struct PlanJoints {
  std::int32_t num_joints = 0, num_rotations = 0;  // num_rotations is the number of all unknowns
  // (num_points) joint or body of each point, as in PlanLinkEnd; -1: none. Empty without joints
  std::vector<std::int32_t> of_points;
  Array rows;  // [1/m] (num_rotations x num_padded) theta = rows q, the rotations of the linear structure
  // K_tt = L D L^T in the order `order`: unknown order[k] is the k-th of the factor. Column k of L has the
  // entries starts[k] to starts[k + 1] of `below` and `lower`.
  std::vector<std::int32_t> order, starts, below;
  std::vector<double> lower, inverse_pivots;  // [-], [1/(N m)] 0 for a rotation that strains no link
  std::vector<double> idle;                   // (k x num_rotations) orthonormal rotations that strain no link
};

/// Holds the rotations of joints beyond the linear ones. They are carried from evaluation to evaluation, so
/// that few sweeps suffice.
struct JointState {
  std::vector<Quat> rotation;  // (num_joints) C_j
  // [rad] (num_rotations - 3 num_joints) of released ends, then [-] displacements of massless points over
  // their lengths
  std::vector<double> angle;
  bool operator==(const JointState&) const = default;
};

/// Holds all links at true geometry but springs, bars and dashpots.
struct PlanTrueLinks {
  std::vector<PlanTrueBeam> beams;
  std::vector<PlanTruePlate> plates;
  std::vector<PlanTrueAngle> angles;
  std::vector<PlanTrueMatrix> matrices;
  PlanJoints joints;
  bool has_joints() const {
    return !beams.empty() || !plates.empty() ||
           std::ranges::any_of(matrices, [](const PlanTrueMatrix& each) { return !each.ends.empty(); });
  }
};

/// Holds a rigid body: a point with inertia, or the points of a rigid link   (THEORY 12.84).
struct PlanTurningBody {
  double mass = 0.0;  // [kg]
  Vec3 centre{};      // [m] rest position of its centre of mass
  Mat3 inertia{};     // [kg m^2] about its centre of mass, rest axes
  Array rows;         // (6 x num_padded) displacement [-] of its centre, then rotation [1/m]
  // Its points, in PlanTurning::points. A mass matrix has no points that turn with it, so count is 0, and
  // first is its first point   (THEORY 12.121)
  std::int32_t first = 0, count = 0;
};

/// Holds the bodies that turn as a whole, which makes their rotations part of the motion. Empty if all points
/// are point masses.
struct PlanTurning {
  std::vector<PlanTurningBody> bodies;
  std::vector<std::int32_t> points;        // points of bodies, in the order of the bodies
  std::vector<std::int32_t> of_points;     // (num_points) body of each point; -1: a point mass
  std::vector<std::int32_t> of_carriers;   // (num_particles) body of each particle
  std::vector<std::int32_t> of_attitudes;  // (num_attitude_points) body of each point whose attitude is read
};

/// Holds a link whose axial stiffness makes modes stiff: a spring, bar or beam.
struct PlanCurveLink {
  std::array<std::int32_t, 2> points{-1, -1};
  std::array<std::int32_t, 2> joints{-1, -1};  // of a beam
  Vec3 direction{};                            // [-] from the first to the second point
  double length = 0.0;                         // [m]
  double skew_bow = 0.0;  // [-] mean of those of a beam in its two planes   (THEORY 12.78)
};

/// Holds a plate, whose membrane makes modes stiff.
struct PlanCurvePlate {
  std::array<std::int32_t, 3> points{-1, -1, -1};
  std::array<std::array<double, 2>, 3> gradients{};  // [1/m] of barycentric coordinates, local axes
};

/// Holds the curvilinear coordinates of stiff modes. Such a mode is measured from the foreshortening that the
/// other modes cause (THEORY 12.77 to 12.83).
struct PlanCurve {
  std::vector<PlanCurveLink> links;
  std::vector<PlanCurvePlate> plates;
  std::vector<std::int32_t> modes;  // those with a frequency, ascending
  // (num modes) true: most of the strain energy of the mode is in axial forces and membranes
  std::vector<std::uint8_t> is_axial;
  // [1/m], [-] (num modes x num strains) s_f = sum_k weights_fk eps_k; one strain for each link, three for
  // each plate
  Array weights;
  // indices into `modes` of the curvilinear ones, which a substep does not resolve
  std::vector<std::int32_t> stiff;
  bool is_filtered = false;    // true: N is evaluated at filtered coordinates, more than once
  std::vector<double> filter;  // [-] (num stiff) share of the deviation from the slow motion that N sees
};

}  // namespace freeflex
