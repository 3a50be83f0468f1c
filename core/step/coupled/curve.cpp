#include "core/step/coupled/curve.hpp"

#include <algorithm>

#include "core/step/linear/columns.hpp"
#include "core/step/linear/kernels.hpp"

namespace freeflex {
namespace {

/// Calls f(k, mode) for each curvilinear mode, with its index into PlanCurve::modes.
template <typename F>
void for_each_mode(const PlanCurve& curve, const F& f) noexcept {
  for (const std::int32_t k : curve.stiff) f(index(k), index(curve.modes[index(k)]));
}

/// Returns the component of a across the unit vector u.
FREEFLEX_KERNEL Vec3 normal_to(const Vec3& u, const Vec3& a) noexcept { return add_scaled(a, -dot(u, a), u); }

void copy_soft(const StepPlan& plan, const double* from, Array& to) noexcept {
  std::copy_n(from, to.size(), to.begin());
  for_each_mode(plan.coupled.curve, [&](std::size_t, std::size_t mode) { to[mode] = 0.0; });
}

constexpr std::size_t kNumBends = 9, kNumLinkRows = 6;  // rows of a block of links

FREEFLEX_KERNEL void bend_blocks(const double* __restrict links, std::size_t count,
                                 double* __restrict bends) noexcept {
  for (std::size_t first = 0; first < count; first += kBlock) {
    for (std::size_t lane = 0; lane < kBlock; ++lane) {
      const double* const link = links + lane;
      double* const bend = bends + lane;
      const Vec3 u = vector_at(link, 0), d = vector_at(bend, 0), difference = vector_at(bend, 3),
                 sum = vector_at(bend, 6);
      put(normal_to(u, d), bend, 0);
      put(normal_to(u, difference), bend, 3);
      put(add_scaled(normal_to(u, sum), -2.0 * entry(link, 3), cross(u, d)), bend, 6);
    }
    links += kNumLinkRows * kBlock, bends += kNumBends * kBlock;
  }
}

FREEFLEX_KERNEL void add_link_strains(const double* __restrict links, const double* __restrict a,
                                      const double* __restrict b, double factor, std::size_t count,
                                      double* __restrict strain) noexcept {
  for (std::size_t first = 0; first < count; first += kBlock) {
    for (std::size_t lane = 0; lane < kBlock; ++lane) {
      const double *link = links + lane, *x = a + lane, *y = b + lane;
      const double by_displacement = entry(link, 3) * dot(vector_at(x, 0), vector_at(y, 0)),
                   by_bend = entry(link, 4) * dot(vector_at(x, 3), vector_at(y, 3)),
                   by_skew = entry(link, 5) * dot(vector_at(x, 6), vector_at(y, 6));
      strain[lane] += factor * (by_displacement + (by_bend + by_skew));
    }
    links += kNumLinkRows * kBlock, a += kNumBends * kBlock, b += kNumBends * kBlock, strain += kBlock;
  }
}

/// Sets the shape of displacements V and of rotations theta.
void set_shape(const PlanCurve& curve, const Array& links, std::span<const Vec3> V, const Array& theta,
               CurveShape& shape) noexcept {
  const auto rotation = [&](std::int32_t joint) {
    const double* at = theta.data() + 3 * index(joint);
    return Vec3{at[0], at[1], at[2]};
  };
  for (std::size_t k = 0; k < curve.links.size(); ++k) {
    const PlanCurveLink& link = curve.links[k];
    double* const bend = column_of(shape.bends.data(), k, kNumBends);
    put(sub(V[index(link.points[1])], V[index(link.points[0])]), bend, 0);
    const bool is_beam = link.joints[0] >= 0;
    const Vec3 first = is_beam ? rotation(link.joints[0]) : Vec3{},
               second = is_beam ? rotation(link.joints[1]) : Vec3{};
    put(sub(second, first), bend, 3);
    put(add(first, second), bend, 6);
  }
  run_auto<bend_blocks>(links.data(), curve.links.size(), shape.bends.data());
  for (std::size_t k = 0; k < curve.plates.size(); ++k) {
    const PlanCurvePlate& plate = curve.plates[k];
    shape.slopes[k] = {};
    for (std::size_t i = 0; i < 3; ++i) {
      shape.slopes[k].x = add_scaled(shape.slopes[k].x, plate.gradients[i][0], V[index(plate.points[i])]);
      shape.slopes[k].y = add_scaled(shape.slopes[k].y, plate.gradients[i][1], V[index(plate.points[i])]);
    }
  }
}

/// Sets a to the shape of the coordinates w.soft, b to that of w.other, and the strains to 0. Stores the
/// displacements of points in w.V and w.W, and the rotations of joints and bodies in w.theta, w.other_theta.
void set_two_shapes(const StepPlan& plan, CurveWorkspace& w, CurveShape& a, CurveShape& b) noexcept {
  const std::size_t n = index(plan.num_padded);
  const double *soft = w.soft.data(), *other = w.other.data();
  contract_points(plan, soft, other, w.V, w.W);
  const PlanJoints& joints = plan.coupled.links.joints;
  double *x = w.theta.data(), *y = w.other_theta.data();
  contract_two(joints.rows.data(), 3 * index(joints.num_joints), n, n, soft, other, x, y);
  x += 3 * index(joints.num_joints), y += 3 * index(joints.num_joints);
  for (const PlanTurningBody& body : plan.coupled.turning.bodies) {
    contract_two(body.rows.data() + 3 * n, 3, n, n, soft, other, x, y);
    x += 3, y += 3;
  }
  set_shape(plan.coupled.curve, w.links, w.V, w.theta, a);
  set_shape(plan.coupled.curve, w.links, w.W, w.other_theta, b);
  for (Array& each : w.strain) std::fill(each.begin(), each.end(), 0.0);
}

/// Adds `factor` times the second derivative of the strains, applied to two shapes, to `strain`
/// (THEORY 12.78):
///   eps = |d|^2 / (2 L) + L (|t_2 - t_1|^2 / 24 + skew_bow |t_1 + t_2|^2) of a link
void add_strains(const PlanCurve& curve, const Array& links, double factor, const CurveShape& a,
                 const CurveShape& b, Array& strain) noexcept {
  run_auto<add_link_strains>(links.data(), a.bends.data(), b.bends.data(), factor, curve.links.size(),
                             strain.data());
  double* at = strain.data() + curve.links.size();
  for (std::size_t k = 0; k < curve.plates.size(); ++k, at += 3) {
    const CurveShape::Slope &x = a.slopes[k], &y = b.slopes[k];
    const double xx = dot(x.x, y.x), yy = dot(x.y, y.y), xy = dot(x.x, y.y) + dot(x.y, y.x);
    at[0] += factor * (xx + yy);
    at[1] += factor * (xx - yy);
    at[2] += factor * xy;
  }
}

/// Sets a and b to the shares of w.strain in the foreshortening of curvilinear modes; those of modes between
/// them are set too, but not used.
void set_shares(const PlanCurve& curve, const CurveWorkspace& w, Array& a, Array& b) noexcept {
  const std::size_t n = w.strain[0].size(), first = index(curve.stiff.front()),
                    count = index(curve.stiff.back()) + 1 - first;
  contract_two(curve.weights.data() + first * n, count, n, n, w.strain[0].data(), w.strain[1].data(),
               a.data() + first, b.data() + first);
}

/// Sets the shapes of q and p, and s and its rate.
void set_shapes(const StepPlan& plan, const double* q, const double* p, CurveWorkspace& w) noexcept {
  const PlanCurve& curve = plan.coupled.curve;
  copy_soft(plan, q, w.soft);
  copy_soft(plan, p, w.other);
  set_two_shapes(plan, w, w.of_q, w.of_p);
  add_strains(curve, w.links, 0.5, w.of_q, w.of_q, w.strain[0]);
  add_strains(curve, w.links, 1.0, w.of_q, w.of_p, w.strain[1]);
  set_shares(curve, w, w.s, w.s_dot);
}

}  // namespace

CurveWorkspace make_curve_workspace(const StepPlan& plan) {
  CurveWorkspace w;
  const PlanCurve& curve = plan.coupled.curve;
  if (curve.modes.empty()) return w;
  const std::size_t n = index(plan.num_padded), m = curve.modes.size();
  for (CurveShape* shape : {&w.of_q, &w.of_p, &w.of_rate, &w.of_acceleration}) {
    shape->bends.resize(kNumBends * pad(curve.links.size()));
    shape->slopes.resize(curve.plates.size());
  }
  for (auto* v : {&w.V, &w.W}) v->resize(plan.points.size());
  for (Array* a : {&w.soft, &w.other, &w.q, &w.p}) a->resize(n);
  for (Array* a :
       {&w.s, &w.s_dot, &w.slow_q, &w.slow_p, &w.miss, &w.tried[0], &w.tried[1], &w.missed[0], &w.missed[1]})
    a->resize(m);
  for (Array* a : {&w.theta, &w.other_theta})
    a->resize(3 * (index(plan.coupled.links.joints.num_joints) + plan.coupled.turning.bodies.size()));
  for (Array& each : w.strain) each.resize(pad(curve.links.size() + 3 * curve.plates.size()));
  for (Array& each : w.share) each.resize(m);
  w.links.resize(kNumLinkRows * pad(curve.links.size()));
  for (std::size_t k = 0; k < curve.links.size(); ++k) {
    const PlanCurveLink& link = curve.links[k];
    double* const to = column_of(w.links.data(), k, kNumLinkRows);
    put(link.direction, to, 0);
    put(1.0 / link.length, to, 3);
    if (link.joints[0] < 0) continue;
    put(link.length / 12.0, to, 4), put(2.0 * link.length * link.skew_bow, to, 5);
  }
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
    for (std::size_t trial = 0; trial < std::min<std::size_t>(index(w.num_tried), 2); ++trial)
      next -= g[trial] * (image - (w.tried[trial][k] + w.missed[trial][k]));
    w.tried[1][k] = w.tried[0][k], w.missed[1][k] = w.missed[0][k];
    w.tried[0][k] = x, w.missed[0][k] = w.miss[k];
    w.slow_q[k] = next;
  });
  ++w.num_tried;
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
  set_two_shapes(plan, w, w.of_rate, w.of_acceleration);
  add_strains(curve, w.links, 1.0, w.of_q, w.of_rate, w.strain[0]);
  add_strains(curve, w.links, 1.0, w.of_q, w.of_acceleration, w.strain[1]);
  add_strains(curve, w.links, 1.0, w.of_p, w.of_p, w.strain[1]);
  add_strains(curve, w.links, 1.0, w.of_rate, w.of_p, w.strain[1]);
  set_shares(curve, w, w.share[0], w.share[1]);
  for_each_mode(curve, [&](std::size_t k, std::size_t mode) {
    rate_q[mode] -= w.share[0][k];
    // damping acts on q' if it is that of true strains, and otherwise on y'   (THEORY 12.80)
    const double damped = plan.coupled.damps_true_strains ? w.s_dot[k] : -w.share[0][k];
    rate_p[mode] -=
        plan.omega[mode] * (plan.omega[mode] * w.s[k]) + 2.0 * plan.decay[mode] * damped + w.share[1][k];
  });
}

void undamp_foreshortening(const StepPlan& plan, const CurveWorkspace& w, Array& Q, Array& q_ddot) noexcept {
  if (plan.coupled.damps_true_strains) return;
  for_each_mode(plan.coupled.curve, [&](std::size_t k, std::size_t mode) {
    const double acceleration = 2.0 * plan.decay[mode] * (w.s_dot[k] + w.share[0][k]);
    Q[mode] += plan.mass * acceleration;
    if (!q_ddot.empty()) q_ddot[mode] += acceleration;
  });
}

}  // namespace freeflex
