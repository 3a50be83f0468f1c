#include "core/plan/modes/propagator.hpp"

#include <bit>
#include <boost/multiprecision/cpp_bin_float.hpp>
#include <cassert>
#include <cstdint>
#include <map>

namespace freeflex {
namespace {

// The computation uses 120 digits, because the divisions below lose at most 48 digits and nearly equal roots
// lose 16 more.
using Real =
    boost::multiprecision::number<boost::multiprecision::cpp_bin_float<120>, boost::multiprecision::et_off>;

/// Holds the response of one mode over a step of unit length, W = omega h, a = decay h: P11 = P_qq = 1 - W^2
/// S (THEORY 6.2), the impulse response g at the end of the step, its integral S, the integral R of S and the
/// integral T of R. The last four are the divided differences g = exp[z+, z-], S = exp[z+, z-, 0], R =
/// exp[z+, z-, 0, 0] and T = exp[z+, z-, 0, 0, 0] with z+, z- = -a +- sqrt(a^2 - W^2) (THEORY 6.4, 12.14).
struct UnitStep {
  Real P11, g, S, R, T;
};

/// Returns the size of a term at which a series is truncated.
const Real& smallest_term() {
  static const Real kSmallest("1e-130");
  return kSmallest;
}

/// Returns the response for small W and a, by a Taylor series of the impulse response. This series needs no
/// square root.
UnitStep from_series(const Real& W, const Real& a) {
  UnitStep unit{0, 0, 0, 0, 0};
  const Real W2 = W * W, a2 = 2 * a;
  Real term = 1, before = 0;  // h_j / (j+1)!, h_(j-1) / j! with h_(j+1) = -2 a h_j - W^2 h_(j-1)
  for (int j = 0; j < 300; ++j) {
    const Real S = term / (j + 2), R = S / (j + 3);
    unit.g += term;
    unit.S += S;
    unit.R += R;
    unit.T += R / (j + 4);
    if (abs(term) + abs(before) / (j + 1) < smallest_term()) break;
    const Real next = -(a2 * term + W2 * before / (j + 1)) / (j + 2);
    before = term;
    term = next;
  }
  unit.P11 = 1 - W2 * unit.S;
  return unit;
}

/// Returns the response for W >= 1 and any damping, by exponential and trigonometric functions.
UnitStep from_roots(const Real& W, const Real& a) {
  UnitStep unit;
  if (W > a) {
    const Real B = sqrt((W - a) * (W + a));
    unit.g = exp(-a) * sin(B) / B;
    unit.P11 = exp(-a) * cos(B) + a * unit.g;
  } else if (W == a) {
    unit.g = exp(-a);
    unit.P11 = exp(-a) * (1 + a);
  } else {
    const Real D = sqrt((a - W) * (a + W)), fast = a + D, slow = W * W / fast;
    unit.g = (exp(-slow) - exp(-fast)) / (2 * D);
    unit.P11 = exp(-slow) + slow * unit.g;
  }
  unit.S = (1 - unit.P11) / (W * W);
  unit.R = (1 - unit.g - 2 * a * unit.S) / (W * W);
  unit.T = (Real(0.5) - unit.S - 2 * a * unit.R) / (W * W);
  return unit;
}

/// Returns (1 - exp(-x)) / x.
Real mean_decay(const Real& x) {
  if (x >= 1) return (1 - exp(-x)) / x;
  Real sum = 0, term = 1;
  for (int j = 1; abs(term) > smallest_term(); ++j) {
    sum += term / j;
    term *= -x / j;
  }
  return sum;
}

/// Returns (x - 1 + exp(-x)) / x^2.
Real mean_ramp(const Real& x) {
  if (x >= 1) return (x - 1 + exp(-x)) / (x * x);
  Real sum = 0, term = 1;
  for (int j = 1; abs(term) > smallest_term(); ++j) {
    sum += term / (j * (j + 1));
    term *= -x / j;
  }
  return sum;
}

/// Returns (x^2 / 2 - x + 1 - exp(-x)) / x^3.
Real mean_square(const Real& x) {
  if (x >= 1) return (x * x / 2 - x + 1 - exp(-x)) / (x * x * x);
  Real sum = 0, term = 1;
  for (int j = 1; abs(term) > smallest_term(); ++j) {
    sum += term / (j * (j + 1) * (j + 2));
    term *= -x / j;
  }
  return sum;
}

/// Returns the response for W < 1 <= a, including W = 0, by divided differences over the two real roots.
/// These roots are well separated.
UnitStep from_decays(const Real& W, const Real& a) {
  const Real D = sqrt((a - W) * (a + W)), fast = a + D, slow = W * W / fast;
  UnitStep unit;
  unit.g = (exp(-slow) - exp(-fast)) / (2 * D);
  unit.P11 = exp(-slow) + slow * unit.g;
  unit.S = (mean_decay(slow) - mean_decay(fast)) / (2 * D);
  unit.R = (mean_ramp(slow) - mean_ramp(fast)) / (2 * D);
  unit.T = (mean_square(slow) - mean_square(fast)) / (2 * D);
  return unit;
}

/// Returns the response over a step of length h. Each thread keeps the last ones, because plans of one
/// structure are compiled several times, and in campaigns thousands of times.
UnitStep unit_step(double omega, double decay, double h) {
  constexpr std::size_t kMostKept = 4096;  // of some 500 bytes each
  thread_local std::map<std::array<double, 3>, UnitStep> kept;
  const auto known = kept.find({omega, decay, h});
  if (known != kept.end()) return known->second;
  const Real W = Real(omega) * h, a = Real(decay) * h;
  const UnitStep unit = W >= 1 ? from_roots(W, a) : a < 1 ? from_series(W, a) : from_decays(W, a);
  if (kept.size() >= kMostKept) kept.clear();
  return kept[{omega, decay, h}] = unit;
}

/// Splits P into its leading 26 bits C and the rest L, which is rounded to double: P = C + L (THEORY 6.5).
void split(const Real& P, double& leading, double& rest) {
  constexpr std::uint64_t kMask = ~((std::uint64_t{1} << 27) - 1);
  leading = std::bit_cast<double>(std::bit_cast<std::uint64_t>(P.convert_to<double>()) & kMask);
  rest = (P - Real(leading)).convert_to<double>();
}

/// Writes the four entries of the matrix scale * (mu_k I + nu_k h L) in the order of PlanCoupled::Entry,
/// where I is the 2 x 2 identity and L = [0, 1; -omega^2, -2 decay] (THEORY 12.14).
/// \param alpha, beta  [-] mu_k and nu_k
/// \param W, a  [-] omega h and decay h
void put(const Real& alpha, const Real& beta, const Real& W, const Real& a, const Real& h, const Real& scale,
         double* entries) {
  entries[PlanCoupled::kQq] = Real(scale * alpha).convert_to<double>();
  entries[PlanCoupled::kQv] = Real(scale * beta * h).convert_to<double>();
  entries[PlanCoupled::kVq] = Real(-scale * beta * W * W / h).convert_to<double>();
  entries[PlanCoupled::kVv] = Real(scale * (alpha - 2 * a * beta)).convert_to<double>();
}

}  // namespace

ModeFunctions mode_functions(double omega, double decay, double period) {
  ModeFunctions all{};
  const auto entries = [&](PlanCoupled::Function function) {
    return all.data() + PlanCoupled::kNumEntries * std::size_t{function};
  };
  const Real h(period), half = h / 2;
  for (const Real& t : {half, h}) {
    const Real W = Real(omega) * t, a = Real(decay) * t;
    const UnitStep unit = unit_step(omega, decay, t.convert_to<double>());
    const bool is_half = t < h;
    // the nu_k for k = 0 to 3 are g, S, R, T; mu_0 - 1 = -W^2 nu_1, mu_k = nu_(k-1) + 2 a nu_k
    // (THEORY 12.14)
    put(-(W * W * unit.S), unit.g, W, a, t, 1,
        entries(is_half ? PlanCoupled::kHalfStep : PlanCoupled::kStep));
    const Real alpha_1 = unit.g + 2 * a * unit.S, alpha_2 = unit.S + 2 * a * unit.R;
    if (is_half) {
      put(alpha_1, unit.S, W, a, t, t, entries(PlanCoupled::kHalf1));
      put(alpha_2, unit.R, W, a, t, h, entries(PlanCoupled::kHalf2));
      continue;
    }
    put(alpha_1, unit.S, W, a, t, t, entries(PlanCoupled::kStep1));
    put(alpha_2, unit.R, W, a, t, t, entries(PlanCoupled::kStep2));
    put(unit.R + 2 * a * unit.T, unit.T, W, a, t, t, entries(PlanCoupled::kStep3));
  }
  return all;
}

void set_mode(Propagator& propagator, int index, double omega, double decay, double period, double mass) {
  assert(omega >= 0.0 && decay >= 0.0 && period > 0.0 && mass > 0.0);
  const Real h(period), W = Real(omega) * h, a = Real(decay) * h, M(mass);
  const UnitStep unit = unit_step(omega, decay, period);
  Propagator::Lanes& lanes = propagator.lanes[static_cast<std::size_t>(index) / kLanes];
  const std::size_t l = static_cast<std::size_t>(index) % kLanes;
  split(unit.P11, lanes.c_qq[l], lanes.l_qq[l]);
  split(h * unit.g, lanes.c_qv[l], lanes.l_qv[l]);
  split(-(W * W) * unit.g / h, lanes.c_vq[l], lanes.l_vq[l]);
  split(unit.P11 - 2 * a * unit.g, lanes.c_vv[l], lanes.l_vv[l]);
  lanes.w_q0[l] = Real(h * h * unit.S / M).convert_to<double>();
  lanes.w_q1[l] = Real(h * h * unit.R / M).convert_to<double>();
  lanes.w_v0[l] = Real(h * unit.g / M).convert_to<double>();
  lanes.w_v1[l] = Real(h * unit.S / M).convert_to<double>();
}

void drop_damping(Propagator& propagator) {
  for (const Propagator::Lanes& p : propagator.lanes)
    propagator.undamped.push_back(
        {p.c_qq, p.c_qv, p.l_qq, p.l_qv, p.w_q0, p.w_q1, p.c_vq, p.l_vq, p.w_v0, p.w_v1});
  propagator.lanes.clear();
}

}  // namespace freeflex
