// Lagrange's equations of point masses with assumed shapes, written in accelerations. These equations are the
// reference for equations in momenta. This file is header only.
#pragma once

#include <Eigen/Dense>
#include <Eigen/Geometry>
#include <array>
#include <cmath>
#include <functional>

#include "core/structure/structure.hpp"

namespace freeflex::testing {

using Rates = std::function<Eigen::VectorXd(double, const Eigen::VectorXd&)>;

/// Returns y after one step by extrapolation of the modified midpoint rule with 2, 4, .. 12 substeps, which
/// has order 12 (Gragg 1965).
inline Eigen::VectorXd extrapolated_step(const Rates& f, double t, const Eigen::VectorXd& y, double h) {
  constexpr std::size_t kColumns = 6;
  std::array<std::array<Eigen::VectorXd, kColumns>, kColumns> T;
  const auto substeps_of = [](std::size_t j) { return 2.0 * (static_cast<double>(j) + 1.0); };
  for (std::size_t j = 0; j < kColumns; ++j) {
    const double substep = h / substeps_of(j);
    Eigen::VectorXd before = y, at = y + substep * f(t, y);
    for (int k = 1; k < substeps_of(j); ++k) {
      const Eigen::VectorXd next = before + 2.0 * substep * f(t + k * substep, at);
      before = at;
      at = next;
    }
    T[j][0] = 0.5 * (before + at + substep * f(t + h, at));
    for (std::size_t k = 1; k <= j; ++k) {
      const double ratio = substeps_of(j) / substeps_of(j - k);
      T[j][k] = T[j][k - 1] + (T[j][k - 1] - T[j - 1][k - 1]) / (ratio * ratio - 1.0);
    }
  }
  return T[kColumns - 1][kColumns - 1];
}

/// Holds point masses that move by V = b q in a rotating frame. The accelerations (w', q'') follow from
/// d'Alembert's principle with a = w' x x + w x (w x x) + 2 w x V' + b q'' at each point and a linear
/// stiffness.
struct AssumedShapes {
  Eigen::VectorXd mass;     // [kg] (N)
  Eigen::Matrix3Xd r;       // [m] from the centre of mass
  Eigen::MatrixXd b;        // [-] (3N x n)
  Eigen::VectorXd omega;    // [rad/s]
  Eigen::Matrix3Xd force;   // [N] world axes, constant
  Eigen::MatrixXd damping;  // [N s/m] (n x n) of dashpots; empty without dashpots

  Eigen::Index n() const { return omega.size(); }
  /// Returns the attitude, the last part of y = (q, q', w, attitude). The attitude is a quaternion whose
  /// vector part comes before its scalar part.
  static Eigen::Quaterniond attitude(const Eigen::VectorXd& y) { return Eigen::Quaterniond(y.tail<4>()); }
  Eigen::Vector3d spin(const Eigen::VectorXd& y) const { return y.segment<3>(2 * n()); }

  /// Returns (w', q'').
  Eigen::VectorXd accelerations(const Eigen::VectorXd& y) const {
    const Eigen::VectorXd q = y.head(n()), q_dot = y.segment(n(), n());
    const Eigen::Vector3d w = spin(y);
    const Eigen::Matrix3d R = attitude(y).normalized().toRotationMatrix();
    const double total = mass.sum();
    Eigen::MatrixXd A = Eigen::MatrixXd::Zero(3 + n(), 3 + n());
    Eigen::VectorXd load = Eigen::VectorXd::Zero(3 + n());
    for (Eigen::Index i = 0; i < mass.size(); ++i) {
      const auto b_i = b.middleRows<3>(3 * i);
      const Eigen::Vector3d x = r.col(i) + b_i * q, V_dot = b_i * q_dot;
      Eigen::MatrixXd jacobian(3, 3 + n());
      jacobian << 0.0, x.z(), -x.y(), Eigen::RowVectorXd(b_i.row(0)), -x.z(), 0.0, x.x(),
          Eigen::RowVectorXd(b_i.row(1)), x.y(), -x.x(), 0.0, Eigen::RowVectorXd(b_i.row(2));
      A += mass[i] * jacobian.transpose() * jacobian;
      const Eigen::Vector3d known = w.cross(w.cross(x)) + 2.0 * w.cross(V_dot);
      load += jacobian.transpose() * (R.transpose() * force.col(i) - mass[i] * known);
    }
    load.tail(n()) -= total * omega.cwiseAbs2().cwiseProduct(q);
    if (damping.size() > 0) load.tail(n()) -= damping * q_dot;
    return A.ldlt().solve(load);
  }

  Eigen::VectorXd rates(const Eigen::VectorXd& y) const {
    const Eigen::VectorXd z = accelerations(y);
    Eigen::VectorXd dot(y.size());
    const Eigen::Vector3d half = 0.5 * spin(y);
    const Eigen::Quaterniond attitude_rate =
        attitude(y) * Eigen::Quaterniond(0.0, half.x(), half.y(), half.z());
    dot << y.segment(n(), n()), z.tail(n()), z.head<3>(), attitude_rate.coeffs();
    return dot;
  }

  Eigen::VectorXd start(const Eigen::VectorXd& q, const Eigen::VectorXd& q_dot,
                        const Eigen::Vector3d& w) const {
    Eigen::VectorXd y(2 * n() + 7);
    y << q, q_dot, w, 0.0, 0.0, 0.0, 1.0;
    return y;
  }

  Eigen::VectorXd run(Eigen::VectorXd y, double end, int steps) const {
    const double h = end / steps;
    for (int k = 0; k < steps; ++k) {
      y = extrapolated_step([&](double, const Eigen::VectorXd& at) { return rates(at); }, k * h, y, h);
      y.tail<4>().normalize();
    }
    return y;
  }
};

/// Returns the equations for some modes of a structure.
inline AssumedShapes assumed_shapes(const Structure& structure, const std::vector<int>& modes) {
  return {structure.particles.mass,
          structure.mass_properties.r,
          structure.shapes(Eigen::all, modes),
          structure.omega(modes),
          Eigen::Matrix3Xd::Zero(3, structure.mass_properties.r.cols()),
          {}};
}

}  // namespace freeflex::testing
