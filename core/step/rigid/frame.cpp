#include "core/step/rigid/frame.hpp"

#include "core/step/loads/field.hpp"
#include "core/step/rigid/flows.hpp"
#include "core/step/rigid/kepler.hpp"
#include "core/step/rigid/tick_rotation.hpp"

namespace freeflex {
namespace {

/// Holds the moment of the loads about the centre of mass, in body axes, as a function of the rotation G of
/// the body since the start of the step:
///   L_B,c = torque_B,c + sum_ak G_ka table[9c+3a+k]   (THEORY 8.3)
struct StepMoment {
  std::array<double, 27> table;
  Vec3 torque_B;
};

StepMoment moment_in_step(const RigidLoad& load, const Mat3& R_WB) noexcept {
  StepMoment moment;
  moment.torque_B = load.torque_B;
  for (std::size_t ca = 0; ca < 9; ++ca) {
    const double* m = load.moment_W.data() + 3 * ca;
    for (std::size_t k = 0; k < 3; ++k)
      moment.table[3 * ca + k] = R_WB[k] * m[0] + R_WB[3 + k] * m[1] + R_WB[6 + k] * m[2];
  }
  return moment;
}

Vec3 moment_B(const StepMoment& moment, const Mat3& G) noexcept {
  Vec3 sum = moment.torque_B;
  for (std::size_t c = 0; c < 3; ++c) {
    const double* t = moment.table.data() + 9 * c;
    sum[c] += (G[0] * t[0] + G[3] * t[1] + G[6] * t[2]) + (G[1] * t[3] + G[4] * t[4] + G[7] * t[5]) +
              (G[2] * t[6] + G[5] * t[7] + G[8] * t[8]);
  }
  return sum;
}

/// Returns the moment at a third of the step from one end of the step (near), on the parabola through the
/// moments at this end, at the middle and at the other end (far): (2 near + 8 middle - far) / 9
/// (THEORY 7.11 at s = 1/3).
StepMoment interpolate(const StepMoment& near, const StepMoment& middle, const StepMoment& far) noexcept {
  const auto at_third = [](double x, double y, double z) { return (2.0 * x + 8.0 * y - z) / 9.0; };
  StepMoment moment;
  for (std::size_t i = 0; i < moment.table.size(); ++i)
    moment.table[i] = at_third(near.table[i], middle.table[i], far.table[i]);
  for (std::size_t i = 0; i < 3; ++i)
    moment.torque_B[i] = at_third(near.torque_B[i], middle.torque_B[i], far.torque_B[i]);
  return moment;
}

/// Butcher's method of order 6 in seven stages (Butcher 1964)   (THEORY 7.10).
constexpr std::size_t kStages = 7;
constexpr double kStageWeights[kStages][kStages - 1] = {
    {},
    {1.0 / 3},
    {0, 2.0 / 3},
    {1.0 / 12, 1.0 / 3, -1.0 / 12},
    {-1.0 / 16, 9.0 / 8, -3.0 / 16, -3.0 / 8},
    {0, 9.0 / 8, -3.0 / 8, -3.0 / 4, 1.0 / 2},
    {9.0 / 44, -9.0 / 11, 63.0 / 44, 18.0 / 11, 0, -16.0 / 11}};
constexpr double kWeights[kStages] = {11.0 / 120, 0, 27.0 / 40, 27.0 / 40, -4.0 / 15, -4.0 / 15, 11.0 / 120};

constexpr double kTimes[kStages] = {0, 1.0 / 3, 2.0 / 3, 1.0 / 3, 1.0 / 2, 1.0 / 2, 1};

using Rates = std::array<Vec3, kStages>;

/// Returns start + h sum_j weights_j rates_j over the stages before `stage`   (THEORY 7.10). The rate of the
/// stage just before is added last, so that the processor can sum the other terms before this rate is known.
template <std::size_t stage>
Vec3 combine(const Vec3& start, double h, const double* weights, const Rates& rates) noexcept {
  Vec3 sum = start;
  for (std::size_t j = 0; j < stage; ++j)
    if (weights[j] != 0.0) sum = add_scaled(sum, h * weights[j], rates[j]);
  return sum;
}

/// Holds the path of the centre of mass relative to an attractor within a step, in body axes at the start of
/// the step:
///   rho + t v + t^2 a / 2
/// A path of second order in time is accurate enough for the torque of the gravity gradient
/// (THEORY 8.18, 8.20).
struct Trajectory {
  Vec3 rho, velocity, acceleration;  // [m], [m/s], [m/s^2]
  Vec3 at(double t) const noexcept {
    return add_scaled(add_scaled(rho, t, velocity), 0.5 * t * t, acceleration);
  }
};

Trajectory path_of(const StepPlan& plan, const Frame& from, const RigidLoad& load,
                   const Mat3& R_WB) noexcept {
  const Vec3 a_W = add_scaled(gravity_at(plan, from.p_WB), 1.0 / plan.mass, resultant_W(load, R_WB));
  return {multiply_transposed(R_WB, sub(from.p_WB, plan.attractor_W)), multiply_transposed(R_WB, from.v_WB),
          multiply_transposed(R_WB, a_W)};
}

/// Computes the stages of a step of the rotation, in body axes at the start of the step:
///   g' = (w + g x w + g (g.w)) / 2   (THEORY 7.7),   H' = G(g) L_B   (THEORY 7.9)
///   w = I^-1 (G(g)^T H - h), h the momentum of the wheels   (THEORY 7.4, 16.22)
/// L_B includes the torque of the gravity gradient of an attractor (THEORY 8.20). The attitude within the
/// step is R_WB G(g) (THEORY 7.8).
struct RotationStages {
  const StepPlan& plan;
  const Trajectory* path;  // set if an attractor acts
  double period;
  Mat3 half_inverse_inertia;
  Vec3 H;  // [N m s] angular momentum at the start, in body axes
  const WheelMomentum& wheels;
  Rates g_rates, H_rates;

  RotationStages(const StepPlan& of, const Vec3& H_start, const Trajectory* along,
                 const WheelMomentum& of_wheels) noexcept
      : plan(of), path(along), period(of.period), H(H_start), wheels(of_wheels) {
    for (std::size_t i = 0; i < 9; ++i) half_inverse_inertia[i] = 0.5 * plan.inverse_inertia[i];
  }

  /// Returns the rate of the Gibbs vector, g' = (w + g x w + g (g.w)) / 2   (THEORY 7.7). The product G^T H
  /// is computed as H + 2 (g x (g x H) - g x H) / (1 + g.g), which takes less time than a product with the
  /// matrix G.
  /// \param share  [-] time since the start of the step, divided by the period
  Vec3 g_rate(const Vec3& g, const Vec3& H_now, double share) const noexcept {
    const Vec3 u = cross(g, H_now);
    Vec3 H_B = add_scaled(H_now, 2.0 / (1.0 + dot(g, g)), sub(cross(g, u), u));
    if (!plan.wheels.empty()) H_B = sub(H_B, wheels.at(share));
    const Vec3 half_w = multiply(half_inverse_inertia, H_B);
    return add_scaled(add(half_w, cross(g, half_w)), dot(g, half_w), g);
  }

  template <std::size_t stage>
  void advance_free() noexcept {
    g_rates[stage] = g_rate(combine<stage>({}, period, kStageWeights[stage], g_rates), H, kTimes[stage]);
  }

  template <std::size_t stage>
  void advance_loaded(const StepMoment& moment) noexcept {
    const Vec3 g = combine<stage>({}, period, kStageWeights[stage], g_rates);
    const Mat3 G = rotation_of_gibbs(g);
    g_rates[stage] = g_rate(g, combine<stage>(H, period, kStageWeights[stage], H_rates), kTimes[stage]);
    H_rates[stage] = multiply(G, moment_B(moment, G));
    if (path != nullptr)
      H_rates[stage] =
          add(H_rates[stage],
              multiply(G, gradient_torque(plan, multiply_transposed(G, path->at(kTimes[stage] * period)))));
  }
};

/// Holds the result of a step of the rotation, in body axes at the start of the step: the Gibbs vectors at
/// the middle and at the end of the step, and the change of the angular momentum [N m s].
struct StepRotation {
  Vec3 g_middle{}, g_end{}, H_gain{};
};

/// Returns the rotation that follows from the stages   (THEORY 7.10).
StepRotation finish(const RotationStages& stages, const Vec3& H_gain, bool needs_middle) noexcept {
  StepRotation rotation;
  rotation.H_gain = H_gain;
  rotation.g_end = combine<kStages>({}, stages.period, kWeights, stages.g_rates);
  if (!needs_middle) return rotation;
  // Hermite's cubic between the ends of the step: g^(1/2) = g^1 / 2 + (h / 8) (g'^0 - g'^1)   (THEORY 7.12)
  const Vec3 end_rate = stages.g_rate(rotation.g_end, add(stages.H, H_gain), 1.0);
  rotation.g_middle =
      add_scaled(scale(0.5, rotation.g_end), 0.125 * stages.period, sub(stages.g_rates[0], end_rate));
  return rotation;
}

StepRotation rotate_free(RotationStages& stages, bool needs_middle) noexcept {
  stages.advance_free<0>();
  stages.advance_free<1>();
  stages.advance_free<2>();
  stages.advance_free<3>();
  stages.advance_free<4>();
  stages.advance_free<5>();
  stages.advance_free<6>();
  return finish(stages, {}, needs_middle);
}

/// Returns the rotation under the moments at the stage times 0, 1/3, 1/2, 2/3 and 1.
StepRotation rotate_loaded(RotationStages& stages, const StepMoment& start, const StepMoment& third,
                           const StepMoment& middle, const StepMoment& two_thirds, const StepMoment& end,
                           bool needs_middle) noexcept {
  stages.advance_loaded<0>(start);
  stages.advance_loaded<1>(third);
  stages.advance_loaded<2>(two_thirds);
  stages.advance_loaded<3>(third);
  stages.advance_loaded<4>(middle);
  stages.advance_loaded<5>(middle);
  stages.advance_loaded<6>(end);
  return finish(stages, combine<kStages>({}, stages.period, kWeights, stages.H_rates), needs_middle);
}

bool has_moment(const RigidLoad& load) noexcept { return load.has_moment_W || !is_zero(load.torque_B); }

StepRotation rotation_in_step(const StepPlan& plan, const Frame& from, const Mat3& R_WB, const Vec3& H_B,
                              const RigidLoads& loads) noexcept {
  const bool needs_middle = loads.later || !is_zero(loads.start.force_B);
  const bool is_attracted = plan.attractor_mu > 0.0;
  const Trajectory path = is_attracted ? path_of(plan, from, loads.start, R_WB) : Trajectory{};
  RotationStages stages(plan, H_B, is_attracted ? &path : nullptr, loads.wheels);
  if (!is_attracted && !has_moment(loads.start) && !has_moment(loads.middle()) && !has_moment(loads.end()))
    return is_zero(from.H_W) && plan.wheels.empty() ? StepRotation{} : rotate_free(stages, needs_middle);
  const StepMoment start = moment_in_step(loads.start, R_WB);
  if (!loads.later) return rotate_loaded(stages, start, start, start, start, start, needs_middle);
  const StepMoment middle = moment_in_step(loads.middle(), R_WB), end = moment_in_step(loads.end(), R_WB);
  const StepMoment third = interpolate(start, middle, end);
  return rotate_loaded(stages, start, third, middle, interpolate(end, middle, start), end, needs_middle);
}

}  // namespace

Mat3 rotation_of_gibbs(const Vec3& g) noexcept {
  const double k = 2.0 / (1.0 + dot(g, g));
  const double xx = k * g[0] * g[0], yy = k * g[1] * g[1], zz = k * g[2] * g[2];
  const double xy = k * g[0] * g[1], xz = k * g[0] * g[2], yz = k * g[1] * g[2];
  const double x = k * g[0], y = k * g[1], z = k * g[2];
  return {1.0 - (yy + zz), xy - z, xz + y, xy + z, 1.0 - (xx + zz), yz - x, xz - y, yz + x, 1.0 - (xx + yy)};
}

void translate(const StepPlan& plan, double h, const Vec3& mean_force, const Vec3& weighted_force,
               Frame& frame) noexcept {
  if (!plan.has_gravity) {
    for (std::size_t i = 0; i < 3; ++i) {
      const double p_gain = h * frame.v_WB_low[i] + 0.5 * h * h * (weighted_force[i] / plan.mass);
      add_compensated(frame.p_WB[i], frame.p_WB_low[i], h * frame.v_WB[i] + p_gain);
      add_compensated(frame.v_WB[i], frame.v_WB_low[i], h * (mean_force[i] / plan.mass));
    }
    return;
  }
  Vec3 mean_gravity = plan.gravity_W, weighted_gravity = plan.gravity_W;
  if (may_orbit_far(plan, frame)) {
    // the exact fall plus the gains due to forces   (THEORY 7.26, 7.29)
    const Fall free = fall(plan.attractor_mu, sub(frame.p_WB, plan.attractor_W), frame.v_WB, h);
    for (std::size_t i = 0; i < 3; ++i) {
      const double p_gain = free.p[i] + h * frame.v_WB_low[i] + 0.5 * h * h * (weighted_force[i] / plan.mass);
      add_compensated(frame.p_WB[i], frame.p_WB_low[i], p_gain);
      add_compensated(frame.v_WB[i], frame.v_WB_low[i], free.v[i] + h * (mean_force[i] / plan.mass));
    }
    return;
  }
  if (plan.attractor_mu > 0.0) {
    // Simpson's rule for the field along the path that follows from the acceleration at the start:
    // p(t) = p^0 + t v^0 + t^2 / 2 (g(rho^0) + weighted_force / M)   (THEORY 8.17, 8.18)
    const Vec3 start = gravity_at(plan, frame.p_WB);
    const Vec3 a = add_scaled(start, 1.0 / plan.mass, weighted_force);
    const auto position = [&](double t) {
      return add_scaled(add_scaled(frame.p_WB, t, frame.v_WB), 0.5 * t * t, a);
    };
    const Vec3 middle = gravity_at(plan, position(0.5 * h)), end = gravity_at(plan, position(h));
    mean_gravity = scale(1.0 / 6.0, add_scaled(add(start, end), 4.0, middle));
    weighted_gravity = scale(1.0 / 3.0, add_scaled(start, 2.0, middle));
  }
  for (std::size_t i = 0; i < 3; ++i) {
    const double p_gain =
        h * frame.v_WB_low[i] + 0.5 * h * h * (weighted_force[i] / plan.mass + weighted_gravity[i]);
    add_compensated(frame.p_WB[i], frame.p_WB_low[i], h * frame.v_WB[i] + p_gain);
    add_compensated(frame.v_WB[i], frame.v_WB_low[i], h * (mean_force[i] / plan.mass + mean_gravity[i]));
  }
}

// q_WB += q_WB o ((1, g) / sqrt(1 + g.g) - (1, 0))   (THEORY 7.13)
void rotate_attitude(const Vec3& g, Frame& frame) noexcept {
  const double s = dot(g, g);
  const double norm = __builtin_sqrt(1.0 + s), inverse = 1.0 / norm;
  add_rotation({-s / (norm * (1.0 + norm)), inverse * g[0], inverse * g[1], inverse * g[2]}, frame);
}

// q_WB += q_WB o less_one - 2^-9 (|q_WB|^2 - 1) q_WB   (THEORY 7.13)
void add_rotation(const Quat& less_one, Frame& frame) noexcept {
  const Quat increment = multiply(frame.q_WB, less_one);
  // Only 2^-9 of the error of the norm is corrected in each step, so that the rounding error of the norm adds
  // less than eps / 256 per step.
  const Quat& q = frame.q_WB;
  const double excess = (q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]) - 1.0;
  for (std::size_t i = 0; i < 4; ++i)
    add_compensated(frame.q_WB[i], frame.q_WB_low[i], increment[i] - 0x1p-9 * excess * q[i]);
}

void translate(const StepPlan& plan, double h, const Vec3& start, const Vec3& middle, const Vec3& end,
               Frame& frame) noexcept {
  const Vec3 mean = scale(1.0 / 6.0, add_scaled(add(start, end), 4.0, middle));
  translate(plan, h, mean, scale(1.0 / 3.0, add_scaled(start, 2.0, middle)), frame);
}

void add_pattern(const LoadPattern& pattern, double amplitude, RigidLoad& load) noexcept {
  if (pattern.has_world) {
    load.force_W = add_scaled(load.force_W, amplitude, pattern.force_W);
    for (std::size_t i = 0; i < load.moment_W.size(); ++i)
      load.moment_W[i] += amplitude * pattern.moment_W[i];
    load.has_moment_W = true;
  }
  if (pattern.has_body) {
    load.force_B = add_scaled(load.force_B, amplitude, pattern.force_B);
    load.torque_B = add_scaled(load.torque_B, amplitude, pattern.torque_B);
  }
}

Vec3 resultant_W(const RigidLoad& load, const Mat3& R_WB) noexcept {
  return is_zero(load.force_B) ? load.force_W : add(load.force_W, multiply(R_WB, load.force_B));
}

Vec3 moment_B(const RigidLoad& load, const Mat3& R_WB) noexcept {
  if (!load.has_moment_W) return load.torque_B;
  Vec3 moment = load.torque_B;
  for (std::size_t c = 0; c < 3; ++c) {
    const double* t = load.moment_W.data() + 9 * c;
    moment[c] += (R_WB[0] * t[0] + R_WB[3] * t[1] + R_WB[6] * t[2]) +
                 (R_WB[1] * t[3] + R_WB[4] * t[4] + R_WB[7] * t[5]) +
                 (R_WB[2] * t[6] + R_WB[5] * t[7] + R_WB[8] * t[8]);
  }
  return moment;
}

namespace {

/// Returns the frame at the end of a tick in which the body keeps its attitude   (THEORY 14.4).
Frame slide(const StepPlan& plan, const Frame& from, const Mat3& R_WB, const RigidLoads& loads) noexcept {
  Frame to = from;
  const Vec3 start = resultant_W(loads.start, R_WB);
  if (loads.later)
    translate(plan, plan.period, start, resultant_W(loads.middle(), R_WB), resultant_W(loads.end(), R_WB),
              to);
  else
    translate(plan, plan.period, start, start, to);
  return to;
}

/// Returns the frame at the end of a tick in which the rotation of the body is known. The attitude is rotated
/// by rotation.g_end, R_WB H_gain is added to H_W, and the frame is translated by the forces at the start,
/// the middle and the end of the tick (THEORY 7.3, 7.5).
Frame apply(const StepPlan& plan, const Frame& from, const Mat3& R_WB, const RigidLoads& loads,
            const StepRotation& rotation) noexcept {
  Frame to = from;
  rotate_attitude(rotation.g_end, to);
  const Vec3 H_gain = multiply(R_WB, rotation.H_gain);
  for (std::size_t i = 0; i < 3; ++i) add_compensated(to.H_W[i], to.H_W_low[i], H_gain[i]);
  const RigidLoad &start = loads.start, &middle = loads.middle(), &end = loads.end();
  if (!loads.later && is_zero(start.force_B)) {
    translate(plan, plan.period, start.force_W, start.force_W, to);
    return to;
  }
  const auto force_W = [&](const RigidLoad& load, const Vec3& g) {
    return add(load.force_W, multiply(R_WB, multiply(rotation_of_gibbs(g), load.force_B)));
  };
  translate(plan, plan.period, force_W(start, {}), force_W(middle, rotation.g_middle),
            force_W(end, rotation.g_end), to);
  return to;
}

}  // namespace

Frame advance_frame(const StepPlan& plan, const Frame& from, const Mat3& R_WB,
                    const RigidLoads& loads) noexcept {
  const auto by_flows = [&](Frame& to) {
    // a tick is advanced by the composition only if it is long   (THEORY 7.24, 7.25)
    const TickRotation tick = rotation_in_tick(plan, from, R_WB, loads);
    if (tick.total <= kShortRotation && tick.orbit <= kShortOrbit) return false;
    to = advance_by_flows(plan, from, R_WB, loads, substeps_for(tick.substep_angle));
    return true;
  };
  Frame to;
  const bool may_fall = plan.attractor_mu > 0.0 && may_orbit_far(plan, from);
  if (!plan.has_rotation) return may_fall && by_flows(to) ? to : slide(plan, from, R_WB, loads);
  const Vec3 H_B = multiply_transposed(R_WB, from.H_W);
  const bool may_rotate =
      !is_surely_short(plan, H_B, loads.wheels) &&
      may_rotate_far(plan, multiply(plan.inverse_inertia, sub(H_B, loads.wheels.h[0])), H_B, loads.wheels);
  if ((may_fall || may_rotate) && by_flows(to)) return to;
  const StepRotation rotation = rotation_in_step(plan, from, R_WB, H_B, loads);
  // Loads may make a body fast that is slow at the start of the tick, so the test is repeated with the
  // rotation that was computed.
  if (!is_zero(rotation.H_gain)) {
    const Vec3 H = add(H_B, rotation.H_gain);
    if (!is_surely_short(plan, H, loads.wheels) &&
        may_rotate_far(plan, scale(2.0 / plan.period, rotation.g_end), H, loads.wheels) && by_flows(to))
      return to;
  }
  return apply(plan, from, R_WB, loads, rotation);
}

}  // namespace freeflex
