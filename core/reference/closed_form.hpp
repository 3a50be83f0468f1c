// A damped oscillator under a load linear in time, in closed form to 150 digits from the exact doubles.
#pragma once

#include <boost/multiprecision/cpp_bin_float.hpp>

namespace freeflex {

using Real =
    boost::multiprecision::number<boost::multiprecision::cpp_bin_float<150>, boost::multiprecision::et_off>;

struct Motion {
  Real q, q_dot;
};

/// q'' + 2 decay q' + omega^2 q = start + slope t from q0, v0, at time t; omega and decay are w and d here.
/// Textbook solutions by the roots; no step.
Motion oscillate(const Real& w, const Real& d, const Real& q0, const Real& v0, const Real& start,
                 const Real& slope, const Real& t);

}  // namespace freeflex
