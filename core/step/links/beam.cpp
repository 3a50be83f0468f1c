#include "core/step/links/beam.hpp"

#include "core/step/links/beam_gradient.hpp"

namespace freeflex {

BeamGradient gradient_of(const BeamConstants& beam, const Vec3& span, const Vec3& d, const BeamEnd& first,
                         const BeamEnd& second) noexcept {
  BeamAngles angles;
  return beam_gradient<AnyAngle>(beam, span, d, first, second, angles);
}

BeamGradient linear_gradient_of(const BeamConstants& beam, const Mat3& axes, const Vec3& d, const Vec3& first,
                                const Vec3& second) noexcept {
  BeamGradient result;
  const Vec3 x{axes[0], axes[3], axes[6]},
      across[2] = {{axes[1], axes[4], axes[7]}, {axes[2], axes[5], axes[8]}};
  const Vec3 chord = scale(1.0 / beam.length, cross(x, d));  // rotation of the chord
  const Vec3 rotation[2] = {sub(first, chord), sub(second, chord)};
  const double N = beam.axial * dot(x, d), T = beam.torsion * dot(x, sub(second, first));
  result.tension = N;
  result.energy = 0.5 * (N * dot(x, d) + T * dot(x, sub(second, first)));
  result.moment[0] = scale(-T, x), result.moment[1] = scale(T, x);
  Vec3 on_chord{};
  for (std::size_t p = 0; p < 2; ++p) {
    const double t1 = dot(across[p], rotation[0]), t2 = dot(across[p], rotation[1]);
    const double a = beam.symmetric[p] * (t2 - t1), b = beam.antisymmetric[p] * (t1 + t2);
    result.energy += 0.5 * (a * (t2 - t1) + b * (t1 + t2));
    result.moment[0] = add_scaled(result.moment[0], b - a, across[p]);
    result.moment[1] = add_scaled(result.moment[1], b + a, across[p]);
    on_chord = add_scaled(on_chord, 2.0 * b, across[p]);
  }
  result.force = add_scaled(scale(N, x), -1.0 / beam.length, cross(on_chord, x));
  return result;
}

Vec3 linear_force_of(const BeamConstants& beam, const Mat3& axes, const Vec3& d, const Vec3& both) noexcept {
  const Vec3 x{axes[0], axes[3], axes[6]}, y{axes[1], axes[4], axes[7]}, z{axes[2], axes[5], axes[8]};
  const double twice = 2.0 / beam.length;  // the chord rotates by (-z . d, y . d) / L about y and z
  const double about_y = beam.antisymmetric[0] * (dot(y, both) + twice * dot(z, d));
  const double about_z = beam.antisymmetric[1] * (dot(z, both) - twice * dot(y, d));
  const Vec3 across = add(scale(twice * about_y, z), scale(-twice * about_z, y));
  return add_scaled(across, beam.axial * dot(x, d), x);
}

}  // namespace freeflex
