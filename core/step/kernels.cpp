#include "core/step/kernels.hpp"

#include <array>
#include <bit>
#include <cstdint>

namespace freeflex {
namespace {

using Lanes = std::array<double, kLanes>;

double sum_lanes(const Lanes& s) noexcept {
  return ((s[0] + s[1]) + (s[2] + s[3])) + ((s[4] + s[5]) + (s[6] + s[7]));
}

/// The leading 26 bits of y: its product with another 26-bit number is exact.
inline double leading_bits(double y) noexcept {
  constexpr std::uint64_t kMask = ~((std::uint64_t{1} << 27) - 1);
  return std::bit_cast<double>(std::bit_cast<std::uint64_t>(y) & kMask);
}

template <bool kAccumulate>
void combine_rows_to(const double* __restrict rows, const Vec3& f, std::size_t n,
                     double* __restrict y) noexcept {
  const double* __restrict x = rows, * __restrict u = rows + n, * __restrict w = rows + 2 * n;
  const double f0 = f[0], f1 = f[1], f2 = f[2];
  for (std::size_t l = 0; l < n; ++l) {
    const double sum = f0 * x[l] + f1 * u[l] + f2 * w[l];
    y[l] = kAccumulate ? y[l] + sum : sum;
  }
}

template <bool kAccumulate>
void combine_table_to(const double* __restrict t, const Mat3& c, std::size_t n,
                      double* __restrict y) noexcept {
  const double c0 = c[0], c1 = c[1], c2 = c[2], c3 = c[3], c4 = c[4], c5 = c[5], c6 = c[6], c7 = c[7],
               c8 = c[8];
  for (std::size_t l = 0; l < n; ++l) {
    const double sum = (c0 * t[l] + c1 * t[l + n] + c2 * t[l + 2 * n]) +
                       (c3 * t[l + 3 * n] + c4 * t[l + 4 * n] + c5 * t[l + 5 * n]) +
                       (c6 * t[l + 6 * n] + c7 * t[l + 7 * n] + c8 * t[l + 8 * n]);
    y[l] = kAccumulate ? y[l] + sum : sum;
  }
}

template <bool kAccumulate>
void combine_one_to(const double* __restrict x, double s, std::size_t n, double* __restrict y) noexcept {
  for (std::size_t l = 0; l < n; ++l) y[l] = kAccumulate ? y[l] + s * x[l] : s * x[l];
}

/// x1 and low1 from one row of (X10): exact leading products, everything else once rounded and small.
struct Sum {
  double value, low;
};
inline Sum advance_row(double c_q, double c_v, double l_q, double l_v, double q, double q_hi, double q_lo,
                       double v, double v_hi, double v_lo, double forced) noexcept {
  const double a = c_q * q_hi;  // exact
  const double b = c_v * v_hi;  // exact
  // a + b = sum + error exactly (Knuth 1969)
  const double sum = a + b;
  const double part = sum - a;
  const double error = (a - (sum - part)) + (b - part);
  const double rest = (((c_q * q_lo + c_v * v_lo) + (l_q * q + l_v * v)) + error) + forced;
  const double value = sum + rest;
  return {value, rest - (value - sum)};
}

}  // namespace

double dot_lanes(const double* __restrict a, const double* __restrict b, std::size_t n) noexcept {
  Lanes s{};
  for (std::size_t l = 0; l < n; l += kLanes)
    for (std::size_t k = 0; k < kLanes; ++k) s[k] += a[l + k] * b[l + k];
  return sum_lanes(s);
}

double dot_squares(const double* __restrict a, const double* __restrict b, std::size_t n) noexcept {
  Lanes s{};
  for (std::size_t l = 0; l < n; l += kLanes)
    for (std::size_t k = 0; k < kLanes; ++k) {
      const double product = a[l + k] * b[l + k];
      s[k] += product * product;
    }
  return sum_lanes(s);
}

double dot_acceleration(const double* __restrict row, const Plan& plan, const double* __restrict q,
                        const double* __restrict q_dot, const double* __restrict Q) noexcept {
  const double* __restrict omega = plan.omega.data(), * __restrict decay = plan.decay.data();
  const double inverse_mass = 1.0 / plan.mass;
  Lanes s{};
  for (std::size_t l = 0; l < static_cast<std::size_t>(plan.num_padded); l += kLanes)
    for (std::size_t k = 0; k < kLanes; ++k) {
      const std::size_t i = l + k;
      s[k] += row[i] * ((inverse_mass * Q[i] - 2.0 * decay[i] * q_dot[i]) - omega[i] * (omega[i] * q[i]));
    }
  return sum_lanes(s);
}

void combine_rows(const double* rows, const Vec3& f, bool accumulate, std::size_t n, double* y) noexcept {
  accumulate ? combine_rows_to<true>(rows, f, n, y) : combine_rows_to<false>(rows, f, n, y);
}

void combine_table(const double* table, const Mat3& weights, bool accumulate, std::size_t n,
                   double* y) noexcept {
  accumulate ? combine_table_to<true>(table, weights, n, y) : combine_table_to<false>(table, weights, n, y);
}

void combine_one(const double* x, double s, bool accumulate, std::size_t n, double* y) noexcept {
  accumulate ? combine_one_to<true>(x, s, n, y) : combine_one_to<false>(x, s, n, y);
}

void add_outer(const double* rows, const Vec3& F, std::size_t n, double* table) noexcept {
  for (std::size_t a = 0; a < 3; ++a)
    for (std::size_t b = 0; b < 3; ++b) combine_one_to<true>(rows + a * n, F[b], n, table + (3 * a + b) * n);
}

void advance_modes(const Propagator& propagator, std::size_t n, const ModalState& from, const double* Q0_in,
                   const double* Q1_in, const ModalResult& to) noexcept {
  const double* __restrict c_qq = propagator.c_qq.data(), * __restrict c_qv = propagator.c_qv.data();
  const double* __restrict c_vq = propagator.c_vq.data(), * __restrict c_vv = propagator.c_vv.data();
  const double* __restrict l_qq = propagator.l_qq.data(), * __restrict l_qv = propagator.l_qv.data();
  const double* __restrict l_vq = propagator.l_vq.data(), * __restrict l_vv = propagator.l_vv.data();
  const double* __restrict w_q0 = propagator.w_q0.data(), * __restrict w_q1 = propagator.w_q1.data();
  const double* __restrict w_v0 = propagator.w_v0.data(), * __restrict w_v1 = propagator.w_v1.data();
  const double* __restrict q = from.q, * __restrict q_low = from.q_low;
  const double* __restrict v = from.q_dot, * __restrict v_low = from.q_dot_low;
  const double* __restrict Q0 = Q0_in, * __restrict Q1 = Q1_in;
  double* __restrict q1 = to.q, * __restrict q1_low = to.q_low;
  double* __restrict v1 = to.q_dot, * __restrict v1_low = to.q_dot_low;
  for (std::size_t l = 0; l < n; ++l) {
    const double q_hi = leading_bits(q[l]), v_hi = leading_bits(v[l]);
    const double q_lo = (q[l] - q_hi) + q_low[l], v_lo = (v[l] - v_hi) + v_low[l];
    const double dQ = Q1[l] - Q0[l];
    const Sum next_q = advance_row(c_qq[l], c_qv[l], l_qq[l], l_qv[l], q[l], q_hi, q_lo, v[l], v_hi, v_lo,
                                   w_q0[l] * Q0[l] + w_q1[l] * dQ);
    const Sum next_v = advance_row(c_vq[l], c_vv[l], l_vq[l], l_vv[l], q[l], q_hi, q_lo, v[l], v_hi, v_lo,
                                   w_v0[l] * Q0[l] + w_v1[l] * dQ);
    q1[l] = next_q.value;
    q1_low[l] = next_q.low;
    v1[l] = next_v.value;
    v1_low[l] = next_v.low;
  }
}

bool all_finite(const double* __restrict x, std::size_t n) noexcept {
  Lanes s{};
  for (std::size_t l = 0; l < n; l += kLanes)
    for (std::size_t k = 0; k < kLanes; ++k) s[k] += x[l + k] - x[l + k];
  return sum_lanes(s) == 0.0;
}

}  // namespace freeflex
