#include "core/step/links/plate.hpp"

#include "core/step/links/rotations.hpp"

namespace freeflex {
namespace {

/// Returns the moments of the corners, D_b theta, in local axes.
void bend(const PlateConstants& plate, const Vec3 (&theta)[3], Vec3 (&m)[3]) noexcept {
  for (std::size_t i = 0; i < 3; ++i)
    for (std::size_t a = 0; a < 3; ++a) {
      const double* row = plate.bending.data() + 9 * (3 * i + a);
      double sum = 0.0;
      for (std::size_t j = 0; j < 3; ++j)
        sum += row[3 * j] * theta[j][0] + row[3 * j + 1] * theta[j][1] + row[3 * j + 2] * theta[j][2];
      m[i][a] = sum;
    }
}

/// Holds the present axes of a plate and its stretch   (THEORY 12.65).
struct PlateAxes {
  Vec3 first, second;  // [m] sides
  double area;         // [m^2] twice the area
  Vec3 x, y, n;
  double U00, U01, U10, U11, trace;
};

/// F = (F_x, F_y), split into a rotation and the stretch U
PlateAxes axes_of(const PlateConstants& plate, const Vec3 (&d)[3]) noexcept {
  PlateAxes a;
  a.first = add(plate.first, sub(d[1], d[0])), a.second = add(plate.second, sub(d[2], d[0]));
  const Vec3 twice_area = cross(a.first, a.second);
  a.area = length(twice_area);
  a.n = scale(1.0 / a.area, twice_area);
  const auto& g = plate.gradients;
  const Vec3 Fx = add(scale(g[1][0], a.first), scale(g[2][0], a.second)),
             Fy = add(scale(g[1][1], a.first), scale(g[2][1], a.second));
  const Vec3 x = scale(1.0 / length(Fx), Fx), y = cross(a.n, x);
  const double G00 = dot(x, Fx), G10 = dot(y, Fx), G01 = dot(x, Fy), G11 = dot(y, Fy);
  const double c = G00 + G11, s = G10 - G01;
  a.trace = __builtin_sqrt(c * c + s * s);
  const double cosine = c / a.trace, sine = s / a.trace;
  a.x = add(scale(cosine, x), scale(sine, y)), a.y = add(scale(-sine, x), scale(cosine, y));
  a.U00 = cosine * G00 + sine * G10, a.U01 = cosine * G01 + sine * G11;
  a.U10 = cosine * G10 - sine * G00, a.U11 = cosine * G11 - sine * G01;
  return a;
}

/// Holds the normal of a corner relative to that of the plate.
struct Corner {
  Vec3 n;                // normal of the corner
  double cosine, f, df;  // cosine of the tilt; angle / sine of the tilt; derivative of f by the cosine
};
Corner corner_of(const PlateAxes& axes, const Mat3& end) noexcept {
  const Vec3 n{end[2], end[5], end[8]};
  const double cosine = dot(n, axes.n), sine = length(cross(n, axes.n)), f = angle_per_sine(sine, cosine);
  return {n, cosine, f, angle_per_sine_slope(sine, cosine, f)};
}

}  // namespace

PlateGradient gradient_of(const PlateConstants& plate, const Vec3 (&d)[3], const Mat3 (&ends)[3]) noexcept {
  PlateGradient result;
  const PlateAxes axes = axes_of(plate, d);
  const Vec3 &first = axes.first, &second = axes.second, &axis_x = axes.x, &axis_y = axes.y, &n = axes.n;
  const double area = axes.area, trace = axes.trace;
  const double U00 = axes.U00, U01 = axes.U01, U10 = axes.U10, U11 = axes.U11;
  const auto& g = plate.gradients;

  // Membrane strains without differences of lengths: with dF the change of F, C - 1 = U^2 - 1 has the entries
  // below, and U - 1 = (C - 1) (U + 1)^-1   (THEORY 12.66)
  const Vec3 by_first = sub(d[1], d[0]), by_second = sub(d[2], d[0]);
  const Vec3 dFx = add(scale(g[1][0], by_first), scale(g[2][0], by_second)),
             dFy = add(scale(g[1][1], by_first), scale(g[2][1], by_second));
  const double C00 = 2.0 * dot(plate.axis_x, dFx) + dot(dFx, dFx),
               C11 = 2.0 * dot(plate.axis_y, dFy) + dot(dFy, dFy),
               C01 = dot(plate.axis_x, dFy) + dot(plate.axis_y, dFx) + dot(dFx, dFy);
  const double determinant = (U00 + 1.0) * (U11 + 1.0) - U01 * U10;
  const double e00 = (C00 * (U11 + 1.0) - C01 * U10) / determinant,
               e11 = (C11 * (U00 + 1.0) - C01 * U01) / determinant,
               e01 = (C01 * (U00 + 1.0) - C00 * U01) / determinant;
  const double eps[3] = {e00 + e11, e00 - e11, 2.0 * e01};
  double S[3];
  for (std::size_t k = 0; k < 3; ++k) {
    S[k] = plate.membrane[k] * eps[k];
    result.energy += 0.5 * S[k] * eps[k];
    result.membrane[k] = S[k];
  }
  for (std::size_t i = 0; i < 3; ++i)
    result.force[i] = add(scale((S[0] + S[1]) * g[i][0] + S[2] * g[i][1], axis_x),
                          scale(S[2] * g[i][0] + (S[0] - S[1]) * g[i][1], axis_y));

  // Bending, over the tilts of the normals of the corners and their rolls relative to the axes. A corner that
  // rolls about its own normal does not bend the plate   (THEORY 12.67)
  Vec3 theta[3];
  Corner corners[3];
  for (std::size_t i = 0; i < 3; ++i) {
    const Corner& corner = corners[i] = corner_of(axes, ends[i]);
    const Vec3 &normal = corner.n, first_axis{ends[i][0], ends[i][3], ends[i][6]};
    const Vec3 level = add_scaled(first_axis, -dot(n, first_axis) / (1.0 + corner.cosine), add(normal, n));
    const double sin_roll = dot(axis_y, level), cos_roll = dot(axis_x, level);
    theta[i] = {-corner.f * dot(normal, axis_y), corner.f * dot(normal, axis_x),
                angle_per_sine(magnitude(sin_roll), cos_roll) * sin_roll};
  }
  Vec3 m[3], on_axes{};  // m in local axes
  bend(plate, theta, m);
  for (std::size_t i = 0; i < 3; ++i) {
    result.energy += 0.5 * dot(m[i], theta[i]);
    result.theta[i] = theta[i];
    // with a = m_y x - m_x y, the tilts do the work of f normal . a   (THEORY 12.67)
    const Corner& corner = corners[i];
    const Vec3 a = add(scale(m[i][1], axis_x), scale(-m[i][0], axis_y));
    const double slope = corner.df * dot(corner.n, a);
    result.moment[i] = add_scaled(cross(corner.n, add(scale(slope, n), scale(corner.f, a))),
                                  m[i][2] / (1.0 + corner.cosine), add(corner.n, n));
    on_axes = add(on_axes, result.moment[i]);
  }
  // The moments also do work on the rotation of the axes: its components in the plane follow from
  // displacements across the plane, that about the normal from the rotation within the plane   (THEORY 12.68)
  const Vec3 side[3] = {sub(second, first), scale(-1.0, second), first};
  const double about_normal = dot(on_axes, n) / trace;
  for (std::size_t i = 0; i < 3; ++i) {
    result.force[i] = add_scaled(result.force[i], -dot(on_axes, side[i]) / area, n);
    result.force[i] = add_scaled(result.force[i], -about_normal * g[i][0], axis_y);
    result.force[i] = add_scaled(result.force[i], about_normal * g[i][1], axis_x);
  }
  return result;
}

PlateGradient linear_gradient_of(const PlateConstants& plate, const Vec3 (&d)[3],
                                 const Vec3 (&theta)[3]) noexcept {
  PlateGradient result;
  const auto& g = plate.gradients;
  const Vec3 &x = plate.axis_x, &y = plate.axis_y, n = cross(x, y);
  const Vec3 by_first = sub(d[1], d[0]), by_second = sub(d[2], d[0]);
  const Vec3 dFx = add(scale(g[1][0], by_first), scale(g[2][0], by_second)),
             dFy = add(scale(g[1][1], by_first), scale(g[2][1], by_second));
  const double e00 = dot(x, dFx), e11 = dot(y, dFy), e01 = dot(x, dFy) + dot(y, dFx);
  const double S[3] = {plate.membrane[0] * (e00 + e11), plate.membrane[1] * (e00 - e11),
                       plate.membrane[2] * e01};
  result.energy = 0.5 * (S[0] * (e00 + e11) + S[1] * (e00 - e11) + S[2] * e01);
  for (std::size_t i = 0; i < 3; ++i)
    result.force[i] = add(scale((S[0] + S[1]) * g[i][0] + S[2] * g[i][1], x),
                          scale(S[2] * g[i][0] + (S[0] - S[1]) * g[i][1], y));
  // small rotation of the axes: about x and y from displacements across the plane, about n within the plane
  const Vec3 turn{dot(n, dFy), -dot(n, dFx), 0.5 * (dot(y, dFx) - dot(x, dFy))};
  Vec3 relative[3], m[3], on_axes{};
  for (std::size_t i = 0; i < 3; ++i)
    relative[i] = sub({dot(x, theta[i]), dot(y, theta[i]), dot(n, theta[i])}, turn);
  bend(plate, relative, m);
  for (std::size_t i = 0; i < 3; ++i) {
    result.moment[i] = add(add(scale(m[i][0], x), scale(m[i][1], y)), scale(m[i][2], n));
    on_axes = add(on_axes, m[i]);
    result.energy += 0.5 * dot(m[i], relative[i]);
  }
  for (std::size_t i = 0; i < 3; ++i) {
    result.force[i] = add_scaled(result.force[i], on_axes[1] * g[i][0] - on_axes[0] * g[i][1], n);
    result.force[i] = add_scaled(result.force[i], -0.5 * on_axes[2] * g[i][0], y);
    result.force[i] = add_scaled(result.force[i], 0.5 * on_axes[2] * g[i][1], x);
  }
  return result;
}

}  // namespace freeflex
