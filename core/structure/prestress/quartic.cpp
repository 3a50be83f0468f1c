#include "core/structure/prestress/quartic.hpp"

#include <algorithm>
#include <cmath>

#include "core/structure/modes/dense/decompositions.hpp"
#include "core/structure/structure.hpp"

namespace freeflex {
namespace {

constexpr Eigen::Index kMostForms = 12;
constexpr double kLeftOut = 0.01;  // [-] sum of the eigenvalues whose forms are omitted, as a fraction of the
                                   // sum of all eigenvalues

}  // namespace

SquareSums::SquareSums(std::vector<int> columns) : columns_(std::move(columns)) {
  const auto size = static_cast<Eigen::Index>(columns_.size());
  sum_ = Eigen::MatrixXd::Zero(size, size);
}

void SquareSums::add(const Eigen::MatrixXd& h, const Eigen::VectorXd& D) {
  if (columns_.empty()) return;
  for (Eigen::Index k = 0; k < D.size(); ++k) {
    if (scaled_.size() == 0) scaled_.resize(sum_.rows(), kAtOnce);
    const double root = std::sqrt(D[k]);
    for (Eigen::Index pair = 0; pair < sum_.rows(); ++pair)
      scaled_(pair, count_) = root * h(k, columns_[index(pair)]);
    if (++count_ == kAtOnce) flush();
  }
}

void SquareSums::flush() {
  if (count_ > 0) sum_.selfadjointView<Eigen::Lower>().rankUpdate(scaled_.leftCols(count_));
  count_ = 0;
}

Eigen::MatrixXd SquareSums::finish() {
  flush();
  return sum_.selfadjointView<Eigen::Lower>();
}

std::vector<int> shadowed_pairs(const Prestress& prestress) {
  std::vector<int> positions;
  for (std::size_t k = 0; k < prestress.pairs.size(); ++k)
    if (std::max(prestress.pairs[k][0], prestress.pairs[k][1]) < prestress.num_shadowed)
      positions.push_back(static_cast<int>(k));
  return positions;
}

Eigen::MatrixXd quartic_forms(const Structure& structure, const Prestress& prestress, Eigen::MatrixXd squares,
                              const Eigen::MatrixXd& rows) {
  const std::vector<int> positions = shadowed_pairs(prestress);
  const double M = structure.mass_properties.mass;
  // subtracts sum_v C_ab,v C_cd,v / (M omega_v^2) over the modes v whose error is not integrated; these modes
  // are in quasi-static equilibrium (THEORY X146)
  for (Eigen::Index v = prestress.num_shadowed; v < structure.omega.size(); ++v) {
    const double stiffness = M * structure.omega[v] * structure.omega[v];
    if (stiffness == 0.0) continue;
    const Eigen::VectorXd gamma = rows.col(v)(positions);
    squares.noalias() -= gamma * (gamma / stiffness).transpose();
  }
  // a product of two different modes occurs twice in x x^T
  Eigen::VectorXd weight(squares.rows());
  for (Eigen::Index k = 0; k < weight.size(); ++k) {
    const auto [a, b] = prestress.pairs[static_cast<std::size_t>(positions[index(k)])];
    weight[k] = a == b ? 1.0 : std::sqrt(2.0);
  }
  squares = (weight.asDiagonal() * squares * weight.asDiagonal()).eval();
  Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver;
  if (squares.size() > 0) solver.compute(squares);
  const Eigen::Index s = prestress.num_shadowed;
  Eigen::MatrixXd forms(0, s);
  double left = squares.size() > 0 ? solver.eigenvalues().cwiseMax(0.0).sum() : 0.0;
  const double enough = kLeftOut * left;
  for (Eigen::Index k = squares.rows() - 1; k >= 0 && left > enough && forms.rows() < kMostForms * s; --k) {
    const double value = solver.eigenvalues()[k];
    if (value <= 0.0) break;
    left -= value;
    Eigen::MatrixXd form(s, s);
    for (Eigen::Index p = 0; p < weight.size(); ++p) {
      const auto [a, b] = prestress.pairs[static_cast<std::size_t>(positions[index(p)])];
      form(a, b) = form(b, a) = std::sqrt(value) * solver.eigenvectors()(p, k) / weight[p];
    }
    forms.conservativeResize(forms.rows() + s, s);
    forms.bottomRows(s) = form;
  }
  return forms;
}

void rotate_quartic_forms(const Eigen::MatrixXd& rotation, int first, Eigen::MatrixXd& forms) {
  const Eigen::Index s = forms.cols(), count = std::min<Eigen::Index>(rotation.rows(), s - first);
  if (count <= 0) return;
  const Eigen::MatrixXd part = rotation.topLeftCorner(count, count);
  forms.middleCols(first, count) = (forms.middleCols(first, count) * part).eval();
  for (Eigen::Index at = first; at < forms.rows(); at += s)
    forms.middleRows(at, count) = (part.transpose() * forms.middleRows(at, count)).eval();
}

}  // namespace freeflex
