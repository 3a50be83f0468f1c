#include "core/step/rigid/tick_rotation.hpp"

#include <algorithm>

#include "core/step/rigid/kepler.hpp"

namespace freeflex {
namespace {

/// Returns a bound on each component of the moment of a load, for any attitude of the body [N m], in
/// principal axes.
Vec3 most_of(const RigidLoad& load, const Mat3& R_PB) noexcept {
  Vec3 most = multiply(R_PB, load.torque_B);
  for (double& each : most) each = magnitude(each);
  if (!load.has_moment_W) return most;
  for (std::size_t c = 0; c < 3; ++c) {
    double square = 0.0;
    for (std::size_t i = 0; i < 9; ++i) {
      double entry = 0.0;
      for (std::size_t b = 0; b < 3; ++b) entry += R_PB[3 * c + b] * load.moment_W[9 * b + i];
      square += entry * entry;
    }
    constexpr double kRootThree = 1.7320508075688772;  // root of the sum of the squares of the nine entries
                                                       // of a rotation matrix
    most[c] += kRootThree * __builtin_sqrt(square);
  }
  return most;
}

/// Returns bounds of the components of the moment over a tick [N m].
Vec3 most_moment(const RigidLoads& loads, const Mat3& R_PB) noexcept {
  Vec3 most = most_of(loads.start, R_PB);
  if (!loads.later) return most;
  for (const RigidLoad* load : {&loads.middle(), &loads.end()}) {
    const Vec3 other = most_of(*load, R_PB);
    for (std::size_t i = 0; i < 3; ++i) most[i] = std::max(most[i], other[i]);
  }
  return most;
}

/// Holds quantities that are conserved in free motion and bound the rates of the body, in principal axes. The
/// largest changes that loads and motors may cause in a tick are added.
struct Conserved {
  double root = 0.0;      // [sqrt(J)] sqrt(2 E_rot)
  double momentum = 0.0;  // [N m s] |H|
  Vec3 wheels{};          // [N m s] largest magnitude of each component of the momentum of the wheels
  int num_axes = 0;       // number of principal axes along which body or wheels have angular momentum
};

Conserved conserved(const StepPlan& plan, const Vec3& H, const Vec3& L,
                    const WheelMomentum& wheels) noexcept {
  Conserved all;
  double energy = 0.0, gain = 0.0;
  std::array<Vec3, 4> h;
  for (std::size_t k = 0; k < h.size(); ++k) h[k] = multiply(plan.principal.R_PB, wheels.h[k]);
  for (std::size_t i = 0; i < 3; ++i) {
    const double inverse = plan.principal.inverse_moment[i], own = H[i] - h[0][i];
    const double driven = magnitude(h[1][i]) + magnitude(h[2][i]) + magnitude(h[3][i]);
    const double push = L[i] * plan.period + driven;
    energy += inverse * own * own;
    gain += inverse * push * push;
    all.wheels[i] = magnitude(h[0][i]) + driven;
    all.num_axes += H[i] != 0.0 || all.wheels[i] != 0.0 ? 1 : 0;
  }
  all.root = __builtin_sqrt(energy) + __builtin_sqrt(gain);
  all.momentum = length(H) + length(L) * plan.period;
  return all;
}

/// Returns a bound on the rate of the body relative to its rotation about the angular momentum [rad/s]. It is
/// the sum of bounds u_i on the rates about the principal axes, plus a bound on the nutation rate. Here
/// d_i = 1/I_i - 1/I_2:
///   sum_i u_i + (|H| sum_(i != j) |d_i| u_j)^(1/2)   (THEORY 7.22)
///   u_i = min(|d_i| (2 E_rot I_i)^(1/2) + |h_i| / I_2, |d_i| |H| + |h_i| / I_i)   (THEORY 7.23)
double relative_rate(const StepPlan& plan, const Conserved& all) noexcept {
  const Vec3& inverse = plan.principal.inverse_moment;
  Vec3 d{}, u{};
  for (std::size_t i = 0; i < 3; ++i) {
    d[i] = magnitude(inverse[i] - inverse[1]);
    u[i] = d[i] * all.momentum + inverse[i] * all.wheels[i];
    if (inverse[i] > 0.0)
      u[i] = std::min(u[i], d[i] * all.root / __builtin_sqrt(inverse[i]) + inverse[1] * all.wheels[i]);
  }
  const double products = (d[1] + d[2]) * u[0] + (d[0] + d[2]) * u[1] + (d[0] + d[1]) * u[2];
  return u[0] + u[1] + u[2] + __builtin_sqrt(all.momentum * products);
}

/// Holds the smallest distance from an attractor in a tick [m], and the angle of the orbit in a tick at the
/// angular rate at that distance [rad].
struct Nearest {
  double distance, orbit;
};
/// Returns the smallest distance r_min and the angle of the orbit. The angular rate is that of a circular
/// orbit at r_min or that of the actual orbit at r_min, whichever is larger:
///   orbit = h max((mu / r_min^3)^(1/2), |rho x v| / r_min^2)   (THEORY 7.25)
/// If the body passes the pericentre in the tick, r_min is p / (1 + e). Otherwise r_min is the smaller of the
/// distances at the two ends of the tick   (THEORY 7.26).
Nearest nearest_in_tick(const StepPlan& plan, const Frame& from) noexcept {
  const Vec3 rho = sub(from.p_WB, plan.attractor_W), &v = from.v_WB;
  const double mu = plan.attractor_mu, h = plan.period, r = length(rho);
  const Fall gain = fall(mu, rho, v, h);
  const Vec3 rho_end = add(rho, gain.p);
  double nearest = std::min(r, length(rho_end));
  const Vec3 momentum = cross(rho, v);
  constexpr double kTwoPi = 6.2831853071795862;
  const double beta = 2.0 * mu / r - dot(v, v);  // mu over the semi-major axis
  const bool is_closed = beta > 0.0 && kTwoPi * mu <= h * beta * __builtin_sqrt(beta);
  if (is_closed || (dot(rho, v) < 0.0 && dot(rho_end, add(v, gain.v)) > 0.0)) {
    // The body passes the pericentre in this tick, at the distance p / (1 + e).
    const double p = dot(momentum, momentum) / mu;
    nearest = p / (1.0 + __builtin_sqrt(std::max(0.0, 1.0 - beta * p / mu)));
  }
  const double circle = __builtin_sqrt(mu / (nearest * nearest * nearest)),
               own = length(momentum) / (nearest * nearest);
  return {nearest, h * std::max(circle, own)};
}

}  // namespace

TickRotation rotation_in_tick(const StepPlan& plan, const Frame& from, const Mat3& R_WB,
                              const RigidLoads& loads) noexcept {
  TickRotation rotation;
  bool is_loaded = false;
  if (plan.has_rotation) {
    const Mat3& R_PB = plan.principal.R_PB;
    const Vec3 L = most_moment(loads, R_PB), H = multiply(R_PB, multiply_transposed(R_WB, from.H_W));
    const Conserved all = conserved(plan, H, L, loads.wheels);
    const double relative = relative_rate(plan, all) * plan.period;
    is_loaded = !is_zero(L);
    rotation.total = plan.principal.inverse_moment[1] * all.momentum * plan.period + relative;
    // free spin about a principal axis is exact in one substep   (THEORY 7.21)
    if (is_loaded)
      rotation.substep_angle = rotation.total;
    else if (all.num_axes > 1)
      rotation.substep_angle = relative;
  }
  if (plan.attractor_mu > 0.0) {
    const Nearest nearest = nearest_in_tick(plan, from);
    rotation.orbit = nearest.orbit;
    rotation.nearest = nearest.distance;
    const auto is_pushed = [](const RigidLoad& load) {
      return !is_zero(load.force_W) || !is_zero(load.force_B);
    };
    const Vec3& inverse = plan.principal.inverse_moment;
    // the gradient exerts no torque on a body with three equal moments
    const bool is_rotated = plan.has_rotation && inverse[0] != inverse[2];
    if (is_rotated || is_pushed(loads.start) || is_pushed(loads.middle()) || is_pushed(loads.end()))
      rotation.substep_angle += 2.0 * rotation.orbit;
  }
  return rotation;
}

bool may_rotate_far(const StepPlan& plan, const Vec3& w, const Vec3& H,
                    const WheelMomentum& wheels) noexcept {
  // The bound includes the spin, its change due to motors, and the nutation due to the momentum of body and
  // wheels. The rate of nutation is at most |H| divided by the root of the product of two principal moments
  // of inertia.
  constexpr double kMost = kShortRotation / 3.0;
  const Vec3& inverse = plan.principal.inverse_moment;
  double square = dot(w, w) + 4.0 * inverse[0] * inverse[1] * dot(H, H);
  if (!plan.wheels.empty()) {
    const auto& h = wheels.h;
    square +=
        4.0 * inverse[0] *
        (inverse[1] * dot(h[0], h[0]) + inverse[0] * (dot(h[1], h[1]) + dot(h[2], h[2]) + dot(h[3], h[3])));
  }
  return 2.0 * square * plan.period * plan.period > kMost * kMost;
}

bool may_orbit_far(const StepPlan& plan, const Frame& from) noexcept {
  if (plan.attractor_mu == 0.0) return false;
  // [-] ratio of the distance travelled in the tick to the distance from the attractor, above which the field
  // may change much in the tick
  constexpr double kShortWay = 0.1;
  const Vec3 rho = sub(from.p_WB, plan.attractor_W);
  const double square = dot(rho, rho), h = plan.period;
  return plan.attractor_mu * h * h > kShortOrbit * kShortOrbit * square * __builtin_sqrt(square) ||
         dot(from.v_WB, from.v_WB) * h * h > kShortWay * kShortWay * square;
}

int substeps_for(double angle) noexcept {
  if (!(angle < kSubstepRotation * kMaxRotationSubsteps)) return kMaxRotationSubsteps;
  const double wanted = angle / kSubstepRotation;
  const int below = static_cast<int>(wanted);
  return std::max(1, below < wanted ? below + 1 : below);
}

}  // namespace freeflex
