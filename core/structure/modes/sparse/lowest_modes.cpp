#include "core/structure/modes/sparse/lowest_modes.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>
#include <utility>

#include "core/faults.hpp"
#include "core/limits.hpp"
#include "core/scene/bodies.hpp"
#include "core/structure/modes/dense/decompositions.hpp"

namespace freeflex {
namespace {

// number of columns in a block; a block finds at most this many modes of one frequency
constexpr int kBlock = 6;
// [-] largest residual of a converged Ritz value, as a fraction of the value. The relative error of a
// frequency is of the order of the square of this fraction
constexpr double kConverged = 1e-10;
// number of modes that are searched for in addition to the kept modes, so that a gap between frequencies
// exists for the Sturm count
constexpr int kBeyond = 6;
// [-] a vector is rough if the highest frequency is more than this factor times the frequency of the vector
constexpr double kRough = 1e4;
constexpr int kMostRestarts = 4;
constexpr int kMostRefinements = 3;
constexpr int kHalfSlice = 72;  // number of missing modes that a shift should have below it
// [-] largest number of missing modes below a shift, as a multiple of the number that it should have
constexpr double kMostOfSlice = 2.5;
// [-] least omega^2 of the sixth lowest mode, as a fraction of the shift
constexpr double kNearLowest = 0.05;
constexpr int kFirstLook = 120;  // number of columns at the first test of convergence
// number of columns at which the first slice ends, because a shift among the modes is then cheaper than more
// columns
constexpr int kFirstColumns = 300;
// number of rough vectors that are smoothed at once, which is cheaper than one after the other
constexpr int kSmoothed = 24;
constexpr Eigen::Index kRowsAtOnce = 4096;
constexpr int kShared = 10'000;  // number of freedoms above which work is worth sharing out

// returns the factor R of the QR decomposition of the product of rows and some of the columns; R is updated
// with one block of rows after the other
Eigen::MatrixXd triangle_of(const SparseRows& rows, const Eigen::MatrixXd& columns,
                            const std::vector<Eigen::Index>& some) {
  const auto size = static_cast<Eigen::Index>(some.size());
  Eigen::MatrixXd triangle = Eigen::MatrixXd::Zero(size, size);  // R before the first block of rows
  for (Eigen::Index row = 0; row < rows.rows(); row += kRowsAtOnce) {
    const Eigen::Index height = std::min(kRowsAtOnce, rows.rows() - row);
    Eigen::MatrixXd stack(size + height, size);
    stack << triangle, exact_product(rows, row, height, columns, some);
    const Eigen::HouseholderQR<Eigen::MatrixXd> qr(stack);
    triangle = qr.matrixQR().topRows(size).triangularView<Eigen::Upper>();
  }
  return triangle;
}

// Returns the number of columns at the next test of convergence: half of the columns that are missing if
// values go on converging at the mean rate, which is too low. At least two blocks, and at most a quarter of
// the present columns, are added. A test costs as much as the columns of a small structure.
Eigen::Index next_look(Eigen::Index columns, Eigen::Index converged, Eigen::Index enough) {
  const Eigen::Index missing = columns * (enough - converged) / std::max<Eigen::Index>(converged, 1);
  return columns + std::max(Eigen::Index{2} * kBlock, std::min(missing / 2, columns / 4));
}

}  // namespace

LowestModes::LowestModes(const Scene& scene, const SparseSystem& system, const SetupProgress& progress,
                         Faults& faults)
    : scene_(scene), system_(system), progress_(progress), faults_(faults) {
  op_.weigh = [&](const Eigen::MatrixXd& x) {
    Eigen::MatrixXd weighed(x.rows(), x.cols());
    run_shared(op_.share, static_cast<int>(x.cols()),
               [&](int k) { weighed.col(k) = system_.mass * x.col(k); });
    return weighed;
  };
  op_.apply = [&](const Eigen::MatrixXd& mass_times_x) {
    return inverse_->apply(mass_times_x, refinements_);
  };
  if (system.num_all() >= kShared) op_.share = progress.share;
  op_.known.append(system_.rigid);
}

bool LowestModes::find(const ModesWanted& wanted) {
  if (system_.rows.nonZeros() == 0) return fail("the scene has no elastic link, so nothing deforms; add one");
  if (!choose_shift() || !choose_count(wanted)) return false;
  if (!find_slices()) return false;
  for (int round = 0; round < kMostRestarts; ++round) {
    sort();
    if (!cut()) return false;
    const int missing = count_missing();
    if (missing <= 0) return missing == 0;
    // Finds the missing modes at the shift of the Sturm count. Earlier start vectors did not contain these
    // modes (THEORY 16.40)
    if (!run_lanczos(missing, missing + kBeyond)) return false;
  }
  return fail(
      "fewer modes were found than the Sturm count gives; request another number or limit under modes");
}

Eigen::MatrixXd LowestModes::take_shapes() {
  Eigen::MatrixXd shapes(system_.num_all(), keep_);
  for (Eigen::Index k = 0; k < keep_; ++k)
    shapes.col(k) = op_.known.range(system_.rigid.cols() + sorted_[index(k)], 1);
  op_.known = {};
  return shapes;
}

ShiftedInverse* LowestModes::lowest_inverse() { return factor_at(lowest_sigma_) ? inverse_.get() : nullptr; }

bool LowestModes::fail(const std::string& message) {
  add_error(faults_, scene_.points.front().origin, message);
  return false;
}

bool LowestModes::report(const std::string& what, double done) {
  if (!progress_.report || progress_.report(what, done)) return true;
  return fail(kSetupEnded);
}

// Returns whether memory suffices for the factor, the particles and the larger of two sets of vectors. One
// set is a Lanczos basis of `columns` vectors and the modes. The other set is the modes twice, because they
// are also stored as shapes.
bool LowestModes::fits(Eigen::Index columns) {
  const double column = 8e-6 * static_cast<double>(system_.num_all());
  const double most = static_cast<double>(std::max(columns + count_, 2 * Eigen::Index{count_}));
  const double particles = 24e-6 * num_particles() * static_cast<double>(count_);
  const double all = wanted_MB_ = most * column + particles + factor_MB_;
  if (progress_.memory_MB == 0.0 || all <= kMemoryShare * progress_.memory_MB) return true;
  return fail(join_text("the set-up of ", scene_.points.size(), " points with ", count_, " modes takes some ",
                        std::ceil(all), " MB (", std::ceil(factor_MB_), " for the factorization, ",
                        std::ceil(particles),
                        " for mass distributed over links), but the machine or a limit "
                        "(ulimit -v) provides ",
                        std::floor(progress_.memory_MB),
                        " MB, of which a fifth is kept free; ask for fewer modes with modes: {count: N}"));
}

// returns the largest possible number of particles from find_particles()
double LowestModes::num_particles() const {
  if (are_point_masses(scene_)) return 0.0;
  double number = 4.0 * static_cast<double>(scene_.points.size());
  for (int i = 0; i < static_cast<int>(scene_.links.size()); ++i)
    number += static_cast<double>(distributed_masses(scene_, i).size());
  return number;
}

// Factors K - sigma m. The assembled form is used if rounding of its entries changes omega^2 by little
// compared with the shift (rounding_). Otherwise the augmented form is used (THEORY 16.36).
bool LowestModes::factor_at(double sigma) {
  // [-] fraction of the shift, small enough for Sturm counts: a tenth of the relative change of omega^2 over
  // half of the gap kTogether
  constexpr double kGoodEnough = 1e-7;
  // [-] fraction of the shift up to which solutions are not refined. The relative error of a frequency is
  // then the square of this fraction, divided by the gap between Ritz values
  constexpr double kExact = 5e-12;
  const double size = std::abs(sigma);
  const bool is_assembled = rounding_ <= kGoodEnough * size;
  const SystemForm form = is_assembled ? SystemForm::kAssembled : SystemForm::kAugmented;
  if (is_factored_ && inverse_->shift() == -sigma && inverse_->form() == form) return true;
  is_factored_ = false;
  if (inverse_ != nullptr && inverse_->form() == form) {
    inverse_->set_shift(-sigma);
  } else {
    std::vector<int>& order = is_assembled ? assembled_order_ : augmented_order_;
    inverse_.reset();
    inverse_ = std::make_unique<ShiftedInverse>(system_, -sigma, form, order, op_.share);
    if (order.empty()) order = inverse_->order();
  }
  factor_MB_ = inverse_->expected_MB();
  if (!report(join_text("factoring the structure, some ", std::ceil(factor_MB_), " MB"), 0.0) || !fits(0))
    return false;
  is_factored_ = inverse_->factor();
  if (is_assembled && sigma < 0.0) {
    const bool is_definite = is_factored_ && inverse_->num_below() == 0;
    rounding_ = std::max(rounding_, size * (is_definite ? inverse_->first_change() : 1.0));
    if (rounding_ > kGoodEnough * size) return factor_at(sigma);
  }
  refinements_ = is_assembled && rounding_ <= kExact * size ? 0 : kMostRefinements;
  return is_factored_ || fail("the structure cannot be factored, because " + inverse_->problem());
}

// Chooses the lowest shift from the frequencies of a few Lanczos blocks. Reduces the shift until omega_6^2 >=
// shift / 20 (THEORY 16.38).
bool LowestModes::choose_shift() {
  constexpr int kMostTries = 24;
  const Eigen::VectorXd mass = system_.mass.diagonal();
  Eigen::VectorXd stiffness = Eigen::VectorXd::Zero(mass.size());
  for (Eigen::Index row = 0; row < system_.rows.rows(); ++row)
    for (SparseRows::InnerIterator it(system_.rows, row); it; ++it)
      stiffness[it.col()] += it.value() * it.value();
  double shift = 0.0;
  for (Eigen::Index i = 0; i < mass.size(); ++i)
    if (mass[i] > 0.0) shift = std::max(shift, stiffness[i] / mass[i]);
  if (!(shift > 0.0) || !std::isfinite(shift))
    return fail("the frequencies are not finite; check the units of masses and stiffnesses");
  stiffest_ = shift;
  shift *= 1e-4;
  for (int k = 0; k < kMostTries; ++k) {
    if (!factor_at(-shift)) return false;
    const int refinements = std::exchange(refinements_, 0);
    BlockLanczos trial(op_, system_.num_all(), kBlock, 17);
    for (int step = 0; step < 3 && trial.step(); ++step) continue;
    if (trial.has_failed()) return fail("the structure cannot be solved, because " + inverse_->problem());
    const RitzPairs few = trial.pairs(kConverged);
    if (few.theta.size() == 0) return fail("the structure cannot be solved");
    // uses the sixth lowest frequency, which is not zero if there are at most five mechanisms
    const Eigen::Index at = std::min<Eigen::Index>(5, few.theta.size() - 1);
    const double lowest = std::max(1.0 / few.theta[at] - shift, 0.0);
    lowest_sigma_ = -shift;
    if (lowest >= kNearLowest * shift) {
      refinements_ = refinements;
      return true;
    }
    if (k + 1 == kMostTries || lowest <= 0.0) return fail_with_mechanisms();
    shift = std::max(lowest, 1e-6 * shift);
  }
  return true;
}

bool LowestModes::fail_with_mechanisms() {
  return fail(
      join_text("there are more than five mechanisms, because links do not hold the parts of the structure "
                "together, and with ",
                scene_.points.size(), " points the mechanisms are not searched for; add links"));
}

// Returns the number of modes below a frequency, including mechanisms. This number is n_negative - n_c - n_A
// minus the number of rigid motions (THEORY 16.40).
std::optional<int> LowestModes::count_below(double omega) {
  if (!factor_at(omega * omega)) return std::nullopt;
  return inverse_->num_below() - static_cast<int>(system_.rigid.cols());
}

bool LowestModes::choose_count(const ModesWanted& wanted) {
  count_ = wanted.count;
  if (wanted.below > 0.0) {
    const std::optional<int> inside = count_below(2.0 * std::numbers::pi * wanted.below * (1.0 + kTogether));
    if (!inside) return false;
    if (*inside < 0)
      return fail(
          "the Sturm count of the modes failed, because it gives fewer modes than there are rigid motions; "
          "request another number or limit under modes");
    if (wanted.count == 0 && *inside > kMaxElastic)
      return fail(join_text("below ", wanted.below, " Hz the structure has ", *inside, " modes, but at most ",
                            kMaxElastic, " are allowed; request a lower frequency limit"));
    if (wanted.count == 0 || *inside <= wanted.count) {
      count_ = *inside;
      asked_below_ = 2.0 * std::numbers::pi * wanted.below;
    }
    if (!factor_at(lowest_sigma_)) return false;
  }
  return fits(kFirstColumns + 8 * kBlock);
}

// Finds the modes slice by slice, with theta = 1 / (omega^2 - sigma^2)   (THEORY 16.41). The first slice uses
// the shift sigma_0^2 below all modes if fewer than kHalfSlice modes are below the frequency sigma_0.
bool LowestModes::find_slices() {
  const Eigen::Index target = count_ + kBeyond;
  const double root = std::sqrt(-lowest_sigma_);
  const std::optional<int> near = count_below(root);
  if (!near) return false;
  const bool is_slice = *near >= kHalfSlice && *near <= kMostOfSlice * kHalfSlice;
  if (is_slice && !run_lanczos(*near, target)) return false;
  if (*near < kHalfSlice && (!factor_at(lowest_sigma_) || !run_lanczos(0, target))) return false;
  double spacing = *near > 0 ? root / *near : root;
  while (num_found() < target && !is_complete_) {
    const std::optional<int> below = move_up(spacing);
    if (!below || !run_lanczos(*below, target - num_found())) return false;
  }
  return true;
}

// Factors at a shift with about kHalfSlice missing modes below it, or fewer towards the end. The shift
// follows from the spacing [rad/s] of the highest modes found   (THEORY 16.41).
// \return number of missing modes below the shift; nullopt: a fault was added
std::optional<int> LowestModes::move_up(double spacing) {
  constexpr int kMostTries = 8;
  sort();
  const Eigen::Index found = num_found(), missing = count_ + kBeyond - found;
  const auto wanted = static_cast<double>(std::clamp<Eigen::Index>((2 * missing) / 3, kBeyond, kHalfSlice));
  const Eigen::Index sample = std::min<Eigen::Index>(found - 1, kHalfSlice);
  const double last = found > 0 ? omega_[found - 1] : 0.0;
  if (sample > 0) spacing = (last - omega_[found - 1 - sample]) / static_cast<double>(sample);
  double step = spacing * wanted;
  if (!(step > kTogether * last)) step = 0.5 * last;
  for (int k = 0; k < kMostTries; ++k) {
    const std::optional<int> below = count_below(last + step);
    if (!below) return std::nullopt;
    const Eigen::Index inside = *below - found;
    if (static_cast<double>(inside) <= kMostOfSlice * wanted) {
      if (inside >= 0) return static_cast<int>(inside);
      fail(join_text(
          "below ", (last + step) / (2.0 * std::numbers::pi), " Hz the Sturm count gives ", *below,
          " modes, but ", found,
          " were found, because the range of stiffnesses is too wide for the count; request another "
          "number or limit under modes"));
      return std::nullopt;
    }
    step *= wanted / static_cast<double>(inside);
  }
  fail(join_text("the modes above ", last / (2.0 * std::numbers::pi),
                 " Hz are too close to be separated; request another number or limit under modes"));
  return std::nullopt;
}

// Runs Lanczos until the `below` missing modes below the shift are found, and a quarter more modes above the
// shift, but not more than `most` in all. In the first slice no modes are below the shift, and Lanczos ends
// when `most` modes are found or when it converges slowly.
bool LowestModes::run_lanczos(Eigen::Index below, Eigen::Index most) {
  std::optional<Eigen::MatrixXd> vectors = find_vectors(below, most);
  return vectors && take(std::move(*vectors));
}

std::optional<Eigen::MatrixXd> LowestModes::find_vectors(Eigen::Index below, Eigen::Index most) {
  BlockLanczos lanczos(op_, system_.num_all(), kBlock, 1 + static_cast<unsigned>(op_.known.size()));
  const bool is_first = inverse_->shift() > 0.0;
  const Eigen::Index target = count_ + kBeyond, before = num_found();
  const Eigen::Index enough =
      std::max<Eigen::Index>(kBlock, is_first || most <= 2 * below ? most : below + below / 4);
  Eigen::Index look = std::min<Eigen::Index>(kFirstLook, enough + enough / 4 + kBlock);
  RitzPairs ritz;
  const auto is_done = [&] {
    const Eigen::Index num = ritz.num_converged, columns = lanczos.num_columns();
    const bool is_slow = is_first && num >= kBlock && (columns >= kFirstColumns || num < columns / 5);
    return (ritz.theta.head(num).array() < 0.0).count() >= below && (num >= enough || is_slow);
  };
  bool is_latest = false;
  while (lanczos.step()) {
    is_latest = lanczos.num_columns() >= look;
    if (!is_latest) continue;
    ritz = lanczos.pairs(kConverged);
    if (is_done()) break;
    const Eigen::Index so_far = std::min(target, before + ritz.num_converged);
    const double share = static_cast<double>(std::max<Eigen::Index>(so_far, 1)) / static_cast<double>(target);
    look = next_look(lanczos.num_columns(), ritz.num_converged, enough);
    if (is_first && lanczos.num_columns() < kFirstColumns) look = std::min<Eigen::Index>(look, kFirstColumns);
    if (!fits(look)) return std::nullopt;
    if (!report(join_text("finding modes: ", so_far, " of ", target, ", some ", std::ceil(wanted_MB_), " MB"),
                share))
      return std::nullopt;
  }
  if (lanczos.has_failed()) {
    fail("the structure cannot be solved, because " + inverse_->problem());
    return std::nullopt;
  }
  if (!is_latest) ritz = lanczos.pairs(kConverged);
  is_complete_ = lanczos.is_complete();
  return lanczos.vectors(ritz, is_complete_ ? ritz.theta.size() : ritz.num_converged);
}

// stores modes, with frequencies computed from the link factor A   (THEORY 16.42)
bool LowestModes::take(Eigen::MatrixXd vectors) {
  const Eigen::Index before = found_omega_.size(), added = vectors.cols();
  found_omega_.conservativeResize(before + added);
  run_shared(op_.share, static_cast<int>(added),
             [&](int k) { found_omega_[before + k] = frequency(vectors.col(k)); });
  std::vector<Eigen::Index> rough;
  for (Eigen::Index k = 0; k < added; ++k)
    if (kRough * found_omega_[before + k] < std::sqrt(stiffest_)) rough.push_back(k);
  if (!rough.empty()) {
    if (!smooth(vectors, rough)) return false;
    for (const Eigen::Index k : rough) found_omega_[before + k] = frequency(vectors.col(k));
  }
  op_.known.append(vectors);
  return true;
}

// Removes the content of the stiffest motions from rough vectors (THEORY 16.42). The removed content comes
// from rounding errors or unrefined solutions, and its effect on the frequency grows with the square of the
// ratio of the highest frequency to the frequency of the vector. Applying the refined inverse once removes
// this content, and the columns stay orthonormal within the square of their residuals. Far below the shift,
// the inverse cannot tell modes apart. The vectors y are therefore rotated by the right singular vectors of
// A y, which can; A is the link factor.
bool LowestModes::smooth(Eigen::MatrixXd& vectors, const std::vector<Eigen::Index>& rough) {
  const auto count = static_cast<Eigen::Index>(rough.size());
  for (Eigen::Index begin = 0; begin < count; begin += kSmoothed) {
    const std::vector<Eigen::Index> some(rough.begin() + begin,
                                         rough.begin() + std::min<Eigen::Index>(begin + kSmoothed, count));
    const Eigen::MatrixXd image = inverse_->apply(op_.weigh(vectors(Eigen::all, some)));
    if (image.cols() == 0) return fail("the structure cannot be solved, because " + inverse_->problem());
    const Eigen::MatrixXd weighed = op_.weigh(image);
    const Eigen::VectorXd lengths = image.cwiseProduct(weighed).colwise().sum().cwiseSqrt();
    vectors(Eigen::all, some) = image * lengths.cwiseInverse().asDiagonal();
  }
  const Eigen::JacobiSVD<Eigen::MatrixXd> svd(triangle_of(system_.rows, vectors, rough), Eigen::ComputeFullV);
  const Eigen::MatrixXd rotation = svd.matrixV().rowwise().reverse();
  for (Eigen::Index row = 0; row < vectors.rows(); row += kRowsAtOnce) {
    const auto rows = Eigen::seqN(row, std::min(kRowsAtOnce, vectors.rows() - row));
    vectors(rows, rough) = (vectors(rows, rough).eval() * rotation).eval();
  }
  return true;
}

// omega = |A y| / sqrt(y^T m y)   (THEORY 16.42)
double LowestModes::frequency(const Eigen::MatrixXd& x) const {
  return exact_product(system_.rows, x).norm() / std::sqrt(x.col(0).dot(system_.mass * x.col(0)));
}

void LowestModes::sort() {
  sorted_.resize(index(found_omega_.size()));
  std::iota(sorted_.begin(), sorted_.end(), Eigen::Index{0});
  std::sort(sorted_.begin(), sorted_.end(),
            [&](Eigen::Index a, Eigen::Index b) { return found_omega_[a] < found_omega_[b]; });
  omega_ = found_omega_(sorted_);
}

// Sets the number of kept modes. Modes with the same frequency as the last requested mode are kept too
bool LowestModes::cut() {
  Eigen::Index end = std::min<Eigen::Index>(count_, omega_.size());
  while (end > 0 && end < omega_.size() && omega_[end] - omega_[end - 1] <= kTogether * omega_[end]) ++end;
  if (end == omega_.size() && !is_complete_)
    return fail(join_text("more than ", kBeyond, " modes have the frequency of the last requested mode, ",
                          omega_[end - 1] / (2.0 * std::numbers::pi), " Hz; request more modes"));
  keep_ = end;
  next_ = end < omega_.size() ? omega_[end] : 2.0 * omega_[end - 1];
  return true;
}

// Returns the number of missing modes below a wide gap between the frequencies around and above the last kept
// mode. A negative number means that a fault was added.
int LowestModes::count_missing() {
  Eigen::Index at = keep_;
  double widest = 0.0;
  const Eigen::Index end = std::min<Eigen::Index>(keep_ + kBeyond, omega_.size());
  for (Eigen::Index k = std::max<Eigen::Index>(keep_, 1); k < end; ++k)
    if (const double gap = (omega_[k] - omega_[k - 1]) / omega_[k]; gap > 2.0 * widest || k == keep_) {
      widest = gap;
      at = k;
    }
  counted_below_ = at == 0              ? 0.5 * omega_[0]
                   : at < omega_.size() ? 0.5 * (omega_[at - 1] + omega_[at])
                                        : 1.5 * omega_[at - 1];
  const std::optional<int> counted = count_below(counted_below_);
  if (!counted) return -1;
  const int missing = *counted - static_cast<int>(at);
  if (missing < 0) {
    fail(join_text("below ", counted_below_ / (2.0 * std::numbers::pi), " Hz the Sturm count gives ",
                   *counted, " modes, but ", at,
                   " were found, because the range of stiffnesses is too wide for the count; request another "
                   "number or limit under modes"));
    return -1;
  }
  if (missing > 0) return missing;
  // if the gap is above the kept modes, all modes below the gap are found, so the first mode that is not kept
  // is known
  if (at > keep_) counted_below_ = (1.0 - kTogether) * next_;
  counted_below_ = std::max(counted_below_, asked_below_);
  omega_ = omega_.head(keep_).eval();
  return missing;
}

}  // namespace freeflex
