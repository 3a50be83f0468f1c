#include "core/structure/masses/root_mass.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "core/structure/modes/dense/graded_svd.hpp"

namespace freeflex {

RootMass::RootMass(const std::vector<PointMass>& points) {
  std::vector<int> by_mass(points.size());
  std::iota(by_mass.begin(), by_mass.end(), 0);
  std::stable_sort(by_mass.begin(), by_mass.end(),
                   [&](int a, int b) { return points[index(a)].mass > points[index(b)].mass; });
  root_mass_.resize(3 * static_cast<Eigen::Index>(points.size()));
  for (const int point : by_mass)
    for (int axis = 0; axis < 3; ++axis) {
      root_mass_[static_cast<Eigen::Index>(order_.size())] = std::sqrt(points[index(point)].mass);
      order_.push_back(3 * point + axis);
    }
}

RootMass::RootMass(Eigen::MatrixXd rows) {
  sort_rows(rows);
  const Eigen::Index n = rows.cols();
  const Eigen::ColPivHouseholderQR<Eigen::MatrixXd> qr(rows);
  R_ = qr.matrixR().topLeftCorner(n, n).triangularView<Eigen::Upper>();
  for (const int freedom : qr.colsPermutation().indices()) order_.push_back(freedom);
}

Eigen::MatrixXd RootMass::weigh(const Eigen::MatrixXd& motions) const {
  if (R_.size() > 0) return R_ * motions(order_, Eigen::all);
  return root_mass_.asDiagonal() * motions(order_, Eigen::all);
}

Eigen::MatrixXd RootMass::weigh_rows(const Eigen::MatrixXd& rows) const {
  if (R_.size() == 0) return rows(Eigen::all, order_) * root_mass_.cwiseInverse().asDiagonal();
  Eigen::MatrixXd weighed = rows(Eigen::all, order_);
  // if there are no rows, Eigen would bind a null reference
  if (weighed.size() > 0) R_.triangularView<Eigen::Upper>().solveInPlace<Eigen::OnTheRight>(weighed);
  return weighed;
}

Eigen::MatrixXd RootMass::motions(const Eigen::MatrixXd& y) const {
  Eigen::MatrixXd motions(y.rows(), y.cols());
  if (y.size() == 0) return motions;
  if (R_.size() > 0)
    motions(order_, Eigen::all) = Eigen::MatrixXd(R_.triangularView<Eigen::Upper>().solve(y));
  else
    motions(order_, Eigen::all) = root_mass_.cwiseInverse().asDiagonal() * y;
  return motions;
}

}  // namespace freeflex
