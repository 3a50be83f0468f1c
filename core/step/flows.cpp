#include "core/step/flows.hpp"

#include <algorithm>

#include "core/step/energy.hpp"
#include "core/step/field.hpp"
#include "core/step/history.hpp"
#include "core/step/kepler.hpp"

namespace freeflex {
namespace {

/// Kahan and Li 1997: 17 symmetric steps of order 2 make one of order 8; the other half mirrors this one.
constexpr std::size_t kSteps = 17;
constexpr std::array<double, 9> kHalf{0.13020248308889008, 0.56116298177510838,  -0.38947496264484729,
                                      0.15884190655515560, -0.39590389413323758, 0.18453964097831571,
                                      0.25837438768632205, 0.29501172360931030,  -0.60550853383003451};
constexpr double share_of_step(std::size_t k) noexcept { return kHalf[std::min(k, kSteps - 1 - k)]; }

/// Cosine and sine of half an angle [rad].
struct HalfTurn {
  double c, s;
};
HalfTurn half_turn(double angle) noexcept {
  constexpr double kShift = 6755399441055744.0;            // 1.5 * 2^52: adding it rounds to a whole number
  constexpr double kCyclesPerHalf = 0.079577471545947667;  // 1 / (4 pi)
  const double cycles = angle * kCyclesPerHalf;
  const double x = cycles - ((cycles + kShift) - kShift);
  return {sine_of_cycles(0.25 + x), sine_of_cycles(x)};
}

Mat3 rotation_of(const Quat& q) noexcept {
  const double w = q[0], x = q[1], y = q[2], z = q[3];
  return {1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - w * z),       2.0 * (x * z + w * y),
          2.0 * (x * y + w * z),       1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - w * x),
          2.0 * (x * z - w * y),       2.0 * (y * z + w * x),       1.0 - 2.0 * (x * x + y * y)};
}

/// Moment about the centre of mass in principal axes as a table over the rotation G since the start, as
/// StepMoment of the frame: L_P,c = torque_P,c + sum_ak G_ka table[9c+3a+k]   (X11).
struct Moment {
  std::array<double, 27> table{};
  Vec3 torque{};
  bool has_table = false;
};

Moment moment_of(const RigidLoad& load, const Mat3& R_WB, const Mat3& R_PB) noexcept {
  Moment moment;
  moment.torque = multiply(R_PB, load.torque_B);
  moment.has_table = load.has_moment_W;
  if (!load.has_moment_W) return moment;
  const Mat3 R_PW =
      multiply(R_PB, {R_WB[0], R_WB[3], R_WB[6], R_WB[1], R_WB[4], R_WB[7], R_WB[2], R_WB[5], R_WB[8]});
  for (std::size_t c = 0; c < 3; ++c) {
    // one component of the moment as a 3 x 3 matrix: rows in body axes, columns in world axes
    Mat3 of_c{};
    for (std::size_t b = 0; b < 3; ++b)
      for (std::size_t i = 0; i < 9; ++i) of_c[i] += R_PB[3 * c + b] * load.moment_W[9 * b + i];
    const Mat3 rows = multiply(R_PB, of_c);
    for (std::size_t a = 0; a < 3; ++a) {
      const Vec3 turned = multiply(R_PW, Vec3{rows[3 * a], rows[3 * a + 1], rows[3 * a + 2]});
      for (std::size_t k = 0; k < 3; ++k) moment.table[9 * c + 3 * a + k] = turned[k];
    }
  }
  return moment;
}

Vec3 at(const Moment& moment, const Mat3& G) noexcept {
  Vec3 sum = moment.torque;
  if (!moment.has_table) return sum;
  for (std::size_t c = 0; c < 3; ++c)
    for (std::size_t a = 0; a < 3; ++a)
      for (std::size_t k = 0; k < 3; ++k) sum[c] += G[3 * k + a] * moment.table[9 * c + 3 * a + k];
  return sum;
}

/// Values at the start, middle and end of a tick on the parabola through them.
struct Shares {
  double start, middle, end;
};
constexpr Shares shares_at(double s) noexcept {
  return {(1.0 - s) * (1.0 - 2.0 * s), 4.0 * s * (1.0 - s), s * (2.0 * s - 1.0)};
}

/// What a tick steps, in principal axes: G turns from those of now to those of the start.
class Flows {
 public:
  Flows(const Plan& plan, const Frame& from, const Mat3& R_WB, const StepLoads& loads) noexcept
      : plan_(plan),
        loads_(loads),
        R_PB_(plan.principal.R_PB),
        R_WB_(R_WB),
        H_start_(multiply(R_PB_, multiply_transposed(R_WB, from.H_W))),
        H_(H_start_) {
    const Vec3& inverse = plan.principal.inverse_moment;
    common_ = inverse[1];
    for (std::size_t i = 0; i < 3; ++i) difference_[i] = inverse[i] - common_;
    for (std::size_t k = 0; k < h_.h.size(); ++k) h_.h[k] = multiply(R_PB_, loads.wheels.h[k]);
    for (const Vec3& each : h_.h) turns_middle_ = turns_middle_ || each[1] != 0.0;
    is_attracted_ = plan.attractor_mu > 0.0;
    moments_[0] = moment_of(loads.start, R_WB, R_PB_);
    if (loads.later) {
      moments_[1] = moment_of(loads.middle(), R_WB, R_PB_);
      moments_[2] = moment_of(loads.end(), R_WB, R_PB_);
    }
    const auto loads_it = [](const RigidLoad& load) {
      return load.has_moment_W || !is_zero(load.torque_B) || !is_zero(load.force_B);
    };
    kicks_ = (is_attracted_ && plan.turns) || loads_it(loads.start) ||
             (loads.later && (loads_it(loads.middle()) || loads_it(loads.end())));
    falls_with_loads_ = is_attracted_ && (kicks_ || !is_zero(loads.start.force_W) || loads.later.has_value());
    rho_ = sub(from.p_WB, plan.attractor_W);
    v_ = from.v_WB;
    gain_.p = from.p_WB_low, gain_.v = from.v_WB_low;
  }

  bool is_kicked() const noexcept { return kicks_ || falls_with_loads_; }

  /// Loads act for a share of the tick, at the instant s of it.
  void kick(double share, double s) noexcept {
    const double h = share * plan_.period;
    const Mat3 G = rotation_of(turn_);
    const Shares w = loads_.later ? shares_at(s) : Shares{1.0, 0.0, 0.0};
    Vec3 L = scale(w.start, at(moments_[0], G));
    if (loads_.later) L = add_scaled(add_scaled(L, w.middle, at(moments_[1], G)), w.end, at(moments_[2], G));
    if (is_attracted_ && plan_.turns) L = add(L, field_moment(G));
    H_ = add_scaled(H_, h, L);
    const Vec3 gain = scale(h, multiply(G, L));
    H_start_ = add(H_start_, gain);
    H_gain_ = add(H_gain_, gain);
    Vec3 F = scale(w.start, force_W(loads_.start, G));
    if (loads_.later)
      F = add_scaled(add_scaled(F, w.middle, force_W(loads_.middle(), G)), w.end, force_W(loads_.end(), G));
    if (is_attracted_) {
      gain_.v = add_scaled(gain_.v, h / plan_.mass, F);
    } else {
      mean_force = add_scaled(mean_force, share, F);
      weighted_force = add_scaled(weighted_force, 2.0 * share * (1.0 - s), F);
    }
  }

  /// Free motion over a share of the tick that starts at the instant s of it.
  void move(double share, double s) noexcept {
    const double t = share * plan_.period;
    if (is_attracted_ && falls_with_loads_) fall_for(t);
    if (!plan_.turns) return;
    const Vec3 h = h_.at(s + 0.5 * share);
    const Vec3& inverse = plan_.principal.inverse_moment;
    const auto about = [&](std::size_t axis, double part) {
      const double rate = difference_[axis] * H_[axis] - inverse[axis] * h[axis];
      if (rate != 0.0) turn_about(axis, part * t * rate);
    };
    if (turns_middle_) about(1, 0.5);
    about(2, 0.5);
    about(0, 1.0);
    about(2, 0.5);
    if (turns_middle_) about(1, 0.5);
    if (is_kicked()) turn_with_momentum(t);
  }

  /// The end of the tick, in a frame that stands at its start.
  void finish(Frame& to) noexcept {
    if (plan_.turns) {
      if (!is_kicked()) turn_with_momentum(plan_.period);
      const double norm = __builtin_sqrt(turn_[0] * turn_[0] + turn_[1] * turn_[1] + turn_[2] * turn_[2] +
                                         turn_[3] * turn_[3]);
      const Vec3 axis = multiply_transposed(R_PB_, Vec3{turn_[1], turn_[2], turn_[3]});
      add_turn({turn_[0] / norm - 1.0, axis[0] / norm, axis[1] / norm, axis[2] / norm}, to);
      const Vec3 H_gain = multiply(R_WB_, multiply_transposed(R_PB_, H_gain_));
      for (std::size_t i = 0; i < 3; ++i) add_compensated(to.H_W[i], to.H_W_low[i], H_gain[i]);
    }
    if (is_attracted_) {
      if (!falls_with_loads_) fall_for(plan_.period);
      to.p_WB_low = to.v_WB_low = {};  // part of the gain
      for (std::size_t i = 0; i < 3; ++i) {
        add_compensated(to.p_WB[i], to.p_WB_low[i], gain_.p[i]);
        add_compensated(to.v_WB[i], to.v_WB_low[i], gain_.v[i]);
      }
    }
  }

  Vec3 mean_force{}, weighted_force{};  // [N] see translate; without an attractor

 private:
  Vec3 force_W(const RigidLoad& load, const Mat3& G) const noexcept {
    if (is_zero(load.force_B)) return load.force_W;
    const Vec3 force_P = multiply(G, multiply(R_PB_, load.force_B));
    return add(load.force_W, multiply(R_WB_, multiply_transposed(R_PB_, force_P)));
  }

  /// Moment of an attractor's gradient (X72), principal axes.
  Vec3 field_moment(const Mat3& G) const noexcept {
    const Vec3 start = multiply(R_PB_, multiply_transposed(R_WB_, add(rho_, gain_.p)));
    const Vec3 rho_B = multiply_transposed(R_PB_, multiply_transposed(G, start));
    return multiply(R_PB_, gradient_torque(plan_, rho_B));
  }

  void fall_for(double t) noexcept {
    const Fall more = fall(plan_.attractor_mu, add(rho_, gain_.p), add(v_, gain_.v), t);
    gain_.p = add(gain_.p, more.p);
    gain_.v = add(gain_.v, more.v);
  }

  /// The body turns about a principal axis, and its momentum the other way about it.
  void turn_about(std::size_t axis, double angle) noexcept {
    const auto [c, s] = half_turn(angle);
    const std::size_t j = (axis + 1) % 3, k = (axis + 2) % 3;
    const double cosine = 1.0 - 2.0 * s * s, sine = 2.0 * s * c;
    const double x = H_[j], y = H_[k];
    H_[j] = cosine * x + sine * y;
    H_[k] = cosine * y - sine * x;
    Quat by{c, 0.0, 0.0, 0.0};
    by[1 + axis] = s;
    turn_ = multiply(turn_, by);
  }

  /// The whole body turns about its momentum, which stays where it is in the body.
  void turn_with_momentum(double t) noexcept {
    const double H = length(H_start_);
    if (H == 0.0) return;
    const auto [c, s] = half_turn(common_ * H * t);
    const Vec3 axis = scale(s / H, H_start_);
    turn_ = multiply(Quat{c, axis[0], axis[1], axis[2]}, turn_);
  }

  const Plan& plan_;
  const StepLoads& loads_;
  Mat3 R_PB_, R_WB_;
  double common_ = 0.0;  // [1/(kg m^2)] inverse moment that all axes share
  Vec3 difference_{};    // and what each has beside it
  WheelMomentum h_;      // [N m s] of the wheels over the tick, principal axes
  std::array<Moment, 3> moments_{};
  bool kicks_ = false, is_attracted_ = false, falls_with_loads_ = false, turns_middle_ = false;
  Quat turn_{1.0, 0.0, 0.0, 0.0};
  Vec3 H_start_, H_, H_gain_{};  // [N m s] axes of the start; of now; of the start
  Vec3 rho_{}, v_{};             // [m], [m/s] at the start
  Fall gain_{};
};

}  // namespace

Frame advance_by_flows(const Plan& plan, const Frame& from, const Mat3& R_WB, const StepLoads& loads,
                       int substeps) noexcept {
  Frame to = from;
  Flows flows(plan, from, R_WB, loads);
  const double part = 1.0 / substeps;
  double before = 0.0;  // half a step waits for its kick
  for (int n = 0; n < substeps; ++n) {
    double s = n * part;
    for (std::size_t k = 0; k < kSteps; ++k) {
      const double share = share_of_step(k) * part;
      if (flows.is_kicked()) flows.kick(0.5 * (before + share), s);
      flows.move(share, s);
      s += share;
      before = share;
    }
  }
  if (flows.is_kicked()) flows.kick(0.5 * before, 1.0);
  flows.finish(to);
  if (plan.turns && !flows.is_kicked() && !loads.wheels.is_driven())
    restore_energy(plan, from, loads.wheels.h[0], to);
  if (plan.attractor_mu > 0.0) return to;
  if (flows.is_kicked())
    translate(plan, plan.period, flows.mean_force, flows.weighted_force, to);
  else if (loads.later)
    translate(plan, plan.period, loads.start.force_W, loads.middle().force_W, loads.end().force_W, to);
  else
    translate(plan, plan.period, loads.start.force_W, loads.start.force_W, to);
  return to;
}

}  // namespace freeflex
