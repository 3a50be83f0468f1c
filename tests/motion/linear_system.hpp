// The linear elastic system M V'' + C V' + K V = F in the displacements of all points, without modes, frames
// or propagators. The stiffness is assembled link by link, and the motion is computed by the exponential of
// the state matrix.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cmath>
#include <unsupported/Eigen/MatrixFunctions>
#include <vector>

#include "core/scene/scene.hpp"

namespace freeflex::testing {

using WideMatrix = Eigen::Matrix<long double, Eigen::Dynamic, Eigen::Dynamic>;
using WideVector = Eigen::Matrix<long double, Eigen::Dynamic, 1>;

struct LinearSystem {
  WideVector mass;  // [kg] (3N)
  WideMatrix C, K;  // [N s/m], [N/m] (3N x 3N)

  explicit LinearSystem(const Scene& scene) {
    const auto n = 3 * static_cast<Eigen::Index>(scene.points.size());
    mass.resize(n);
    for (Eigen::Index i = 0; i < n; ++i) mass[i] = scene.points[static_cast<std::size_t>(i / 3)].mass;
    C = K = WideMatrix::Zero(n, n);
    for (const Link& link : scene.links) {
      if (link.points.size() != 2) continue;
      const Eigen::Index a = 3 * link.points[0], b = 3 * link.points[1];
      const Eigen::Matrix<long double, 3, 1> span =
          (scene.points[static_cast<std::size_t>(link.points[1])].position -
           scene.points[static_cast<std::size_t>(link.points[0])].position)
              .cast<long double>();
      WideVector row = WideVector::Zero(n);
      row.segment<3>(a) = -span / span.norm();
      row.segment<3>(b) = span / span.norm();
      if (const auto* spring = std::get_if<Spring>(&link.kind)) {
        K += static_cast<long double>(spring->stiffness) * row * row.transpose();
        C += static_cast<long double>(spring->stiffness) * static_cast<long double>(link.viscous) * row *
             row.transpose();
      }
      if (const auto* dashpot = std::get_if<Dashpot>(&link.kind))
        C += static_cast<long double>(dashpot->damping) * row * row.transpose();
    }
  }

  /// Returns the state matrix of (V, V').
  WideMatrix generator() const {
    const Eigen::Index n = mass.size();
    WideMatrix A = WideMatrix::Zero(2 * n, 2 * n);
    A.topRightCorner(n, n).setIdentity();
    A.bottomLeftCorner(n, n) = -(mass.cwiseInverse().asDiagonal() * K);
    A.bottomRightCorner(n, n) = -(mass.cwiseInverse().asDiagonal() * C);
    return A;
  }

  /// Returns (V, V') at time t from (V, V') at 0 under a constant force.
  WideVector at(long double t, const WideVector& start, const WideVector& force) const {
    return advance(generator(), t, start, force);
  }

  WideVector advance(const WideMatrix& A, long double t, const WideVector& start,
                     const WideVector& force) const {
    const Eigen::Index n = mass.size();
    // an additional coordinate, which is always 1, multiplies the force
    WideMatrix all = WideMatrix::Zero(2 * n + 1, 2 * n + 1);
    all.topLeftCorner(2 * n, 2 * n) = A;
    all.block(n, 2 * n, n, 1) = mass.cwiseInverse().cwiseProduct(force);
    WideVector y(2 * n + 1);
    y << start, 1.0L;
    return ((t * all).exp() * y).head(2 * n);
  }
};

}  // namespace freeflex::testing
