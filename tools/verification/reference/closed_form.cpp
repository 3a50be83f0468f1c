#include "tools/verification/reference/closed_form.hpp"

namespace freeflex {
namespace {

/// Returns the motion without load: q'' + 2 d q' + w^2 q = 0 from q0, v0.
OscillatorMotion free_motion(const Real& w, const Real& d, const Real& q0, const Real& v0, const Real& t) {
  if (w > d) {
    const Real b = sqrt((w - d) * (w + d)), decay = exp(-d * t), c = cos(b * t), s = sin(b * t);
    return {decay * (q0 * c + (v0 + d * q0) / b * s), decay * (v0 * c - (d * v0 + w * w * q0) / b * s)};
  }
  if (w == d) {
    const Real decay = exp(-d * t), rate = v0 + d * q0;
    return {decay * (q0 + rate * t), decay * (v0 - d * rate * t)};
  }
  const Real root = sqrt((d - w) * (d + w)), fast = -d - root, slow = -w * w / (d + root);
  const Real a = (v0 - fast * q0) / (slow - fast), b = (slow * q0 - v0) / (slow - fast);
  return {a * exp(slow * t) + b * exp(fast * t), a * slow * exp(slow * t) + b * fast * exp(fast * t)};
}

/// Returns a particular solution of q'' + 2 d q' + w^2 q = start + slope t.
OscillatorMotion particular(const Real& w, const Real& d, const Real& start, const Real& slope,
                            const Real& t) {
  if (w > 0) return {(start + slope * t - 2 * d * slope / (w * w)) / (w * w), slope / (w * w)};
  if (d > 0) {
    const Real offset = slope / (4 * d * d);
    return {(start * t + slope * t * t / 2) / (2 * d) - offset * t, (start + slope * t) / (2 * d) - offset};
  }
  return {start * t * t / 2 + slope * t * t * t / 6, start * t + slope * t * t / 2};
}

}  // namespace

OscillatorMotion oscillate(const Real& w, const Real& d, const Real& q0, const Real& v0, const Real& start,
                           const Real& slope, const Real& t) {
  const OscillatorMotion at_start = particular(w, d, start, slope, 0),
                         now = particular(w, d, start, slope, t);
  const OscillatorMotion free = free_motion(w, d, q0 - at_start.q, v0 - at_start.q_dot, t);
  return {free.q + now.q, free.q_dot + now.q_dot};
}

}  // namespace freeflex
