#include "core/step/rigid/kepler.hpp"

namespace freeflex {
namespace {

/// Returns the nearest whole number, for |x| below 2^51.
double nearest(double x) noexcept {
  constexpr double kShift = 6755399441055744.0;  // 1.5 * 2^52
  return (x + kShift) - kShift;
}

/// Holds Stumpff's functions c_k(z) = sum_j (-z)^j / (k + 2 j)!   (THEORY 7.28).
struct Stumpff {
  double c0, c1, c2, c3;
};

/// Returns the functions at z. They are computed by their series at z / 4^k, and the argument is then
/// multiplied by four k times (the angle is doubled).
Stumpff stumpff(double z) noexcept {
  constexpr double kSmall = 0.1;  // up to this |z|, seven terms of the series are exact to the last bit
  int quarters = 0;
  for (; z > kSmall || z < -kSmall; ++quarters) z *= 0.25;
  constexpr double kOdd[] = {1.0 / 20, 1.0 / 42, 1.0 / 72, 1.0 / 110, 1.0 / 156, 1.0 / 210};
  constexpr double kEven[] = {1.0 / 12, 1.0 / 30, 1.0 / 56, 1.0 / 90, 1.0 / 132, 1.0 / 182};
  double odd = 1.0, even = 1.0;
  for (int j = 5; j >= 0; --j) {
    odd = 1.0 - z * kOdd[j] * odd;
    even = 1.0 - z * kEven[j] * even;
  }
  Stumpff c{0.0, 0.0, even / 2.0, odd / 6.0};
  c.c1 = 1.0 - z * c.c3;
  c.c0 = 1.0 - z * c.c2;
  for (; quarters > 0; --quarters)
    c = {2.0 * c.c0 * c.c0 - 1.0, c.c0 * c.c1, 0.5 * c.c1 * c.c1, 0.25 * (c.c2 + c.c0 * c.c3)};
  return c;
}

/// Holds the constants of an orbit, from the position rho and the velocity v at its start:
/// r_0 = |rho|, eta = rho . v, zeta = mu - beta r_0, beta = 2 mu / r_0 - |v|^2.
struct Orbit {
  double r_0, eta, zeta, beta;
};
/// Holds a point of an orbit at a value X of the universal variable: time [s], distance [m], universal
/// functions.
struct OrbitPoint {
  double t, r, G1, G2, G3;
};
/// Returns the point of the orbit at X:
///   t = r_0 X + eta G_2 + zeta G_3   (THEORY 7.26)
///   r = dt/dX = r_0 + eta G_1 + zeta G_2   (THEORY 7.27)
///   G_k = X^k c_k(beta X^2)   (THEORY 7.28)
OrbitPoint orbit_at(const Orbit& o, double X) noexcept {
  const Stumpff c = stumpff(o.beta * X * X);
  const double G1 = X * c.c1, G2 = X * X * c.c2, G3 = X * X * X * c.c3;
  return {o.r_0 * X + (o.eta * G2 + o.zeta * G3), o.r_0 + (o.eta * G1 + o.zeta * G2), G1, G2, G3};
}

/// Returns the point of the orbit after a time t > 0. Newton's method finds X between two bounds that
/// approach each other, because t increases with X.
OrbitPoint find(const Orbit& o, double t) noexcept {
  // First find bounds on X that differ by a factor of two. Between them Newton's method converges quickly.
  double high = t / o.r_0;
  constexpr int kMostOctaves = 2200;  // more than the factors of two in the range of doubles
  for (int k = 0; k < kMostOctaves && orbit_at(o, high).t < t; ++k) high *= 2.0;
  double low = 0.5 * high;
  for (int k = 0; k < kMostOctaves && !(orbit_at(o, low).t < t); ++k) high = low, low *= 0.5;
  double X = high;
  OrbitPoint at = orbit_at(o, X);
  constexpr int kMostIterations = 100;  // bisection alone would need fewer
  for (int k = 0; k < kMostIterations; ++k) {
    if (at.t < t)
      low = X;
    else
      high = X;
    double next = X - (at.t - t) / at.r;
    if (!(next >= low && next <= high)) next = 0.5 * (low + high);
    const double change = next - X;
    X = next;
    at = orbit_at(o, X);
    if (change <= 0x1p-51 * X && change >= -0x1p-51 * X) break;
  }
  return at;
}

}  // namespace

Fall fall(double mu, const Vec3& rho, const Vec3& v, double t) noexcept {
  if (t == 0.0) return {};
  const double r_0 = __builtin_sqrt(dot(rho, rho));
  const double beta = 2.0 * mu / r_0 - dot(v, v);
  if (beta > 0.0) {
    constexpr double kTwoPi = 6.2831853071795862;
    const double period = kTwoPi * mu / (beta * __builtin_sqrt(beta));
    const double revolutions = t / period;
    if (revolutions >= 0.5 || revolutions <= -0.5) t -= period * nearest(revolutions);
    if (t == 0.0) return {};
  }
  // if the time is negative, reverse the velocity and use a positive time
  const double sign = t < 0.0 ? -1.0 : 1.0;
  const Orbit orbit{r_0, sign * dot(rho, v), mu - beta * r_0, beta};
  const OrbitPoint at = find(orbit, sign * t);
  // rho^1 - rho^0 = f rho^0 + g v^0,  v^1 - v^0 = f_dot rho^0 + g_dot v^0   (THEORY 7.29)
  const double f = -mu * at.G2 / r_0, g = t - sign * mu * at.G3;
  const double f_dot = -sign * mu * at.G1 / (r_0 * at.r), g_dot = -mu * at.G2 / at.r;
  return {add_scaled(scale(f, rho), g, v), add_scaled(scale(f_dot, rho), g_dot, v)};
}

}  // namespace freeflex
