// These tests check the convergence of plates by the frequencies of the free square plate, and by a strip
// that is compared with a beam.
#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <array>
#include <cmath>
#include <cstdio>
#include <numeric>

#include "core/structure/modes/dense/decompositions.hpp"
#include "tests/setup/plate_mesh.hpp"

namespace freeflex::testing {
namespace {

constexpr int kNumModes = 5;

// Returns the Legendre polynomials of degree below n at x and their first two derivatives, in columns 0, 1,
// 2.
Eigen::MatrixXd legendre(Eigen::Index n, double x) {
  Eigen::MatrixXd P = Eigen::MatrixXd::Zero(n, 3);
  P(0, 0) = 1.0;
  P(1, 0) = x;
  P(1, 1) = 1.0;
  for (Eigen::Index k = 2; k < n; ++k) {
    const auto degree = static_cast<double>(k);
    P(k, 0) = ((2.0 * degree - 1.0) * x * P(k - 1, 0) - (degree - 1.0) * P(k - 2, 0)) / degree;
    for (int d = 1; d < 3; ++d) P(k, d) = P(k - 2, d) + (2.0 * degree - 1.0) * P(k - 1, d - 1);
  }
  return P;
}

// Returns omega a^2 sqrt(rho h / D) of the free square plate by Ritz's method (1909) with n x n products of
// Legendre polynomials. The result is an upper bound in thin-plate theory, and for n = 14 it has converged to
// five digits.
Eigen::VectorXd ritz_free_square(Eigen::Index n, double nu) {
  // for each pair of polynomials, the integral over [-1, 1] of derivative d of one times derivative e of the
  // other is computed by Gauss's rule, whose points come from the recurrence of the polynomials
  Eigen::MatrixXd jacobi = Eigen::MatrixXd::Zero(n, n);
  for (Eigen::Index k = 1; k < n; ++k) {
    const auto degree = static_cast<double>(k);
    jacobi(k, k - 1) = jacobi(k - 1, k) = degree / std::sqrt(4.0 * degree * degree - 1.0);
  }
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> gauss(jacobi);
  const auto integral = [&](int d, int e) {
    Eigen::MatrixXd sum = Eigen::MatrixXd::Zero(n, n);
    for (Eigen::Index g = 0; g < n; ++g) {
      const Eigen::MatrixXd P = legendre(n, gauss.eigenvalues()[g]);
      sum += 2.0 * gauss.eigenvectors()(0, g) * gauss.eigenvectors()(0, g) * P.col(d) * P.col(e).transpose();
    }
    return sum;
  };
  const Eigen::MatrixXd I00 = integral(0, 0), I11 = integral(1, 1), I22 = integral(2, 2),
                        I02 = integral(0, 2), I20 = I02.transpose();
  Eigen::MatrixXd K(n * n, n * n), M(n * n, n * n);
  for (Eigen::Index i = 0; i < n; ++i)
    for (Eigen::Index k = 0; k < n; ++k) {
      K.block(n * i, n * k, n, n) = I22(i, k) * I00 + I00(i, k) * I22 +
                                    nu * (I20(i, k) * I02 + I02(i, k) * I20) +
                                    2.0 * (1.0 - nu) * I11(i, k) * I11;
      M.block(n * i, n * k, n, n) = I00(i, k) * I00;
    }
  const Eigen::GeneralizedSelfAdjointEigenSolver<Eigen::MatrixXd> solver(K, M, Eigen::EigenvaluesOnly);
  return 4.0 * solver.eigenvalues()
                   .segment<kNumModes>(3)
                   .cwiseSqrt();  // the side is 2, and the first three modes are rigid motions
}

TEST(PlateVibration, FrequenciesOfAFreeSquarePlateHaveSecondOrderInTheMeshSize) {
  const double nu = 0.3;
  // Leissa 1973, J. Sound Vib. 31, 257-293, case 21: Ritz's method with 36 products of beam functions, upper
  // bounds
  const Eigen::Matrix<double, kNumModes, 1> leissa{13.489, 19.789, 24.432, 35.024, 35.024};
  const Eigen::VectorXd exact = ritz_free_square(14, nu);
  for (int l = 0; l < kNumModes; ++l) {
    EXPECT_LT(exact[l], leissa[l]);
    EXPECT_GT(exact[l], 0.99 * leissa[l]);
  }
  // NAFEMS R0015, test FV12: 10 m, h = 0.05 m, E = 2e11 Pa, 8000 kg/m^3: 1.622, 2.360, 2.922 Hz
  const double hertz =
      std::sqrt(2e11 * 0.05 * 0.05 / (12.0 * (1.0 - nu * nu) * 8000.0)) / (100.0 * 4.0 * std::acos(0.0));
  EXPECT_NEAR(exact[0] * hertz, 1.622, 0.0006);
  EXPECT_NEAR(exact[1] * hertz, 2.360, 0.0006);
  EXPECT_NEAR(exact[2] * hertz, 2.922, 0.0006);

  // at a / h = 1000 the frequencies of in-plane motion begin at 6e3 / a^2 sqrt(D / rho h), so the lowest
  // modes are bending modes
  const std::vector<int> meshes{4, 8, 12};
  std::vector<Eigen::VectorXd> found;
  found.reserve(meshes.size());
  for (const int cells : meshes)
    found.push_back(build(plate_mesh(1.0, 1.0, cells, cells, unit_plate(nu, 1e-3))).omega.head(kNumModes));
  std::printf(
      "mode  Leissa   Ritz      4x4  error   8x8  error   12x12  error  order  extrapolated  error\n");
  for (int l = 0; l < kNumModes; ++l) {
    std::array<double, 3> error{};
    for (std::size_t i = 0; i < 3; ++i) error[i] = found[i][l] / exact[l] - 1.0;
    const double order = std::log(error[1] / error[2]) / std::log(1.5);
    const double extrapolated = found[2][l] + (found[2][l] - found[1][l]) / (1.5 * 1.5 - 1.0);
    std::printf("%d  %8.3f %8.4f  %8.4f %7.4f  %8.4f %7.4f  %8.4f %7.4f  %.2f  %8.4f  %.1e\n", l + 1,
                leissa[l], exact[l], found[0][l], error[0], found[1][l], error[1], found[2][l], error[2],
                order, extrapolated, extrapolated / exact[l] - 1.0);
    // lumped masses lower the frequencies
    for (const double each : error) EXPECT_LT(each, 0.0);
    EXPECT_GT(order, 1.8);
    EXPECT_LT(order, 2.2);
    EXPECT_LT(std::abs(error[2]), 0.026);
    // extrapolation removes the error of second order, and the remainder has higher order
    EXPECT_NEAR(extrapolated, exact[l], 0.1 * std::abs(found[2][l] - exact[l]));
  }
}

TEST(PlateVibration, AStripWithoutPoissonsRatioBendsLikeABeam) {
  // in three-point bending the deflection is F L^3 / 48 EI between the middle and the ends
  const double L = 1.0, b = 0.25, F = 2.0;
  const Plate plate{7e10, 0.0, 0.01};
  const double beam = F * L * L * L / (48.0 * plate.E * b * std::pow(plate.thickness, 3) / 12.0);
  std::vector<double> error;
  for (const int cells : {4, 8, 16}) {
    const Scene scene = plate_mesh(L, b, cells, cells / 4, plate);
    Faults faults;
    const LinkFactor factor = factor_links(scene, false, faults);
    const int across = cells / 4;
    Eigen::VectorXd force = Eigen::VectorXd::Zero(factor.rows.cols());
    for (int j = 0; j <= across; ++j) {
      const double share = F / across * (j == 0 || j == across ? 0.5 : 1.0);
      const int first = j * (cells + 1);
      force[3 * first + 2] = force[3 * (first + cells) + 2] = -0.5 * share;
      force[3 * (first + cells / 2) + 2] = share;
    }
    std::vector<int> points(scene.points.size());
    std::iota(points.begin(), points.end(), 0);
    const Eigen::MatrixXd rigid = rigid_basis(scene, points), K = factor.rows.transpose() * factor.rows;
    const Eigen::VectorXd V =
        (K + K.trace() / static_cast<double>(K.rows()) * rigid * rigid.transpose()).ldlt().solve(force);
    // the deflection is measured by the work of the forces, which is independent of the shape across the
    // strip
    error.push_back(force.dot(V) / (F * beam) - 1.0);
    std::printf("strip, %d cells along: deflection over the beam's, less one: %.3e\n", cells, error.back());
  }
  // the deflection across a cell is not cubic, so the error is proportional to the square of the cell size
  for (std::size_t i = 1; i < error.size(); ++i) EXPECT_NEAR(std::log2(error[i - 1] / error[i]), 2.0, 0.2);
  EXPECT_LT(error.back(), 1e-3);
}

}  // namespace
}  // namespace freeflex::testing
