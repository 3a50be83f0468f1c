#include "core/structure/modes/dense/rigid_residual.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <limits>

#include "core/structure/masses/mass_properties.hpp"
#include "core/structure/modes/dense/decompositions.hpp"

namespace freeflex {
namespace {

// [-] fraction of the lowest elastic frequency. A residual that does not come from a support is reported only
// if its frequency is above this limit. A residual below the limit shifts elastic frequencies by at most half
// of the square of the ratio of frequencies, 0.5 %, which is less than the error of a finite element model.
constexpr double kReported = 0.1;

// [-] fraction of the largest eigenvalue of T^T K_o T. For a support, T^T K_o T has no eigenvalue below minus
// this fraction of the largest. For rounding errors it has eigenvalues of both signs (THEORY 3.20)
constexpr double kOneSigned = 0.1;

// [-] fraction of the largest frequency of a residual. Smaller frequencies are not listed, because they
// belong to directions without support
constexpr double kListed = 1e-3;

// The last printed digits of the entries of a matrix. The shortest decimal form of each entry shows them
class PrintedDigits {
 public:
  explicit PrintedDigits(const Eigen::SparseMatrix<double>& matrix) {
    for (Eigen::Index column = 0; column < matrix.outerSize(); ++column)
      for (Eigen::SparseMatrix<double>::InnerIterator entry(matrix, column); entry; ++entry)
        if (entry.value() != 0.0) add(entry.value());
  }

  // Returns half a unit of the last digit of an entry. The result is the largest of three values. The first
  // follows from the number of significant digits of the longest entry, the second from the largest number of
  // decimals of any entry, and the third from single precision, if all entries are in single precision:
  //   delta = max(10^(floor(log10 |K|) + 1 - n_sig), 10^-n_dec, 2^-23 |K|) / 2   (THEORY 3.19)
  double rounding(double entry) const {
    if (entry == 0.0) return 0.0;
    const int exponent = static_cast<int>(std::floor(std::log10(std::abs(entry))));
    const double by_digits = 0.5 * std::pow(10.0, exponent + 1 - significant_);
    const double by_decimals = 0.5 * std::pow(10.0, -decimals_);
    const double by_single = is_single_ ? 0.5 * std::numeric_limits<float>::epsilon() * std::abs(entry) : 0.0;
    return std::max({by_digits, by_decimals, by_single});
  }

 private:
  void add(double entry) {
    is_single_ = is_single_ && std::abs(entry) <= std::numeric_limits<float>::max() &&
                 static_cast<double>(static_cast<float>(entry)) == entry;
    char text[32];  // -d.ddddddddddddddde-ddd
    const auto end =
        std::to_chars(text, text + sizeof text, std::abs(entry), std::chars_format::scientific).ptr;
    const auto mark = std::find(text, end, 'e');
    const int digits = std::max<int>(1, static_cast<int>(mark - text) - 1);  // without the decimal point
    int exponent = 0;
    std::from_chars(mark + (mark[1] == '+' ? 2 : 1), end, exponent);
    significant_ = std::max(significant_, digits);
    decimals_ = std::max(decimals_, digits - 1 - exponent);
  }

  int significant_ = 1;
  int decimals_ = -std::numeric_limits<double>::max_exponent10;
  bool is_single_ = true;
};

// motions, orthonormal in the mass metric   (THEORY 4.13)
struct FreeAndElastic {
  Eigen::MatrixXd rigid;    // [1/sqrt(kg)] (3N x k)
  Eigen::MatrixXd free;     // Psi, [1/sqrt(kg)] (3N x (k + mechanisms)) rigid motions, then mechanisms
  Eigen::MatrixXd elastic;  // b / sqrt(M), [1/sqrt(kg)] (3N x n)
  Eigen::VectorXd omega;    // [rad/s] (n) > 0
};

FreeAndElastic motions_of(const Scene& scene, const Structure& structure) {
  FreeAndElastic motions;
  motions.rigid = rigid_motions(structure.mass_properties);
  Eigen::VectorXd mass(motions.rigid.rows());
  for (Eigen::Index i = 0; i < mass.size(); ++i) mass[i] = scene.points[index(i / 3)].mass;
  for (auto motion : motions.rigid.colwise()) motion /= std::sqrt(mass.dot(motion.cwiseAbs2()));
  const auto num_mechanisms = static_cast<Eigen::Index>(structure.mechanisms.size());
  const Eigen::Index num_elastic = structure.omega.size() - num_mechanisms;
  const double root_mass = std::sqrt(structure.mass_properties.mass);
  motions.free.resize(mass.size(), motions.rigid.cols() + num_mechanisms);
  motions.free << motions.rigid, structure.shapes.leftCols(num_mechanisms) / root_mass;
  motions.elastic = structure.shapes.rightCols(num_elastic) / root_mass;
  motions.omega = structure.omega.tail(num_elastic);
  return motions;
}

// projections of T and G of a link on some motions, one row for each motion
struct Projections {
  Eigen::MatrixXd rigid, forces;
};
Projections project(const Scene& scene, const RigidResidual& residual, const Eigen::MatrixXd& motions) {
  const std::vector<int>& points = scene.links[index(residual.link)].points;
  Eigen::MatrixXd at(3 * static_cast<Eigen::Index>(points.size()), motions.cols());
  for (std::size_t k = 0; k < points.size(); ++k)
    at.middleRows<3>(3 * static_cast<Eigen::Index>(k)) = motions.middleRows<3>(3 * Eigen::Index{points[k]});
  return {at.transpose() * residual.rigid, at.transpose() * residual.forces};
}

// returns the block of K_o = T G^T + G T^T   (THEORY 3.15) between two sets of motions
Eigen::MatrixXd between(const Projections& rows, const Projections& columns) {
  return rows.rigid * columns.forces.transpose() + rows.forces * columns.rigid.transpose();
}

// returns the eigenvalues of the symmetric part, ascending; one zero for an empty matrix
Eigen::VectorXd eigenvalues_of(const Eigen::MatrixXd& symmetric) {
  if (symmetric.size() == 0) return Eigen::VectorXd::Zero(1);
  const Eigen::MatrixXd mean = 0.5 * (symmetric + symmetric.transpose());
  return Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(mean, Eigen::EigenvaluesOnly).eigenvalues();
}

// returns the norm |sum t g^T + g t^T|, where t and g are the projections of T and G on the elastic motions;
// if these have fewer columns than rows, the norm is computed from their triangular factor
double norm_of_sum(const std::vector<Projections>& elastic, Eigen::Index num_elastic) {
  Eigen::Index num_columns = 0;
  for (const Projections& each : elastic) num_columns += 2 * each.rigid.cols();
  Eigen::MatrixXd columns(num_elastic, num_columns);
  Eigen::Index next = 0;
  for (const Projections& each : elastic) {
    columns.middleCols(next, 2 * each.rigid.cols()) << each.rigid, each.forces;
    next += 2 * each.rigid.cols();
  }
  if (num_columns < num_elastic)
    columns = Eigen::HouseholderQR<Eigen::MatrixXd>(columns)
                  .matrixQR()
                  .topRows(num_columns)
                  .triangularView<Eigen::Upper>()
                  .toDenseMatrix()
                  .eval();
  Eigen::MatrixXd sum = Eigen::MatrixXd::Zero(columns.rows(), columns.rows());
  next = 0;
  for (const Projections& each : elastic) {
    const Eigen::Index count = each.rigid.cols();
    const Eigen::MatrixXd product =
        columns.middleCols(next, count) * columns.middleCols(next + count, count).transpose();
    sum += product + product.transpose();
    next += 2 * count;
  }
  return eigenvalues_of(sum).cwiseAbs().maxCoeff();
}

// returns a number as text with four digits
std::string size_text(double size) {
  char text[32];  // -d.ddde-ddd
  return {text, std::to_chars(text, text + sizeof text, size, std::chars_format::general, 4).ptr};
}

// Returns text such as "0.1123, 0.1645". A negative frequency means that the residual drives the motion
std::string list_of(const Eigen::VectorXd& hertz) {
  std::string text;
  for (const double each : hertz)
    if (std::abs(each) >= kListed * hertz.cwiseAbs().maxCoeff())
      text += (text.empty() ? "" : ", ") + size_text(each);
  return text;
}

// returns the frequencies [Hz], ascending, of the rigid motions of the structure if K_o of one link were the
// only stiffness: det(T^T K_o T - omega_o^2 T^T m T) = 0   (THEORY 3.17)
Eigen::VectorXd rigid_hertz(const Scene& scene, const RigidResidual& residual,
                            const FreeAndElastic& motions) {
  const Projections rigid = project(scene, residual, motions.rigid);
  return eigenvalues_of(between(rigid, rigid)).unaryExpr([](double square) {
    return std::copysign(std::sqrt(std::abs(square)), square) / (2.0 * M_PI);
  });
}

// Returns the bound on the relative difference between the elastic frequencies and those of the matrices as
// given: K_ff = Psi^T K_o Psi, K_ef = b^T K_o Psi, K_ee = b^T K_o b   (THEORY 4.13), rho = |Omega^-1 K_ee
// Omega^-1| (THEORY 4.14), kappa = |Omega^-1 K_ef|^2 / ((1 - rho) omega_1^2 - lambda_f)   (THEORY 4.15),
// omega sqrt(1 - rho) <= omega_given <= omega sqrt(1 + rho + kappa)   (THEORY 4.16)
double largest_shift(const Scene& scene, const std::vector<RigidResidual>& residuals,
                     const FreeAndElastic& motions) {
  const Eigen::Index num_elastic = motions.omega.size();
  if (num_elastic == 0) return 0.0;
  // elastic rows are divided by omega; in the code K_ff and K_ef are `held` and `coupled`
  const Eigen::MatrixXd scaled = motions.elastic * motions.omega.cwiseInverse().asDiagonal();
  Eigen::MatrixXd held = Eigen::MatrixXd::Zero(motions.free.cols(), motions.free.cols());
  Eigen::MatrixXd coupled = Eigen::MatrixXd::Zero(num_elastic, motions.free.cols());
  std::vector<Projections> elastic;
  for (const RigidResidual& each : residuals) {
    const Projections free = project(scene, each, motions.free);
    elastic.push_back(project(scene, each, scaled));
    held += between(free, free);
    coupled += between(elastic.back(), free);
  }
  const double rho = norm_of_sum(elastic, num_elastic);
  const double lowest = (1.0 - rho) * motions.omega[0] * motions.omega[0];
  const double highest_held = std::max(0.0, eigenvalues_of(held).maxCoeff());
  if (!(lowest > highest_held)) return 1.0;
  const double kappa = eigenvalues_of(coupled.transpose() * coupled).maxCoeff() / (lowest - highest_held);
  // 1 - sqrt(1 - rho) and sqrt(1 + rho + kappa) - 1 without cancellation   (THEORY 4.17)
  const double lower = rho / (1.0 + std::sqrt(1.0 - rho));
  const double upper = (rho + kappa) / (1.0 + std::sqrt(1.0 + rho + kappa));
  return std::min(1.0, std::max(lower, upper));
}

enum class Origins { kSupport, kDigits, kOther };

// Returns the origin of a residual: printed digits (THEORY 3.18); a support (THEORY 3.20), if the eigenvalues
// of T^T K_o T have one sign, kappa_min >= -kappa_max / 10; or another origin.
Origins origin_of(const RigidResidual& residual) {
  if (residual.is_within_digits) return Origins::kDigits;
  const Eigen::VectorXd resisted = eigenvalues_of(2.0 * residual.rigid.transpose() * residual.forces);
  return resisted.minCoeff() >= -kOneSigned * resisted.maxCoeff() ? Origins::kSupport : Origins::kOther;
}

}  // namespace

// |K T| <= (delta + delta^T) |T| / 2 + slack for every entry   (THEORY 3.18)
bool is_within_digits(const Eigen::SparseMatrix<double>& matrix, const Eigen::MatrixXd& rigid,
                      const Eigen::MatrixXd& product, double slack) {
  const PrintedDigits digits(matrix);
  const Eigen::SparseMatrix<double> rounding =
      matrix.unaryExpr([&](double entry) { return digits.rounding(entry); });
  const Eigen::SparseMatrix<double> other = rounding.transpose();
  const Eigen::MatrixXd size = rigid.cwiseAbs();
  const Eigen::MatrixXd allowed = 0.5 * (rounding * size + other * size);
  return ((product.cwiseAbs() - allowed).array() <= slack).all();
}

void account_for_rigid_residuals(const Scene& scene, const std::vector<RigidResidual>& residuals,
                                 Structure& structure, Faults& faults) {
  if (residuals.empty()) return;
  const FreeAndElastic motions = motions_of(scene, structure);
  const double lowest = motions.omega.size() > 0 ? motions.omega[0] / (2.0 * M_PI) : 0.0;
  const double shift = largest_shift(scene, residuals, motions);
  structure.frequency_accuracy = std::max(structure.frequency_accuracy, shift);
  for (const RigidResidual& each : residuals) {
    const Eigen::VectorXd hertz = rigid_hertz(scene, each, motions);
    const Origins from = origin_of(each);
    const bool is_large = lowest > 0.0 && hertz.cwiseAbs().maxCoeff() > kReported * lowest;
    if (from != Origins::kSupport && !is_large) continue;
    const Link& link = scene.links[index(each.link)];
    add_warning(
        faults, link.origin,
        join_text(
            "link ", called(link, each.link), ": the stiffness matrix resists rigid motion",
            from == Origins::kSupport  ? ", as supports do"
            : from == Origins::kDigits ? " by the rounding of its digits"
                                       : "",
            ". It alone would make the whole structure vibrate at ", list_of(hertz), " Hz",
            lowest > 0.0 ? ", and the lowest elastic frequency is " + size_text(lowest) + " Hz" : "",
            ". A free structure has no link to ground, so this resistance is removed, which shifts "
            "elastic frequencies by ",
            shift < 1.0 ? "up to " + size_text(shift) + " of their value" : "up to their whole value", "; ",
            from == Origins::kSupport  ? "give the matrix without supports, or, to keep them, add a heavy "
                                         "point for the ground and springs to it"
            : from == Origins::kDigits ? "write the matrix with more digits"
                                       : "check its digits and the positions and order of its points"));
  }
}

}  // namespace freeflex
