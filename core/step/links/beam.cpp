#include "core/step/links/beam.hpp"

#include <algorithm>

#include "core/step/linear/columns.hpp"
#include "core/step/links/beam_batch.hpp"
#include "core/step/links/rotations.hpp"

namespace freeflex {
namespace {

// With SmallAngle, the functions for the gradient have no branches, so that the compiler puts a loop over
// beams into vector registers.

/// Holds the largest angles of one beam, by their sines and cosines. SmallAngle may be used for the beam if
/// is_small_angle() is true for them.
struct BeamAngles {
  double largest_square, smallest_cosine;  // of the sines and of the cosines
};
FREEFLEX_KERNEL double larger(double a, double b) noexcept { return a > b ? a : b; }
FREEFLEX_KERNEL double smaller(double a, double b) noexcept { return a < b ? a : b; }

/// Takes angles from 0 to pi.
struct AnyAngle {
  static double per_sine(double square, double cosine) noexcept {
    return angle_per_sine(__builtin_sqrt(square), cosine);
  }
  static double per_sine_slope(double square, double cosine, double ratio) noexcept {
    return angle_per_sine_slope(__builtin_sqrt(square), cosine, ratio);
  }
};
/// Takes angles for which is_small_angle() is true, by series.
struct SmallAngle {
  static FREEFLEX_KERNEL double per_sine(double square, double) noexcept {
    return all_terms<0>(kAngleRatios, square);
  }
  static FREEFLEX_KERNEL double per_sine_slope(double square, double, double) noexcept {
    return -all_terms<0>(kSlopeRatios, square) / 3.0;
  }
};

/// Holds the rotation of an end relative to the chord u, which is normal to u: rho = -f n x u with f =
/// angle / sine   (THEORY 12.60).
struct EndOnChord {
  Vec3 n_u;                      // n x u
  double square, cosine, f, df;  // |n x u|^2; n . u; f; derivative of f by the cosine
  Vec3 y;                        // y axis of the end after the smallest rotation that takes n to u
};

template <class Angle>
FREEFLEX_KERNEL EndOnChord on_chord(const BeamEnd& end, const Vec3& u) noexcept {
  EndOnChord result;
  result.n_u = cross(end.n, u);
  result.cosine = dot(end.n, u);
  result.square = dot(result.n_u, result.n_u);
  result.f = Angle::per_sine(result.square, result.cosine);
  result.df = Angle::per_sine_slope(result.square, result.cosine, result.f);
  result.y = add_scaled(end.y, -dot(u, end.y) / (1.0 + result.cosine), add(end.n, u));
  return result;
}

/// Sets the energy without torsion [J] and its derivatives M by the rotations t of the ends [N m]. Returns
/// the tension [N], its derivative by the length of the chord   (THEORY 12.62). \param elongation  [m] of the
/// chord  \param t  [rad] relative to the chord, [end][plane]
FREEFLEX_KERNEL double bend(const BeamConstants& beam, double elongation, const double (&t)[2][2],
                            double& energy, double (&M)[2][2]) noexcept {
  const double L = beam.length;
  double bent[2], skew[2], bow = 0.0,
                           sheared = 0.0;  // `sheared` is L times what the shear adds to the tension
  for (std::size_t p = 0; p < 2; ++p) {
    bent[p] = t[1][p] - t[0][p], skew[p] = t[0][p] + t[1][p];
    bow += bent[p] * bent[p] / 24.0 + beam.skew_bow[p] * (skew[p] * skew[p]);
    sheared += beam.shear[p] * beam.antisymmetric[p] * (skew[p] * skew[p]);
  }
  const double stretch = elongation + L * bow;
  const double N = beam.axial * stretch + sheared / L;
  energy = 0.5 * (beam.axial * stretch * stretch) + sheared * stretch / L;
  for (std::size_t p = 0; p < 2; ++p) {
    const double a = beam.symmetric[p] * bent[p], b = beam.antisymmetric[p] * skew[p];
    energy += 0.5 * (a * bent[p] + b * skew[p]);
    const double of_bent = a + N * L / 12.0 * bent[p];
    const double of_skew = b + 2.0 * (beam.shear[p] * stretch / L * b + N * L * beam.skew_bow[p] * skew[p]);
    M[0][p] = of_skew - of_bent;
    M[1][p] = of_skew + of_bent;
  }
  return N;
}

/// Computes the gradient of gradient_of(), and sets `angles`.
template <class Angle>
FREEFLEX_KERNEL BeamGradient beam_gradient(const BeamConstants& beam, const Vec3& span, const Vec3& d,
                                           const BeamEnd& first, const BeamEnd& second,
                                           BeamAngles& angles) noexcept {
  BeamGradient result;
  const Vec3 chord = add(span, d);
  const double l = length(chord);
  const Vec3 u = scale(1.0 / l, chord);
  const BeamEnd* const given[2] = {&first, &second};
  const EndOnChord ends[2] = {on_chord<Angle>(first, u), on_chord<Angle>(second, u)};

  // the axes y, z of the chord are half way between those of the two ends, and the twist tau is the roll from
  // the first end to the second   (THEORY 12.61)
  const Vec3 both = add(ends[0].y, ends[1].y);
  const Vec3 y = scale(1.0 / length(both), both), z = cross(u, y);
  const double sine = dot(u, cross(ends[0].y, ends[1].y)), cosine = dot(ends[0].y, ends[1].y);
  const double twist = Angle::per_sine(sine * sine, cosine) * sine;
  angles = {larger(sine * sine, larger(ends[0].square, ends[1].square)),
            smaller(cosine, smaller(ends[0].cosine, ends[1].cosine))};

  // t_y = rho . y = -f n . z, t_z = rho . z = f n . y   (THEORY 12.60)
  double t[2][2], M[2][2];  // [end][plane]
  for (std::size_t k = 0; k < 2; ++k) {
    t[k][0] = -ends[k].f * dot(given[k]->n, z);
    t[k][1] = ends[k].f * dot(given[k]->n, y);
  }
  const double elongation = (2.0 * dot(span, d) + dot(d, d)) / (l + beam.length);
  const double N = result.tension = bend(beam, elongation, t, result.energy, M);
  const double T = beam.torsion * twist;
  result.y = y;
  result.energy += 0.5 * T * twist;

  // With a = M_z y - M_y z, M . t = f n . a. The axes of the chord roll by the mean roll of both ends, so
  // bending does the work P = f n . (u x a) per roll   (THEORY 12.63)
  Vec3 a[2];
  double P = 0.0;
  for (std::size_t k = 0; k < 2; ++k) {
    a[k] = add(scale(M[k][1], y), scale(-M[k][0], z));
    P += ends[k].f * dot(a[k], ends[k].n_u);
  }
  Vec3 by_u{};
  for (std::size_t k = 0; k < 2; ++k) {
    const EndOnChord& end = ends[k];
    const Vec3& n = given[k]->n;
    const double slope = end.df * dot(n, a[k]);
    const double roll = ((k == 0 ? -T : T) + 0.5 * P) / (1.0 + end.cosine);
    result.moment[k] = add_scaled(cross(n, add(scale(slope, u), scale(end.f, a[k]))), roll, add(n, u));
    by_u = add(by_u, add(scale(slope, n), scale(-end.f * end.cosine, a[k])));
    by_u = add_scaled(by_u, -roll, end.n_u);
  }
  result.force = add_scaled(scale(N, u), 1.0 / l, add_scaled(by_u, -dot(u, by_u), u));
  return result;
}

constexpr std::size_t kNumConstants = 14, kNumEnds = 15, kNumResults = 11;  // rows of a block

FREEFLEX_KERNEL void set_block_to(const double* __restrict constants, const double* __restrict ends,
                                  double* __restrict results) noexcept {
  for (std::size_t lane = 0; lane < kBlock; ++lane) {
    const double *c = constants + lane, *e = ends + lane;
    BeamConstants beam;
    beam.length = entry(c, 3), beam.axial = entry(c, 4), beam.torsion = entry(c, 5);
    beam.symmetric = {entry(c, 6), entry(c, 7)};
    beam.antisymmetric = {entry(c, 8), entry(c, 9)};
    beam.shear = {entry(c, 10), entry(c, 11)};
    beam.skew_bow = {entry(c, 12), entry(c, 13)};
    BeamAngles angles;
    const BeamGradient g =
        beam_gradient<SmallAngle>(beam, vector_at(c, 0), vector_at(e, 0), {vector_at(e, 3), vector_at(e, 6)},
                                  {vector_at(e, 9), vector_at(e, 12)}, angles);
    double* const to = results + lane;
    put(g.force, to, 0), put(g.moment[0], to, 3), put(g.moment[1], to, 6);
    put(angles.largest_square, to, 9), put(angles.smallest_cosine, to, 10);
  }
}

FREEFLEX_KERNEL void set_blocks_to(const double* constants, const double* ends, std::size_t count,
                                   double* results) noexcept {
  for (std::size_t first = 0; first < count; first += kBlock) {
    set_block_to(constants, ends, results);
    constants += kNumConstants * kBlock, ends += kNumEnds * kBlock, results += kNumResults * kBlock;
  }
}

}  // namespace

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

BeamBatch make_beam_batch(const std::vector<PlanTrueBeam>& beams) {
  BeamBatch batch;
  const std::size_t padded = pad(beams.size());
  batch.constants.resize(kNumConstants * padded);
  batch.ends.resize(kNumEnds * padded);
  batch.results.resize(kNumResults * padded);
  for (std::size_t k = 0; k < padded; ++k) {
    // the last beam fills the rest of its block
    const PlanTrueBeam& plan = beams[std::min(k, beams.size() - 1)];
    const BeamConstants& beam = plan.constants;
    double* const c = column_of(batch.constants.data(), k, kNumConstants);
    put(plan.span, c, 0);
    put(beam.length, c, 3), put(beam.axial, c, 4), put(beam.torsion, c, 5);
    for (std::size_t p = 0; p < 2; ++p) {
      put(beam.symmetric[p], c, 6 + p), put(beam.antisymmetric[p], c, 8 + p);
      put(beam.shear[p], c, 10 + p), put(beam.skew_bow[p], c, 12 + p);
    }
    const Mat3& axes = plan.axes;
    const BeamEnd rest{{axes[0], axes[3], axes[6]}, {axes[1], axes[4], axes[7]}};
    set_beam(k, {}, rest, rest, batch);
  }
  return batch;
}

void set_beam(std::size_t beam, const Vec3& d, const BeamEnd& first, const BeamEnd& second,
              BeamBatch& batch) noexcept {
  double* const e = column_of(batch.ends.data(), beam, kNumEnds);
  put(d, e, 0), put(first.n, e, 3), put(first.y, e, 6), put(second.n, e, 9), put(second.y, e, 12);
}

void set_gradients(const std::vector<PlanTrueBeam>& beams, BeamBatch& batch) noexcept {
  run_auto<set_blocks_to>(static_cast<const double*>(batch.constants.data()),
                          static_cast<const double*>(batch.ends.data()), beams.size(), batch.results.data());
  for (std::size_t k = 0; k < beams.size(); ++k) {
    double* const to = column_of(batch.results.data(), k, kNumResults);
    if (is_small_angle(entry(to, 9), entry(to, 10))) continue;
    const double* const e = column_of(batch.ends.data(), k, kNumEnds);
    const BeamGradient g =
        gradient_of(beams[k].constants, beams[k].span, vector_at(e, 0), {vector_at(e, 3), vector_at(e, 6)},
                    {vector_at(e, 9), vector_at(e, 12)});
    put(g.force, to, 0), put(g.moment[0], to, 3), put(g.moment[1], to, 6);
  }
}

BeamGradient gradient_in(const BeamBatch& batch, std::size_t beam) noexcept {
  const double* const from = column_of(batch.results.data(), beam, kNumResults);
  BeamGradient g;
  g.force = vector_at(from, 0);
  g.moment[0] = vector_at(from, 3), g.moment[1] = vector_at(from, 6);
  return g;
}

}  // namespace freeflex
