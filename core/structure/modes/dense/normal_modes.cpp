#include "core/structure/modes/dense/normal_modes.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/structure/modes/dense/graded_svd.hpp"

namespace freeflex {
namespace {

// [-] components of a shape within this distance of the largest are treated as equal, so that rounding errors
// do not determine the sign
constexpr double kEqualComponents = 1e-6;

// Returns the relative error of the lowest frequency that comes from rounding each row before its rigid part
// is projected out:
//   d omega_1 / omega_1 = 2 eps / sigma_1 sqrt(sum_k X_k1^2 alpha_k^2)   (THEORY 4.12)
// In a thin shape this error is large, because the rigid part is nearly the whole row.
double reduction_rounding(const Eigen::VectorXd& sizes, const GradedSvd& svd) {
  constexpr double kRoundings = 2.0;  // [eps] rounding error of a row, by its direction and six reflectors
  if (svd.values.size() == 0 || !(svd.values[0] > 0.0)) return 0.0;
  return kRoundings * std::numeric_limits<double>::epsilon() * svd.lowest_left.cwiseProduct(sizes).norm() /
         svd.values[0];
}

}  // namespace

// A m^-1/2 H = X diag(omega) Y^T   (THEORY 4.8); b = sqrt(M) m^-1/2 H Y   (THEORY 4.9)
NormalModes normal_modes(const Eigen::MatrixXd& rows, const EckartComplement& complement) {
  const GradedSvd svd = graded_svd(complement.reduce(rows));
  const Eigen::MatrixXd mechanisms = complement.mechanism_shapes();
  NormalModes modes;
  modes.omega = Eigen::VectorXd::Zero(mechanisms.cols() + svd.values.size());
  modes.omega.tail(svd.values.size()) = svd.values;
  modes.motions.resize(rows.cols(), modes.omega.size());
  if (modes.omega.size() == 0) return modes;
  modes.motions << mechanisms, complement.shapes(svd.vectors);
  modes.accuracy = std::max(svd.accuracy, reduction_rounding(complement.sizes(rows), svd));
  if (svd.values.size() > 0) modes.conditioning = svd.values[svd.values.size() - 1] / svd.values[0];
  return modes;
}

Eigen::VectorXd fix_signs(Eigen::MatrixXd& shapes) {
  Eigen::VectorXd signs = Eigen::VectorXd::Ones(shapes.cols());
  for (Eigen::Index mode = 0; mode < shapes.cols(); ++mode) {
    const double largest = shapes.col(mode).cwiseAbs().maxCoeff();
    for (const double component : shapes.col(mode)) {
      if (std::abs(component) < (1.0 - kEqualComponents) * largest) continue;
      if (component < 0.0) signs[mode] = -1.0;
      break;
    }
    if (signs[mode] < 0.0) shapes.col(mode) *= -1.0;
  }
  return signs;
}

}  // namespace freeflex
