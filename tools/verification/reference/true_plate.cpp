// The linear plate of (THEORY 3.28 to 3.37) in axes that rotate with the triangle, without using code of
// core/structure (THEORY 10.18, 10.19).
#include <Eigen/Geometry>
#include <Eigen/LU>
#include <cmath>

#include "tools/verification/reference/rotating_links.hpp"
#include "tools/verification/reference/rotations.hpp"

namespace freeflex {
namespace {

using Eigen::Matrix2d;
using Eigen::Matrix3d;
using Eigen::Vector2d;
using Eigen::Vector3d;
using Row = Eigen::Matrix<double, 1, 9>;

// [-] stiffness of a corner's rotation about the normal, divided by E thickness^3 / 12   (THEORY 3.36)
constexpr double kNormalRotation = 1e-3;

// the measures of strain P_1 = x x^T + y y^T, P_2 = x x^T - y y^T, P_3 = x y^T + y x^T in local axes
// (THEORY 3.29)
std::array<Matrix2d, 3> measures() {
  std::array<Matrix2d, 3> P;
  P[0] << 1.0, 0.0, 0.0, 1.0;
  P[1] << 1.0, 0.0, 0.0, -1.0;
  P[2] << 0.0, 1.0, 1.0, 0.0;
  return P;
}

// adds the inclination of the normal at a corner times v: (theta x z).v, theta x z = (theta_y, -theta_x)
// (THEORY 3.32)
void add_inclination(Row& row, Eigen::Index corner, const Vector2d& v) {
  row[3 * corner] -= v[1];
  row[3 * corner + 1] += v[0];
}

}  // namespace

TruePlate::TruePlate(const Plate& plate, const std::array<Vector3d, 3>& corners) {
  const Vector3d first = corners[1] - corners[0], second = corners[2] - corners[0];
  const Vector3d normal = first.cross(second);
  const double area = 0.5 * normal.norm();
  rest.col(0) = first.normalized();
  rest.col(2) = normal.normalized();
  rest.col(1) = rest.col(2).cross(rest.col(0));
  edges << first, second;

  std::array<Vector2d, 3> side;
  for (std::size_t i = 0; i < 3; ++i) {
    side[i] = rest.leftCols<2>().transpose() * (corners[(i + 2) % 3] - corners[(i + 1) % 3]);
    gradients.col(static_cast<Eigen::Index>(i)) = Vector2d(-side[i][1], side[i][0]) / (2.0 * area);
  }
  const double stretch = plate.E * plate.thickness;                           // [N/m]
  const double flexure = stretch * plate.thickness * plate.thickness / 12.0;  // [N m]
  const Vector3d factor(0.5 / (1.0 - plate.nu), 0.5 / (1.0 + plate.nu), 0.5 / (1.0 + plate.nu));
  membrane = area * stretch * factor;  // (THEORY 3.31)

  bending.setZero();
  const auto P = measures();
  for (Eigen::Index j = 0; j < 3; ++j) {
    for (std::size_t m = 0; m < 3; ++m) {
      // Curvature at the middle of the side opposite to corner j   (THEORY 3.33, 3.34). The local plane
      // passes through the three corners, so their deflections are zero and the deflection terms vanish.
      Row row = Row::Zero();
      for (Eigen::Index i = 0; i < 3; ++i) add_inclination(row, i, P[m] * gradients.col(i));
      for (Eigen::Index k = 0; k < 3; ++k) {
        const Vector2d& s = side[index(k)];
        const double mu = (k == j ? 3.0 : -3.0) * s.dot(P[m] * gradients.col(j)) / s.squaredNorm();
        add_inclination(row, (k + 1) % 3, 0.5 * mu * s);
        add_inclination(row, (k + 2) % 3, 0.5 * mu * s);
      }
      bending += area / 3.0 * flexure * factor[static_cast<Eigen::Index>(m)] * row.transpose() * row;
    }
    // the membrane does not rotate relative to the axes of the triangle, so the deformation (THEORY 3.36) is
    // the rotation of the corner alone
    bending(3 * j + 2, 3 * j + 2) += kNormalRotation * flexure;
  }
}

void TruePlate::evaluate(const std::array<Vector3d, 3>& d, const std::array<Matrix3d, 3>& ends,
                         bool with_stiffness, LinkGradient& result) const {
  const Vector3d first = edges.col(0) + (d[1] - d[0]), second = edges.col(1) + (d[2] - d[0]);
  const Vector3d twice_area = first.cross(second);
  const Vector3d n = twice_area.normalized();

  // F = sum p_i g_i^T = R U is the gradient of the positions with respect to rest coordinates, split into the
  // rotation R with `axes` as columns and the stretch U   (THEORY 10.18)
  Eigen::Matrix<double, 3, 2> F =
      first * gradients.col(1).transpose() + second * gradients.col(2).transpose();
  Eigen::Matrix<double, 3, 2> plane;
  plane.col(0) = F.col(0).normalized();
  plane.col(1) = n.cross(Vector3d(plane.col(0)));
  const Matrix2d G = plane.transpose() * F;
  const double angle = std::atan2(G(1, 0) - G(0, 1), G(0, 0) + G(1, 1));
  const Matrix2d rotation = Eigen::Rotation2Dd(angle).toRotationMatrix();
  const Matrix2d U = rotation.transpose() * G;
  Matrix3d axes;
  axes << plane * rotation, n;

  // membrane: eps_1 = U_11 + U_22 - 2, eps_2 = U_11 - U_22, eps_3 = U_12 + U_21   (THEORY 10.19)
  const Vector3d strain(U(0, 0) + U(1, 1) - 2.0, U(0, 0) - U(1, 1), U(0, 1) + U(1, 0));
  const Vector3d s = membrane.cwiseProduct(strain);
  result.energy = 0.5 * s.dot(strain);
  Matrix2d stress;
  stress << s[0] + s[1], s[2], s[2], s[0] - s[1];
  for (Eigen::Index i = 0; i < 3; ++i)
    result.force[index(i)] = axes.leftCols<2>() * (stress * gradients.col(i));

  // bending, over the tilts and rolls of the corners relative to the axes of the plate   (THEORY 10.19)
  Eigen::Matrix<double, 9, 1> theta;
  std::array<Matrix3d, 3> rates;  // rates of tilts and roll per angular velocity
  for (std::size_t i = 0; i < 3; ++i) {
    const Vector3d corner = ends[i].col(2), w = corner.cross(n);
    const Vector3d tilt = -angle_over_sine(w.norm(), corner.dot(n)) * w;
    const Vector3d x = smallest_rotation(corner, n) * ends[i].col(0);
    theta.segment<3>(3 * static_cast<Eigen::Index>(i)) << tilt.dot(axes.col(0)), tilt.dot(axes.col(1)),
        std::atan2(x.dot(axes.col(1)), x.dot(axes.col(0)));
    // the corner rolls about the normal first and tilts then
    Matrix3d spins;
    spins << spin_per_rate(tilt) * axes.leftCols<2>(), corner;
    rates[i] = spins.inverse();
  }
  const Eigen::Matrix<double, 9, 1> M = bending * theta;
  result.energy += 0.5 * M.dot(theta);
  Vector3d on_axes = Vector3d::Zero();
  for (std::size_t i = 0; i < 3; ++i) {
    result.moment[i] = rates[i].transpose() * M.segment<3>(3 * static_cast<Eigen::Index>(i));
    on_axes += result.moment[i];
  }
  // The moments of the corners also do work on the rotation of the axes of the plate. The components of this
  // rotation in the plane follow from displacements out of the plane, but its component about the normal
  // follows from the rotation R within the plane.
  const std::array<Vector3d, 3> side{second - first, -second, first};
  const double trace = U(0, 0) + U(1, 1);
  for (std::size_t i = 0; i < 3; ++i) {
    const auto g = gradients.col(static_cast<Eigen::Index>(i));
    result.force[i] -= on_axes.dot(side[i]) / twice_area.norm() * n +
                       on_axes.dot(n) / trace * (axes.col(1) * g[0] - axes.col(0) * g[1]);
  }
  if (!with_stiffness) return;
  for (Eigen::Index i = 0; i < 3; ++i)
    for (Eigen::Index j = 0; j < 3; ++j)
      result.stiffness.block<3, 3>(3 * i, 3 * j) =
          rates[index(i)].transpose() * bending.block<3, 3>(3 * i, 3 * j) * rates[index(j)];
}

}  // namespace freeflex
