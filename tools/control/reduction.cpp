// Parts of single modes in a linear model, models with fewer modes, and transfer functions.
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <complex>
#include <limits>
#include <numbers>
#include <numeric>

#include "core/index.hpp"
#include "tools/control/state_space.hpp"

namespace freeflex::control {
namespace {

using Eigen::Index;
using Eigen::MatrixXcd;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using RowMatrixXcd = Eigen::Matrix<std::complex<double>, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

/// Returns true if a mode acts on another, or on the body.
bool are_modes_coupled(const StateSpace& model) {
  const auto n = static_cast<Index>(model.modes.size());
  MatrixXd A = model.A;
  for (Index l = 0; l < n; ++l)
    A(kBodyStates + n + l, kBodyStates + l) = A(kBodyStates + n + l, kBodyStates + n + l) = 0.0;
  A.block(kBodyStates, kBodyStates + n, n, n).setZero();
  return (A.middleCols(kBodyStates, 2 * n).array() != 0.0).any() ||
         (A.middleRows(kBodyStates, 2 * n).array() != 0.0).any();
}

/// Returns x y, and 0 if x is 0 and y infinite.
double product(double x, double y) { return x == 0.0 ? 0.0 : x * y; }

}  // namespace

std::vector<ModeGain> mode_gains(const StateSpace& model) {
  constexpr double kInfinite = std::numeric_limits<double>::infinity();
  std::vector<ModeGain> gains;
  const auto n = static_cast<Index>(model.modes.size());
  for (Index l = 0; l < n; ++l) {
    ModeGain gain;
    gain.mode = model.modes[index(l)];
    const double omega = std::sqrt(std::max(0.0, -model.A(kBodyStates + n + l, kBodyStates + l)));
    const double decay = 0.0 - 0.5 * model.A(kBodyStates + n + l, kBodyStates + n + l);
    gain.frequency = omega / (2.0 * std::numbers::pi);
    gain.damping = omega > 0.0 ? decay / omega : 0.0;
    const double b = model.B.row(kBodyStates + n + l).norm(), zeta = gain.damping;
    const VectorXd c0 = model.by_state.col(kBodyStates + l),
                   c1 = model.by_state.col(kBodyStates + n + l) + model.by_rate.col(kBodyStates + l),
                   c2 = model.by_rate.col(kBodyStates + n + l);
    const double at_resonance = b * std::hypot((c0 - omega * omega * c2).norm(), omega * c1.norm());
    gain.gain = product(at_resonance, omega > 0.0 ? 1.0 / (omega * omega) : kInfinite);
    gain.hankel = product(gain.gain, zeta > 0.0 ? 0.25 / zeta : kInfinite);
    // largest values of 1, s and s^2 over s^2 + 2 zeta omega s + omega^2
    const bool has_resonance = omega > 0.0 && zeta < std::sqrt(0.5);
    const double rise = has_resonance ? 0.5 / (zeta * std::sqrt(1.0 - zeta * zeta)) : 1.0;
    const double of_1 = omega > 0.0 ? rise / (omega * omega) : kInfinite,
                 of_s = decay > 0.0 ? 0.5 / decay : kInfinite;
    gain.peak = product(b * c0.norm(), of_1) + product(b * c1.norm(), of_s) + product(b * c2.norm(), rise);
    gains.push_back(gain);
  }
  return gains;
}

Reduced reduce(const StateSpace& model, const Reduction& reduction) {
  const std::vector<ModeGain> gains = mode_gains(model);
  std::vector<Index> modes;
  for (std::size_t l = 0; l < gains.size(); ++l)
    if (gains[l].frequency >= reduction.low &&
        (reduction.high == 0.0 || gains[l].frequency <= reduction.high))
      modes.push_back(static_cast<Index>(l));
  double largest = 0.0;
  for (const Index l : modes) largest = std::max(largest, gains[index(l)].hankel);
  if (reduction.share.value_or(0.0) > 0.0)
    std::erase_if(modes, [&](Index l) { return gains[index(l)].hankel < *reduction.share * largest; });
  if (reduction.count && index(*reduction.count) < modes.size()) {
    // without damping all Hankel values are infinite, and the gain decides
    std::stable_sort(modes.begin(), modes.end(), [&](Index a, Index b) {
      const ModeGain &x = gains[index(a)], &y = gains[index(b)];
      return x.hankel != y.hankel ? x.hankel > y.hankel : x.gain > y.gain;
    });
    modes.resize(index(*reduction.count));
    std::sort(modes.begin(), modes.end());
  }
  const auto n = static_cast<Index>(gains.size());
  Reduced reduced;
  for (Index l = 0; l < n; ++l)
    if (!std::binary_search(modes.begin(), modes.end(), l)) reduced.bound += gains[index(l)].peak;
  if (reduced.bound > 0.0 && are_modes_coupled(model))
    reduced.bound = std::numeric_limits<double>::quiet_NaN();
  std::vector<Index> kept(kBodyStates);
  std::iota(kept.begin(), kept.end(), Index{0});
  for (const Index block : {Index{0}, n})
    for (const Index l : modes) kept.push_back(kBodyStates + block + l);
  for (Index k = kBodyStates + 2 * n; k < model.A.rows(); ++k) kept.push_back(k);
  reduced.model.A = model.A(kept, kept);
  reduced.model.B = model.B(kept, Eigen::all);
  reduced.model.by_state = model.by_state(Eigen::all, kept);
  reduced.model.by_rate = model.by_rate(Eigen::all, kept);
  reduced.model.by_load = model.by_load;
  set_outputs(reduced.model);
  for (const Index k : kept) reduced.model.states.push_back(model.states[index(k)]);
  for (const Index l : modes) reduced.model.modes.push_back(model.modes[index(l)]);
  reduced.model.inputs = model.inputs;
  reduced.model.outputs = model.outputs;
  return reduced;
}

Response::Response(const StateSpace& model) : D_(model.D) {
  const Eigen::HessenbergDecomposition<MatrixXd> decomposition(model.A);
  const MatrixXd Q = decomposition.matrixQ();
  hessenberg_ = decomposition.matrixH();
  B_ = Q.transpose() * model.B;
  C_ = model.C * Q;
}

MatrixXcd Response::at(double omega) const {
  // Gaussian elimination of i omega - H, which has one row below the diagonal
  RowMatrixXcd matrix = -hessenberg_.cast<std::complex<double>>();
  matrix.diagonal().array() += std::complex<double>(0.0, omega);
  RowMatrixXcd x = B_.cast<std::complex<double>>();
  const Index n = matrix.rows();
  for (Index k = 0; k + 1 < n; ++k) {
    if (std::norm(matrix(k + 1, k)) > std::norm(matrix(k, k))) {
      matrix.row(k).tail(n - k).swap(matrix.row(k + 1).tail(n - k));
      x.row(k).swap(x.row(k + 1));
    }
    if (matrix(k + 1, k) == 0.0) continue;
    const std::complex<double> factor = matrix(k + 1, k) / matrix(k, k);
    matrix.row(k + 1).tail(n - k - 1) -= factor * matrix.row(k).tail(n - k - 1);
    x.row(k + 1) -= factor * x.row(k);
  }
  for (Index k = n - 1; k >= 0; --k) {
    x.row(k) -= matrix.row(k).tail(n - k - 1) * x.bottomRows(n - k - 1);
    x.row(k) /= matrix(k, k);
  }
  return C_.cast<std::complex<double>>() * x + D_;
}

}  // namespace freeflex::control
