// The linear plate of (X62), written anew, in axes that turn with the triangle   (THEORY X153).
#include <Eigen/Geometry>
#include <Eigen/LU>
#include <cmath>

#include "core/reference/rotations.hpp"
#include "core/reference/turning_links.hpp"

namespace freeflex {
namespace {

using Eigen::Matrix2d;
using Eigen::Matrix3d;
using Eigen::Vector2d;
using Eigen::Vector3d;
using Row = Eigen::Matrix<double, 1, 9>;

constexpr double kNormalTurn = 1e-3;  // [-] of E thickness^3 / 12   (THEORY X62)

// P of (X62) in local axes
std::array<Matrix2d, 3> measures() {
  std::array<Matrix2d, 3> P;
  P[0] << 1.0, 0.0, 0.0, 1.0;
  P[1] << 1.0, 0.0, 0.0, -1.0;
  P[2] << 0.0, 1.0, 1.0, 0.0;
  return P;
}

// adds beta . v of a corner, beta = theta x z = (theta_y, -theta_x)
void add_lean(Row& row, Eigen::Index corner, const Vector2d& v) {
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
  const Vector3d share(0.5 / (1.0 - plate.nu), 0.5 / (1.0 + plate.nu), 0.5 / (1.0 + plate.nu));
  membrane = area * stretch * share;

  bending.setZero();
  const auto P = measures();
  for (Eigen::Index j = 0; j < 3; ++j) {
    for (std::size_t m = 0; m < 3; ++m) {
      // curvature at the middle of the side opposite to corner j; no corner leaves the triangle's plane
      Row row = Row::Zero();
      for (Eigen::Index i = 0; i < 3; ++i) add_lean(row, i, P[m] * gradients.col(i));
      for (Eigen::Index k = 0; k < 3; ++k) {
        const Vector2d& s = side[static_cast<std::size_t>(k)];
        const double mu = (k == j ? 3.0 : -3.0) * s.dot(P[m] * gradients.col(j)) / s.squaredNorm();
        add_lean(row, (k + 1) % 3, 0.5 * mu * s);
        add_lean(row, (k + 2) % 3, 0.5 * mu * s);
      }
      bending += area / 3.0 * flexure * share[static_cast<Eigen::Index>(m)] * row.transpose() * row;
    }
    // the membrane does not turn against the triangle's axes
    bending(3 * j + 2, 3 * j + 2) += kNormalTurn * flexure;
  }
}

void TruePlate::evaluate(const std::array<Vector3d, 3>& d, const std::array<Matrix3d, 3>& ends,
                         bool with_stiffness, TurnResult& result) const {
  const Vector3d first = edges.col(0) + (d[1] - d[0]), second = edges.col(1) + (d[2] - d[0]);
  const Vector3d twice_area = first.cross(second);
  const Vector3d n = twice_area.normalized();

  // gradient of the places by local rest coordinates, in axes of its plane, then F = R U
  Eigen::Matrix<double, 3, 2> F =
      first * gradients.col(1).transpose() + second * gradients.col(2).transpose();
  Eigen::Matrix<double, 3, 2> plane;
  plane.col(0) = F.col(0).normalized();
  plane.col(1) = n.cross(Vector3d(plane.col(0)));
  const Matrix2d G = plane.transpose() * F;
  const double angle = std::atan2(G(1, 0) - G(0, 1), G(0, 0) + G(1, 1));
  const Matrix2d turn = Eigen::Rotation2Dd(angle).toRotationMatrix();
  const Matrix2d U = turn.transpose() * G;
  Matrix3d axes;
  axes << plane * turn, n;

  // membrane
  const Vector3d strain(U(0, 0) + U(1, 1) - 2.0, U(0, 0) - U(1, 1), U(0, 1) + U(1, 0));
  const Vector3d s = membrane.cwiseProduct(strain);
  result.energy = 0.5 * s.dot(strain);
  Matrix2d stress;
  stress << s[0] + s[1], s[2], s[2], s[0] - s[1];
  for (Eigen::Index i = 0; i < 3; ++i)
    result.place[static_cast<std::size_t>(i)] = axes.leftCols<2>() * (stress * gradients.col(i));

  // bending
  Eigen::Matrix<double, 9, 1> theta;
  std::array<Matrix3d, 3> rates;  // of theta per spin
  for (std::size_t i = 0; i < 3; ++i) {
    const Vector3d v = rotation_vector(axes.transpose() * ends[i]);
    theta.segment<3>(3 * static_cast<Eigen::Index>(i)) = v;
    rates[i] = spin_per_rate(v).inverse() * axes.transpose();
  }
  const Eigen::Matrix<double, 9, 1> M = bending * theta;
  result.energy += 0.5 * M.dot(theta);
  Vector3d on_axes = Vector3d::Zero();
  for (std::size_t i = 0; i < 3; ++i) {
    result.moment[i] = rates[i].transpose() * M.segment<3>(3 * static_cast<Eigen::Index>(i));
    on_axes += result.moment[i];
  }
  // spin of the axes: across the normal by what leaves the plane, about it by the best turn within
  const std::array<Vector3d, 3> side{second - first, -second, first};
  const double trace = U(0, 0) + U(1, 1);
  for (std::size_t i = 0; i < 3; ++i) {
    const auto g = gradients.col(static_cast<Eigen::Index>(i));
    result.place[i] -= on_axes.dot(side[i]) / twice_area.norm() * n +
                       on_axes.dot(n) / trace * (axes.col(1) * g[0] - axes.col(0) * g[1]);
  }
  if (!with_stiffness) return;
  for (Eigen::Index i = 0; i < 3; ++i)
    for (Eigen::Index j = 0; j < 3; ++j)
      result.stiffness.block<3, 3>(3 * i, 3 * j) = rates[static_cast<std::size_t>(i)].transpose() *
                                                   bending.block<3, 3>(3 * i, 3 * j) *
                                                   rates[static_cast<std::size_t>(j)];
}

}  // namespace freeflex
