#include "core/step/points/multistep.hpp"

#include "core/widths.hpp"

namespace freeflex {
namespace {

FREEFLEX_KERNEL void advance_past(const Past* changes, const Past* accelerations, double square,
                                  std::size_t size, const double* x, const double* low,
                                  double* __restrict change, double* __restrict x_to,
                                  double* __restrict low_to) noexcept {
  const Past &e = *changes, &f = *accelerations;
  const double *e0 = e[0], *e1 = e[1], *e2 = e[2], *e3 = e[3], *e4 = e[4], *e5 = e[5], *e6 = e[6], *e7 = e[7],
               *e8 = e[8], *e9 = e[9], *e10 = e[10];
  const double *f0 = f[0], *f1 = f[1], *f2 = f[2], *f3 = f[3], *f4 = f[4], *f5 = f[5], *f6 = f[6], *f7 = f[7],
               *f8 = f[8], *f9 = f[9], *f10 = f[10];
  constexpr auto A = kChangeWeights;
  constexpr auto B = kAccelerationWeights;
  for (std::size_t i = 0; i < size; ++i) {
    const double force = ((B[0] * (f0[i] + f10[i]) + B[1] * (f1[i] + f9[i])) +
                          (B[2] * (f2[i] + f8[i]) + B[3] * (f3[i] + f7[i]))) +
                         (B[4] * (f4[i] + f6[i]) + B[5] * f5[i]);
    const double past = ((A[0] * (e1[i] - e10[i]) + A[1] * (e2[i] - e9[i])) +
                         (A[2] * (e3[i] - e8[i]) + A[3] * (e4[i] - e7[i]))) +
                        A[4] * (e5[i] - e6[i]);
    const double by = e0[i] + (past + square * force);
    change[i] = by;
    const double corrected = low[i] + by, sum = x[i] + corrected;
    low_to[i] = corrected - (sum - x[i]);
    x_to[i] = sum;
  }
}

FREEFLEX_KERNEL void sum_weighted(const double* weights, double scale, const Past* past, double share,
                                  const double* change, std::size_t size, double* __restrict to) noexcept {
  static_assert(kPastSteps == 11);
  const Past& p = *past;
  const double *p0 = p[10], *p1 = p[9], *p2 = p[8], *p3 = p[7], *p4 = p[6], *p5 = p[5], *p6 = p[4],
               *p7 = p[3], *p8 = p[2], *p9 = p[1], *p10 = p[0];
  const double w0 = scale * weights[0], w1 = scale * weights[1], w2 = scale * weights[2],
               w3 = scale * weights[3], w4 = scale * weights[4], w5 = scale * weights[5],
               w6 = scale * weights[6], w7 = scale * weights[7], w8 = scale * weights[8],
               w9 = scale * weights[9], w10 = scale * weights[10];
  for (std::size_t i = 0; i < size; ++i) {
    const double late = ((w0 * p0[i] + w1 * p1[i]) + (w2 * p2[i] + w3 * p3[i])) + (w4 * p4[i] + w5 * p5[i]),
                 early = ((w6 * p6[i] + w7 * p7[i]) + (w8 * p8[i] + w9 * p9[i])) + w10 * p10[i];
    to[i] = share * change[i] + (late + early);
  }
}

FREEFLEX_KERNEL void begin_substeps(double substep, const double* x, const double* v, const double* a,
                                    double* __restrict u, double* __restrict d, double* __restrict at,
                                    std::size_t size) noexcept {
  const double half = 0.5 * substep;
  for (std::size_t i = 0; i < size; ++i) {
    u[i] = v[i] + half * a[i];
    d[i] = substep * u[i];
    at[i] = x[i] + d[i];
  }
}

FREEFLEX_KERNEL void make_substep(double substep, const double* x, const double* f, double* __restrict u,
                                  double* __restrict d, double* __restrict at, std::size_t size) noexcept {
  for (std::size_t i = 0; i < size; ++i) {
    u[i] += substep * f[i];
    d[i] += substep * u[i];
    at[i] = x[i] + d[i];
  }
}

FREEFLEX_KERNEL void end_substeps(double substep, double weight, const double* u, const double* d,
                                  const double* f, double* __restrict sum_d, double* __restrict sum_u,
                                  std::size_t size) noexcept {
  const double half = 0.5 * substep;
  for (std::size_t i = 0; i < size; ++i) {
    sum_u[i] += weight * (u[i] + half * f[i]);
    sum_d[i] += weight * d[i];
  }
}

FREEFLEX_KERNEL void begin_midpoint_in(double substep, const double* x, const double* v, const double* a,
                                       double* __restrict u, double* __restrict d, double* __restrict at,
                                       double* __restrict v_at, std::size_t size) noexcept {
  for (std::size_t i = 0; i < size; ++i) {
    d[i] = substep * v[i];
    u[i] = substep * a[i];
    at[i] = x[i] + d[i];
    v_at[i] = v[i] + u[i];
  }
}

/// The newer values replace those before, of which the caller then swaps the names.
FREEFLEX_KERNEL void make_midpoint_substep(double twice, const double* x, const double* v, const double* f,
                                           const double* u, double* __restrict u_before,
                                           double* __restrict d_before, double* __restrict at,
                                           double* __restrict v_at, std::size_t size) noexcept {
  for (std::size_t i = 0; i < size; ++i) {
    d_before[i] += twice * (v[i] + u[i]);
    u_before[i] += twice * f[i];
    at[i] = x[i] + d_before[i];
    v_at[i] = v[i] + u_before[i];
  }
}

}  // namespace

void begin_midpoint(double substep, const double* x, const double* v, const double* a,
                    ExtrapolationWorkspace& w) noexcept {
  for (Array* each : {&w.u_before, &w.d_before}) std::fill(each->begin(), each->end(), 0.0);
  run_auto<begin_midpoint_in>(substep, x, v, a, w.u.data(), w.d.data(), w.at.data(), w.v_at.data(),
                              w.u.size());
}

void continue_midpoint(double substep, const double* x, const double* v, ExtrapolationWorkspace& w) noexcept {
  run_auto<make_midpoint_substep>(2.0 * substep, x, v, w.f.data(), w.u.data(), w.u_before.data(),
                                  w.d_before.data(), w.at.data(), w.v_at.data(), w.u.size());
  w.u.swap(w.u_before);
  w.d.swap(w.d_before);
}

void advance_multistep(const Past& changes, const Past& accelerations, double h, std::size_t size,
                       const Positions& from, double* change, const NextPositions& to) noexcept {
  run_auto<advance_past>(&changes, &accelerations, h * h, size, from.x, from.low, change, to.x, to.low);
}

void sum_past(const double* weights, double scale, const Past& past, double share, const double* change,
              std::size_t size, double* to) noexcept {
  run_auto<sum_weighted>(weights, scale, &past, share, change, size, to);
}

double square_of_differences(const Past& past, const double* weight, std::size_t size) noexcept {
  constexpr std::array<double, kPastSteps> kBinomials{1, -10, 45, -120, 210, -252, 210, -120, 45, -10, 1};
  double square = 0.0;
  for (std::size_t i = 0; i < size; ++i) {
    double difference = 0.0;
    for (std::size_t k = 0; k < kPastSteps; ++k) difference += kBinomials[k] * past[k][i];
    square += weight[i] * (difference * difference);
  }
  return square;
}

ExtrapolationWorkspace make_extrapolation_workspace(std::size_t size) {
  ExtrapolationWorkspace w;
  for (Array* each : {&w.u, &w.d, &w.at, &w.f, &w.sum_d, &w.sum_u, &w.u_before, &w.d_before, &w.v_at})
    each->resize(size);
  return w;
}

void begin_column(double substep, const double* x, const double* v, const double* a,
                  ExtrapolationWorkspace& w) noexcept {
  run_auto<begin_substeps>(substep, x, v, a, w.u.data(), w.d.data(), w.at.data(), w.u.size());
}

void continue_column(double substep, const double* x, ExtrapolationWorkspace& w) noexcept {
  run_auto<make_substep>(substep, x, w.f.data(), w.u.data(), w.d.data(), w.at.data(), w.u.size());
}

void end_column(double substep, double weight, ExtrapolationWorkspace& w) noexcept {
  run_auto<end_substeps>(substep, weight, w.u.data(), w.d.data(), w.f.data(), w.sum_d.data(), w.sum_u.data(),
                         w.u.size());
}

}  // namespace freeflex
