#include "tests/bench/modal_rivals.hpp"

#include <Spectra/MatOp/SparseSymMatProd.h>
#include <Spectra/SymGEigsShiftSolver.h>
#include <cholmod.h>

#include <Eigen/SparseCore>
#include <chrono>
#include <cmath>
#include <variant>
#include <vector>

namespace freeflex::testing {
namespace {

using Sparse = Eigen::SparseMatrix<double, Eigen::ColMajor, int>;
using Clock = std::chrono::steady_clock;

double since(Clock::time_point begin) { return std::chrono::duration<double>(Clock::now() - begin).count(); }

/// Returns M^-1/2 K M^-1/2. Both libraries then solve a problem with a unit mass matrix, which takes the
/// least time.
Sparse scaled_stiffness(const Scene& scene) {
  std::vector<Eigen::Triplet<double>> entries;
  for (const Link& link : scene.links) {
    const double stiffness = std::get<Spring>(link.kind).stiffness;
    const PointMass& a = scene.points[static_cast<std::size_t>(link.points[0])];
    const PointMass& b = scene.points[static_cast<std::size_t>(link.points[1])];
    const Eigen::Vector3d d = (b.position - a.position).normalized();
    const Eigen::Matrix3d k = stiffness * d * d.transpose();
    const auto add = [&](int row, int column, double scale) {
      for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j) entries.emplace_back(3 * row + i, 3 * column + j, scale * k(i, j));
    };
    add(link.points[0], link.points[0], 1.0 / a.mass);
    add(link.points[1], link.points[1], 1.0 / b.mass);
    add(link.points[0], link.points[1], -1.0 / std::sqrt(a.mass * b.mass));
    add(link.points[1], link.points[0], -1.0 / std::sqrt(a.mass * b.mass));
  }
  const auto size = static_cast<Eigen::Index>(3 * scene.points.size());
  Sparse matrix(size, size);
  matrix.setFromTriplets(entries.begin(), entries.end());
  return matrix;
}

/// Solves with the supernodal Cholesky factor of K + shift I.
class CholmodInverse {
 public:
  using Scalar = double;
  CholmodInverse(const Sparse& matrix, double shift) : matrix_(matrix) {
    for (Eigen::Index k = 0; k < matrix_.cols(); ++k) matrix_.coeffRef(k, k) += shift;
    matrix_ = Sparse(matrix_.triangularView<Eigen::Lower>());
    matrix_.makeCompressed();
    cholmod_start(&common_);
    common_.supernodal = CHOLMOD_SUPERNODAL;
    common_.final_ll = 1;
    common_.print = 0;
    cholmod_sparse view{};
    view.nrow = view.ncol = static_cast<std::size_t>(matrix_.cols());
    view.nzmax = static_cast<std::size_t>(matrix_.nonZeros());
    view.p = matrix_.outerIndexPtr();
    view.i = matrix_.innerIndexPtr();
    view.x = matrix_.valuePtr();
    view.stype = -1;
    view.itype = CHOLMOD_INT;
    view.xtype = CHOLMOD_REAL;
    view.sorted = view.packed = 1;
    factor_ = cholmod_analyze(&view, &common_);
    cholmod_factorize(&view, factor_, &common_);
  }
  CholmodInverse(const CholmodInverse&) = delete;
  CholmodInverse& operator=(const CholmodInverse&) = delete;
  ~CholmodInverse() {
    cholmod_free_dense(&x_, &common_);
    cholmod_free_dense(&y_, &common_);
    cholmod_free_dense(&e_, &common_);
    cholmod_free_factor(&factor_, &common_);
    cholmod_finish(&common_);
  }
  bool is_good() const { return common_.status == CHOLMOD_OK; }

  Eigen::Index rows() const { return matrix_.rows(); }
  Eigen::Index cols() const { return matrix_.cols(); }
  void set_shift(double) const {}
  void perform_op(const double* in, double* out) const {
    cholmod_dense side{};
    side.nrow = side.nzmax = side.d = static_cast<std::size_t>(rows());
    side.ncol = 1;
    side.x = const_cast<double*>(in);
    side.xtype = CHOLMOD_REAL;
    cholmod_solve2(CHOLMOD_A, factor_, &side, nullptr, &x_, nullptr, &y_, &e_, &common_);
    std::copy_n(static_cast<const double*>(x_->x), rows(), out);
  }

 private:
  Sparse matrix_;
  mutable cholmod_common common_{};
  cholmod_factor* factor_ = nullptr;
  mutable cholmod_dense *x_ = nullptr, *y_ = nullptr, *e_ = nullptr;
};

/// Applies the mass matrix of the scaled problem, which is the identity.
struct Identity {
  using Scalar = double;
  Eigen::Index size;
  Eigen::Index rows() const { return size; }
  Eigen::Index cols() const { return size; }
  void perform_op(const double* in, double* out) const { std::copy_n(in, size, out); }
};

Eigen::VectorXd elastic(Eigen::VectorXd lambda) {
  std::sort(lambda.begin(), lambda.end());
  return lambda.tail(std::max<Eigen::Index>(0, lambda.size() - 6)).cwiseMax(0.0).cwiseSqrt();
}

constexpr double kTolerance = 1e-10;  // [-] relative tolerance of the eigenvalues, the same as in our solver

RivalModes run_spectra(const Scene& scene, int count, double shift) {
  RivalModes rival{"Spectra", "", {}, 0.0};
  const Clock::time_point begin = Clock::now();
  const Sparse K = scaled_stiffness(scene);
  CholmodInverse inverse(K, shift);
  if (!inverse.is_good()) return rival.problem = "K + shift M is not positive definite", rival;
  Identity metric{K.cols()};
  const int wanted = count + 6;
  Spectra::SymGEigsShiftSolver<CholmodInverse, Identity, Spectra::GEigsMode::ShiftInvert> solver(
      inverse, metric, wanted, 2 * wanted, -shift);
  solver.init();
  solver.compute(Spectra::SortRule::LargestMagn, 1000, kTolerance);
  rival.seconds = since(begin);
  if (solver.info() != Spectra::CompInfo::Successful) return rival.problem = "not converged", rival;
  rival.omega = elastic(solver.eigenvalues());
  const Eigen::MatrixXd vectors = solver.eigenvectors();
  rival.seconds = since(begin);
  return rival;
}

extern "C" {
void dsaupd_(int* ido, const char* bmat, const int* n, const char* which, const int* nev, const double* tol,
             double* resid, const int* ncv, double* v, const int* ldv, int* iparam, int* ipntr, double* workd,
             double* workl, const int* lworkl, int* info);
void dseupd_(const int* rvec, const char* howmny, int* select, double* d, double* z, const int* ldz,
             const double* sigma, const char* bmat, const int* n, const char* which, const int* nev,
             const double* tol, double* resid, const int* ncv, double* v, const int* ldv, int* iparam,
             int* ipntr, double* workd, double* workl, const int* lworkl, int* info);
}

RivalModes run_arpack(const Scene& scene, int count, double shift) {
  RivalModes rival{"ARPACK", "", {}, 0.0};
  const Clock::time_point begin = Clock::now();
  const Sparse K = scaled_stiffness(scene);
  const CholmodInverse inverse(K, shift);
  if (!inverse.is_good()) return rival.problem = "K + shift M is not positive definite", rival;
  const int n = static_cast<int>(K.cols()), nev = count + 6, ncv = 2 * nev, lworkl = ncv * (ncv + 8);
  Eigen::VectorXd resid(n), workd(3 * Eigen::Index{n}), workl(lworkl), d(nev);
  Eigen::MatrixXd v(n, ncv);
  int iparam[11] = {1, 0, 1000, 1, 0, 0, 3, 0, 0, 0, 0}, ipntr[11] = {}, ido = 0, info = 0;
  const double tol = kTolerance, sigma = -shift;
  while (ido != 99) {
    dsaupd_(&ido, "I", &n, "LM", &nev, &tol, resid.data(), &ncv, v.data(), &n, iparam, ipntr, workd.data(),
            workl.data(), &lworkl, &info);
    if (ido == -1 || ido == 1) inverse.perform_op(&workd[ipntr[0] - 1], &workd[ipntr[1] - 1]);
    if (ido == 2) std::copy_n(&workd[ipntr[0] - 1], n, &workd[ipntr[1] - 1]);
  }
  if (info != 0) return rival.problem = "not converged", rival;
  const int rvec = 1;
  std::vector<int> select(static_cast<std::size_t>(ncv));
  dseupd_(&rvec, "A", select.data(), d.data(), v.data(), &n, &sigma, "I", &n, "LM", &nev, &tol, resid.data(),
          &ncv, v.data(), &n, iparam, ipntr, workd.data(), workl.data(), &lworkl, &info);
  rival.seconds = since(begin);
  rival.omega = elastic(d);
  return rival;
}

}  // namespace

std::vector<RivalModes> run_modal_rivals(const Scene& scene, int count, double shift) {
  return {run_spectra(scene, count, shift), run_arpack(scene, count, shift)};
}

}  // namespace freeflex::testing
