// A beam at true geometry (Crisfield 1990; Felippa and Haugen 2005), with the bow of its axis.
#pragma once

#include <array>

#include "core/step/vector.hpp"

namespace freeflex {

/// Holds the constants of a beam. Planes: 0 is rotation about local y, 1 is rotation about local z.
struct BeamConstants {
  double length = 0.0;                                 // [m]
  double axial = 0.0;                                  // [N/m] EA / L
  double torsion = 0.0;                                // [N m] GJ / L
  std::array<double, 2> symmetric{}, antisymmetric{};  // [N m] EI / L, 3 EI / (L (1 + phi))
  // [-] shear's share of the antisymmetric energy, phi / (1 + phi), and the strain of the axis per square of
  // t_1 + t_2   (THEORY 12.62)
  std::array<double, 2> shear{}, skew_bow{};
};

/// Holds the local axes of one end, columns of its present rotation: n along the beam, and y.
struct BeamEnd {
  Vec3 n, y;
};

/// Holds the derivatives of the strain energy of a beam.
struct BeamGradient {
  double energy = 0.0;   // [J]
  double tension = 0.0;  // [N] along the chord
  Vec3 y{};              // axis y of the chord
  Vec3 force{};          // [N] by the displacement of the second point; that of the first is the opposite
  Vec3 moment[2] = {};   // [N m] by a small rotation of each end
};

/// Computes the gradient of the energy   (THEORY 12.60 to 12.64):
///   E = EA e^2 / (2 L) + GJ tau^2 / (2 L) + sum over planes (EI (t_2 - t_1)^2 / (2 L)
///       + 3 EI (t_1 + t_2)^2 (1 + 2 shear e / L) / (2 L (1 + phi)))
///   e = l - L + L sum over planes ((t_2 - t_1)^2 / 24 + skew_bow (t_1 + t_2)^2)
/// \param span  [m] rest vector from the first to the second point  \param d  [m] its change
BeamGradient gradient_of(const BeamConstants& beam, const Vec3& span, const Vec3& d, const BeamEnd& first,
                         const BeamEnd& second) noexcept;

/// Computes the same derivatives for small displacements and rotations   (THEORY 3.6 to 3.9).
/// \param axes  rest axes of the beam as columns  \param theta  [rad] small rotations of the ends
BeamGradient linear_gradient_of(const BeamConstants& beam, const Mat3& axes, const Vec3& d, const Vec3& first,
                                const Vec3& second) noexcept;
/// Returns the force of this gradient alone.  \param both  [rad] sum of the rotations of the ends
Vec3 linear_force_of(const BeamConstants& beam, const Mat3& axes, const Vec3& d, const Vec3& both) noexcept;

}  // namespace freeflex
