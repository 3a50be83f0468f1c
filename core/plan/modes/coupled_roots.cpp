#include "core/plan/modes/coupled_roots.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "core/structure/modes/dense/decompositions.hpp"

namespace freeflex {
namespace {

using Complex = std::complex<double>;
using Eigen::ArrayXcd;
using Eigen::Index;
using Eigen::MatrixXcd;
using Eigen::VectorXcd;

// [flop] The iteration is used up to a cost of kFewFlops if the dense problem is possible too, and up to
// kMostWork if the dense problem is not possible. A problem of kMostWork takes some ten seconds.
constexpr double kFewFlops = 2e9, kMostWork = 1e11;
constexpr int kMostSweeps = 60;
// [-] A root has converged if its change is at most this fraction of its distance from the nearest pole. The
// iteration converges cubically, so the next change would be below the rounding error.
constexpr double kConverged = 1e-10;

struct Pair {
  Complex first, second;
};

// Returns the roots of s^2 + 2 b s + c. Of a complex pair, the root with positive imaginary part is first. Of
// two real roots, the slower one is first.
Pair roots_of(double b, double c) {
  const double square = (b - std::sqrt(std::abs(c))) * (b + std::sqrt(std::abs(c)));
  const double discriminant = c >= 0.0 ? square : b * b - c;
  if (discriminant < 0.0) {
    const double frequency = std::sqrt(-discriminant);
    return {{-b, frequency}, {-b, -frequency}};
  }
  const double far = -(b + std::copysign(std::sqrt(discriminant), b));
  return {far == 0.0 ? 0.0 : c / far, far};
}

// Holds the polynomial whose roots are the eigenvalues: det(1 - N diag(1 / den) out^T) times the product of
// the denominators, N = by_q + s by_q_dot, den = (s - pole) (s - other pole)   (THEORY 8.43). Zero-frequency
// modes have den = s + 2 decay and N = by_q_dot.
class Secular {
 public:
  explicit Secular(const CoupledModes& modes) : modes_(modes), n_(modes.omega.size()) {
    poles_.resize(2 * n_);
    for (Index l = 0; l < n_; ++l) {
      const double omega = modes.omega[l], decay = modes.decay[l];
      is_zero_frequency_.push_back(is_zero_frequency(modes, l));
      const Pair poles = is_zero_frequency_.back() ? Pair{0.0, -2.0 * decay} : roots_of(decay, omega * omega);
      poles_[l] = poles.first, poles_[n_ + l] = poles.second;
      const double u = modes.out.col(l).dot(modes.by_q.col(l)),
                   v = modes.out.col(l).dot(modes.by_q_dot.col(l));
      const Pair guess = is_zero_frequency_.back() ? Pair{0.0, v - 2.0 * decay}
                                                   : roots_of(decay - 0.5 * v, omega * omega - u);
      if (!is_zero_frequency_.back()) start(l, guess.first, std::abs(v));
      start(n_ + l, guess.second, std::abs(v));
      damping_ += v;
      coupling_ += std::abs(v);
    }
  }

  static double work(const CoupledModes& modes) {
    const auto n = static_cast<double>(modes.omega.size()), k = static_cast<double>(modes.out.rows());
    return 2.0 * n * 12.0 * (16.0 * k * k * n + 4.0 * k * k * k + 60.0 * n);
  }

  // Returns false if an eigenvalue does not converge, or if the sum of the eigenvalues is not the trace of
  // the coupled equations
  bool solve() {
    for (int sweep = 0; sweep < kMostSweeps; ++sweep) {
      bool is_done = true;
      for (std::size_t i = 0; i < roots_.size(); ++i) is_done = advance(i) && is_done;
      if (is_done) break;
    }
    Complex moved = 0.0;
    double largest = 0.0;
    for (const Root& root : roots_) {
      if (!root.is_done) return false;
      const Complex s = poles_[root.pole] + root.shift;
      moved += s - poles_[root.first];
      largest = std::max(largest, std::abs(s));
    }
    return std::abs(moved - damping_) <= 1e-6 * coupling_ + 1e-12 * largest;
  }

  void visit(const std::function<void(const CoupledRoot&)>& take) {
    for (const Root& root : roots_) {
      const Complex s = poles_[root.pole] + root.shift;
      if (s.imag() < 0.0 && !is_real_root(s)) continue;
      set_distances(root);
      CoupledRoot out;
      out.s = s;
      MatrixXcd M = matrix();
      const auto [right, left] = null_vectors(M);
      // eigenvector x from (s - A) x = (0, out^T c), where A is the matrix of the uncoupled equations and c
      // is the right null vector
      out.q_dot = (modes_.out.transpose() * right).array() * g_;
      out.q.resize(n_);
      out.left_q_dot = (N_.transpose() * left).array() * g_;
      out.left_q.resize(n_);
      for (Index l = 0; l < n_; ++l) {
        const bool is_zero_frequency = is_zero_frequency_[index(l)];
        if (!is_zero_frequency) out.q_dot[l] *= s;
        out.q[l] = out.q_dot[l] == 0.0 ? 0.0 : out.q_dot[l] / s;
        out.left_q[l] = is_zero_frequency ? 0.0
                                          : (modes_.by_q.col(l).cast<Complex>().cwiseProduct(left).sum() -
                                             modes_.omega[l] * modes_.omega[l] * out.left_q_dot[l]) /
                                                s;
      }
      take(out);
    }
  }

 private:
  struct Root {
    Index first = 0;  // pole at the start
    Index pole = 0;   // nearest pole
    Complex shift;    // root minus the nearest pole
    bool is_done = false;
  };

  // Starts near the guess, but off the real axis. An iteration that starts with real roots keeps them real,
  // so two such roots could not become a complex pair.
  void start(Index pole, Complex guess, double coupling) {
    const double scale = std::max(std::abs(poles_[pole]) + coupling, std::numeric_limits<double>::min());
    const Complex aside = std::polar(1.0, 2.4 * static_cast<double>(roots_.size() + 1));
    Complex shift = guess - poles_[pole];
    shift = std::abs(shift) < 1e-13 * scale ? 1e-9 * scale * aside : shift * (1.0 + 1e-3 * aside);
    roots_.push_back({pole, pole, shift, false});
  }

  // Computes the distances of a root from all poles.
  void set_distances(const Root& root) {
    const Complex s = poles_[root.pole] + root.shift;
    first_ = (poles_[root.pole] - poles_.head(n_).array()) + root.shift;
    second_ = (poles_[root.pole] - poles_.tail(n_).array()) + root.shift;
    N_ = modes_.by_q.cast<Complex>() + s * modes_.by_q_dot.cast<Complex>();
    slope_ = first_ + second_;
    for (Index l = 0; l < n_; ++l) {
      if (!is_zero_frequency_[index(l)]) continue;
      first_[l] = 1.0, slope_[l] = 1.0;
      N_.col(l) = modes_.by_q_dot.col(l).cast<Complex>();
    }
    g_ = (first_ * second_).inverse();
  }

  MatrixXcd matrix() const {
    const Index k = modes_.out.rows();
    return MatrixXcd::Identity(k, k) - N_ * g_.matrix().asDiagonal() * modes_.out.transpose().cast<Complex>();
  }

  // Returns d ln(polynomial) / ds. Call set_distances first.
  Complex log_derivative() const {
    Complex sum = 0.0;
    MatrixXcd slope = modes_.by_q_dot.cast<Complex>();
    for (Index l = 0; l < n_; ++l) {
      const bool is_zero_frequency = is_zero_frequency_[index(l)];
      sum += slope_[l] * g_[l];
      if (is_zero_frequency) slope.col(l).setZero();
      slope.col(l) = (slope.col(l) - N_.col(l) * (slope_[l] * g_[l])) * g_[l];
    }
    return sum - matrix().partialPivLu().solve(slope * modes_.out.transpose().cast<Complex>()).trace();
  }

  // Makes one iteration of one root. Returns true if the root has converged.
  bool advance(std::size_t i) {
    Root& root = roots_[i];
    if (root.is_done) return true;
    set_distances(root);
    Complex others = 0.0;
    for (std::size_t l = 0; l < roots_.size(); ++l)
      if (l != i)
        others += 1.0 / ((poles_[root.pole] - poles_[roots_[l].pole]) + (root.shift - roots_[l].shift));
    const Complex slope = log_derivative() - others, change = 1.0 / slope;
    if (!std::isfinite(std::abs(slope)) || !std::isfinite(std::abs(change))) {
      // The root is at a pole, at another root or converged, so the computation continues from a point close
      // to the root.
      root.shift *= Complex(1.0 + 1e-9, 1e-9);
      return false;
    }
    root.shift -= change;
    root.is_done = std::abs(change) <= kConverged * std::abs(root.shift) ||
                   std::abs(change) <= 1e-16 * std::abs(poles_[root.pole]);
    // From here on, distances are measured from the nearest pole, because distances from this pole keep their
    // digits.
    const Complex s = poles_[root.pole] + root.shift;
    Index nearest = root.pole;
    double least = std::abs(root.shift);
    for (Index pole = 0; pole < 2 * n_; ++pole) {
      if (pole < n_ && is_zero_frequency_[index(pole)]) continue;
      const double distance = std::abs(s - poles_[pole]);
      if (distance < 0.5 * least) nearest = pole, least = distance;
    }
    if (nearest != root.pole) {
      root.shift += poles_[root.pole] - poles_[nearest];
      root.pole = nearest;
    }
    return root.is_done;
  }

  // Returns the right and left null vectors of a matrix that is singular up to rounding error, by inverse
  // iteration.
  static std::pair<VectorXcd, VectorXcd> null_vectors(MatrixXcd& M) {
    const Index k = M.rows();
    const double norm = std::max(M.cwiseAbs().maxCoeff(), std::numeric_limits<double>::min());
    M.diagonal().array() += std::numeric_limits<double>::epsilon() * norm;
    const Eigen::PartialPivLU<MatrixXcd> lu(M);
    VectorXcd right(k), left(k);
    for (Index row = 0; row < k; ++row) right[row] = left[row] = std::polar(1.0, static_cast<double>(row));
    for (int pass = 0; pass < 3; ++pass) {
      right = lu.solve(right).normalized().eval();
      left = lu.transpose().solve(left).normalized().eval();
    }
    return {right, left};
  }

  const CoupledModes& modes_;
  Index n_;
  VectorXcd poles_;  // [1/s] (2 n) first pole of each mode, then the second pole of each mode
  std::vector<bool> is_zero_frequency_;
  std::vector<Root> roots_;
  double damping_ = 0.0, coupling_ = 0.0;  // [1/s] sums over modes: change of the trace, |change|
  ArrayXcd first_, second_, slope_, g_;
  MatrixXcd N_;
};

// Solves the dense eigenvalue problem in (size q, q'), where size is the frequency of each mode, but at least
// 1e-6 of the highest. Omits the displacements of zero-frequency modes.
bool visit_dense(const CoupledModes& modes, const std::function<void(const CoupledRoot&)>& take) {
  const Index n = modes.omega.size();
  std::vector<Index> held;
  for (Index l = 0; l < n; ++l)
    if (!is_zero_frequency(modes, l)) held.push_back(l);
  const auto m = static_cast<Index>(held.size());
  const double top = modes.omega.maxCoeff();
  const Eigen::VectorXd size = modes.omega(held).cwiseMax(1e-6 * top);
  Eigen::MatrixXd A = Eigen::MatrixXd::Zero(m + n, m + n);
  for (Index k = 0; k < m; ++k) {
    A(k, m + held[index(k)]) = size[k];
    A(m + held[index(k)], k) = -modes.omega[held[index(k)]] * modes.omega[held[index(k)]] / size[k];
  }
  A.bottomLeftCorner(n, m) +=
      modes.out.transpose() * modes.by_q(Eigen::all, held) * size.cwiseInverse().asDiagonal();
  A.bottomRightCorner(n, n) = modes.out.transpose() * modes.by_q_dot;
  A.bottomRightCorner(n, n).diagonal() -= 2.0 * modes.decay;
  if (!A.allFinite()) return false;
  const Eigen::EigenSolver<Eigen::MatrixXd> solver(A);
  if (solver.info() != Eigen::Success) return false;
  const MatrixXcd right = solver.eigenvectors(), left = right.inverse();
  if (!left.allFinite()) return false;
  const double rounding = std::numeric_limits<double>::epsilon() * A.norm();
  for (Index i = 0; i < m + n; ++i) {
    const Complex s = solver.eigenvalues()[i];
    if (s.imag() < 0.0 && !is_real_root(s)) continue;
    CoupledRoot root{s,
                     rounding * right.col(i).norm() * left.row(i).norm(),
                     VectorXcd::Zero(n),
                     right.col(i).tail(n),
                     VectorXcd::Zero(n),
                     left.row(i).tail(n).transpose()};
    for (Index k = 0; k < m; ++k) {
      root.q[held[index(k)]] = right(k, i) / size[k];
      root.left_q[held[index(k)]] = left(i, k) * size[k];
    }
    take(root);
  }
  return true;
}

}  // namespace

bool is_zero_frequency(const CoupledModes& modes, Index l) {
  return modes.omega[l] == 0.0 && modes.by_q.col(l).isZero(0.0);
}

bool find_coupled_roots(const CoupledModes& modes, const std::function<void(const CoupledRoot&)>& take) {
  const double work = Secular::work(modes);
  const bool has_dense = modes.omega.size() <= kMostDenseModes;
  if (!modes.is_gyroscopic && (work <= kFewFlops || (!has_dense && work <= kMostWork))) {
    Secular secular(modes);
    if (secular.solve()) return secular.visit(take), true;
  }
  return has_dense && visit_dense(modes, take);
}

}  // namespace freeflex
