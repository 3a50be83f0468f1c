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

/// The strain of the axis of a beam whose ends have the rotations t_1, t_2 relative to the chord:
/// of_squares (t_1^2 + t_2^2) + of_product t_1 t_2. The axis has the slope of bending, and the strain of
/// Reissner (1972) is along the normal of the sections, which shear turns by gamma from the axis. Half of the
/// mean square of the slope is L^-1 int w'^2 dx / 2 with w = s x (L - x) / L in symmetric bending and a cubic
/// in antisymmetric bending   (THEORY 10.17).
struct Bow {
  explicit Bow(double phi) {
    const double slope = 1.0 / (1.0 + phi), gamma = phi / (1.0 + phi);  // per (t_1 + t_2) / 2
    const double antisymmetric = slope * slope / 10.0 - 0.5 * gamma * gamma;
    of_squares = (1.0 / 6.0 + antisymmetric) / 4.0;
    of_product = (antisymmetric - 1.0 / 6.0) / 2.0;
  }
  double of_squares, of_product;
};

/// Returns the second derivative of the energy with respect to t_y, t_z and roll of both ends (THEORY 10.17).
/// \param N  [N] tension  \param bow  [m] derivatives of the length of the bowed axis, [end][plane]
Eigen::Matrix<double, 6, 6> natural_stiffness(const TrueBeam& beam, double N,
                                              const std::array<std::array<double, 2>, 2>& bow) {
  Eigen::Matrix<double, 6, 6> natural = Eigen::Matrix<double, 6, 6>::Zero();
  for (Eigen::Index p = 0; p < 2; ++p) {
    const auto plane = index(p);
    const Bow shape(beam.phi[plane]);
    const double own =
        beam.symmetric[plane] + beam.antisymmetric[plane] + 2.0 * N * beam.length * shape.of_squares;
    const double other =
        beam.antisymmetric[plane] - beam.symmetric[plane] + N * beam.length * shape.of_product;
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

/// Energy and its derivatives with respect to the end rotations t_1, t_2 about y and about z (THEORY 10.17).
struct Bending {
  using PerEnd = std::array<std::array<double, 2>, 2>;  // [end][plane]
  /// \param elongation  [m] of the chord  \param t  [rad] rotations of the ends relative to the chord
  Bending(const TrueBeam& beam, double elongation, const PerEnd& t) {
    const double length = beam.length;
    double stretch = elongation, shear_energy = 0.0;
    for (std::size_t p = 0; p < 2; ++p) {
      const Bow shape(beam.phi[p]);
      const double t1 = t[0][p], t2 = t[1][p], skew = t1 + t2;
      stretch += length * (shape.of_squares * (t1 * t1 + t2 * t2) + shape.of_product * t1 * t2);
      bow[0][p] = length * (2.0 * shape.of_squares * t1 + shape.of_product * t2);
      bow[1][p] = length * (2.0 * shape.of_squares * t2 + shape.of_product * t1);
      shear_energy += beam.phi[p] / (1.0 + beam.phi[p]) * 0.5 * beam.antisymmetric[p] * skew * skew;
    }
    // The shear strain of Reissner is (1 + e / L) gamma, so a stretch raises the energy of shear G A L
    // gamma^2 / 2 by the factor (1 + e / L)^2, here to first order.
    N = beam.EA / length * stretch + 2.0 * shear_energy / length;
    energy = 0.5 * beam.EA / length * stretch * stretch + 2.0 * shear_energy * stretch / length;
    for (std::size_t p = 0; p < 2; ++p) {
      const double bent = t[1][p] - t[0][p], skew = t[0][p] + t[1][p];
      energy += 0.5 * beam.symmetric[p] * bent * bent + 0.5 * beam.antisymmetric[p] * skew * skew;
      const double stiffened =
          beam.antisymmetric[p] * (1.0 + 2.0 * beam.phi[p] / (1.0 + beam.phi[p]) * stretch / length) * skew;
      M[0][p] = -beam.symmetric[p] * bent + stiffened + N * bow[0][p];
      M[1][p] = beam.symmetric[p] * bent + stiffened + N * bow[1][p];
    }
  }
  double N = 0.0, energy = 0.0;  // [N] by the length of the chord; [J] without torsion
  PerEnd bow{}, M{};             // [m] of the length of the axis; [N m]
};

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
    phi[plane] = GA[plane] > 0.0 ? 12.0 * EI[plane] / (GA[plane] * length * length) : 0.0;
    symmetric[plane] = EI[plane] / length;
    antisymmetric[plane] = 3.0 * EI[plane] / (length * (1.0 + phi[plane]));
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

  std::array<std::array<double, 2>, 2> t{};  // [end][plane]
  for (std::size_t k = 0; k < 2; ++k)
    for (std::size_t p = 0; p < 2; ++p) t[k][p] = across[p].dot(on_chord[k].rotation);
  // l - L without a difference of lengths   (THEORY 10.3)
  const Bending bending(*this, (2.0 * span.dot(d) + d.squaredNorm()) / (l + length), t);
  const auto& [N, energy, bow, M] = bending;
  result.energy = energy + 0.5 * torsion * twist * twist;

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
