#include "core/step/coupled/curve.hpp"

#include <algorithm>

#include "core/step/linear/kernels.hpp"

namespace freeflex {
namespace {

/// Calls f(k, mode) for each curvilinear mode, with its index into PlanCurve::modes.
template <typename F>
void for_each_mode(const PlanCurve& curve, const F& f) noexcept {
  for (const std::int32_t k : curve.stiff) f(index(k), index(curve.modes[index(k)]));
}

void copy_soft(const StepPlan& plan, const double* from, Array& to) noexcept {
  std::copy_n(from, to.size(), to.begin());
  for_each_mode(plan.coupled.curve, [&](std::size_t, std::size_t mode) { to[mode] = 0.0; });
}

/// Sets w.V, w.W and w.theta, w.other_theta: the displacements of points and the rotations of joints and
/// bodies at the coordinates w.soft and w.other.
void set_displacements(const StepPlan& plan, CurveWorkspace& w) noexcept {
  const std::size_t n = index(plan.num_padded);
  const double *a = w.soft.data(), *b = w.other.data();
  contract_points(plan, a, b, w.V, w.W);
  const PlanJoints& joints = plan.coupled.links.joints;
  double *x = w.theta.data(), *y = w.other_theta.data();
  contract_two(joints.rows.data(), 3 * index(joints.num_joints), n, n, a, b, x, y);
  x += 3 * joints.num_joints, y += 3 * joints.num_joints;
  for (const PlanTurningBody& body : plan.coupled.turning.bodies) {
    contract_two(body.rows.data() + 3 * n, 3, n, n, a, b, x, y);
    x += 3, y += 3;
  }
}

/// Sets the shape of displacements V and of rotations theta.
void set_shape(const PlanCurve& curve, std::span<const Vec3> V, const Array& theta,
               CurveShape& shape) noexcept {
  const auto rotation = [&](std::int32_t joint) {
    const double* at = theta.data() + 3 * index(joint);
    return Vec3{at[0], at[1], at[2]};
  };
  for (std::size_t k = 0; k < curve.links.size(); ++k) {
    const PlanCurveLink& link = curve.links[k];
    const Vec3& u = link.direction;
    const auto across = [&](const Vec3& a) { return add_scaled(a, -dot(u, a), u); };
    const Vec3 d = sub(V[index(link.points[1])], V[index(link.points[0])]);
    CurveShape::Bend& bend = shape.bends[k];
    bend.across = across(d);
    if (link.joints[0] < 0) continue;
    const Vec3 chord = scale(1.0 / link.length, cross(u, d));
    const Vec3 first = sub(across(rotation(link.joints[0])), chord);
    const Vec3 second = sub(across(rotation(link.joints[1])), chord);
    bend.bent = sub(second, first);
    bend.skew = add(first, second);
  }
  for (std::size_t k = 0; k < curve.plates.size(); ++k) {
    const PlanCurvePlate& plate = curve.plates[k];
    shape.slopes[k] = {};
    for (std::size_t i = 0; i < 3; ++i) {
      shape.slopes[k].x = add_scaled(shape.slopes[k].x, plate.gradients[i][0], V[index(plate.points[i])]);
      shape.slopes[k].y = add_scaled(shape.slopes[k].y, plate.gradients[i][1], V[index(plate.points[i])]);
    }
  }
}

/// Adds `factor` times the second derivative of the strains, applied to two shapes, to w.strain
/// (THEORY 12.78):
///   eps = |d|^2 / (2 L) + L (|t_2 - t_1|^2 / 24 + skew_bow |t_1 + t_2|^2) of a link
void add_strains(const PlanCurve& curve, double factor, const CurveShape& a, const CurveShape& b,
                 Array& strain) noexcept {
  for (std::size_t k = 0; k < curve.links.size(); ++k) {
    const CurveShape::Bend &x = a.bends[k], &y = b.bends[k];
    const double L = curve.links[k].length;
    const double bow = dot(x.bent, y.bent) / 12.0 + 2.0 * curve.links[k].skew_bow * dot(x.skew, y.skew);
    strain[k] += factor * (dot(x.across, y.across) / L + L * bow);
  }
  double* at = strain.data() + curve.links.size();
  for (std::size_t k = 0; k < curve.plates.size(); ++k, at += 3) {
    const CurveShape::Slope &x = a.slopes[k], &y = b.slopes[k];
    const double xx = dot(x.x, y.x), yy = dot(x.y, y.y), xy = dot(x.x, y.y) + dot(x.y, y.x);
    at[0] += factor * (xx + yy);
    at[1] += factor * (xx - yy);
    at[2] += factor * xy;
  }
}

double share_of(const PlanCurve& curve, std::size_t k, const Array& strain) noexcept {
  return dot_lanes(curve.weights.data() + k * strain.size(), strain.data(), strain.size());
}

/// Sets the shapes of q and p, and s and its rate.
void set_shapes(const StepPlan& plan, const double* q, const double* p, CurveWorkspace& w) noexcept {
  const PlanCurve& curve = plan.coupled.curve;
  copy_soft(plan, q, w.soft);
  copy_soft(plan, p, w.other);
  set_displacements(plan, w);
  set_shape(curve, w.V, w.theta, w.of_q);
  set_shape(curve, w.W, w.other_theta, w.of_p);
  std::fill(w.strain.begin(), w.strain.end(), 0.0);
  add_strains(curve, 0.5, w.of_q, w.of_q, w.strain);
  for_each_mode(curve, [&](std::size_t k, std::size_t) { w.s[k] = share_of(curve, k, w.strain); });
  std::fill(w.strain.begin(), w.strain.end(), 0.0);
  add_strains(curve, 1.0, w.of_q, w.of_p, w.strain);
  for_each_mode(curve, [&](std::size_t k, std::size_t) { w.s_dot[k] = share_of(curve, k, w.strain); });
}

}  // namespace

CurveWorkspace make_curve_workspace(const StepPlan& plan) {
  CurveWorkspace w;
  const PlanCurve& curve = plan.coupled.curve;
  if (curve.modes.empty()) return w;
  const std::size_t n = index(plan.num_padded), m = curve.modes.size();
  for (CurveShape* shape : {&w.of_q, &w.of_p, &w.of_rate, &w.of_acceleration}) {
    shape->bends.resize(curve.links.size());
    shape->slopes.resize(curve.plates.size());
  }
  for (auto* v : {&w.V, &w.W}) v->resize(plan.points.size());
  for (Array* a : {&w.soft, &w.other, &w.q, &w.p}) a->resize(n);
  for (Array* a :
       {&w.s, &w.s_dot, &w.slow_q, &w.slow_p, &w.miss, &w.tried[0], &w.tried[1], &w.missed[0], &w.missed[1]})
    a->resize(m);
  for (Array* a : {&w.theta, &w.other_theta})
    a->resize(3 * (index(plan.coupled.links.joints.num_joints) + plan.coupled.turning.bodies.size()));
  w.strain.resize(pad(curve.links.size() + 3 * curve.plates.size()));
  return w;
}

void to_linear(const StepPlan& plan, const double* y, const double* v, CurveWorkspace& w) noexcept {
  set_shapes(plan, y, v, w);
  std::copy_n(y, w.q.size(), w.q.begin());
  std::copy_n(v, w.p.size(), w.p.begin());
  for_each_mode(plan.coupled.curve, [&](std::size_t k, std::size_t mode) {
    w.q[mode] += w.s[k];
    w.p[mode] += w.s_dot[k];
  });
}

void to_curved(const StepPlan& plan, const double* q, const double* p, double* y, double* v,
               CurveWorkspace& w) noexcept {
  set_shapes(plan, q, p, w);
  std::copy_n(q, w.q.size(), w.q.begin());
  std::copy_n(p, w.p.size(), w.p.begin());
  std::copy_n(q, w.q.size(), y);
  std::copy_n(p, w.p.size(), v);
  for_each_mode(plan.coupled.curve, [&](std::size_t k, std::size_t mode) {
    y[mode] -= w.s[k];
    v[mode] -= w.s_dot[k];
  });
}

void filter(const StepPlan& plan, const double* y, const double* v, Array& q, Array& p,
            const CurveWorkspace& w) noexcept {
  const PlanCurve& curve = plan.coupled.curve;
  std::copy_n(y, q.size(), q.begin());
  std::copy_n(v, p.size(), p.begin());
  const double* sigma = curve.filter.data();
  for_each_mode(curve, [&](std::size_t k, std::size_t mode) {
    q[mode] = w.slow_q[k] + *sigma * (y[mode] - w.slow_q[k]);
    p[mode] = w.slow_p[k] + *sigma++ * (v[mode] - w.slow_p[k]);
  });
}

namespace {

/// Returns sum_f omega_f^4 a_f b_f over the curvilinear modes [m^2/s^4].
template <typename A, typename B>
double force_product(const StepPlan& plan, const A& a, const B& b) noexcept {
  double sum = 0.0;
  for_each_mode(plan.coupled.curve, [&](std::size_t k, std::size_t mode) {
    const double square = plan.omega[mode] * plan.omega[mode];
    sum += (square * a(k)) * (square * b(k));
  });
  return sum;
}

/// Returns the shares g of the last two trials that make | f - g_1 (f - f_1) - g_2 (f - f_2) | least.
std::array<double, 2> least_miss(const StepPlan& plan, const CurveWorkspace& w) noexcept {
  const auto f = [&](std::size_t k) { return w.miss[k]; };
  const auto to = [&](std::size_t trial) {
    return [&w, trial](std::size_t k) { return w.miss[k] - w.missed[trial][k]; };
  };
  if (w.num_tried == 0) return {};
  const double aa = force_product(plan, to(0), to(0)), af = force_product(plan, to(0), f);
  if (!(aa > 0.0)) return {};
  const std::array<double, 2> one{af / aa, 0.0};
  if (w.num_tried == 1) return one;
  const double ab = force_product(plan, to(0), to(1)), bb = force_product(plan, to(1), to(1));
  const double bf = force_product(plan, to(1), f), determinant = aa * bb - ab * ab;
  // two differences in almost the same direction give no more than one
  if (!(determinant > 1e-10 * aa * bb)) return one;
  return {(af * bb - bf * ab) / determinant, (aa * bf - ab * af) / determinant};
}

}  // namespace

double improve_slow_motion(const StepPlan& plan, const double* rate_q, const double* rate_p,
                           const double* rate_q_dot, CurveWorkspace& w) noexcept {
  const PlanCurve& curve = plan.coupled.curve;
  for_each_mode(curve, [&](std::size_t k, std::size_t mode) {
    const double square = plan.omega[mode] * plan.omega[mode];
    w.slow_p[k] = -rate_q[mode];
    w.miss[k] =
        (rate_p[mode] + rate_q_dot[mode] - 2.0 * plan.decay[mode] * w.slow_p[k]) / square - w.slow_q[k];
  });
  const auto f = [&](std::size_t k) { return w.miss[k]; };
  const double distance = __builtin_sqrt(force_product(plan, f, f));
  const std::array<double, 2> g = least_miss(plan, w);
  for_each_mode(curve, [&](std::size_t k, std::size_t) {
    const double x = w.slow_q[k], image = x + w.miss[k];
    double next = image;
    for (std::size_t trial = 0; trial < index(w.num_tried); ++trial)
      next -= g[trial] * (image - (w.tried[trial][k] + w.missed[trial][k]));
    w.tried[1][k] = w.tried[0][k], w.missed[1][k] = w.missed[0][k];
    w.tried[0][k] = x, w.missed[0][k] = w.miss[k];
    w.slow_q[k] = next;
  });
  w.num_tried = std::min(w.num_tried + 1, 2);
  return distance;
}

double distance_of_slow_motion(const StepPlan& plan, const CurveWorkspace& w, const Array& other,
                               double share) noexcept {
  const auto distance = [&](std::size_t k) { return w.slow_q[k] - share * other[k]; };
  return __builtin_sqrt(force_product(plan, distance, distance));
}

void curve_rates(const StepPlan& plan, double* rate_q, double* rate_p, CurveWorkspace& w) noexcept {
  const PlanCurve& curve = plan.coupled.curve;
  copy_soft(plan, rate_q, w.soft);
  for (std::size_t l = 0; l < w.other.size(); ++l)
    w.other[l] = rate_p[l] - plan.omega[l] * (plan.omega[l] * w.q[l]) - 2.0 * plan.decay[l] * w.p[l];
  for_each_mode(curve, [&](std::size_t, std::size_t mode) { w.other[mode] = 0.0; });
  set_displacements(plan, w);
  set_shape(curve, w.V, w.theta, w.of_rate);
  set_shape(curve, w.W, w.other_theta, w.of_acceleration);
  std::fill(w.strain.begin(), w.strain.end(), 0.0);
  add_strains(curve, 1.0, w.of_q, w.of_rate, w.strain);
  for_each_mode(curve,
                [&](std::size_t k, std::size_t mode) { rate_q[mode] -= share_of(curve, k, w.strain); });
  std::fill(w.strain.begin(), w.strain.end(), 0.0);
  add_strains(curve, 1.0, w.of_q, w.of_acceleration, w.strain);
  add_strains(curve, 1.0, w.of_p, w.of_p, w.strain);
  add_strains(curve, 1.0, w.of_rate, w.of_p, w.strain);
  for_each_mode(curve, [&](std::size_t k, std::size_t mode) {
    rate_p[mode] -= plan.omega[mode] * (plan.omega[mode] * w.s[k]) + 2.0 * plan.decay[mode] * w.s_dot[k] +
                    share_of(curve, k, w.strain);
  });
}

}  // namespace freeflex
