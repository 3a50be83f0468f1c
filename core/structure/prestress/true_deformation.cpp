#include "core/structure/prestress/true_deformation.hpp"

#include <Eigen/Geometry>
#include <cassert>
#include <cmath>

#include "core/scene/link_kinds.hpp"

namespace freeflex {
namespace {

Eigen::Matrix3d rotation_of(const Eigen::Vector3d& theta) {
  const double angle = theta.norm();
  if (angle == 0.0) return Eigen::Matrix3d::Identity();
  return Eigen::AngleAxisd(angle, theta / angle).toRotationMatrix();
}

// returns the rotation vector of R, for rotations of less than half a revolution
Eigen::Vector3d vector_of(const Eigen::Matrix3d& R) {
  const Eigen::Vector3d twice_sine(R(2, 1) - R(1, 2), R(0, 2) - R(2, 0), R(1, 0) - R(0, 1));
  const double sine = 0.5 * twice_sine.norm(), cosine = 0.5 * (R.trace() - 1.0);
  return sine == 0.0 ? Eigen::Vector3d(Eigen::Vector3d::Zero())
                     : Eigen::Vector3d(std::atan2(sine, cosine) / (2.0 * sine) * twice_sine);
}

// returns the smallest rotation from one unit vector to another
Eigen::Matrix3d smallest_rotation(const Eigen::Vector3d& from, const Eigen::Vector3d& to) {
  const Eigen::Vector3d axis = from.cross(to);
  Eigen::Matrix3d cross;
  cross << 0.0, -axis[2], axis[1], axis[2], 0.0, -axis[0], -axis[1], axis[0], 0.0;
  return Eigen::Matrix3d::Identity() + cross + cross * cross / (1.0 + from.dot(to));
}

double angle_between(const Eigen::Vector3d& a, const Eigen::Vector3d& c) {
  return std::atan2(a.cross(c).norm(), a.dot(c));
}

// returns the dihedral angle of four points; a_1 to a_3 are the vectors from each point to the next
// (THEORY 3.27)
double dihedral(const Eigen::Vector3d& a_1, const Eigen::Vector3d& a_2, const Eigen::Vector3d& a_3) {
  const Eigen::Vector3d eta_1 = a_1.cross(a_2), eta_2 = a_2.cross(a_3);
  return std::atan2(a_2.norm() * a_1.dot(eta_2), eta_1.dot(eta_2));
}

}  // namespace

TrueLink::TrueLink(const Scene& scene, int link_index, const Freedoms& freedoms) {
  assert(!is_rigid(scene.links[index(link_index)]) && matrices_of(scene.links[index(link_index)]) == nullptr);
  const Link& link = scene.links[index(link_index)];
  const auto num_points = static_cast<Eigen::Index>(link.points.size());
  rest_.resize(3, num_points);
  for (Eigen::Index k = 0; k < num_points; ++k)
    rest_.col(k) = scene.points[index(link.points[index(k)])].position -
                   scene.points[index(link.points.front())].position;
  axes_.setIdentity();
  std::visit(
      Cases{
          [](const Spring&) {}, [](const Bar&) {}, [](const Dashpot&) {},
          [&](const Beam&) {
            form_ = Form::kBeam;
            num_deformations_ = 6;
            axes_ = axes_of(scene, link);
          },
          [&](const BendingSpring&) { set_bend(scene, link); },
          [&](const TorsionSpring&) {
            form_ = Form::kTorsion;
            rest_angle_ = dihedral(rest_.col(1) - rest_.col(0), rest_.col(2) - rest_.col(1),
                                   rest_.col(3) - rest_.col(2));
          },
          [&](const Plate&) { set_plate(scene, link, freedoms); }, [](const MatrixLink&) {},  // not possible
          [](const Rigid&) {},                                                                // not possible
      },
      link.kind);
}

void TrueLink::set_bend(const Scene& scene, const Link& link) {
  form_ = Form::kBend;
  const DeformationRows rows = bending_rows(scene, link);
  num_deformations_ = static_cast<int>(rows.size());
  const Eigen::Vector3d a = (rest_.col(0) - rest_.col(1)).stableNormalized(),
                        c = (rest_.col(2) - rest_.col(1)).stableNormalized();
  rest_angle_ = angle_between(a, c);
  if (num_deformations_ != 2) return;
  side_ = a.dot(c) < 0.0 ? 1.0 : -1.0;
  first_ = a.unitOrthogonal();
}

void TrueLink::set_plate(const Scene& scene, const Link& link, const Freedoms& freedoms) {
  form_ = Form::kPlate;
  const DeformationRows rows = plate_rows(scene, link, freedoms);
  num_deformations_ = static_cast<int>(rows.size());
  plate_rows_ = Eigen::MatrixXd::Zero(num_deformations_, 18);
  for (int row = 0; row < num_deformations_; ++row)
    for (const auto& [freedom, coefficient] : rows[index(row)].coefficients)
      for (int k = 0; k < 3; ++k) {
        const int point = link.points[index(k)];
        if (freedom / 3 == point && freedom < freedoms.num_displacements())
          plate_rows_(row, 3 * k + freedom % 3) += coefficient;
        const int component = freedom - freedoms.rotation(point);
        if (freedom >= freedoms.num_displacements() && component >= 0 && component < 3)
          plate_rows_(row, 9 + 3 * k + component) += coefficient;
      }
  axes_.col(0) = rest_.col(1).stableNormalized();
  axes_.col(2) = rest_.col(1).cross(Eigen::Vector3d(rest_.col(2))).stableNormalized();
  axes_.col(1) = axes_.col(2).cross(axes_.col(0));
  rest_edges_ = (axes_.leftCols<2>().transpose() * rest_.rightCols<2>()).inverse();
}

Eigen::VectorXd TrueLink::deformations(const Eigen::Matrix3Xd& V, const Eigen::Matrix3Xd& theta,
                                       const Eigen::Matrix3Xd& own) const {
  switch (form_) {
    case Form::kBeam:
      return of_beam(V, theta, own);
    case Form::kBend:
      return of_bend(V);
    case Form::kTorsion:
      return of_torsion(V);
    case Form::kPlate:
      return of_plate(V, theta);
    case Form::kAxial:
      break;
  }
  return Eigen::VectorXd::Constant(1, elongation(V.col(1) - V.col(0)));
}

// returns |l| - |L| = (2 L . d + d . d) / (|l| + |L|), without subtracting lengths, where L is the
// undeformed span and l = L + d is the displaced span
double TrueLink::elongation(const Eigen::Vector3d& d) const {
  const Eigen::Vector3d span = rest_.col(1);
  return (2.0 * span.dot(d) + d.dot(d)) / ((span + d).norm() + span.norm());
}

// A corotational beam. The rotations of the ends against the chord, and its axes half way between the ends,
// are those of (THEORY 12.60, 12.61). The bow shortens the chord: e_1 = |l| - L + L (2 a^2 - a b + 2 b^2) /
// 30 in each plane, where a and b are the rotations of the ends   (THEORY 8.54).
Eigen::VectorXd TrueLink::of_beam(const Eigen::Matrix3Xd& V, const Eigen::Matrix3Xd& theta,
                                  const Eigen::Matrix3Xd& own) const {
  const Eigen::Vector3d d = V.col(1) - V.col(0), span = rest_.col(1), chord = (span + d).normalized();
  Eigen::Matrix<double, 3, 2> turn,
      across;  // rotation of each end against the chord, and its y axis on the chord
  for (Eigen::Index end = 0; end < 2; ++end) {
    // rotation of the joint, then the rotation of the end relative to the joint
    const Eigen::Matrix3d joint = rotation_of(theta.col(end));
    const Eigen::Matrix3d axes =
        (own.cols() > 0 ? Eigen::Matrix3d(joint * rotation_of(own.col(end))) : joint) * axes_;
    const Eigen::Vector3d sine = chord.cross(axes.col(0));
    const double size = sine.norm(), angle = std::atan2(size, chord.dot(axes.col(0)));
    turn.col(end) = size == 0.0 ? sine : Eigen::Vector3d(angle / size * sine);
    across.col(end) = smallest_rotation(axes.col(0), chord) * axes.col(1);
  }
  const Eigen::Vector3d y = (across.col(0) + across.col(1)).normalized(), z = chord.cross(y);
  const double twist =
      std::atan2(chord.dot(across.col(0).cross(across.col(1))), across.col(0).dot(across.col(1)));
  const Eigen::Vector2d about_y = turn.transpose() * y, about_z = turn.transpose() * z;
  double bow = 0.0;
  for (const Eigen::Vector2d& t : {about_y, about_z})
    bow += 2.0 * t[0] * t[0] - t[0] * t[1] + 2.0 * t[1] * t[1];
  Eigen::VectorXd e(6);
  e << elongation(d) + span.norm() / 30.0 * bow, twist, about_z[1] - about_z[0], about_z.sum(),
      about_y[1] - about_y[0], about_y.sum();
  return e;
}

Eigen::VectorXd TrueLink::of_bend(const Eigen::Matrix3Xd& V) const {
  const Eigen::Matrix3Xd x = rest_ + V;
  const Eigen::Vector3d a = (x.col(0) - x.col(1)).normalized(), c = (x.col(2) - x.col(1)).normalized();
  if (side_ == 0.0) return Eigen::VectorXd::Constant(1, angle_between(a, c) - rest_angle_);
  // bending in two directions normal to the mean line of the two arms
  const Eigen::Vector3d rest = (rest_.col(0) - rest_.col(1)).normalized();
  const Eigen::Matrix3d rotation = smallest_rotation(rest, (a - side_ * c).normalized());
  const Eigen::Vector3d bend = a + side_ * c;
  Eigen::VectorXd e(2);
  e << bend.dot(rotation * first_), bend.dot(rotation * rest.cross(first_));
  return e;
}

Eigen::VectorXd TrueLink::of_torsion(const Eigen::Matrix3Xd& V) const {
  const Eigen::Matrix3Xd x = rest_ + V;
  const double angle = dihedral(x.col(1) - x.col(0), x.col(2) - x.col(1), x.col(3) - x.col(2));
  return Eigen::VectorXd::Constant(1, std::remainder(angle - rest_angle_, 2.0 * M_PI));
}

// Local axes rotate with the triangle. Their rotation consists of the rotation of the plane and the polar
// rotation within the plane (THEORY 8.54).
Eigen::VectorXd TrueLink::of_plate(const Eigen::Matrix3Xd& V, const Eigen::Matrix3Xd& theta) const {
  const Eigen::Matrix3Xd x = rest_ + V;
  const Eigen::Vector3d to_second = x.col(1) - x.col(0), to_third = x.col(2) - x.col(0);
  const Eigen::Matrix3d lean = smallest_rotation(axes_.col(2), to_second.cross(to_third).normalized());
  const Eigen::Matrix3d leaning = lean * axes_;
  Eigen::Matrix2d edges;
  edges << leaning.leftCols<2>().transpose() * to_second, leaning.leftCols<2>().transpose() * to_third;
  const Eigen::Matrix2d F = edges * rest_edges_;
  const double angle = std::atan2(F(1, 0) - F(0, 1), F(0, 0) + F(1, 1));
  const Eigen::Matrix3d R = lean * Eigen::AngleAxisd(angle, Eigen::Vector3d(axes_.col(2))).toRotationMatrix();
  Eigen::VectorXd local(18);
  for (Eigen::Index k = 0; k < 3; ++k) {
    local.segment<3>(3 * k) = R.transpose() * (x.col(k) - x.col(0)) - rest_.col(k);
    local.segment<3>(9 + 3 * k) = vector_of(R.transpose() * rotation_of(theta.col(k)));
  }
  return plate_rows_ * local;
}

}  // namespace freeflex
