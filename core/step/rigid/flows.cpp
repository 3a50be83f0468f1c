#include "core/step/rigid/flows.hpp"

#include <algorithm>

#include "core/step/energy.hpp"
#include "core/step/loads/field.hpp"
#include "core/step/loads/history.hpp"
#include "core/step/rigid/kepler.hpp"

namespace freeflex {
namespace {

/// Fractions of a substep that the 17 symmetric steps of order 2 take. Together these steps form a substep of
/// order 8 (Kahan and Li 1997). The second half of the fractions mirrors the first half   (THEORY 7.18).
constexpr std::size_t kSteps = 17;
constexpr std::array<double, 9> kHalf{0.13020248308889008, 0.56116298177510838,  -0.38947496264484729,
                                      0.15884190655515560, -0.39590389413323758, 0.18453964097831571,
                                      0.25837438768632205, 0.29501172360931030,  -0.60550853383003451};
constexpr double share_of_step(std::size_t k) noexcept { return kHalf[std::min(k, kSteps - 1 - k)]; }

/// Holds the cosine and the sine of half an angle [-].
struct HalfAngle {
  double c, s;
};
HalfAngle half_angle(double angle) noexcept {
  constexpr double kShift = 6755399441055744.0;            // 1.5 * 2^52: adding it rounds to a whole number
  constexpr double kCyclesPerHalf = 0.079577471545947667;  // 1 / (4 pi)
  const double cycles = angle * kCyclesPerHalf;
  const double x = cycles - ((cycles + kShift) - kShift);
  return {sine_of_cycles(0.25 + x), sine_of_cycles(x)};
}

Mat3 matrix_of_flow(const Quat& q) noexcept {
  const double w = q[0], x = q[1], y = q[2], z = q[3];
  return {1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - w * z),       2.0 * (x * z + w * y),
          2.0 * (x * y + w * z),       1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - w * x),
          2.0 * (x * z - w * y),       2.0 * (y * z + w * x),       1.0 - 2.0 * (x * x + y * y)};
}

/// Holds the moment of the loads about the centre of mass, in principal axes, as a function of the rotation G
/// of the body since the start of the tick:
///   L_P,c = torque_P,c + sum_ak G_ka table[9c+3a+k]   (THEORY 8.3)
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
    // the coefficients of component c of the moment: a 3 x 3 matrix with rows in body axes and columns in
    // world axes
    Mat3 of_c{};
    for (std::size_t b = 0; b < 3; ++b)
      for (std::size_t i = 0; i < 9; ++i) of_c[i] += R_PB[3 * c + b] * load.moment_W[9 * b + i];
    const Mat3 rows = multiply(R_PB, of_c);
    for (std::size_t a = 0; a < 3; ++a) {
      const Vec3 rotated = multiply(R_PW, Vec3{rows[3 * a], rows[3 * a + 1], rows[3 * a + 2]});
      for (std::size_t k = 0; k < 3; ++k) moment.table[9 * c + 3 * a + k] = rotated[k];
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

/// Holds the weights at the time s of a tick (0 to 1) of the values at its start, middle and end, in the
/// parabola through these values:
///   (1 - s) (1 - 2 s),   4 s (1 - s),   s (2 s - 1)   (THEORY 7.11)
struct Shares {
  double start, middle, end;
};
constexpr Shares shares_at(double s) noexcept {
  return {(1.0 - s) * (1.0 - 2.0 * s), 4.0 * s * (1.0 - s), s * (2.0 * s - 1.0)};
}

/// Advances the body by a tick as a composition of exact motions, in principal axes. G transforms vectors
/// from the present axes to the axes at the start of the tick. The rotational energy is split into a sum. Its
/// first term alone would rotate the body about the angular momentum, and term i of the sum alone about the
/// principal axis i, with d_i = 1/I_i - 1/I_2   (THEORY 7.14):
///   E_rot = |H|^2 / (2 I_2) + sum_i (d_i H_i^2 / 2 - h_i H_i / I_i) + const
class Flows {
 public:
  Flows(const StepPlan& plan, const Frame& from, const Mat3& R_WB, const RigidLoads& loads) noexcept
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
    for (const Vec3& each : h_.h) rotates_about_middle_ = rotates_about_middle_ || each[1] != 0.0;
    is_attracted_ = plan.attractor_mu > 0.0;
    moments_[0] = moment_of(loads.start, R_WB, R_PB_);
    if (loads.later) {
      moments_[1] = moment_of(loads.middle(), R_WB, R_PB_);
      moments_[2] = moment_of(loads.end(), R_WB, R_PB_);
    }
    const auto loads_it = [](const RigidLoad& load) {
      return load.has_moment_W || !is_zero(load.torque_B) || !is_zero(load.force_B);
    };
    has_impulses_ = (is_attracted_ && plan.has_rotation) || loads_it(loads.start) ||
                    (loads.later && (loads_it(loads.middle()) || loads_it(loads.end())));
    falls_with_loads_ =
        is_attracted_ && (has_impulses_ || !is_zero(loads.start.force_W) || loads.later.has_value());
    rho_ = sub(from.p_WB, plan.attractor_W);
    v_ = from.v_WB;
    gain_.p = from.p_WB_low, gain_.v = from.v_WB_low;
  }

  /// Returns true if loads act as impulses between the symmetric steps.
  bool needs_impulses() const noexcept { return has_impulses_ || falls_with_loads_; }

  /// Applies the impulse of the loads over a time D, which is the fraction `share` of the tick. The loads are
  /// those at the time s of the tick (0 to 1):
  ///   H_A += D G L_B,   v_WB += D F_W / M   (THEORY 7.19)
  /// Without an attractor, the impulses of the force are summed to mean_force and weighted_force, which
  /// translate applies.
  void apply_impulse(double share, double s) noexcept {
    const double h = share * plan_.period;
    const Mat3 G = matrix_of_flow(rotation_);
    const Shares w = loads_.later ? shares_at(s) : Shares{1.0, 0.0, 0.0};
    Vec3 L = scale(w.start, at(moments_[0], G));
    if (loads_.later) L = add_scaled(add_scaled(L, w.middle, at(moments_[1], G)), w.end, at(moments_[2], G));
    if (is_attracted_ && plan_.has_rotation) L = add(L, field_moment(G));
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

  /// Moves the body without loads from the time s of the tick (0 to 1) over a time D, which is the fraction
  /// `share` of the tick. The symmetric step rotates the body about the principal axes 2, 3, 1, 3, 2 in this
  /// order (THEORY 7.17). The rate about axis i is
  ///   rate_i = d_i H_i - h_i / I_i   (THEORY 7.16)
  /// The rotation about axis 1 lasts D, each of the other rotations D / 2. If loads act, the rotation about
  /// the angular momentum follows. Otherwise finish() makes it for the whole tick   (THEORY 7.15).
  void move(double share, double s) noexcept {
    const double t = share * plan_.period;
    if (is_attracted_ && falls_with_loads_) fall_for(t);
    if (!plan_.has_rotation) return;
    const Vec3 h = h_.at(s + 0.5 * share);
    const Vec3& inverse = plan_.principal.inverse_moment;
    const auto about = [&](std::size_t axis, double fraction) {
      const double rate = difference_[axis] * H_[axis] - inverse[axis] * h[axis];
      if (rate != 0.0) rotate_about(axis, fraction * t * rate);
    };
    if (rotates_about_middle_) about(1, 0.5);
    about(2, 0.5);
    about(0, 1.0);
    about(2, 0.5);
    if (rotates_about_middle_) about(1, 0.5);
    if (needs_impulses()) rotate_with_momentum(t);
  }

  /// Applies the motion of the tick to the frame `to`. On entry, `to` holds the frame at the start of the
  /// tick.
  void finish(Frame& to) noexcept {
    if (plan_.has_rotation) {
      if (!needs_impulses()) rotate_with_momentum(plan_.period);
      const double norm = __builtin_sqrt(rotation_[0] * rotation_[0] + rotation_[1] * rotation_[1] +
                                         rotation_[2] * rotation_[2] + rotation_[3] * rotation_[3]);
      const Vec3 axis = multiply_transposed(R_PB_, Vec3{rotation_[1], rotation_[2], rotation_[3]});
      add_rotation({rotation_[0] / norm - 1.0, axis[0] / norm, axis[1] / norm, axis[2] / norm}, to);
      const Vec3 H_gain = multiply(R_WB_, multiply_transposed(R_PB_, H_gain_));
      for (std::size_t i = 0; i < 3; ++i) add_compensated(to.H_W[i], to.H_W_low[i], H_gain[i]);
    }
    if (is_attracted_) {
      if (!falls_with_loads_) fall_for(plan_.period);
      to.p_WB_low = to.v_WB_low = {};  // gain_ already contains the low parts
      for (std::size_t i = 0; i < 3; ++i) {
        add_compensated(to.p_WB[i], to.p_WB_low[i], gain_.p[i]);
        add_compensated(to.v_WB[i], to.v_WB_low[i], gain_.v[i]);
      }
    }
  }

  Vec3 mean_force{}, weighted_force{};  // [N] arguments of translate; used only without an attractor

 private:
  Vec3 force_W(const RigidLoad& load, const Mat3& G) const noexcept {
    if (is_zero(load.force_B)) return load.force_W;
    const Vec3 force_P = multiply(G, multiply(R_PB_, load.force_B));
    return add(load.force_W, multiply(R_WB_, multiply_transposed(R_PB_, force_P)));
  }

  /// Returns the moment due to the gravity gradient of an attractor   (THEORY 8.20), principal axes.
  Vec3 field_moment(const Mat3& G) const noexcept {
    const Vec3 start = multiply(R_PB_, multiply_transposed(R_WB_, add(rho_, gain_.p)));
    const Vec3 rho_B = multiply_transposed(R_PB_, multiply_transposed(G, start));
    return multiply(R_PB_, gradient_torque(plan_, rho_B));
  }

  /// Advances the position and the velocity by free fall over a time t [s]   (THEORY 7.29).
  void fall_for(double t) noexcept {
    const Fall more = fall(plan_.attractor_mu, add(rho_, gain_.p), add(v_, gain_.v), t);
    gain_.p = add(gain_.p, more.p);
    gain_.v = add(gain_.v, more.v);
  }

  /// Rotates the body about a principal axis. The components of the angular momentum in the body rotate by
  /// the opposite angle (THEORY 7.16).
  void rotate_about(std::size_t axis, double angle) noexcept {
    const auto [c, s] = half_angle(angle);
    const std::size_t j = (axis + 1) % 3, k = (axis + 2) % 3;
    const double cosine = 1.0 - 2.0 * s * s, sine = 2.0 * s * c;
    const double x = H_[j], y = H_[k];
    H_[j] = cosine * x + sine * y;
    H_[k] = cosine * y - sine * x;
    Quat by{c, 0.0, 0.0, 0.0};
    by[1 + axis] = s;
    rotation_ = multiply(rotation_, by);
  }

  /// Rotates the body about its angular momentum by |H| t / I_2. The components of the angular momentum in
  /// the body do not change (THEORY 7.15).
  void rotate_with_momentum(double t) noexcept {
    const double H = length(H_start_);
    if (H == 0.0) return;
    const auto [c, s] = half_angle(common_ * H * t);
    const Vec3 axis = scale(s / H, H_start_);
    rotation_ = multiply(Quat{c, axis[0], axis[1], axis[2]}, rotation_);
  }

  const StepPlan& plan_;
  const RigidLoads& loads_;
  Mat3 R_PB_, R_WB_;
  double common_ = 0.0;  // [1/(kg m^2)] 1 / I_2
  Vec3 difference_{};    // [1/(kg m^2)] d_i = 1 / I_i - 1 / I_2
  WheelMomentum h_;      // [N m s] momentum of the wheels over the tick, principal axes
  std::array<Moment, 3> moments_{};
  bool has_impulses_ = false, is_attracted_ = false, falls_with_loads_ = false, rotates_about_middle_ = false;
  Quat rotation_{1.0, 0.0, 0.0, 0.0};
  Vec3 H_start_, H_, H_gain_{};  // [N m s] H now, in the axes at the start; H now, in the present axes;
                                 // change of H, in the axes at the start
  Vec3 rho_{}, v_{};  // [m], [m/s] position relative to the attractor, and velocity, at the start of the tick
  Fall gain_{};
};

}  // namespace

Frame advance_by_flows(const StepPlan& plan, const Frame& from, const Mat3& R_WB, const RigidLoads& loads,
                       int substeps) noexcept {
  Frame to = from;
  Flows flows(plan, from, R_WB, loads);
  const double fraction = 1.0 / substeps;
  // Each symmetric step begins and ends with half of its impulse. The second half is applied together with
  // the first half of the next step, so `before` keeps the length of the previous step. Lengths are fractions
  // of the tick.
  double before = 0.0;
  for (int n = 0; n < substeps; ++n) {
    double s = n * fraction;
    for (std::size_t k = 0; k < kSteps; ++k) {
      const double share = share_of_step(k) * fraction;
      if (flows.needs_impulses()) flows.apply_impulse(0.5 * (before + share), s);
      flows.move(share, s);
      s += share;
      before = share;
    }
  }
  if (flows.needs_impulses()) flows.apply_impulse(0.5 * before, 1.0);
  flows.finish(to);
  if (plan.has_rotation && !flows.needs_impulses() && !loads.wheels.is_driven())
    restore_energy(plan, from, loads.wheels.h[0], to);
  if (plan.attractor_mu > 0.0) return to;
  if (flows.needs_impulses())
    translate(plan, plan.period, flows.mean_force, flows.weighted_force, to);
  else if (loads.later)
    translate(plan, plan.period, loads.start.force_W, loads.middle().force_W, loads.end().force_W, to);
  else
    translate(plan, plan.period, loads.start.force_W, loads.start.force_W, to);
  return to;
}

}  // namespace freeflex
