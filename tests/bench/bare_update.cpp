#include "tests/bench/bare_update.hpp"

void bare_update(BareModes &modes, std::size_t n) {
  double *__restrict q = modes.q.data();
  double *__restrict v = modes.v.data();
  const double *p_qq = modes.p_qq.data(), *p_qv = modes.p_qv.data();
  const double *p_vq = modes.p_vq.data(), *p_vv = modes.p_vv.data();
  const double *w_q0 = modes.w_q0.data(), *w_q1 = modes.w_q1.data();
  const double *w_v0 = modes.w_v0.data(), *w_v1 = modes.w_v1.data();
  const double *f0 = modes.f0.data(), *f1 = modes.f1.data();
  for (std::size_t l = 0; l < n; ++l) {
    const double q_next = p_qq[l] * q[l] + p_qv[l] * v[l] + w_q0[l] * f0[l] + w_q1[l] * f1[l];
    const double v_next = p_vq[l] * q[l] + p_vv[l] * v[l] + w_v0[l] * f0[l] + w_v1[l] * f1[l];
    q[l] = q_next;
    v[l] = v_next;
  }
}
