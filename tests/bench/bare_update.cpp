#include "tests/bench/bare_update.hpp"

namespace {

// The arrays are function parameters, because the compiler honours __restrict only on parameters and would
// not vectorise the loop otherwise.
inline __attribute__((always_inline)) void update(
    std::size_t n, double* __restrict q, double* __restrict v, const double* __restrict p_qq,
    const double* __restrict p_qv, const double* __restrict p_vq, const double* __restrict p_vv,
    const double* __restrict w_q0, const double* __restrict w_q1, const double* __restrict w_v0,
    const double* __restrict w_v1, const double* __restrict f0, const double* __restrict f1) {
  for (std::size_t l = 0; l < n; ++l) {
    const double q_next = p_qq[l] * q[l] + p_qv[l] * v[l] + w_q0[l] * f0[l] + w_q1[l] * f1[l];
    const double v_next = p_vq[l] * q[l] + p_vv[l] * v[l] + w_v0[l] * f0[l] + w_v1[l] * f1[l];
    q[l] = q_next;
    v[l] = v_next;
  }
}

inline __attribute__((always_inline)) void update(BareModes& modes, std::size_t n) {
  update(n, modes.q.data(), modes.v.data(), modes.p_qq.data(), modes.p_qv.data(), modes.p_vq.data(),
         modes.p_vv.data(), modes.w_q0.data(), modes.w_q1.data(), modes.w_v0.data(), modes.w_v1.data(),
         modes.f0.data(), modes.f1.data());
}

#if defined(__x86_64__)
__attribute__((target("avx2"))) void update_avx2(BareModes& modes, std::size_t n) { update(modes, n); }
__attribute__((target("avx2,avx512f,prefer-vector-width=512"))) void update_avx512(BareModes& modes,
                                                                                   std::size_t n) {
  update(modes, n);
}
#endif

}  // namespace

void bare_update(BareModes& modes, std::size_t n) { update(modes, n); }

void bare_update_wide(BareModes& modes, std::size_t n) {
#if defined(__x86_64__)
  if (__builtin_cpu_supports("avx512f")) {
    update_avx512(modes, n);
    return;
  }
  if (__builtin_cpu_supports("avx2")) {
    update_avx2(modes, n);
    return;
  }
#endif
  update(modes, n);
}
