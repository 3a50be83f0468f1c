#include "core/structure/modes/sparse/sparse_system.hpp"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <numeric>
#include <random>

#include "core/rounding.hpp"
#include "core/scene/bodies.hpp"
#include "core/structure/body_modes.hpp"
#include "core/structure/masses/mass_properties.hpp"
#include "core/structure/masses/particles.hpp"
#include "core/structure/modes/dense/decompositions.hpp"
#include "core/structure/modes/sparse/solver_library.hpp"

namespace freeflex {
namespace {

constexpr int kNamesInError = 8;
// [-] fraction of the largest displacement in a motion: a point that moves by less than this is at rest
constexpr double kStaysBelow = 1e-6;
// [-] fraction of the norm of the Gram matrix. A smaller pivot may belong to a motion that moves no mass and
// strains no link
constexpr double kNoPivot = 1e-10;
constexpr double kSmallest = 1e-300;

SparseRows to_sparse(const DeformationRows& rows, const SparseSystem& system, int num_all, bool unit) {
  std::vector<Eigen::Triplet<double>> entries;
  for (std::size_t i = 0; i < rows.size(); ++i)
    for (const auto& [freedom, coefficient] : rows[i].coefficients) {
      const double scale = freedom < system.num_displacements ? 1.0 : 1.0 / system.length;
      if (!system.pinned[index(freedom)])
        entries.emplace_back(static_cast<int>(i), freedom,
                             scale * coefficient * (unit ? rows[i].unit_scale : rows[i].root_stiffness));
    }
  SparseRows sparse(static_cast<Eigen::Index>(rows.size()), num_all);
  sparse.setFromTriplets(entries.begin(), entries.end());
  return sparse;
}

double length_of(const MassProperties& body) {
  const double size =
      std::sqrt(std::max(body.r.colwise().squaredNorm().maxCoeff(), body.principal.maxCoeff() / body.mass));
  return size > 0.0 ? size : 1.0;
}

// makes columns orthonormal in the mass metric, in two passes because of rounding errors
void orthonormalise(const SparseRows& mass, Eigen::MatrixXd& columns) {
  for (int pass = 0; pass < 2; ++pass)
    for (Eigen::Index k = 0; k < columns.cols(); ++k) {
      const Eigen::VectorXd weighed = mass * columns.col(k);
      for (Eigen::Index other = 0; other < columns.cols(); ++other) {
        if (other >= k) break;
        columns.col(k) -= columns.col(other).dot(weighed) * columns.col(other);
      }
      columns.col(k) /= std::sqrt(columns.col(k).dot(mass * columns.col(k)));
    }
}

// Returns the null vectors of some rows, which have |(B y, B_m y, C y)| < 1e-11 |y|   (THEORY 16.45). Inverse
// iteration with the Gram matrix of the rows, whose columns are scaled to length one, gives candidates. The
// number of candidates is the number of small pivots. The rows decide which candidates are null vectors,
// because eigenvalues of the Gram matrix are squares and have fewer digits. If MUMPS fails, the result has no
// rows, and `problem` contains the reason.
Eigen::MatrixXd null_vectors(const std::vector<const SparseRows*>& rows, const Eigen::VectorXd& scale,
                             SymmetricEntries gram, std::string& problem) {
  // [-] This number is added to the diagonal, whose entries are one, or zero for empty columns. The matrix is
  // then regular, and three iterations suffice
  constexpr double kAdded = 1e-13;
  // [-] a unit vector is a null vector if the rows times the vector have a smaller norm, which is then a
  // rounding error of directions
  constexpr double kIsNull = 1e-11;
  const int size = gram.size;
  int count = 0;
  {
    Mumps ranked(gram);
    if (!ranked.factor(kNoPivot)) return problem = ranked.problem(), Eigen::MatrixXd();
    count = ranked.num_null();
  }
  Eigen::MatrixXd null(size, count);
  if (count == 0) return null;
  for (int row = 0; row < size; ++row) gram.add(row, row, kAdded);
  Mumps factor(std::move(gram));
  const auto failed = [&] { return problem = factor.problem(), Eigen::MatrixXd(); };
  if (!factor.factor()) return failed();
  std::mt19937_64 engine(1);
  std::normal_distribution<double> normal;
  for (double& value : null.reshaped()) value = normal(engine);
  for (int step = 0; step < 3; ++step) {
    if (!factor.solve(null)) return failed();
    const Eigen::HouseholderQR<Eigen::MatrixXd> qr(null);
    null.setIdentity();
    null.applyOnTheLeft(qr.householderQ());
  }
  null = (scale.asDiagonal() * null).eval();
  Eigen::MatrixXd square = Eigen::MatrixXd::Zero(count, count);
  for (const SparseRows* each : rows) {
    const Eigen::MatrixXd product = exact_product(*each, null);
    square += product.transpose() * product;
  }
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(square);
  const Eigen::Index num_null = (eigen.eigenvalues().array() < kIsNull * kIsNull).count();
  return null * eigen.eigenvectors().leftCols(num_null);
}

// Finds motions that move no mass and strain no link. If such a motion moves a point, the function adds an
// error. Otherwise it fixes one freedom of each such motion at zero (THEORY 16.45).
void pin_zero_frequency(const Scene& scene, const SparseRows& unit_mass, SparseSystem& system,
                        Faults& faults) {
  const std::vector<const SparseRows*> rows{&system.unit_rows, &unit_mass, &system.constraints};
  SparseRows gram(system.num_all(), system.num_all());
  for (const SparseRows* each : rows) {
    const SparseRows square = SparseRows(each->transpose()) * *each;
    gram = SparseRows(gram + square);
  }
  // columns are scaled to length one, so that the unit of a freedom does not make a pivot small
  const Eigen::VectorXd diagonal = gram.diagonal();
  const Eigen::VectorXd scale =
      diagonal.unaryExpr([](double d) { return d > 0.0 ? 1.0 / std::sqrt(d) : 1.0; });
  SymmetricEntries entries;
  entries.size = system.num_all();
  for (int row = 0; row < entries.size; ++row) {
    if (diagonal[row] == 0.0) entries.add(row, row, 0.0);
    for (SparseRows::InnerIterator it(gram, row); it; ++it)
      if (it.col() <= row)
        entries.add(row, static_cast<int>(it.col()), it.value() * scale[row] * scale[it.col()]);
  }
  std::string problem;
  const Eigen::MatrixXd null = null_vectors(rows, scale, std::move(entries), problem);
  if (null.rows() == 0)
    return add_error(faults, scene.points.front().origin,
                     problem.starts_with("memory ran out")
                         ? problem
                         : join_text("the search for motions without mass and stiffness failed (", problem,
                                     "); give a mass to the joints of massless points"));
  if (null.cols() == 0) return;
  std::vector<int> points;
  for (int i = 0; i < static_cast<int>(scene.points.size()); ++i)
    for (Eigen::Index k = 0; k < null.cols(); ++k)
      if (null.col(k).segment<3>(3 * Eigen::Index{i}).norm() >
          kStaysBelow * null.col(k).cwiseAbs().maxCoeff()) {
        points.push_back(i);
        break;
      }
  if (!points.empty())
    return add_error(
        faults, scene.points[index(points.front())].origin,
        join_text(points.size() == 1 ? "point " : "points ", point_names(scene, points, kNamesInError),
                  points.size() == 1 ? " has" : " have", " no mass, and links do not hold ",
                  points.size() == 1 ? "it" : "them", " in every direction; give a mass, or add links"));
  // pivoting chooses, for each null vector, the freedom with the largest component
  const Eigen::ColPivHouseholderQR<Eigen::MatrixXd> qr(null.transpose());
  const std::vector<Eigen::Index> pins(qr.colsPermutation().indices().data(),
                                       qr.colsPermutation().indices().data() + null.cols());
  for (const Eigen::Index freedom : pins) system.pinned[index(freedom)] = 1;
  // changes the rigid motions so that the fixed freedoms are zero
  const Eigen::MatrixXd at_pins = null(pins, Eigen::all);
  system.rigid -= null * at_pins.partialPivLu().solve(system.rigid(pins, Eigen::all));
}

}  // namespace

SparseSystem sparse_system(const Scene& scene, const Freedoms& freedoms, const LinkFactor& factor,
                           const MassProperties& body, Faults& faults) {
  SparseSystem system;
  system.num_displacements = freedoms.num_displacements();
  system.length = length_of(body);
  system.pinned.assign(index(freedoms.num_all()), 0);
  const DeformationRows mass = mass_rows(scene, freedoms, system.length);
  const auto set_rows = [&] {
    system.rows = to_sparse(factor.natural, system, freedoms.num_all(), false);
    system.unit_rows = to_sparse(factor.natural, system, freedoms.num_all(), true);
    system.constraints = to_sparse(factor.constraint_rows, system, freedoms.num_all(), false);
  };
  set_rows();
  const SparseRows mass_factor = to_sparse(mass, system, freedoms.num_all(), false);
  system.mass = SparseRows(mass_factor.transpose()) * mass_factor;
  // a line that contains all mass has no rotation about it
  system.rigid = rigid_motions_of(scene, freedoms, body, system.length).leftCols(body.rigid_freedoms);
  orthonormalise(system.mass, system.rigid);
  const bool has_massless = freedoms.num_rotations() > 0 || !are_point_masses(scene);
  if (!has_massless) return system;
  pin_zero_frequency(scene, to_sparse(mass, system, freedoms.num_all(), true), system, faults);
  set_rows();
  return system;
}

// (-1, A, 0; A^T, shift m, C^T; 0, C, 0)   (THEORY 16.33), or (A^T A + shift m, C^T; C, 0)   (THEORY 16.34)
SymmetricEntries entries_of(const SparseSystem& system, double shift, SystemForm form) {
  SymmetricEntries entries;
  const int num_strains = form == SystemForm::kAugmented ? static_cast<int>(system.rows.rows()) : 0;
  const int num_all = system.num_all(), num_constraints = static_cast<int>(system.constraints.rows());
  entries.size = num_strains + num_all + num_constraints;
  const auto add_lower = [&](const SparseRows& matrix, double scale) {
    for (int row = 0; row < num_all; ++row)
      for (SparseRows::InnerIterator it(matrix, row); it && it.col() <= row; ++it)
        entries.add(num_strains + row, num_strains + static_cast<int>(it.col()), scale * it.value());
  };
  for (int row = 0; row < num_strains; ++row) {
    entries.add(row, row, -1.0);
    for (SparseRows::InnerIterator it(system.rows, row); it; ++it)
      entries.add(row, num_strains + static_cast<int>(it.col()), it.value());
  }
  if (form == SystemForm::kAssembled)
    add_lower(SparseRows(SparseRows(system.rows.transpose()) * system.rows), 1.0);
  add_lower(system.mass, shift);
  // a freedom fixed at zero is not coupled to others and adds one positive eigenvalue
  for (int row = 0; row < num_all; ++row)
    if (system.pinned[index(row)]) entries.add(num_strains + row, num_strains + row, 1.0);
  for (int row = 0; row < num_constraints; ++row)
    for (SparseRows::InnerIterator it(system.constraints, row); it; ++it)
      entries.add(num_strains + num_all + row, num_strains + static_cast<int>(it.col()), it.value());
  return entries;
}

// returns n_c + n_A, where n_negative is n_c + n_A plus the number of modes below the shift   (THEORY 16.40)
int num_negative_rows(const SparseSystem& system, SystemForm form) {
  return static_cast<int>((form == SystemForm::kAugmented ? system.rows.rows() : 0) +
                          system.constraints.rows());
}

ShiftedInverse::ShiftedInverse(const SparseSystem& system, double shift, SystemForm form,
                               const std::vector<int>& order, const ShareWork& share)
    : system_(system),
      shift_(shift),
      form_(form),
      first_(form == SystemForm::kAugmented ? system.rows.rows() : 0),
      factor_(entries_of(system, shift, form), order),
      share_(share),
      rows_by_freedom_(system.rows.transpose()),
      constraints_by_freedom_(system.constraints.transpose()) {}

void ShiftedInverse::set_shift(double shift) {
  shift_ = shift;
  factor_.change_values(entries_of(system_, shift, form_).values);
}

bool ShiftedInverse::factor() { return factor_.factor(); }

namespace {

// returns start + sign * row . column
template <typename T>
long double dot(const SparseRows& rows, Eigen::Index row, const T* column, long double start, double sign) {
  for (SparseRows::InnerIterator it(rows, row); it; ++it)
    start += static_cast<long double>(sign * it.value()) * column[it.col()];
  return start;
}

}  // namespace

Eigen::MatrixXd ShiftedInverse::residual(const Eigen::MatrixXd& sides,
                                         const Eigen::MatrixXd& solution) const {
  const Eigen::Index m = system_.rows.rows(), n = system_.num_all(), c = system_.constraints.rows();
  Eigen::MatrixXd left(sides.rows(), sides.cols());
  // Strains are unknowns of the augmented system, but in the assembled system they are computed as A y
  run_shared(share_, static_cast<int>(sides.cols()), [&](int k) {
    std::vector<long double> strains(index(m));
    const double* const e = solution.col(k).data();
    const double* const x = e + first_;
    const double* const lambda = x + n;
    const double* const b = sides.col(k).data();
    double* const out = left.col(k).data();
    for (Eigen::Index i = 0; i < m; ++i) {
      long double& strain = strains[index(i)];
      strain = form_ == SystemForm::kAugmented ? static_cast<long double>(e[i])
                                               : dot(system_.rows, i, x, 0.0L, 1.0);
      if (form_ == SystemForm::kAugmented)
        out[i] = static_cast<double>(dot(system_.rows, i, x, b[i] + strain, -1.0));
    }
    for (Eigen::Index i = 0; i < n; ++i) {
      long double sum = dot(rows_by_freedom_, i, strains.data(), b[first_ + i], -1.0);
      for (SparseRows::InnerIterator it(system_.mass, i); it; ++it)
        sum -= static_cast<long double>(shift_ * it.value()) * x[it.col()];
      if (c > 0) sum = dot(constraints_by_freedom_, i, lambda, sum, -1.0);
      if (system_.pinned[index(i)]) sum -= x[i];
      out[first_ + i] = static_cast<double>(sum);
    }
    for (Eigen::Index i = 0; i < c; ++i)
      out[first_ + n + i] = static_cast<double>(dot(system_.constraints, i, x, b[first_ + n + i], -1.0));
  });
  return left;
}

double ShiftedInverse::relative(const Eigen::MatrixXd& change, const Eigen::MatrixXd& solution) const {
  const Eigen::Index n = system_.num_all();
  return (change.middleRows(first_, n).colwise().norm().array() /
          solution.middleRows(first_, n).colwise().norm().array().max(kSmallest))
      .maxCoeff();
}

Eigen::MatrixXd ShiftedInverse::apply(const Eigen::MatrixXd& mass_times_x, int most_refinements) {
  constexpr double kSolved = 1e-12;  // [-] error at which refinement ends, as a fraction of the solution
  const Eigen::Index n = system_.num_all();
  Eigen::MatrixXd sides = Eigen::MatrixXd::Zero(first_ + n + system_.constraints.rows(), mass_times_x.cols());
  sides.middleRows(first_, n) = mass_times_x;
  Eigen::MatrixXd solution = sides;
  if (!factor_.solve(solution)) return {};
  double last = 1.0;
  for (int step = 0; step < most_refinements; ++step) {
    Eigen::MatrixXd change = residual(sides, solution);
    if (!factor_.solve(change)) return {};
    solution += change;
    const double now = relative(change, solution);
    // the ratio of the last two corrections predicts the next one   (THEORY 16.35)
    if (now * now <= kSolved * last) break;
    last = now;
  }
  return solution.middleRows(first_, n);
}

double ShiftedInverse::first_change() {
  constexpr int kNumTried = 4;
  std::mt19937_64 engine(5);
  std::normal_distribution<double> normal;
  Eigen::MatrixXd sides =
      Eigen::MatrixXd::Zero(first_ + system_.num_all() + system_.constraints.rows(), kNumTried);
  Eigen::MatrixXd x(system_.num_all(), kNumTried);
  for (double& value : x.reshaped()) value = normal(engine);
  sides.middleRows(first_, system_.num_all()) = system_.mass * x;
  Eigen::MatrixXd solution = sides;
  if (!factor_.solve(solution)) return 1.0;
  Eigen::MatrixXd change = residual(sides, solution);
  return factor_.solve(change) ? relative(change, solution) : 1.0;
}

Eigen::MatrixXd exact_product(const SparseRows& rows, const Eigen::MatrixXd& columns) {
  std::vector<Eigen::Index> all(index(columns.cols()));
  std::iota(all.begin(), all.end(), Eigen::Index{0});
  return exact_product(rows, 0, rows.rows(), columns, all);
}

Eigen::MatrixXd exact_product(const SparseRows& rows, Eigen::Index begin, Eigen::Index count,
                              const Eigen::MatrixXd& columns, const std::vector<Eigen::Index>& some) {
  Eigen::MatrixXd product(count, static_cast<Eigen::Index>(some.size()));
  for (Eigen::Index k = 0; k < product.cols(); ++k) {
    const double* const column = columns.col(some[index(k)]).data();
    for (Eigen::Index i = 0; i < count; ++i)
      product(i, k) = static_cast<double>(dot(rows, begin + i, column, 0.0L, 1.0));
  }
  return product;
}

Eigen::MatrixXd products(const Eigen::MatrixXd& x, Eigen::Index count, const Eigen::MatrixXd& y) {
  Eigen::MatrixXd result(count, y.cols());
  const int m = static_cast<int>(count), n = static_cast<int>(y.cols()), k = static_cast<int>(y.rows());
  if (m == 0 || n == 0) return result;
  const double one = 1.0, zero = 0.0;
  solver_library().dgemm("T", "N", &m, &n, &k, &one, x.data(), &k, y.data(), &k, &zero, result.data(), &m);
  return result;
}

void subtract(const Eigen::MatrixXd& x, Eigen::Index count, const Eigen::MatrixXd& h, Eigen::MatrixXd& y) {
  const int m = static_cast<int>(y.rows()), n = static_cast<int>(y.cols()), k = static_cast<int>(count);
  if (n == 0 || k == 0) return;
  const double minus = -1.0, one = 1.0;
  solver_library().dgemm("N", "N", &m, &n, &k, &minus, x.data(), &m, h.data(), &k, &one, y.data(), &m);
}

}  // namespace freeflex
