#include "core/step/linear/kernels.hpp"

#include <cstdint>
#include <type_traits>
#include <vector>

#include "core/widths.hpp"

namespace freeflex {
namespace {

// two lanes, which fill a register of the baseline
using Pair = double __attribute__((vector_size(16)));

Pair load(const double* from) noexcept {
  Pair pair;
  __builtin_memcpy(&pair, from, sizeof(pair));
  return pair;
}

/// Returns the sum of both components of the pairs term(l) for l = 0, 2, 4, ... < n, accumulated in kLanes
/// partial sums.
template <class Term>
double sum_in_lanes(std::size_t n, const Term& term) noexcept {
  static_assert(kLanes == 8);
  Pair s0{}, s1{}, s2{}, s3{};
  for (std::size_t l = 0; l < n; l += kLanes) {
    s0 += term(l);
    s1 += term(l + 2);
    s2 += term(l + 4);
    s3 += term(l + 6);
  }
  return ((s0[0] + s0[1]) + (s1[0] + s1[1])) + ((s2[0] + s2[1]) + (s3[0] + s3[1]));
}

template <bool kAccumulate>
FREEFLEX_KERNEL void combine_rows_to(const double* __restrict rows, const Vec3* f, std::size_t n,
                                     double* __restrict y) noexcept {
  const double* __restrict x = rows, * __restrict u = rows + n, * __restrict w = rows + 2 * n;
  const double f0 = (*f)[0], f1 = (*f)[1], f2 = (*f)[2];
  for (std::size_t l = 0; l < n; ++l) {
    const double sum = f0 * x[l] + f1 * u[l] + f2 * w[l];
    y[l] = kAccumulate ? y[l] + sum : sum;
  }
}

template <bool kAccumulate>
FREEFLEX_KERNEL void combine_table_to(const double* __restrict t, const Mat3* weights, std::size_t n,
                                      double* __restrict y) noexcept {
  const Mat3& c = *weights;
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
FREEFLEX_KERNEL void combine_one_to(const double* __restrict x, double s, std::size_t n,
                                    double* __restrict y) noexcept {
  for (std::size_t l = 0; l < n; ++l) y[l] = kAccumulate ? y[l] + s * x[l] : s * x[l];
}

using PairBits = std::int64_t __attribute__((vector_size(16)));
using Quad = double __attribute__((vector_size(32)));
using QuadBits = std::int64_t __attribute__((vector_size(32)));
using Oct = double __attribute__((vector_size(64)));
using OctBits = std::int64_t __attribute__((vector_size(64)));

template <class V>
FREEFLEX_KERNEL void load_to(V& to, const double* from, std::size_t l) noexcept {
  __builtin_memcpy(&to, from + l, sizeof(V));
}

/// Copies the leading 26 bits of y. The product of this copy with another number of 26 bits is exact.
template <class V, class Bits>
FREEFLEX_KERNEL void take_leading_bits(const V& y, V& leading) noexcept {
  constexpr std::int64_t kMask = ~((std::int64_t{1} << 27) - 1);
  leading = reinterpret_cast<V>(reinterpret_cast<Bits>(y) & kMask);
}

/// Holds one coordinate of several modes as three parts. These are the value, the leading bits of the value,
/// and the remaining bits plus the low part.
template <class V>
struct Coordinate {
  V value, leading, rest;
};

/// Computes one row of the step P = C + L for several modes at a time   (THEORY 6.1, 6.5):
///   c_q q + c_v q' + l_q q + l_v q' + forced
/// The products of leading bits are exact, and so is their sum together with its error term (Knuth 1969). The
/// other terms are rounded, but they are at most 2^-26 of the result, or belong to the load.
template <class V>
FREEFLEX_KERNEL void advance_row(const V& c_q, const V& c_v, const V& l_q, const V& l_v,
                                 const Coordinate<V>& q, const Coordinate<V>& v, const V& forced,
                                 double* value_out, double* low_out, V& sum_of_lows) noexcept {
  const V a = c_q * q.leading, b = c_v * v.leading;
  const V sum = a + b;
  const V part = sum - a;
  const V error = (a - (sum - part)) + (b - part);
  const V rest = (((c_q * q.rest + c_v * v.rest) + (l_q * q.value + l_v * v.value)) + error) + forced;
  const V value = sum + rest;
  const V low = rest - (value - sum);
  __builtin_memcpy(value_out, &value, sizeof(V));
  __builtin_memcpy(low_out, &low, sizeof(V));
  sum_of_lows += low;
}

/// Advances all modes by a step (THEORY 6.1), as many modes at a time as V has lanes. The sum of all low
/// parts shows whether all values are finite, because the low part of a value that is not finite is not
/// finite either. If Lanes has no c_vv and l_vv, the modes have no decay.
template <class V, class Bits, class Lanes>
FREEFLEX_KERNEL void advance(const Lanes* all, std::size_t n, ModalState from, const double* load_start,
                             const double* load_end, ModalResult to, bool* is_finite) noexcept {
  V q_lows{}, v_lows{};
  for (std::size_t l = 0; l < n; l += sizeof(V) / sizeof(double)) {
    Coordinate<V> q, v;
    const Lanes& p = all[l / kLanes];
    const std::size_t lane = l % kLanes;
    V low, Q0, dQ, c_q, c_v, l_q, l_v, w0, w1;
    load_to(q.value, from.q, l);
    load_to(low, from.q_low, l);
    take_leading_bits<V, Bits>(q.value, q.leading);
    q.rest = (q.value - q.leading) + low;
    load_to(v.value, from.q_dot, l);
    load_to(low, from.q_dot_low, l);
    take_leading_bits<V, Bits>(v.value, v.leading);
    v.rest = (v.value - v.leading) + low;
    load_to(Q0, load_start, l);
    load_to(dQ, load_end, l);
    dQ -= Q0;
    load_to(c_q, p.c_qq.data(), lane);
    load_to(c_v, p.c_qv.data(), lane);
    load_to(l_q, p.l_qq.data(), lane);
    load_to(l_v, p.l_qv.data(), lane);
    load_to(w0, p.w_q0.data(), lane);
    load_to(w1, p.w_q1.data(), lane);
    advance_row<V>(c_q, c_v, l_q, l_v, q, v, w0 * Q0 + w1 * dQ, to.q + l, to.q_low + l, q_lows);
    load_to(c_q, p.c_vq.data(), lane);
    load_to(l_q, p.l_vq.data(), lane);
    if constexpr (std::is_same_v<Lanes, Propagator::Lanes>) {
      load_to(c_v, p.c_vv.data(), lane);
      load_to(l_v, p.l_vv.data(), lane);
    } else {
      load_to(c_v, p.c_qq.data(), lane);
      load_to(l_v, p.l_qq.data(), lane);
    }
    load_to(w0, p.w_v0.data(), lane);
    load_to(w1, p.w_v1.data(), lane);
    advance_row<V>(c_q, c_v, l_q, l_v, q, v, w0 * Q0 + w1 * dQ, to.q_dot + l, to.q_dot_low + l, v_lows);
  }
  q_lows += v_lows;
  double sum = 0.0;
  for (std::size_t k = 0; k < sizeof(V) / sizeof(double); ++k) sum += q_lows[k];
  *is_finite = sum - sum == 0.0;
}

/// Computes V, V' and V'' of a point, which are nine sums over modes, with the partial sums of sum_in_lanes.
/// The outer loop handles as many partial sums at a time as V has lanes, so that all sums fit in the
/// registers of the baseline.
///   V = sum_l b_l q_l   (THEORY 2.14),   q_l'' = Q_l / M - 2 decay_l q_l' - omega_l^2 q_l   (THEORY 4.22)
template <class V>
FREEFLEX_KERNEL void contract_motion_to(const double* rows, const StepPlan* plan, const double* q,
                                        const double* q_dot, const double* Q, PointMotion* motion) noexcept {
  const std::size_t n = index(plan->num_moving), stride = index(plan->num_padded);
  constexpr std::size_t kLanesOfV = sizeof(V) / sizeof(double);
  const double *omega = plan->omega.data(), *decay = plan->decay.data();
  const double inverse_mass = 1.0 / plan->mass;
  double sums[3][3][kLanes];
  for (std::size_t chunk = 0; chunk < kLanes; chunk += kLanesOfV) {
    V sum[3][3]{};
    for (std::size_t l = chunk; l < n; l += kLanes) {
      V x, x_dot, load, w, d;
      load_to(x, q, l);
      load_to(x_dot, q_dot, l);
      load_to(load, Q, l);
      load_to(w, omega, l);
      load_to(d, decay, l);
      const V x_ddot = (inverse_mass * load - 2.0 * d * x_dot) - w * (w * x);
      for (std::size_t axis = 0; axis < 3; ++axis) {
        V b;
        load_to(b, rows + axis * stride, l);
        sum[0][axis] += b * x;
        sum[1][axis] += b * x_dot;
        sum[2][axis] += b * x_ddot;
      }
    }
    for (std::size_t k = 0; k < 3; ++k)
      for (std::size_t axis = 0; axis < 3; ++axis)
        __builtin_memcpy(sums[k][axis] + chunk, &sum[k][axis], sizeof(V));
  }
  Vec3* const results[3] = {&motion->V, &motion->V_dot, &motion->V_ddot};
  for (std::size_t k = 0; k < 3; ++k)
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const double* s = sums[k][axis];
      (*results[k])[axis] = ((s[0] + s[1]) + (s[2] + s[3])) + ((s[4] + s[5]) + (s[6] + s[7]));
    }
}

/// Computes the products of the first kRows rows with kVectors vectors, in the lanes of sum_in_lanes.
template <class V, std::size_t kRows, std::size_t kVectors>
FREEFLEX_KERNEL void contract_block_to(const double* rows, std::size_t stride, std::size_t n,
                                       const double* const* x, double* const* y) noexcept {
  constexpr std::size_t kLanesOfV = sizeof(V) / sizeof(double);
  double sums[kVectors][kRows][kLanes];
  for (std::size_t chunk = 0; chunk < kLanes; chunk += kLanesOfV) {
    V sum[kVectors][kRows]{};
    for (std::size_t l = chunk; l < n; l += kLanes) {
      V value[kVectors];
      for (std::size_t k = 0; k < kVectors; ++k) load_to(value[k], x[k], l);
      for (std::size_t i = 0; i < kRows; ++i) {
        V row;
        load_to(row, rows + i * stride, l);
        for (std::size_t k = 0; k < kVectors; ++k) sum[k][i] += row * value[k];
      }
    }
    for (std::size_t k = 0; k < kVectors; ++k)
      for (std::size_t i = 0; i < kRows; ++i) __builtin_memcpy(sums[k][i] + chunk, &sum[k][i], sizeof(V));
  }
  for (std::size_t k = 0; k < kVectors; ++k)
    for (std::size_t i = 0; i < kRows; ++i) {
      const double* s = sums[k][i];
      y[k][i] = ((s[0] + s[1]) + (s[2] + s[3])) + ((s[4] + s[5]) + (s[6] + s[7]));
    }
}

/// Computes the products of all rows with kVectors vectors, three rows at a time.
template <class V, std::size_t kVectors>
FREEFLEX_KERNEL void contract_to(const double* rows, std::size_t num_rows, std::size_t stride, std::size_t n,
                                 const double* const* x, double* const* y) noexcept {
  double* to[kVectors];
  for (std::size_t k = 0; k < kVectors; ++k) to[k] = y[k];
  const auto advance_by = [&](std::size_t count) {
    rows += count * stride;
    for (double*& each : to) each += count;
  };
  for (; num_rows >= 3; num_rows -= 3) {
    contract_block_to<V, 3, kVectors>(rows, stride, n, x, to);
    advance_by(3);
  }
  for (; num_rows > 0; --num_rows) {
    contract_block_to<V, 1, kVectors>(rows, stride, n, x, to);
    advance_by(1);
  }
}

/// Computes the products of three rows with `count` vectors of n values, four vectors at a time.
template <class V>
FREEFLEX_KERNEL void contract_vectors_to(const double* rows, std::size_t stride, std::size_t n,
                                         const double* x, std::size_t count, double* y) noexcept {
  const double* from[4];
  double* to[4];
  const auto take = [&](std::size_t first, std::size_t size) {
    for (std::size_t k = 0; k < size; ++k) from[k] = x + (first + k) * n, to[k] = y + 3 * (first + k);
  };
  const std::size_t in_fours = count / 4 * 4;
  for (std::size_t k = 0; k < in_fours; k += 4)
    take(k, 4), contract_block_to<V, 3, 4>(rows, stride, n, from, to);
  for (std::size_t k = in_fours; k < count; ++k)
    take(k, 1), contract_block_to<V, 3, 1>(rows, stride, n, from, to);
}

/// Computes x_l = sum_k rows_kl f_k and y_l = sum_k rows_kl g_k over all rows k, for eight modes l at a time.
template <class V>
FREEFLEX_KERNEL void project_points_to(const StepPlan* plan, std::size_t n, const double* f, const double* g,
                                       std::size_t num_rows, double* x, double* y) noexcept {
  const auto stride = index(plan->num_padded);
  constexpr std::size_t kLanesOfV = sizeof(V) / sizeof(double), kChunks = kLanes / kLanesOfV;
  for (std::size_t l = 0; l < n; l += kLanes) {
    V sum_x[kChunks]{}, sum_y[kChunks]{};
    const double* row = plan->rows.data() + l;
    for (std::size_t k = 0; k < num_rows; ++k, row += stride)
      for (std::size_t c = 0; c < kChunks; ++c) {
        V b;
        load_to(b, row, c * kLanesOfV);
        sum_x[c] += b * f[k];
        sum_y[c] += b * g[k];
      }
    __builtin_memcpy(x + l, sum_x, sizeof(sum_x));
    __builtin_memcpy(y + l, sum_y, sizeof(sum_y));
  }
}

// Each pass over y adds eight rows, so that y is read and written only once per eight rows.
FREEFLEX_KERNEL void sum_rows_to(const double* __restrict rows, std::size_t stride,
                                 const double* __restrict weights, std::size_t count, std::size_t n,
                                 double* __restrict y) noexcept {
  for (std::size_t l = 0; l < n; ++l) y[l] = 0.0;
  for (std::size_t k = 0; k < count; k += kLanes, rows += kLanes * stride, weights += kLanes) {
    const double *x0 = rows, *x1 = x0 + stride, *x2 = x1 + stride, *x3 = x2 + stride, *x4 = x3 + stride,
                 *x5 = x4 + stride, *x6 = x5 + stride, *x7 = x6 + stride;
    for (std::size_t l = 0; l < n; ++l)
      y[l] += ((weights[0] * x0[l] + weights[1] * x1[l]) + (weights[2] * x2[l] + weights[3] * x3[l])) +
              ((weights[4] * x4[l] + weights[5] * x5[l]) + (weights[6] * x6[l] + weights[7] * x7[l]));
  }
}

}  // namespace

double dot_lanes(const double* a, const double* b, std::size_t n) noexcept {
  return sum_in_lanes(n, [&](std::size_t l) { return load(a + l) * load(b + l); });
}

double dot_squares(const double* a, const double* b, std::size_t n) noexcept {
  return sum_in_lanes(n, [&](std::size_t l) {
    const Pair product = load(a + l) * load(b + l);
    return product * product;
  });
}

void combine_rows(const double* rows, const Vec3& f, bool accumulate, std::size_t n, double* y) noexcept {
  accumulate ? run<combine_rows_to<true>>(rows, &f, n, y) : run<combine_rows_to<false>>(rows, &f, n, y);
}

void combine_table(const double* table, const Mat3& weights, bool accumulate, std::size_t n,
                   double* y) noexcept {
  accumulate ? run<combine_table_to<true>>(table, &weights, n, y)
             : run<combine_table_to<false>>(table, &weights, n, y);
}

void combine_one(const double* x, double s, bool accumulate, std::size_t n, double* y) noexcept {
  accumulate ? run<combine_one_to<true>>(x, s, n, y) : run<combine_one_to<false>>(x, s, n, y);
}

void add_outer(const double* rows, const Vec3& F, std::size_t n, double* table) noexcept {
  for (std::size_t a = 0; a < 3; ++a)
    for (std::size_t b = 0; b < 3; ++b) combine_one(rows + a * n, F[b], true, n, table + (3 * a + b) * n);
}

PointMotion contract_motion(const double* rows, const StepPlan& plan, const double* q, const double* q_dot,
                            const double* Q) noexcept {
  PointMotion motion;
  run_widest<contract_motion_to<Pair>, contract_motion_to<Quad>, contract_motion_to<Oct>>(rows, &plan, q,
                                                                                          q_dot, Q, &motion);
  return motion;
}

void contract_two(const double* rows, std::size_t num_rows, std::size_t stride, std::size_t n,
                  const double* a, const double* b, double* x, double* y) noexcept {
  const double* from[2] = {a, b};
  double* to[2] = {x, y};
  run_widest<contract_to<Pair, 2>, contract_to<Quad, 2>, contract_to<Oct, 2>>(
      rows, num_rows, stride, n, static_cast<const double* const*>(from), static_cast<double* const*>(to));
}

void modal_accelerations(const StepPlan& plan, const double* q, const double* q_dot, const double* Q,
                         double* q_ddot) noexcept {
  const double inverse_mass = 1.0 / plan.mass;
  for (std::size_t l = 0; l < index(plan.num_moving); ++l)
    q_ddot[l] =
        (inverse_mass * Q[l] - 2.0 * plan.decay[l] * q_dot[l]) - plan.omega[l] * (plan.omega[l] * q[l]);
}

void contract_one(const double* rows, std::size_t num_rows, std::size_t n, const double* a,
                  double* x) noexcept {
  run_widest<contract_to<Pair, 1>, contract_to<Quad, 1>, contract_to<Oct, 1>>(
      rows, num_rows, n, n, static_cast<const double* const*>(&a), static_cast<double* const*>(&x));
}

void contract_vectors(const double* rows, std::size_t stride, std::size_t n, const double* x,
                      std::size_t count, Vec3* y) noexcept {
  run_widest<contract_vectors_to<Pair>, contract_vectors_to<Quad>, contract_vectors_to<Oct>>(
      rows, stride, n, x, count, y->data());
}

void contract_points(const StepPlan& plan, const double* a, const double* b, std::span<Vec3> V,
                     std::span<Vec3> W) noexcept {
  contract_two(plan.rows.data(), 3 * V.size(), index(plan.num_padded), index(plan.num_moving), a, b,
               V.data()->data(), W.data()->data());
}

void project_columns(const StepPlan& plan, std::size_t n, std::span<const Vec3> f, std::span<const Vec3> g,
                     double* x, double* y) noexcept {
  run_widest<project_points_to<Pair>, project_points_to<Quad>, project_points_to<Oct>>(
      &plan, n, f.data()->data(), g.data()->data(), 3 * f.size(), x, y);
}

void sum_rows(const double* rows, std::size_t stride, const double* weights, std::size_t count, std::size_t n,
              double* y) noexcept {
  run<sum_rows_to>(rows, stride, weights, count, n, y);
}

bool advance_modes(const Propagator& propagator, std::size_t n, const ModalState& from, const double* Q0,
                   const double* Q1, const ModalResult& to) noexcept {
  bool is_finite = true;
  const auto run_over = [&]<class Lanes>(const std::vector<Lanes>& lanes) {
    run_widest<advance<Pair, PairBits, Lanes>, advance<Quad, QuadBits, Lanes>, advance<Oct, OctBits, Lanes>>(
        lanes.data(), n, from, Q0, Q1, to, &is_finite);
  };
  propagator.undamped.empty() ? run_over(propagator.lanes) : run_over(propagator.undamped);
  return is_finite;
}

}  // namespace freeflex
