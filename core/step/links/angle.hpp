// Bending and torsion springs at their true angle.
#pragma once

#include "core/step/vector.hpp"

namespace freeflex {

/// Holds a spring on the angle at the second of three points, or on the dihedral angle of four points.
struct AngleConstants {
  enum class Form { kAngle = 0, kStraight = 1, kFolded = 2, kDihedral = 3 };
  Form form = Form::kAngle;
  double stiffness = 0.0;                     // [N m/rad]
  double rest_sine = 0.0, rest_cosine = 1.0;  // of the rest angle
};

/// Holds the derivatives of the energy by displacements of the points. A dihedral angle has four points.
struct AngleGradient {
  double energy = 0.0;  // [J]
  Vec3 force[4] = {};   // [N]
};

/// Computes the gradient of D (angle - rest)^2 / 2 at the positions x [m] of its three points, or of its four
/// points for a dihedral angle   (THEORY 12.69 to 12.71).
AngleGradient gradient_of(const AngleConstants& angle, const Vec3 (&x)[4]) noexcept;

/// Returns the change of the angle [rad].  \pre the form is kAngle or kDihedral
double change_of(const AngleConstants& angle, const Vec3 (&x)[4]) noexcept;
/// Returns the bend of a straight or folded angle as a vector normal to its line, of length |bend| [rad]. It
/// points to the side to which the ends bend.
Vec3 bend_of(const AngleConstants& angle, const Vec3 (&x)[4]) noexcept;

}  // namespace freeflex
