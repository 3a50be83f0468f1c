// The motion of a damped oscillator under a load that is linear in time, in closed form with 150 digits.
#pragma once

#include <boost/multiprecision/cpp_bin_float.hpp>

namespace freeflex {

using Real =
    boost::multiprecision::number<boost::multiprecision::cpp_bin_float<150>, boost::multiprecision::et_off>;

struct OscillatorMotion {
  Real q, q_dot;
};

/// Returns the motion of q'' + 2 d q' + w^2 q = start + slope t at time t, from q0 and v0 at time 0. The
/// motion is the textbook solution from the roots of the characteristic polynomial, so no time steps are
/// taken. A double is converted to Real exactly.
OscillatorMotion oscillate(const Real& w, const Real& d, const Real& q0, const Real& v0, const Real& start,
                           const Real& slope, const Real& t);

}  // namespace freeflex
