#include "core/step/links/true_links.hpp"

#include <algorithm>
#include <limits>
#include <utility>

#include "core/step/linear/kernels.hpp"
#include "core/step/links/bar.hpp"
#include "core/step/links/rotations.hpp"

namespace freeflex {
namespace {
constexpr int kMostSweeps = 24;
// [rad] A sweep that moves no joint by more than this is the last.
constexpr double kConverged = 1e-7;
constexpr double kLargestStep = 0.3;  // [rad] longer steps are shortened
// [-] A sweep that is not shorter than this share of the one before is slow: the stiffness has changed, and
// the factor is renewed.
constexpr double kSlow = 0.1;
// [-] A step after which the energy rises faster than this share of its first fall went too far, and is
// shortened to where the slope is zero by interpolation, but at most to kShortest.
constexpr double kOvershoot = 0.5;
constexpr double kShortest = 0.1;

/// Sets the present rotations of the joints.
void set_rotations(const PlanJoints& joints, const JointState& state, JointWorkspace& w) noexcept {
  for (std::size_t j = 0; j < index(joints.num_joints); ++j)
    w.R[j] = matrix_of(multiply(w.turn[j].q, state.rotation[j]));
}

bool is_body(const PlanLinkEnd& end, const PlanJoints& joints) noexcept {
  return end.joint >= joints.num_joints;
}
std::size_t body_of(const PlanLinkEnd& end, const PlanJoints& joints) noexcept {
  return index(end.joint - joints.num_joints);
}

bool is_released(const PlanLinkEnd& end) noexcept {
  return end.released[0] >= 0 || end.released[1] >= 0 || end.released[2] >= 0;
}

/// Adds the moment on an end to that on its joint or body.
void add_moment(const PlanLinkEnd& end, const Vec3& moment, JointWorkspace& w) noexcept {
  Vec3& sum = w.moment[index(end.joint)];
  sum = add(sum, moment);
}
/// Adds the work of the moment on an end to the gradient over its released rotations.
void add_released_work(const PlanLinkEnd& end, const PresentEnd& at, const Vec3& moment,
                       JointWorkspace& w) noexcept {
  for (std::size_t a = 0; a < 3; ++a)
    if (end.released[a] >= 0) w.gradient[index(end.released[a])] += dot(at.spins[a], moment);
}
void add_linear_moment(const PlanLinkEnd& end, const Vec3& moment, const PlanJoints& joints,
                       JointWorkspace& w) noexcept {
  if (!is_body(end, joints)) return;
  Vec3& on_body = w.linear_on_body[body_of(end, joints)];
  on_body = sub(on_body, moment);
}

/// Returns the small rotation of an end in the linear structure.
Vec3 linear_rotation(const PlanLinkEnd& end, const Mat3& rest, const PlanJoints& joints,
                     const JointWorkspace& w) noexcept {
  Vec3 rotation = is_body(end, joints)
                      ? w.body_theta[body_of(end, joints)]
                      : Vec3{w.theta[3 * index(end.joint)], w.theta[3 * index(end.joint) + 1],
                             w.theta[3 * index(end.joint) + 2]};
  for (std::size_t a = 0; a < 3; ++a)
    if (end.released[a] >= 0)
      rotation = add_scaled(rotation, w.theta[index(end.released[a])], {rest[a], rest[3 + a], rest[6 + a]});
  return rotation;
}

/// Adds the gradient of a matrix link, which turns as one piece.
void add_matrix(const PlanTrueMatrix& matrix, std::span<const Vec3> V, std::span<const Vec3> linear_V,
                const PlanJoints& joints, JointWorkspace& w, std::span<Vec3> force,
                std::span<Vec3> linear_force) noexcept {
  if (matrix.ends.empty() && force.empty()) return;
  const std::size_t count = matrix.points.size(), num_ends = matrix.ends.size();
  std::array<Vec3, kMostMatrixPoints> x, theta;
  std::array<Mat3, kMostMatrixPoints> R;
  for (std::size_t i = 0; i < count; ++i) {
    x[i] = add(matrix.constants.arms[i], V[index(matrix.points[i])]);
    if (num_ends > 0) R[i] = w.R[index(matrix.ends[i].joint)];
  }
  MatrixGradient g;
  set_gradient(matrix.constants, {x.data(), count}, {R.data(), num_ends}, g);
  for (std::size_t i = 0; i < num_ends; ++i) add_moment(matrix.ends[i], g.moment[i], w);
  if (force.empty()) return;
  for (std::size_t i = 0; i < count; ++i) {
    const std::size_t point = index(matrix.points[i]);
    force[point] = sub(force[point], g.force[i]);
    if (linear_force.empty()) continue;
    x[i] = linear_V[point];
    if (num_ends > 0) theta[i] = linear_rotation(matrix.ends[i], {}, joints, w);
  }
  if (linear_force.empty()) return;
  set_linear_gradient(matrix.constants, {x.data(), count}, {theta.data(), num_ends}, g);
  for (std::size_t i = 0; i < count; ++i) {
    const std::size_t point = index(matrix.points[i]);
    linear_force[point] = sub(linear_force[point], g.force[i]);
    if (num_ends > 0) add_linear_moment(matrix.ends[i], g.moment[i], joints, w);
  }
}

/// Returns the local axes of one end of a beam.
BeamEnd axes_of(const PlanLinkEnd& end, const Mat3& rest, const PlanJoints& joints, const JointState& state,
                const JointWorkspace& w) noexcept {
  if (is_released(end)) return beam_end(present(end, rest, joints, state, w));
  const Mat3& R = w.R[index(end.joint)];
  return {multiply(R, Vec3{rest[0], rest[3], rest[6]}), multiply(R, Vec3{rest[1], rest[4], rest[7]})};
}

/// Adds the gradients of beams.
void add_beams(const PlanTrueLinks& links, std::span<const Vec3> V, std::span<const Vec3> linear_V,
               const JointState& state, JointWorkspace& w, std::span<Vec3> force,
               std::span<Vec3> linear_force) noexcept {
  const PlanJoints& joints = links.joints;
  for (std::size_t b = 0; b < links.beams.size(); ++b) {
    const PlanTrueBeam& beam = links.beams[b];
    set_beam(b, sub(V[index(beam.points[1])], V[index(beam.points[0])]),
             axes_of(beam.ends[0], beam.axes, joints, state, w),
             axes_of(beam.ends[1], beam.axes, joints, state, w), w.beams);
  }
  set_gradients(links.beams, w.beams);
  for (std::size_t b = 0; b < links.beams.size(); ++b) {
    const PlanTrueBeam& beam = links.beams[b];
    const BeamGradient g = gradient_in(w.beams, b);
    for (std::size_t k = 0; k < 2; ++k) {
      const PlanLinkEnd& end = beam.ends[k];
      add_moment(end, g.moment[k], w);
      if (is_released(end)) add_released_work(end, present(end, beam.axes, joints, state, w), g.moment[k], w);
    }
    if (force.empty()) continue;
    const std::size_t i = index(beam.points[0]), j = index(beam.points[1]);
    force[i] = add(force[i], g.force), force[j] = sub(force[j], g.force);
    if (linear_force.empty()) continue;
    const Vec3 linear_d = sub(linear_V[j], linear_V[i]),
               first = linear_rotation(beam.ends[0], beam.axes, joints, w),
               second = linear_rotation(beam.ends[1], beam.axes, joints, w);
    const Vec3 linear = linear_force_of(beam.constants, beam.axes, linear_d, add(first, second));
    linear_force[i] = add(linear_force[i], linear), linear_force[j] = sub(linear_force[j], linear);
    if (!is_body(beam.ends[0], joints) && !is_body(beam.ends[1], joints)) continue;
    const BeamGradient on_bodies = linear_gradient_of(beam.constants, beam.axes, linear_d, first, second);
    for (std::size_t k = 0; k < 2; ++k) add_linear_moment(beam.ends[k], on_bodies.moment[k], joints, w);
  }
}

/// Adds the gradients of plates.
void add_plates(const PlanTrueLinks& links, std::span<const Vec3> V, std::span<const Vec3> linear_V,
                const JointState& state, JointWorkspace& w, std::span<Vec3> force,
                std::span<Vec3> linear_force) noexcept {
  for (const PlanTruePlate& plate : links.plates) {
    Vec3 d[3], theta[3];
    Mat3 axes[3];
    PresentEnd ends[3];
    for (std::size_t k = 0; k < 3; ++k) {
      d[k] = V[index(plate.points[k])];
      ends[k] = present(plate.ends[k], plate.axes, links.joints, state, w);
      axes[k] = ends[k].axes;
      theta[k] = linear_rotation(plate.ends[k], plate.axes, links.joints, w);
    }
    const PlateGradient g = gradient_of(plate.constants, d, axes);
    for (std::size_t k = 0; k < 3; ++k) add_moment(plate.ends[k], g.moment[k], w);
    if (force.empty()) continue;
    for (std::size_t k = 0; k < 3; ++k) {
      const std::size_t point = index(plate.points[k]);
      force[point] = sub(force[point], g.force[k]);
    }
    if (linear_force.empty()) continue;
    for (std::size_t k = 0; k < 3; ++k) d[k] = linear_V[index(plate.points[k])];
    const PlateGradient linear = linear_gradient_of(plate.constants, d, theta);
    for (std::size_t k = 0; k < 3; ++k) {
      const std::size_t point = index(plate.points[k]);
      linear_force[point] = sub(linear_force[point], linear.force[k]);
      add_linear_moment(plate.ends[k], linear.moment[k], links.joints, w);
    }
  }
}

/// Sums the moments on joints and bodies, and takes them into the axes of each: those on joints to the
/// gradient over the unknown rotations. Unless `force` is empty, adds the forces on points, and, unless
/// `linear_force` is empty, those of the linear links.
void add_gradients(const PlanTrueLinks& links, std::span<const Vec3> V, std::span<const Vec3> linear_V,
                   const JointState& state, JointWorkspace& w, std::span<Vec3> force,
                   std::span<Vec3> linear_force) noexcept {
  std::fill(w.gradient.begin(), w.gradient.end(), 0.0);
  std::fill(w.moment.begin(), w.moment.end(), Vec3{});
  std::fill(w.linear_on_body.begin(), w.linear_on_body.end(), Vec3{});
  add_beams(links, V, linear_V, state, w, force, linear_force);
  add_plates(links, V, linear_V, state, w, force, linear_force);
  for (const PlanTrueMatrix& matrix : links.matrices)
    add_matrix(matrix, V, linear_V, links.joints, w, force, linear_force);
  const std::size_t num_joints = index(links.joints.num_joints);
  for (std::size_t j = 0; j < w.moment.size(); ++j) {
    const Vec3 own = multiply_transposed(w.R[j], w.moment[j]);
    if (j < num_joints)
      std::copy(own.begin(), own.end(), w.gradient.begin() + static_cast<std::ptrdiff_t>(3 * j));
    else
      w.on_body[j - num_joints] = scale(-1.0, own);
  }
}

/// Adds the forces of angle springs, which have no joints.
void add_angles(const PlanTrueLinks& links, std::span<const Vec3> V, std::span<const Vec3> linear_V,
                std::span<const Vec3> rest, std::span<Vec3> force, std::span<Vec3> linear) noexcept {
  for (const PlanTrueAngle& angle : links.angles) {
    const std::size_t count = angle.constants.form == AngleConstants::Form::kDihedral ? 4 : 3;
    Vec3 x[4];
    for (std::size_t k = 0; k < count; ++k)
      x[k] = add(rest[index(angle.points[k])], V[index(angle.points[k])]);
    const AngleGradient g = gradient_of(angle.constants, x);
    if (linear.empty()) {
      for (std::size_t k = 0; k < count; ++k)
        force[index(angle.points[k])] = sub(force[index(angle.points[k])], g.force[k]);
      continue;
    }
    std::array<double, 2> s{};
    for (std::size_t row = 0; row < index(angle.num_rows); ++row)
      for (std::size_t k = 0; k < count; ++k)
        s[row] += dot(angle.rows[row][k], linear_V[index(angle.points[k])]);
    for (std::size_t k = 0; k < count; ++k) {
      const std::size_t point = index(angle.points[k]);
      force[point] = sub(force[point], g.force[k]);
      for (std::size_t row = 0; row < index(angle.num_rows); ++row)
        linear[point] = add_scaled(linear[point], -s[row], angle.rows[row][k]);
    }
  }
}

/// Sums the gradient over all unknowns at the displacements V.
void set_gradient(const PlanTrueLinks& links, std::span<const PlanBar> bars, std::span<const Vec3> rest,
                  std::span<const Vec3> V, const JointState& state, JointWorkspace& w) noexcept {
  MasslessPoints& massless = w.massless;
  std::fill(massless.force.begin(), massless.force.end(), Vec3{});
  add_gradients(links, V, V, state, w, massless.force, {});
  if (massless.empty()) return;
  add_angles(links, V, V, rest, massless.force, {});
  for (const PlanBar& bar : bars) {
    if (!massless.holds(bar)) continue;
    const std::size_t i = index(bar.first), j = index(bar.second);
    const Vec3 force = elastic_force(bar, sub(V[j], V[i]));
    massless.force[i] = add(massless.force[i], force);
    massless.force[j] = sub(massless.force[j], force);
  }
  double* gradient = w.gradient.data() + w.gradient.size() - 3 * massless.points.size();
  for (std::size_t k = 0; k < massless.points.size(); ++k) {
    const MasslessPoint& each = massless.points[k];
    for (std::size_t a = 0; a < 3; ++a)
      *gradient++ = -each.length * (massless.force[index(each.point)][a] + massless.load[k][a]);
  }
}

/// Sets w.step to -K_tt^-1 gradient. Returns its largest component.
double solve(const PlanJoints& joints, const JointState& state, JointWorkspace& w) noexcept {
  const std::size_t n = index(joints.num_rotations);
  double* const x = w.step.data();
  for (std::size_t k = 0; k < n; ++k) x[k] = -w.gradient[k];
  solve_stiffness(joints, w.factor, x);
  // Rotations that strain no link stay those of the linear structure, so their part of C is taken out
  // (THEORY 12.76).
  for (const double* idle = joints.idle.data(); idle != joints.idle.data() + joints.idle.size(); idle += n) {
    double share = 0.0;
    for (std::size_t k = 0; k < n; ++k) {
      const double present = k < 3 * index(joints.num_joints) ? 2.0 * state.rotation[k / 3][1 + k % 3]
                                                              : state.angle[k - 3 * index(joints.num_joints)];
      share += idle[k] * (x[k] + present);
    }
    for (std::size_t k = 0; k < n; ++k) x[k] -= share * idle[k];
  }
  double largest = 0.0;
  for (std::size_t k = 0; k < n; ++k) largest = std::max(largest, magnitude(x[k]));
  double sum = 0.0;  // NaN if a component is not finite, which std::max ignores
  for (std::size_t k = 0; k < n; ++k) sum += x[k] - x[k];
  return largest + sum;
}

/// Sets the displacements of massless points.
void place_massless(const PlanJoints& joints, const JointState& state, const JointWorkspace& w,
                    std::span<Vec3> V) noexcept {
  std::size_t unknown = w.theta.size() - 3 * w.massless.points.size();
  for (const MasslessPoint& each : w.massless.points)
    for (std::size_t a = 0; a < 3; ++a, ++unknown)
      V[index(each.point)][a] =
          each.length * (w.theta[unknown] + state.angle[unknown - 3 * index(joints.num_joints)]);
}

void turn(const PlanJoints& joints, double share, JointState& state, const JointWorkspace& w) noexcept {
  for (std::size_t j = 0; j < index(joints.num_joints); ++j) {
    const Vec3 delta{share * w.step[3 * j], share * w.step[3 * j + 1], share * w.step[3 * j + 2]};
    const Quat product = multiply(state.rotation[j], rotation_of(delta).q);
    double norm = 0.0;
    for (const double x : product) norm += x * x;
    norm = 1.0 / __builtin_sqrt(norm);
    for (std::size_t k = 0; k < 4; ++k) state.rotation[j][k] = norm * product[k];
  }
  for (std::size_t k = 0; k < state.angle.size(); ++k)
    state.angle[k] += share * w.step[3 * index(joints.num_joints) + k];
}

/// Returns the derivative of the energy along the last step [N m].
double slope_of(const JointWorkspace& w) noexcept {
  double slope = 0.0;
  for (std::size_t k = 0; k < w.step.size(); ++k) slope += w.step[k] * w.gradient[k];
  return slope;
}
}  // namespace

JointState make_joint_state(const PlanJoints& joints) {
  return {std::vector<Quat>(index(joints.num_joints), Quat{1.0, 0.0, 0.0, 0.0}),
          std::vector<double>(index(joints.num_rotations - 3 * joints.num_joints))};
}

JointWorkspace make_joint_workspace(const PlanTrueLinks& links, std::size_t num_bodies,
                                    MasslessPoints massless) {
  const PlanJoints& joints = links.joints;
  const std::size_t n = index(joints.num_rotations), m = index(joints.num_joints);
  JointWorkspace w;
  for (Array* each : {&w.theta, &w.gradient, &w.step}) each->resize(n);
  w.before = make_joint_state(joints);
  w.R.resize(m + num_bodies);
  w.moment.resize(m + num_bodies);
  w.beams = make_beam_batch(links.beams);
  for (auto* each : {&w.body_theta, &w.on_body, &w.linear_on_body}) each->resize(num_bodies);
  w.turn.resize(m);
  w.factor = make_joint_factor(links);
  w.massless = std::move(massless);
  return w;
}

double relax_joints(const PlanTrueLinks& links, std::span<const PlanBar> bars, std::span<const Vec3> rest,
                    std::size_t num_padded, const double* q, std::span<Vec3> V, JointState& state,
                    JointWorkspace& w) noexcept {
  const PlanJoints& joints = links.joints;
  if (joints.num_rotations == 0) return 0.0;
  contract_one(joints.rows.data(), index(joints.num_rotations), num_padded, q, w.theta.data());
  for (std::size_t j = 0; j < index(joints.num_joints); ++j)
    w.turn[j] = rotation_of({w.theta[3 * j], w.theta[3 * j + 1], w.theta[3 * j + 2]});
  double largest = 0.0, slope = 0.0, share = 0.0;
  for (int sweep = 0; sweep < kMostSweeps; ++sweep) {
    set_rotations(joints, state, w);
    place_massless(joints, state, w, V);
    set_gradient(links, bars, rest, V, state, w);
    if (const double rise = slope_of(w); sweep > 0 && rise > kOvershoot * -slope) {
      share *= std::max(slope / (slope - rise), kShortest);
      state = w.before;
      turn(joints, share, state, w);
      continue;
    }
    const double before = largest;
    largest = solve(joints, state, w);
    if (!(largest < std::numeric_limits<double>::max())) return std::numeric_limits<double>::quiet_NaN();
    slope = slope_of(w);
    share = largest > kLargestStep ? kLargestStep / largest : 1.0;
    w.before = state;
    turn(joints, share, state, w);
    if (largest <= kConverged) break;
    if (sweep == 0 || largest < kSlow * before) continue;
    set_rotations(joints, state, w);
    place_massless(joints, state, w, V);
    renew_factor(links, bars, rest, V, state, w);
    // a massless point that leaves a fold would snap to another equilibrium, which loses energy
    if (w.massless.points.empty() || w.factor.is_definite) continue;
    w.unsolved = static_cast<std::int32_t>(index(joints.num_rotations) - 3 * w.massless.points.size());
    return std::numeric_limits<double>::quiet_NaN();
  }
  set_rotations(joints, state, w);
  place_massless(joints, state, w, V);
  if (largest <= kConverged) return largest;
  for (std::size_t k = 0; k < index(joints.num_rotations); ++k)
    if (magnitude(w.step[k]) == largest) w.unsolved = static_cast<std::int32_t>(k);
  return std::numeric_limits<double>::quiet_NaN();
}

std::int32_t unsolved_point(const PlanJoints& joints, const JointWorkspace& w) noexcept {
  const std::size_t unknown = index(w.unsolved), num_massless = w.massless.points.size();
  if (unknown + 3 * num_massless >= index(joints.num_rotations))
    return w.massless.points[(unknown + 3 * num_massless - index(joints.num_rotations)) / 3].point;
  const auto found =
      std::find(joints.of_points.begin(), joints.of_points.end(), static_cast<std::int32_t>(unknown / 3));
  return found == joints.of_points.end() ? -1 : static_cast<std::int32_t>(found - joints.of_points.begin());
}

void add_true_links(const PlanTrueLinks& links, std::size_t num_padded, std::span<const Vec3> V,
                    std::span<const Vec3> linear_V, std::span<const Vec3> rest, const JointState& state,
                    JointWorkspace& w, std::span<Vec3> force, std::span<Vec3> linear, double* Q) noexcept {
  add_angles(links, V, linear_V, rest, force, linear);
  const PlanJoints& joints = links.joints;
  add_gradients(links, V, linear_V, state, w, force, linear);
  for (std::size_t j = 0; j < index(joints.num_joints); ++j) {
    const Vec3 theta{w.theta[3 * j], w.theta[3 * j + 1], w.theta[3 * j + 2]};
    const Vec3 moment = transposed_tangent(theta, tangent_of(theta, w.turn[j]), w.moment[j]);
    combine_rows(joints.rows.data() + 3 * j * num_padded, scale(-1.0, moment), true, num_padded, Q);
  }
  // the forces that massless points still carry are among those on points
  for (std::size_t k = 3 * index(joints.num_joints);
       k < index(joints.num_rotations) - 3 * w.massless.points.size(); ++k)
    combine_one(joints.rows.data() + k * num_padded, -w.gradient[k], true, num_padded, Q);
}

}  // namespace freeflex
