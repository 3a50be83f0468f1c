// The corotational beam (Crisfield 1990; Felippa and Haugen 2005) with the bow of its axis
// (THEORY 10.16, 10.17).
#include <Eigen/LU>
#include <cmath>

#include "tools/verification/reference/rotating_links.hpp"
#include "tools/verification/reference/rotations.hpp"

namespace freeflex {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

// the local axes of the undeformed beam as columns   (THEORY 3.4)
Matrix3d local_axes(const Vector3d& span, const Vector3d& given) {
  const Vector3d x = span.normalized();
  Vector3d y = given;
  if (y.isZero(0.0)) {
    Eigen::Index least = 0;
    x.cwiseAbs().minCoeff(&least);
    y = Vector3d::Unit(least);
  }
  const Vector3d z = x.cross(y).normalized();
  Matrix3d axes;
  axes << x, z.cross(x), z;
  return axes;
}

/// An end of a beam. The chord of the beam has the direction u, and n is the x axis of the end
/// (THEORY 10.16).
struct EndOnChord {
  EndOnChord(const Matrix3d& end, const Vector3d& u) {
    const Vector3d w = end.col(0).cross(u);
    const double cosine = end.col(0).dot(u);
    to_chord = smallest_rotation(end.col(0), u);
    axes = to_chord * end;
    rotation = -angle_over_sine(w.norm(), cosine) * w;
  }
  Matrix3d to_chord;  // the smallest rotation that takes n to the chord
  Matrix3d axes;      // axes of the end after that rotation
  Vector3d rotation;  // [rad] rotation of the end relative to the chord, normal to the chord: -(angle /
                      // sin(angle)) n x u
};

/// Returns the second derivative of the energy with respect to t_y, t_z and roll of both ends (THEORY 10.17).
/// \param N  [N] tension  \param bow  [m] derivatives of the length of the bowed axis, [end][plane]
Eigen::Matrix<double, 6, 6> natural_stiffness(const TrueBeam& beam, double N,
                                              const std::array<std::array<double, 2>, 2>& bow) {
  Eigen::Matrix<double, 6, 6> natural = Eigen::Matrix<double, 6, 6>::Zero();
  for (Eigen::Index p = 0; p < 2; ++p) {
    const auto plane = index(p);
    const double own = beam.symmetric[plane] + beam.antisymmetric[plane] + 4.0 * N * beam.length / 30.0;
    const double other = beam.antisymmetric[plane] - beam.symmetric[plane] - N * beam.length / 30.0;
    natural(p, p) = natural(3 + p, 3 + p) = own;
    natural(p, 3 + p) = natural(3 + p, p) = other;
  }
  natural(2, 2) = natural(5, 5) = beam.torsion;
  natural(2, 5) = natural(5, 2) = -beam.torsion;
  Eigen::Matrix<double, 6, 1> bows;
  bows << bow[0][0], bow[0][1], 0.0, bow[1][0], bow[1][1], 0.0;
  natural += beam.EA / beam.length * bows * bows.transpose();
  return natural;
}

}  // namespace

TrueBeam::TrueBeam(const Beam& beam, const Vector3d& given_span)
    : rest(local_axes(given_span, beam.y_axis)),
      span(given_span),
      length(given_span.norm()),
      EA(beam.EA),
      torsion(beam.GJ / length) {
  // bending about y deflects the beam along z, and bending about z deflects it along y; phi is defined by
  // (THEORY 3.10)
  const std::array<double, 2> EI{beam.EI_y, beam.EI_z}, GA{beam.GA_z, beam.GA_y};
  for (std::size_t plane = 0; plane < 2; ++plane) {
    const double phi = GA[plane] > 0.0 ? 12.0 * EI[plane] / (GA[plane] * length * length) : 0.0;
    symmetric[plane] = EI[plane] / length;
    antisymmetric[plane] = 3.0 * EI[plane] / (length * (1.0 + phi));
  }
}

void TrueBeam::evaluate(const Vector3d& d, const std::array<Matrix3d, 2>& ends, bool with_stiffness,
                        LinkGradient& result) const {
  const Vector3d chord = span + d;
  const double l = chord.norm();
  const Vector3d u = chord / l;
  const std::array<EndOnChord, 2> on_chord{EndOnChord(ends[0], u), EndOnChord(ends[1], u)};

  // The axes y and z of the chord are half way between the axes of the ends after `to_chord`. The twist
  // is the roll from the first end to the second, atan2(z_1.y_2, y_1.y_2)   (THEORY 10.16)
  const Vector3d y = (on_chord[0].axes.col(1) + on_chord[1].axes.col(1)).normalized(), z = u.cross(y);
  const double twist = std::atan2(on_chord[0].axes.col(2).dot(on_chord[1].axes.col(1)),
                                  on_chord[0].axes.col(1).dot(on_chord[1].axes.col(1)));
  const std::array<Vector3d, 2> across{y, z};

  // energy and its derivatives with respect to the end rotations t_1, t_2 about y and about z (THEORY 10.17)
  std::array<std::array<double, 2>, 2> t{}, bow{}, M{};  // [end][plane]
  double bow_length = 0.0;                               // [m] length of the bowed axis minus the chord
  for (std::size_t p = 0; p < 2; ++p) {
    const double t1 = across[p].dot(on_chord[0].rotation), t2 = across[p].dot(on_chord[1].rotation);
    t[0][p] = t1;
    t[1][p] = t2;
    bow_length += length * (2.0 * t1 * t1 - t1 * t2 + 2.0 * t2 * t2) / 30.0;
    bow[0][p] = length * (4.0 * t1 - t2) / 30.0;
    bow[1][p] = length * (4.0 * t2 - t1) / 30.0;
  }
  // l - L without a difference of lengths   (THEORY 10.3)
  const double stretch = (2.0 * span.dot(d) + d.squaredNorm()) / (l + length) + bow_length;
  const double N = EA / length * stretch;
  result.energy = 0.5 * N * stretch + 0.5 * torsion * twist * twist;
  for (std::size_t p = 0; p < 2; ++p) {
    const double bent = t[1][p] - t[0][p], skew = t[0][p] + t[1][p];
    result.energy += 0.5 * symmetric[p] * bent * bent + 0.5 * antisymmetric[p] * skew * skew;
    M[0][p] = -symmetric[p] * bent + antisymmetric[p] * skew + N * bow[0][p];
    M[1][p] = symmetric[p] * bent + antisymmetric[p] * skew + N * bow[1][p];
  }

  // The angular velocity of an end relative to the chord has three components: the rates of its rotation
  // about y and about z, and the rate of its roll. The axes y and z roll by the mean roll of both ends, so
  // the bending moments also do work on the rolls. `shift` [N m] takes this work into account.
  const std::array<Vector3d, 2> M_across{M[0][0] * y + M[0][1] * z, M[1][0] * y + M[1][1] * z};
  const double shift =
      0.5 * u.dot(on_chord[0].rotation.cross(M_across[0]) + on_chord[1].rotation.cross(M_across[1]));
  std::array<Matrix3d, 2> rates;  // rates of rotation about y, about z and of roll, per angular velocity
  Vector3d chord_moment = Vector3d::Zero();
  for (std::size_t k = 0; k < 2; ++k) {
    const Matrix3d T = spin_per_rate(on_chord[k].rotation);
    Matrix3d spins;
    spins << T * y, T * z, ends[k].col(0);
    rates[k] = spins.inverse();
    const double roll = (k == 0 ? -1.0 : 1.0) * torsion * twist - shift;
    result.moment[k] = rates[k].transpose() * Vector3d(M[k][0], M[k][1], roll);
    chord_moment += result.moment[k];
  }
  result.force[1] = N * u - chord_moment.cross(u) / l;
  result.force[0] = -result.force[1];
  if (!with_stiffness) return;

  const Eigen::Matrix<double, 6, 6> natural = natural_stiffness(*this, N, bow);
  for (Eigen::Index i = 0; i < 2; ++i)
    for (Eigen::Index j = 0; j < 2; ++j)
      result.stiffness.block<3, 3>(3 * i, 3 * j) =
          rates[index(i)].transpose() * natural.block<3, 3>(3 * i, 3 * j) * rates[index(j)];
}

}  // namespace freeflex
