#include "tools/verification/reference/steady_motion.hpp"

#include <Eigen/LU>
#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <numeric>

#include "core/structure/modes/dense/decompositions.hpp"
#include "tools/verification/reference/rotations.hpp"

namespace freeflex {
namespace {

using Eigen::Map;
using Eigen::Matrix3d;
using Eigen::Matrix3Xd;
using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;

// [-] step of finite differences, as a fraction of the shortest distance between points. The step causes a
// tension that is proportional to the axial stiffness. The step is so small that this tension hardly stiffens
// a slender link against bending (THEORY 10.27).
constexpr double kLargestStep = 3e-4, kSmallestStep = 1e-5, kTension = 0.1;

/// Returns the step of finite differences [m].
double step_of_differences(const Matrix3Xd& r, const std::vector<double>& stiffnesses) {
  double shortest = r.cwiseAbs().maxCoeff();
  for (Eigen::Index i = 0; i < r.cols(); ++i)
    for (Eigen::Index j = 0; j < i; ++j) shortest = std::min(shortest, (r.col(i) - r.col(j)).norm());
  double ratio = kLargestStep;
  for (std::size_t k = 0; k + 1 < stiffnesses.size(); k += 2)
    ratio = std::min(ratio, kTension * stiffnesses[k + 1] / stiffnesses[k]);
  return std::max(ratio, kSmallestStep) * shortest;
}

double step_of_differences(const CartesianSystem& system) {
  return step_of_differences(
      system.r, system.true_geometry ? system.true_geometry->stiffnesses() : std::vector<double>{});
}

/// Returns the mass of each coordinate, 1 kg for those of massless points, which allowed() excludes.
VectorXd masses(const CartesianSystem& system) {
  VectorXd mass = system.mass;
  for (const int point : system.massless.points) mass[point] = 1.0;
  return mass.transpose().replicate<3, 1>().reshaped();
}

/// Returns the derivative of f at x along a direction, by central differences of order six.
template <typename Function>
VectorXd derivative(const Function& f, const VectorXd& x, const VectorXd& direction, double step) {
  const double h = step / direction.cwiseAbs().maxCoeff();
  const auto odd = [&](double k) { return (f(x + k * h * direction) - f(x - k * h * direction)).eval(); };
  return (45.0 * odd(1.0) - 9.0 * odd(2.0) + odd(3.0)) / (60.0 * h);
}

VectorXd acceleration(const CartesianSystem& system, const VectorXd& e, const VectorXd& e_dot) {
  VectorXd result(e.size());
  const auto size = index(e.size());
  accelerations(system, 0.0, 0.0, {e.data(), size}, {e_dot.data(), size}, {result.data(), size});
  return result;
}

/// Returns orthonormal columns in y = sqrt(m) V, orthogonal to the motions that rigid links forbid, to those
/// of massless points and, unless `with_rigid`, to the rigid motions.
MatrixXd allowed(const CartesianSystem& system, const VectorXd& e, bool with_rigid) {
  const Eigen::Index n = system.mass.size();
  const Map<const Matrix3Xd> E(e.data(), 3, n);
  const Eigen::Index num_rigid = with_rigid ? 0 : 6;
  const MatrixXd forbidden = system.true_geometry ? system.true_geometry->forbidden(E) : MatrixXd(0, 3 * n);
  const auto num_massless = 3 * static_cast<Eigen::Index>(system.massless.points.size());
  MatrixXd columns = MatrixXd::Zero(3 * n, num_rigid + num_massless + forbidden.rows());
  columns.rightCols(forbidden.rows()) = forbidden.transpose();
  for (Eigen::Index k = 0; k < num_massless; ++k)
    columns(Eigen::Index{3} * system.massless.points[index(k / 3)] + k % 3, num_rigid + k) = 1.0;
  if (!with_rigid) {
    const double size = system.r.cwiseAbs().maxCoeff();
    for (Eigen::Index i = 0; i < n; ++i)
      columns.block<3, 6>(3 * i, 0) << std::sqrt(system.mass[i]) * Matrix3d::Identity(),
          -std::sqrt(system.mass[i]) * cross_matrix((system.r.col(i) + E.col(i)) / size);
  }
  if (columns.cols() == 0) return MatrixXd::Identity(3 * n, 3 * n);
  Eigen::ColPivHouseholderQR<MatrixXd> qr(columns);
  qr.setThreshold(1e-9);
  const MatrixXd all = qr.householderQ() * MatrixXd::Identity(3 * n, 3 * n);
  return all.rightCols(3 * n - qr.rank());
}

CartesianSystem at_rest(const CartesianSystem& system) {
  CartesianSystem rest = system;
  rest.loads.clear();
  rest.spin.setZero();
  rest.attractor_mu = 0.0;
  for (CartesianLink& link : rest.links) link.damping = 0.0;
  if (rest.true_geometry) {
    rest.true_geometry->set_damping({});
    rest.true_geometry->set_correction(0.0);
  }
  return rest;
}

/// Returns the derivatives of the accelerations y'' along the columns of a basis of y, with respect to the
/// displacements or, if `by_rates`, to their rates.
MatrixXd jacobian(const CartesianSystem& system, const VectorXd& e, const MatrixXd& basis, bool by_rates) {
  const VectorXd root = masses(system).cwiseSqrt();
  const VectorXd zero = VectorXd::Zero(e.size());
  const double step = step_of_differences(system);
  MatrixXd J(e.size(), basis.cols());
  for (Eigen::Index k = 0; k < basis.cols(); ++k) {
    const VectorXd direction = basis.col(k).cwiseQuotient(root);
    J.col(k) = root.cwiseProduct(
        by_rates
            ? derivative([&](const VectorXd& v) { return acceleration(system, e, v); }, zero, direction, step)
            : derivative([&](const VectorXd& x) { return acceleration(system, x, zero); }, e, direction,
                         step));
  }
  return J;
}

}  // namespace

RestModes rest_modes(const CartesianSystem& system) {
  const CartesianSystem rest = at_rest(system);
  const VectorXd zero = VectorXd::Zero(3 * rest.mass.size());
  const MatrixXd basis = allowed(rest, zero, false);
  const MatrixXd K = -basis.transpose() * jacobian(rest, zero, basis, false);
  const Eigen::SelfAdjointEigenSolver<MatrixXd> eigen(0.5 * (K + K.transpose()));
  RestModes modes;
  modes.omega = eigen.eigenvalues().cwiseMax(0.0).cwiseSqrt();
  modes.shapes = masses(rest).cwiseSqrt().cwiseInverse().asDiagonal() * (basis * eigen.eigenvectors());
  return modes;
}

MatrixXd stiffness_at_rest(const TrueGeometry& links, const CartesianSystem& system) {
  const Eigen::Index size = 3 * system.mass.size();
  const double step = step_of_differences(system.r, links.stiffnesses());
  const auto force = [&](const VectorXd& e) {
    VectorXd result = VectorXd::Zero(size);
    links.add_forces(Map<const Matrix3Xd>(e.data(), 3, size / 3), Map<Matrix3Xd>(result.data(), 3, size / 3));
    return result;
  };
  MatrixXd K(size, size);
  for (Eigen::Index k = 0; k < size; ++k)
    K.col(k) = -derivative(force, VectorXd::Zero(size), VectorXd::Unit(size, k), step);
  return 0.5 * (K + K.transpose());
}

VectorXd energies_of_mode(const CartesianSystem& system, const VectorXd& shape) {
  const double h = step_of_differences(system) / shape.cwiseAbs().maxCoeff();
  const auto even = [&](double k) {
    VectorXd sum = VectorXd::Zero(system.true_geometry->num_links());
    for (const double sign : {-1.0, 1.0}) {
      const VectorXd e = sign * k * h * shape;
      const Map<const Matrix3Xd> E(e.data(), 3, system.mass.size());
      sum += system.true_geometry->energies(E);
      for (const CartesianLink& link : system.links) {
        const Vector3d d = E.col(link.second) - E.col(link.first);
        const double elongation =
            (2.0 * link.rest.dot(d) + d.squaredNorm()) / ((link.rest + d).norm() + link.length);
        sum[link.link] += 0.5 * link.stiffness * elongation * elongation;
      }
    }
    return (sum / (2.0 * k * k * h * h)).eval();
  };
  return (4.0 * even(1.0) - even(2.0)) / 3.0;
}

SteadyMotion steady_motion(const CartesianSystem& system, const VectorXd& start) {
  constexpr int kMost = 40;
  // [-] the motion counts as found if the Newton step is below this fraction of the size
  constexpr double kFound = 1e-11;
  SteadyMotion motion;
  CartesianSystem uncorrected = system;
  if (uncorrected.true_geometry) uncorrected.true_geometry->set_correction(0.0);
  const Eigen::Index n = uncorrected.mass.size();
  const VectorXd root = masses(uncorrected).cwiseSqrt(), zero = VectorXd::Zero(3 * n);
  VectorXd e = start.size() == 0 ? zero : start, residual;
  double last = std::numeric_limits<double>::infinity();
  for (int k = 0;; ++k) {
    if (k == kMost) {
      motion.error = "no steady motion was found, because Newton's method does not converge";
      return motion;
    }
    VectorXd a = acceleration(uncorrected, e, zero);
    motion.acceleration = Map<const Matrix3Xd>(a.data(), 3, n) * uncorrected.mass / uncorrected.mass.sum();
    residual = a - motion.acceleration.replicate(n, 1);
    const MatrixXd basis = allowed(uncorrected, e, false);
    const MatrixXd J = basis.transpose() * jacobian(uncorrected, e, basis, false);
    const VectorXd step = -(basis * J.partialPivLu().solve(basis.transpose() * root.cwiseProduct(residual)));
    e += step.cwiseQuotient(root);
    VectorXd no_rates = zero;
    if (uncorrected.true_geometry)
      uncorrected.true_geometry->project(Map<Matrix3Xd>(e.data(), 3, n),
                                         Map<Matrix3Xd>(no_rates.data(), 3, n));
    const double size = step.cwiseQuotient(root).cwiseAbs().maxCoeff() / uncorrected.r.cwiseAbs().maxCoeff();
    motion.stiffness = -J;
    if (!std::isfinite(size)) {
      motion.error = "no steady motion was found, because the accelerations are not finite";
      return motion;
    }
    if (size < kFound || (size < 1e-8 && size > 0.5 * last)) break;
    last = size;
  }
  motion.e = e;
  motion.residual = residual.cwiseAbs().maxCoeff();

  const MatrixXd basis = allowed(uncorrected, e, true);
  const Eigen::Index m = basis.cols();
  MatrixXd first_order = MatrixXd::Zero(2 * m, 2 * m);
  first_order.topRightCorner(m, m).setIdentity();
  first_order.bottomLeftCorner(m, m) = basis.transpose() * jacobian(uncorrected, e, basis, false);
  first_order.bottomRightCorner(m, m) = basis.transpose() * jacobian(uncorrected, e, basis, true);
  const Eigen::EigenSolver<MatrixXd> eigen(first_order);
  std::vector<Eigen::Index> order(index(2 * m));
  std::iota(order.begin(), order.end(), 0);
  std::sort(order.begin(), order.end(), [&](Eigen::Index i, Eigen::Index j) {
    return std::abs(eigen.eigenvalues()[i]) < std::abs(eigen.eigenvalues()[j]);
  });
  motion.rates.resize(2 * m);
  motion.shapes.resize(3 * n, 2 * m);
  for (Eigen::Index k = 0; k < 2 * m; ++k) {
    const Eigen::Index i = order[index(k)];
    motion.rates[k] = eigen.eigenvalues()[i];
    motion.shapes.col(k) = root.cwiseInverse().asDiagonal() * (basis * eigen.eigenvectors().col(i).head(m));
  }
  return motion;
}

}  // namespace freeflex
