#include "core/structure/loose_modes.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "core/scene/bodies.hpp"
#include "core/structure/decompositions.hpp"
#include "core/structure/mechanisms.hpp"

namespace freeflex {
namespace {

constexpr double kSuspect = 1e-4;  // [-] of the highest frequency: what may be a mechanism is looked at
// [-] strain by geometry of a unit motion: that of a mechanism is what other modes it carries with it, some
// 1e-12, while a mast of 25,000 bays bends with 1e-9
constexpr double kNoStrain = 2e-10;

// points, and beside those that turn three more on arms
Places places_of(const Scene& scene, const MassProperties& body, double length) {
  Places places;
  const auto num_points = static_cast<int>(scene.points.size());
  for (int i = 0; i < num_points; ++i) places.point_of.push_back(i);
  for (int i = 0; i < num_points; ++i)
    if (has_attitude(scene.points[static_cast<std::size_t>(i)]))
      places.point_of.insert(places.point_of.end(), 3, i);
  places.r.resize(3, static_cast<Eigen::Index>(places.point_of.size()));
  for (Eigen::Index p = 0; p < places.r.cols(); ++p) {
    places.r.col(p) = body.r.col(places.point_of[static_cast<std::size_t>(p)]);
    if (p >= num_points) places.r.col(p) += length * Eigen::Vector3d::Unit((p - num_points) % 3);
  }
  return places;
}

Eigen::MatrixXd moved(const Places& places, const Freedoms& freedoms, const Eigen::MatrixXd& y) {
  const Eigen::Index num_points = freedoms.num_displacements() / 3;
  Eigen::MatrixXd at(3 * places.r.cols(), y.cols());
  for (Eigen::Index p = 0; p < places.r.cols(); ++p) {
    const int point = places.point_of[static_cast<std::size_t>(p)];
    at.middleRows<3>(3 * p) = y.middleRows<3>(3 * Eigen::Index{point});
    // rotations stand as length times theta: an arm of that length moves by theta x e_k
    for (Eigen::Index k = 0; p >= num_points && k < y.cols(); ++k)
      at.block<3, 1>(3 * p, k) += Eigen::Vector3d(y.block<3, 1>(freedoms.rotation(point), k))
                                      .cross(Eigen::Vector3d(Eigen::Vector3d::Unit((p - num_points) % 3)));
  }
  return at;
}

}  // namespace

Eigen::Index take_out_mechanisms(const Scene& scene, const SparseSystem& system, const Freedoms& freedoms,
                                 const MassProperties& body, double rounding, Structure& structure,
                                 Eigen::MatrixXd& x) {
  Eigen::VectorXd& omega = structure.omega;
  Eigen::Index suspects = 0;
  while (suspects < omega.size() && omega[suspects] <= kSuspect * omega[omega.size() - 1]) ++suspects;
  if (suspects == 0) return 0;
  // strain of motions of unit length, by geometry alone: a soft link counts as any other
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

  // M-orthonormal again: the mechanisms, and what is left of the others by their own frequencies
  Eigen::MatrixXd turned = R.triangularView<Eigen::Upper>().solve(eigen.eigenvectors());
  for (int pass = 0; pass < 2; ++pass)
    for (Eigen::Index k = 0; k < suspects; ++k) {
      for (Eigen::Index other = 0; other < k; ++other)
        turned.col(k) -= turned.col(other).dot(turned.col(k)) * turned.col(other);
      turned.col(k).normalize();
    }
  Eigen::MatrixXd rest = turned.rightCols(suspects - count);
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
  x.leftCols(count) = few * turned.leftCols(count);
  x.middleCols(count, rest.cols()) = few * rest;
  omega.head(count).setZero();
  const Places places = places_of(scene, body, system.length);
  const auto at_places = [&](const Eigen::MatrixXd& y) { return moved(places, freedoms, y); };
  Eigen::MatrixXd motions = x.leftCols(count), rigid = system.rigid;
  motions.colwise().normalize();
  rigid.colwise().normalize();
  structure.mechanisms = name_mechanisms(motions, rigid, places, at_places).names;
  return count;
}

}  // namespace freeflex
