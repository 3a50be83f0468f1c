#include "core/step/links/angle.hpp"

#include "core/step/links/rotations.hpp"

namespace freeflex {
namespace {

/// Returns the angle from one direction of the plane to another, in (-pi, pi), from their sines and cosines.
double angle_between(double from_sine, double from_cosine, double sine, double cosine) noexcept {
  const double s = sine * from_cosine - cosine * from_sine, c = cosine * from_cosine + sine * from_sine;
  return angle_per_sine(magnitude(s), c) * s;
}

/// (THEORY 12.69, 12.70)
AngleGradient of_bend(const AngleConstants& angle, const Vec3 (&x)[4]) noexcept {
  AngleGradient result;
  const Vec3 to_first = sub(x[0], x[1]), to_last = sub(x[2], x[1]);
  const double l_first = length(to_first), l_last = length(to_last);
  const Vec3 a = scale(1.0 / l_first, to_first), c = scale(1.0 / l_last, to_last), across = cross(a, c);
  const double sine = length(across), cosine = dot(a, c);
  double moment = 0.0;  // minus the derivative of the energy by the cosine of the angle
  if (angle.form == AngleConstants::Form::kAngle) {
    const double change = angle_between(angle.rest_sine, angle.rest_cosine, sine, cosine);
    result.energy = 0.5 * angle.stiffness * change * change;
    moment = angle.stiffness * change / sine;
  } else {
    const double side = angle.form == AngleConstants::Form::kFolded ? 1.0 : -1.0;
    const double ratio = angle_per_sine(sine, side * cosine);
    result.energy = 0.5 * angle.stiffness * (ratio * sine) * (ratio * sine);
    moment = side * angle.stiffness * ratio;
  }
  result.force[0] = scale(-moment / l_first, cross(across, a));
  result.force[2] = scale(-moment / l_last, cross(c, across));
  result.force[1] = scale(-1.0, add(result.force[0], result.force[2]));
  return result;
}

/// (THEORY 12.71)
AngleGradient of_twist(const AngleConstants& angle, const Vec3 (&x)[4]) noexcept {
  AngleGradient result;
  const Vec3 a1 = sub(x[1], x[0]), a2 = sub(x[2], x[1]), a3 = sub(x[3], x[2]);
  const Vec3 m = cross(a1, a2), n = cross(a2, a3);
  const double l = length(a2), mm = dot(m, m), nn = dot(n, n), size = __builtin_sqrt(mm * nn);
  const double change =
      angle_between(angle.rest_sine, angle.rest_cosine, l * dot(a1, n) / size, dot(m, n) / size);
  const double moment = angle.stiffness * change;
  result.energy = 0.5 * moment * change;
  const Vec3 at_first = scale(-l / mm, m), at_last = scale(l / nn, n);
  const double by_first = dot(a1, a2) / (l * l), by_last = dot(a3, a2) / (l * l);
  result.force[0] = scale(moment, at_first);
  result.force[1] = scale(moment, add(scale(by_last, at_last), scale(-(1.0 + by_first), at_first)));
  result.force[2] = scale(moment, add(scale(by_first, at_first), scale(-(1.0 + by_last), at_last)));
  result.force[3] = scale(moment, at_last);
  return result;
}

}  // namespace

AngleGradient gradient_of(const AngleConstants& angle, const Vec3 (&x)[4]) noexcept {
  return angle.form == AngleConstants::Form::kDihedral ? of_twist(angle, x) : of_bend(angle, x);
}

double change_of(const AngleConstants& angle, const Vec3 (&x)[4]) noexcept {
  if (angle.form == AngleConstants::Form::kDihedral) {
    const Vec3 a1 = sub(x[1], x[0]), a2 = sub(x[2], x[1]), a3 = sub(x[3], x[2]);
    const Vec3 m = cross(a1, a2), n = cross(a2, a3);
    const double size = __builtin_sqrt(dot(m, m) * dot(n, n));
    return angle_between(angle.rest_sine, angle.rest_cosine, length(a2) * dot(a1, n) / size,
                         dot(m, n) / size);
  }
  const Vec3 a = sub(x[0], x[1]), c = sub(x[2], x[1]);
  const double size = length(a) * length(c);
  return angle_between(angle.rest_sine, angle.rest_cosine, length(cross(a, c)) / size, dot(a, c) / size);
}

Vec3 bend_of(const AngleConstants& angle, const Vec3 (&x)[4]) noexcept {
  const Vec3 to_first = sub(x[0], x[1]), to_last = sub(x[2], x[1]);
  const Vec3 a = scale(1.0 / length(to_first), to_first), c = scale(1.0 / length(to_last), to_last);
  const double side = angle.form == AngleConstants::Form::kFolded ? -1.0 : 1.0;
  const Vec3 kink = add_scaled(a, side, c);  // of length 2 sin(bend / 2)
  const double sine = length(cross(a, c)), bend = angle_per_sine(sine, -side * dot(a, c)) * sine,
               size = length(kink);
  return size < 1e-9 ? kink : scale(bend / size, kink);
}

}  // namespace freeflex
