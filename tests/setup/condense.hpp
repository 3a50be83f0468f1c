// Condenses some links of a scene to a superelement by the method of Craig and Bampton (1968). Header only.
#pragma once

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>

#include "core/structure/masses/particles.hpp"
#include "tests/setup/make_scene.hpp"

namespace freeflex::testing {

/// Replaces the links `first` to the last, and the points that only they have, by a superelement on the given
/// points with `num_modes` modes of vibration between fixed ends. The points that are removed must be the
/// last of the scene but for the given ones, which keep their order. Their masses go into the superelement.
/// \param ends  points of the superelement, ascending; all points that remain are listed by `remain`
inline Scene condensed(const Scene& whole, std::size_t first_link, const std::vector<int>& ends,
                       const std::vector<int>& remain, int num_modes) {
  Scene part = whole, rest = whole;
  part.links.erase(part.links.begin(), part.links.begin() + static_cast<std::ptrdiff_t>(first_link));
  const Freedoms freedoms(part);
  Faults faults;
  for (const int k : remain) {
    PointMass& point = part.points[index(k)];
    point.mass = 0.0, point.inertia.setZero(), point.offset.setZero();
  }
  const Freedoms own(part);
  const LinkFactor factor = factor_links(part, false, faults);
  const Eigen::Index size = own.num_all();
  const Eigen::MatrixXd A = dense_rows(factor.natural, size, false),
                        N = dense_rows(mass_rows(part, own, 1.0), size, false);
  const Eigen::MatrixXd K = A.transpose() * A, M = N.transpose() * N;
  std::vector<int> outer, inner;
  for (const int point : ends)
    for (int a = 0; a < 6; ++a) outer.push_back(a < 3 ? 3 * point + a : own.rotation(point) + a - 3);
  for (int k = 0; k < size; ++k) {
    const bool is_used = K(k, k) > 0.0;
    if (is_used && std::find(outer.begin(), outer.end(), k) == outer.end()) inner.push_back(k);
  }
  const auto num_outer = static_cast<Eigen::Index>(outer.size()),
             num_inner = static_cast<Eigen::Index>(inner.size());
  const Eigen::LLT<Eigen::MatrixXd> llt(Eigen::MatrixXd(K(inner, inner)));
  const Eigen::MatrixXd held = llt.solve(Eigen::MatrixXd(K(inner, outer)));
  // L^-1 M L^-T x = x / omega^2
  Eigen::MatrixXd flexible = llt.matrixL().solve(Eigen::MatrixXd(M(inner, inner)));
  flexible = llt.matrixL().solve(Eigen::MatrixXd(flexible.transpose())).eval();
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(flexible);
  const Eigen::MatrixXd modes =
      llt.matrixU().solve(Eigen::MatrixXd(eigen.eigenvectors().rightCols(num_modes)));
  Eigen::MatrixXd T = Eigen::MatrixXd::Zero(num_outer + num_inner, num_outer + num_modes);
  T.topLeftCorner(num_outer, num_outer).setIdentity();
  T.bottomLeftCorner(num_inner, num_outer) = -held;
  T.bottomRightCorner(num_inner, num_modes) = modes;
  std::vector<int> all = outer;
  all.insert(all.end(), inner.begin(), inner.end());
  MatrixLink matrix;
  matrix.has_rotations = true;
  matrix.num_inner = num_modes;
  matrix.matrix = Eigen::MatrixXd(T.transpose() * Eigen::MatrixXd(K(all, all)) * T).sparseView();
  matrix.mass = Eigen::MatrixXd(T.transpose() * Eigen::MatrixXd(M(all, all)) * T).sparseView();
  std::vector<int> number(whole.points.size(), -1);
  rest.points.clear();
  for (const int point : remain) {
    number[index(point)] = static_cast<int>(rest.points.size());
    rest.points.push_back(whole.points[index(point)]);
  }
  rest.links.resize(first_link);
  for (Link& link : rest.links)
    for (int& point : link.points) point = number[index(point)];
  std::vector<int> points;
  for (const int point : ends) points.push_back(number[index(point)]);
  add_link(rest, points, matrix);
  return rest;
}

}  // namespace freeflex::testing
