#include "tools/verification/reference/elastic_error.hpp"

#include <Eigen/Geometry>

#include "core/structure/modes/dense/decompositions.hpp"

namespace freeflex {
namespace {

Eigen::Matrix3Xd from_centre_of_mass(const Eigen::VectorXd& mass, const Eigen::Matrix3Xd& p) {
  const Eigen::Vector3d centre = p * mass / mass.sum();
  return p.colwise() - centre;
}

}  // namespace

Eigen::Matrix3d fit_rotation(const Eigen::VectorXd& mass, const Eigen::Matrix3Xd& r,
                             const Eigen::Matrix3Xd& p) {
  // [-] a shape is collinear if the second singular value divided by the first is at most this limit. The
  // quotient is the square of width over length, and rounding errors alone can make it this large
  constexpr double kCollinear = 1e-14;
  const Eigen::Matrix3d correlation = p * mass.asDiagonal() * r.transpose();
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(correlation, Eigen::ComputeFullU | Eigen::ComputeFullV);
  const Eigen::Vector3d& sigma = svd.singularValues();
  if (sigma[1] <= kCollinear * sigma[0]) {
    return Eigen::Quaterniond::FromTwoVectors(svd.matrixV().col(0), svd.matrixU().col(0)).toRotationMatrix();
  }
  // the sign on the smallest singular value excludes reflections
  const double sign = svd.matrixU().determinant() * svd.matrixV().determinant() < 0.0 ? -1.0 : 1.0;
  return svd.matrixU() * Eigen::Vector3d(1.0, 1.0, sign).asDiagonal() * svd.matrixV().transpose();
}

Eigen::Matrix3Xd elastic_displacements(const Eigen::VectorXd& mass, const Eigen::Matrix3Xd& rest,
                                       const Eigen::Matrix3Xd& p_W) {
  const Eigen::Matrix3Xd r = from_centre_of_mass(mass, rest);
  const Eigen::Matrix3Xd p = from_centre_of_mass(mass, p_W);
  return fit_rotation(mass, r, p).transpose() * p - r;
}

double elastic_error(const Eigen::Matrix3Xd& V, const Eigen::Matrix3Xd& V_ref) {
  const double difference = (V - V_ref).norm();
  return difference == 0.0 ? 0.0 : difference / V_ref.norm();
}

}  // namespace freeflex
