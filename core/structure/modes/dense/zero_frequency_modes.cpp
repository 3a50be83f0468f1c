#include "core/structure/modes/dense/zero_frequency_modes.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "core/scene/bodies.hpp"
#include "core/structure/modes/dense/decompositions.hpp"
#include "core/structure/modes/dense/mechanisms.hpp"

namespace freeflex {
namespace {

// [-] fraction of the highest frequency. A mode below this frequency may be a mechanism
constexpr double kSuspect = 1e-4;
// [-] largest strain, by unit rows, of a unit motion that is a mechanism. A computed mechanism contains small
// parts of other modes and therefore has a strain of about 1e-12, but the bending mode of a mast of 25,000
// bays has a strain of 1e-9
constexpr double kNoStrain = 2e-10;

// returns the points and, for each point with an attitude, three additional sample points on rigid arms
SamplePoints sample_points_of(const Scene& scene, const MassProperties& body, double length) {
  SamplePoints samples;
  const auto num_points = static_cast<int>(scene.points.size());
  for (int i = 0; i < num_points; ++i) samples.point_of.push_back(i);
  for (int i = 0; i < num_points; ++i)
    if (has_attitude(scene.points[index(i)])) samples.point_of.insert(samples.point_of.end(), 3, i);
  samples.r.resize(3, static_cast<Eigen::Index>(samples.point_of.size()));
  for (Eigen::Index p = 0; p < samples.r.cols(); ++p) {
    samples.r.col(p) = body.r.col(samples.point_of[index(p)]);
    if (p >= num_points) samples.r.col(p) += length * Eigen::Vector3d::Unit((p - num_points) % 3);
  }
  return samples;
}

Eigen::MatrixXd moved(const SamplePoints& samples, const Freedoms& freedoms, const Eigen::MatrixXd& y) {
  const Eigen::Index num_points = freedoms.num_displacements() / 3;
  Eigen::MatrixXd at(3 * samples.r.cols(), y.cols());
  for (Eigen::Index p = 0; p < samples.r.cols(); ++p) {
    const int point = samples.point_of[index(p)];
    at.middleRows<3>(3 * p) = y.middleRows<3>(3 * Eigen::Index{point});
    // rotations in y are length times theta, so their cross product with e_k is the displacement at the end
    // of an arm of that length along e_k
    for (Eigen::Index k = 0; p >= num_points && k < y.cols(); ++k)
      at.block<3, 1>(3 * p, k) += Eigen::Vector3d(y.block<3, 1>(freedoms.rotation(point), k))
                                      .cross(Eigen::Vector3d(Eigen::Vector3d::Unit((p - num_points) % 3)));
  }
  return at;
}

}  // namespace

Eigen::Index separate_mechanisms(const Scene& scene, const SparseSystem& system, const Freedoms& freedoms,
                                 const MassProperties& body, double rounding, Structure& structure,
                                 Eigen::MatrixXd& x) {
  Eigen::VectorXd& omega = structure.omega;
  Eigen::Index suspects = 0;
  while (suspects < omega.size() && omega[suspects] <= kSuspect * omega[omega.size() - 1]) ++suspects;
  if (suspects == 0) return 0;
  // a motion y is a mechanism if unit rows, which contain no stiffness, strain it by a rounding error only:
  // |(B y, C y)| < max(2e-10, 16 `rounding`) |y|   (THEORY 16.39)
  const Eigen::MatrixXd few = x.leftCols(suspects);
  const Eigen::HouseholderQR<Eigen::MatrixXd> qr(few);
  const Eigen::MatrixXd R = qr.matrixQR().topRows(suspects).triangularView<Eigen::Upper>();
  const Eigen::MatrixXd strain = exact_product(system.unit_rows, few);
  const Eigen::MatrixXd held = exact_product(system.constraints, few);
  Eigen::MatrixXd all(strain.rows() + held.rows(), suspects);
  all << strain, held;
  const Eigen::MatrixXd unit =
      R.transpose().triangularView<Eigen::Lower>().solve(all.transpose()).transpose();
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(unit.transpose() * unit);
  const double least = std::max(kNoStrain, 16.0 * rounding);
  const Eigen::Index count = (eigen.eigenvalues().array() < least * least).count();
  if (count == 0) return 0;

  // Makes the motions m-orthonormal again, first the mechanisms and then the other motions. The other motions
  // are rotated to modes and get new frequencies
  Eigen::MatrixXd rotated = R.triangularView<Eigen::Upper>().solve(eigen.eigenvectors());
  for (int pass = 0; pass < 2; ++pass)
    for (Eigen::Index k = 0; k < suspects; ++k) {
      for (Eigen::Index other = 0; other < k; ++other)
        rotated.col(k) -= rotated.col(other).dot(rotated.col(k)) * rotated.col(other);
      rotated.col(k).normalize();
    }
  Eigen::MatrixXd rest = rotated.rightCols(suspects - count);
  const Eigen::MatrixXd forces = exact_product(system.rows, few * rest);
  if (rest.cols() > 0) {
    const Eigen::JacobiSVD<Eigen::MatrixXd> svd(Eigen::MatrixXd(Eigen::HouseholderQR<Eigen::MatrixXd>(forces)
                                                                    .matrixQR()
                                                                    .topRows(rest.cols())
                                                                    .triangularView<Eigen::Upper>()),
                                                Eigen::ComputeFullV);
    rest = (rest * svd.matrixV().rowwise().reverse()).eval();
    omega.segment(count, rest.cols()) = svd.singularValues().reverse();
  }
  x.leftCols(count) = few * rotated.leftCols(count);
  x.middleCols(count, rest.cols()) = few * rest;
  omega.head(count).setZero();
  const SamplePoints samples = sample_points_of(scene, body, system.length);
  const auto displacements_of = [&](const Eigen::MatrixXd& y) { return moved(samples, freedoms, y); };
  Eigen::MatrixXd motions = x.leftCols(count), rigid = system.rigid;
  motions.colwise().normalize();
  rigid.colwise().normalize();
  structure.mechanisms = name_mechanisms(motions, rigid, samples, displacements_of).names;
  return count;
}

}  // namespace freeflex
