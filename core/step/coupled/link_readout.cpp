#include "core/step/coupled/link_readout.hpp"

#include <algorithm>

#include "core/step/coupled/coupled.hpp"
#include "core/step/linear/kernels.hpp"
#include "core/step/links/bar.hpp"
#include "core/step/readout.hpp"
#include "core/step/turning/turning.hpp"

namespace freeflex {
namespace {

/// Reads displacements and rotations of a state.
class Shape {
 public:
  Shape(const StepPlan& plan, const MotionState& state) : plan_(plan), state_(state) {}

  Vec3 linear_V(std::int32_t point) const noexcept {
    return contract_rows(point_rows(plan_, plan_.points[index(point)].row), state_.q.data(), n());
  }
  Vec3 V(std::int32_t point) const noexcept {
    const std::int32_t body = turns(plan_) ? plan_.coupled.turning.of_points[index(point)] : -1;
    if (const MasslessMotion* massless = find_massless(state_.coupled.massless, point)) return massless->V;
    if (body < 0) return linear_V(point);
    const Vec3& r = plan_.points[index(point)].r;
    return sub(position_on_body(plan_.coupled.turning.bodies[index(body)], motion(body), r), r);
  }
  /// Returns the rate of V in body axes. \param w  [rad/s] angular velocity of the frame
  Vec3 V_dot(std::int32_t point, const Vec3& w) const noexcept {
    const std::int32_t body = turns(plan_) ? plan_.coupled.turning.of_points[index(point)] : -1;
    if (const MasslessMotion* massless = find_massless(state_.coupled.massless, point))
      return sub(massless->v, cross(w, x(point)));
    if (body < 0)
      return contract_rows(point_rows(plan_, plan_.points[index(point)].row), state_.q_dot.data(), n());
    const PlanTurningBody& given = plan_.coupled.turning.bodies[index(body)];
    const TurningMotion at = read_turning(plan_, given, state_.q.data(), state_.q_dot.data(), w);
    const Vec3 arm = sub(plan_.points[index(point)].r, given.centre);
    return sub(add(at.v, multiply(at.R, cross(at.s, arm))), cross(w, x(point)));
  }
  Vec3 x(std::int32_t point) const noexcept { return add(plan_.points[index(point)].r, V(point)); }

  Vec3 linear_rotation(std::int32_t joint) const noexcept {
    if (joint >= joints().num_joints) return motion(joint - joints().num_joints).theta;
    return contract_rows(joints().rows.data() + 3 * index(joint) * n(), state_.q.data(), n());
  }
  double linear_release(std::size_t unknown) const noexcept {
    return dot_lanes(joints().rows.data() + unknown * n(), state_.q.data(), n());
  }
  PresentEnd end(const PlanLinkEnd& end, const Mat3& rest) const noexcept {
    const bool is_body = end.joint >= joints().num_joints;
    const Quat turn = rotation_of(linear_rotation(end.joint)).q;
    const Mat3 R =
        matrix_of(is_body ? turn : multiply(turn, state_.coupled.joints.rotation[index(end.joint)]));
    return present(end, rest, R, [&](std::size_t unknown) {
      return linear_release(unknown) + state_.coupled.joints.angle[unknown - 3 * index(joints().num_joints)];
    });
  }
  /// Returns the small rotation of an end in the linear structure.
  Vec3 linear_end(const PlanLinkEnd& end, const Mat3& rest) const noexcept {
    Vec3 rotation = linear_rotation(end.joint);
    for (std::size_t a = 0; a < 3; ++a)
      if (end.released[a] >= 0)
        rotation =
            add_scaled(rotation, linear_release(index(end.released[a])), {rest[a], rest[3 + a], rest[6 + a]});
    return rotation;
  }

 private:
  std::size_t n() const noexcept { return index(plan_.num_padded); }
  const PlanJoints& joints() const noexcept { return plan_.coupled.links.joints; }
  TurningMotion motion(std::int32_t body) const noexcept {
    return read_turning(plan_, plan_.coupled.turning.bodies[index(body)], state_.q.data(),
                        state_.q_dot.data(), {});
  }
  const StepPlan& plan_;
  const MotionState& state_;
};

BeamGradient gradient_of(const PlanTrueBeam& beam, const Shape& shape) noexcept {
  return freeflex::gradient_of(
      beam.constants, beam.span, sub(shape.V(beam.points[1]), shape.V(beam.points[0])),
      beam_end(shape.end(beam.ends[0], beam.axes)), beam_end(shape.end(beam.ends[1], beam.axes)));
}
double linear_energy_of(const PlanTrueBeam& beam, const Shape& shape) noexcept {
  const Vec3 d = sub(shape.linear_V(beam.points[1]), shape.linear_V(beam.points[0]));
  return linear_gradient_of(beam.constants, beam.axes, d, shape.linear_end(beam.ends[0], beam.axes),
                            shape.linear_end(beam.ends[1], beam.axes))
      .energy;
}

PlateGradient gradient_of(const PlanTruePlate& plate, const Shape& shape) noexcept {
  Vec3 d[3];
  Mat3 axes[3];
  for (std::size_t k = 0; k < 3; ++k) {
    d[k] = shape.V(plate.points[k]);
    axes[k] = shape.end(plate.ends[k], plate.axes).axes;
  }
  return freeflex::gradient_of(plate.constants, d, axes);
}
double linear_energy_of(const PlanTruePlate& plate, const Shape& shape) noexcept {
  Vec3 d[3], theta[3];
  for (std::size_t k = 0; k < 3; ++k) {
    d[k] = shape.linear_V(plate.points[k]);
    theta[k] = shape.linear_end(plate.ends[k], plate.axes);
  }
  return linear_gradient_of(plate.constants, d, theta).energy;
}

/// Sets the gradient of a matrix link. Returns the energy of the linear link.
double set_gradient(const PlanTrueMatrix& matrix, const Shape& shape, MatrixGradient& result) noexcept {
  const std::size_t count = matrix.points.size(), num_ends = matrix.ends.size();
  std::array<Vec3, kMostMatrixPoints> x, theta;
  std::array<Mat3, kMostMatrixPoints> R;
  for (std::size_t i = 0; i < count; ++i) {
    x[i] = shape.linear_V(matrix.points[i]);
    if (num_ends > 0) theta[i] = shape.linear_end(matrix.ends[i], {});
  }
  set_linear_gradient(matrix.constants, {x.data(), count}, {theta.data(), num_ends}, result);
  const double linear_energy = result.energy;
  for (std::size_t i = 0; i < count; ++i) {
    x[i] = add(matrix.constants.arms[i], shape.V(matrix.points[i]));
    if (num_ends > 0) R[i] = shape.end(matrix.ends[i], {1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0}).axes;
  }
  freeflex::set_gradient(matrix.constants, {x.data(), count}, {R.data(), num_ends}, result);
  return linear_energy;
}

std::size_t num_points(const PlanTrueAngle& angle) noexcept {
  return angle.constants.form == AngleConstants::Form::kDihedral ? 4 : 3;
}
double energy_beyond_linear(const PlanTrueAngle& angle, const Shape& shape) noexcept {
  Vec3 x[4];
  std::array<double, 2> s{};
  for (std::size_t k = 0; k < num_points(angle); ++k) {
    x[k] = shape.x(angle.points[k]);
    const Vec3 V = shape.linear_V(angle.points[k]);
    for (std::size_t row = 0; row < index(angle.num_rows); ++row) s[row] += dot(angle.rows[row][k], V);
  }
  return freeflex::gradient_of(angle.constants, x).energy - 0.5 * (s[0] * s[0] + s[1] * s[1]);
}

void read(const PlanTrueBeam& beam, const Shape& shape, std::span<double> out) noexcept {
  const BeamGradient g = gradient_of(beam, shape);
  const Vec3 chord = add(beam.span, sub(shape.V(beam.points[1]), shape.V(beam.points[0])));
  const Vec3 u = scale(1.0 / length(chord), chord), axes[3] = {u, g.y, cross(u, g.y)};
  for (std::size_t a = 0; a < 3; ++a) {
    out[a] = -dot(axes[a], g.force);
    out[3 + a] = dot(axes[a], g.moment[0]);
    out[6 + a] = dot(axes[a], g.force);
    out[9 + a] = dot(axes[a], g.moment[1]);
  }
}

void read(const PlanTruePlate& plate, const Shape& shape, std::span<double> out) noexcept {
  const PlateGradient g = gradient_of(plate, shape);
  const double area = 0.5 * length(cross(plate.constants.first, plate.constants.second));
  Vec3 moments{};
  for (std::size_t m = 0; m < 3; ++m)
    for (std::size_t k = 0; k < 9; ++k)
      moments[m] += plate.constants.curvature[9 * m + k] * g.theta[k / 3][k % 3];
  const auto write = [&](const Vec3& s, std::size_t first) {
    out[first] = (s[0] + s[1]) / area, out[first + 1] = (s[0] - s[1]) / area, out[first + 2] = s[2] / area;
  };
  write(g.membrane, 0);
  write(moments, 3);
}

/// Two moments of a straight angle are those about the axes of its linear rows, turned with the line through
/// the outer points by the smallest rotation.
void read(const PlanTrueAngle& angle, const StepPlan& plan, const Shape& shape,
          std::span<double> out) noexcept {
  Vec3 x[4];
  for (std::size_t k = 0; k < num_points(angle); ++k) x[k] = shape.x(angle.points[k]);
  if (angle.num_rows == 1) {
    out[0] = angle.sign * angle.constants.stiffness * change_of(angle.constants, x);
    return;
  }
  const auto rest = [&](std::size_t k) { return plan.points[index(angle.points[k])].r; };
  const auto line = [&](const Vec3& from, const Vec3& to) {
    const Vec3 d = sub(to, from);
    return scale(1.0 / length(d), d);
  };
  const Vec3 before = line(rest(1), rest(0)), now = line(x[1], x[0]), w = cross(before, now),
             bend = bend_of(angle.constants, x);
  const double root = __builtin_sqrt(angle.constants.stiffness), arm = length(sub(rest(0), rest(1)));
  for (std::size_t row = 0; row < 2; ++row) {
    const Vec3 axis = scale(arm / root, angle.rows[row][0]), once = cross(w, axis);
    const Vec3 turned = add(add(axis, once), scale(1.0 / (1.0 + dot(before, now)), cross(w, once)));
    out[row] = angle.constants.stiffness * dot(turned, bend);
  }
}

/// Sets the forces on the points of a matrix link, in body axes.
void read(const PlanTrueMatrix& matrix, const Shape& shape, std::span<double> out) noexcept {
  MatrixGradient g;
  set_gradient(matrix, shape, g);
  for (std::size_t i = 0; i < matrix.points.size(); ++i)
    for (std::size_t a = 0; a < 3; ++a) out[3 * i + a] = -g.force[i][a];
}

template <typename Links>
auto find(const Links& links, std::int32_t link) noexcept {
  const auto found =
      std::find_if(links.begin(), links.end(), [&](const auto& each) { return each.link == link; });
  return found == links.end() ? nullptr : &*found;
}

}  // namespace

bool read_true_link(const StepPlan& plan, const MotionState& state, std::int32_t link,
                    std::span<double> out) noexcept {
  const PlanTrueLinks& links = plan.coupled.links;
  const Shape shape(plan, state);
  if (const auto* beam = find(links.beams, link))
    read(*beam, shape, out);
  else if (const auto* plate = find(links.plates, link))
    read(*plate, shape, out);
  else if (const auto* angle = find(links.angles, link))
    read(*angle, plan, shape, out);
  else if (const auto* matrix = find(links.matrices, link))
    read(*matrix, shape, out);
  else
    return false;
  return true;
}

BarMotion read_bar(const StepPlan& plan, const MotionState& state, const PlanBar& bar) noexcept {
  const Shape shape(plan, state);
  const Vec3& w = state.coupled.w_B;
  return {sub(shape.V(bar.second), shape.V(bar.first)),
          sub(shape.V_dot(bar.second, w), shape.V_dot(bar.first, w))};
}

double strain_energy_beyond_linear(const StepPlan& plan, const MotionState& state) noexcept {
  const Shape shape(plan, state);
  double sum = 0.0;
  for (const PlanTrueBeam& beam : plan.coupled.links.beams)
    sum += gradient_of(beam, shape).energy - linear_energy_of(beam, shape);
  for (const PlanTruePlate& plate : plan.coupled.links.plates)
    sum += gradient_of(plate, shape).energy - linear_energy_of(plate, shape);
  for (const PlanTrueAngle& angle : plan.coupled.links.angles) sum += energy_beyond_linear(angle, shape);
  for (const PlanTrueMatrix& matrix : plan.coupled.links.matrices) {
    MatrixGradient g;
    const double linear = set_gradient(matrix, shape, g);
    sum += g.energy - linear;
  }
  for (const PlanBar& bar : plan.coupled.bars) {
    if (bar.stiffness == 0.0) continue;
    // the energy of a bar is s^2 / (2 D)   (THEORY 12.17)
    const double tension = bar_force(bar, sub(shape.V(bar.second), shape.V(bar.first))).tension;
    const double linear =
        bar.stiffness * dot(bar.direction, sub(shape.linear_V(bar.second), shape.linear_V(bar.first)));
    sum += 0.5 * (tension - linear) * ((tension + linear) / bar.stiffness);
  }
  return sum;
}

namespace {

/// Returns the bar at true length that belongs to a link, or nullptr if there is none.
const PlanBar* find_bar(const StepPlan& plan, std::int32_t link) noexcept {
  const auto& bars = plan.coupled.bars;
  const auto found =
      std::lower_bound(bars.begin(), bars.end(), link,
                       [](const PlanBar& bar, std::int32_t wanted) { return bar.link < wanted; });
  return found != bars.end() && found->link == link ? &*found : nullptr;
}

}  // namespace

void read_link(const StepPlan& given, const MotionState& state, int output, std::span<double> out) noexcept {
  const StepPlan& plan = active_plan(given, state);
  const PlanLinkOutput& link = plan.link_outputs[index(output)];
  const std::size_t n = index(plan.num_padded);
  for (std::int32_t k = 0; k < link.num_rows; ++k)
    out[index(k)] = dot_lanes(plan.link_rows.data() + index(link.first_row + k) * n, state.q.data(), n);
  const auto add = [&](std::int32_t first, const Array& x) {
    for (std::int32_t k = 0; first >= 0 && k < link.num_rows; ++k)
      out[index(k)] += dot_lanes(plan.link_rows.data() + index(first + k) * n, x.data(), n);
  };
  const PlanBar* bar = find_bar(plan, link.link);
  if (bar != nullptr) {
    const BarMotion motion = read_bar(plan, state, *bar);
    out[0] = bar_force(*bar, motion.d).tension;
    if (bar->damping > 0.0) out[0] += damper_force(*bar, motion.d, motion.d_dot).tension;
  } else {
    // the rows of damping are those of linear strains, which Rayleigh's beta does not damp here
    const bool is_true =
        traits_of(plan.fidelity).has_true_geometry && read_true_link(plan, state, link.link, out);
    if (!is_true || !plan.coupled.damps_true_strains || plan.coupled.beta == 0.0)
      add(link.first_rate_row, state.q_dot);
  }
  add(link.first_load_row, state.Q);
}

}  // namespace freeflex
