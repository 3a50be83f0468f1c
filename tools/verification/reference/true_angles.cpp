// Angles between three points, dihedral angles of four points, stiffness matrices in axes that rotate with
// their points, and damping in body axes. THEORY 10.20 to 10.22, 10.24
#include <Eigen/Geometry>
#include <cmath>

#include "tools/verification/reference/rotations.hpp"
#include "tools/verification/reference/true_geometry.hpp"

namespace freeflex {
namespace {

using Eigen::Map;
using Eigen::Matrix3Xd;
using Eigen::Vector3d;
using Eigen::VectorXd;

// [rad] atan2(|a_2| a_1.(a_2 x a_3), (a_1 x a_2).(a_2 x a_3)), where a_1, a_2, a_3 are the vectors b1, b2, b3
// from each point to the next   (THEORY 10.21)
double dihedral(const Vector3d& b1, const Vector3d& b2, const Vector3d& b3) {
  const Vector3d m = b1.cross(b2), n = b2.cross(b3);
  return std::atan2(b2.norm() * b1.dot(n), m.dot(n));
}

// Adds the forces of a bending spring and returns its energy D (angle - rest)^2 / 2 [J]   (THEORY 10.20).
double bend(const TrueAngle& angle, const Matrix3Xd& x, TrueGeometry::Forces force) {
  const Vector3d to_i = x.col(0) - x.col(1), to_k = x.col(2) - x.col(1);
  const double l_i = to_i.norm(), l_k = to_k.norm();
  const Vector3d a = to_i / l_i, c = to_k / l_k, across = a.cross(c);
  const double sine = across.norm(), cosine = a.dot(c);
  // `moment` is minus the derivative of the energy with respect to the cosine of the angle
  double energy = 0.0, moment = 0.0;
  if (angle.is_straight) {
    // If the arms are folded, the angle is measured from one arm to the other arm. Otherwise it is measured
    // from one arm to the extension of the other arm.
    const double side = angle.is_folded ? 1.0 : -1.0;
    const double ratio = angle_over_sine(sine, side * cosine);
    energy = 0.5 * angle.stiffness * ratio * ratio * sine * sine;
    moment = side * angle.stiffness * ratio;
  } else {
    const double change = std::atan2(sine, cosine) - angle.rest;
    energy = 0.5 * angle.stiffness * change * change;
    moment = angle.stiffness * change / sine;
  }
  // Each force is `moment` times the gradient of the cosine, (c - cosine a) / l_i. It is computed as (a x c)
  // x a / l_i, which has no difference of nearly parallel vectors
  const Vector3d on_i = moment / l_i * across.cross(a), on_k = moment / l_k * c.cross(across);
  force.col(angle.points[0]) += on_i;
  force.col(angle.points[2]) += on_k;
  force.col(angle.points[1]) -= on_i + on_k;
  return energy;
}

// Adds the forces of a torsion spring, with the row of (THEORY 3.26, 3.27) at the present positions, and
// returns its energy D (dihedral - rest)^2 / 2 [J]   (THEORY 10.21).
double twist(const TrueAngle& angle, const Matrix3Xd& x, TrueGeometry::Forces force) {
  const Vector3d b1 = x.col(1) - x.col(0), b2 = x.col(2) - x.col(1), b3 = x.col(3) - x.col(2);
  const Vector3d m = b1.cross(b2), n = b2.cross(b3);
  const double change = std::remainder(dihedral(b1, b2, b3) - angle.rest, 2.0 * M_PI);
  const Vector3d at_i = -b2.norm() / m.squaredNorm() * m, at_l = b2.norm() / n.squaredNorm() * n;
  const double first = b1.dot(b2) / b2.squaredNorm(), last = b3.dot(b2) / b2.squaredNorm();
  const double moment = -angle.stiffness * change;
  force.col(angle.points[0]) += moment * at_i;
  force.col(angle.points[1]) += moment * (last * at_l - (1.0 + first) * at_i);
  force.col(angle.points[2]) += moment * (first * at_i - (1.0 + last) * at_l);
  force.col(angle.points[3]) += moment * at_l;
  return 0.5 * angle.stiffness * change * change;
}

// [m] (3 x points) present positions of the points of an angle
Matrix3Xd positions_of(const TrueAngle& angle, const Matrix3Xd& r, const TrueGeometry::PointVectors& e) {
  Matrix3Xd x(3, static_cast<Eigen::Index>(angle.points.size()));
  for (std::size_t k = 0; k < angle.points.size(); ++k)
    x.col(static_cast<Eigen::Index>(k)) = r.col(angle.points[k]) + e.col(angle.points[k]);
  return x;
}

}  // namespace

void TrueGeometry::add_twist(const Scene& scene, int index, double stiffness) {
  TrueAngle angle{.link = index, .points = scene.links[static_cast<std::size_t>(index)].points};
  const Matrix3Xd x = positions_of(angle, r_, Matrix3Xd::Zero(3, r_.cols()));
  angle.stiffness = stiffness;
  angle.rest = dihedral(x.col(1) - x.col(0), x.col(2) - x.col(1), x.col(3) - x.col(2));
  dihedrals_.push_back(angle);
}

void TrueGeometry::add_bend(const Scene& scene, int index, double stiffness) {
  TrueAngle angle{.link = index, .points = scene.links[static_cast<std::size_t>(index)].points};
  const Matrix3Xd x = positions_of(angle, r_, Matrix3Xd::Zero(3, r_.cols()));
  const Vector3d a = (x.col(0) - x.col(1)).normalized(), c = (x.col(2) - x.col(1)).normalized();
  constexpr double kStraight = 1e-12;  // [-] an angle with a smaller sine is straight
  angle.stiffness = stiffness;
  angle.rest = std::atan2(a.cross(c).norm(), a.dot(c));
  angle.is_straight = a.cross(c).norm() < kStraight;
  angle.is_folded = angle.is_straight && a.dot(c) > 0.0;
  angles_.push_back(angle);
}

double TrueGeometry::add_angles(const PointVectors& e, const Forces& force, VectorXd* energies) const {
  double sum = 0.0;
  const auto add = [&](const TrueAngle& angle, double energy) {
    if (energies != nullptr) (*energies)[angle.link] += energy;
    sum += energy;
  };
  for (const TrueAngle& angle : angles_) add(angle, bend(angle, positions_of(angle, r_, e), force));
  for (const TrueAngle& angle : dihedrals_) add(angle, twist(angle, positions_of(angle, r_, e), force));
  return sum;
}

// energy V^T K V / 2 and forces -K V, with V in the axes that fit the points of the link best
// (THEORY 10.22)
double TrueGeometry::add_matrices(const PointVectors& e, const Forces& force, VectorXd* energies) const {
  double sum = 0.0;
  for (const TrueMatrix& matrix : matrices_) {
    const FittedFrame::Fit fit = matrix.frame.fit(r_ + e);
    const Map<const VectorXd> V(fit.V.data(), fit.V.size());
    const VectorXd s = -matrix.K * V;
    matrix.frame.add_forces(fit, Map<const Matrix3Xd>(s.data(), 3, fit.V.cols()), force);
    const double energy = -0.5 * s.dot(V);
    if (energies != nullptr) (*energies)[matrix.link] += energy;
    sum += energy;
  }
  return sum;
}

// s = -C_d V'   (THEORY 10.24)
void TrueGeometry::add_damping(const PointVectors& e, const PointVectors& e_dot, const Forces& force) const {
  if (damping_.size() == 0) return;
  const FittedFrame::Fit fit = body_.fit(r_ + e);
  const Matrix3Xd rates = body_.rates(fit, e_dot);
  const VectorXd s = -damping_ * Map<const VectorXd>(rates.data(), rates.size());
  body_.add_forces(fit, Map<const Matrix3Xd>(s.data(), 3, r_.cols()), force);
}

}  // namespace freeflex
