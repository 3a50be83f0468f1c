#include "core/structure/lowest_modes.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>
#include <utility>

#include "core/limits.hpp"
#include "core/scene/bodies.hpp"
#include "core/scene/faults.hpp"
#include "core/structure/decompositions.hpp"

namespace freeflex {
namespace {

constexpr int kBlock = 6;             // right sides at once, and copies of a frequency that one start finds
constexpr double kConverged = 1e-10;  // [-] of a Ritz value; frequencies have its square
constexpr int kBeyond = 6;      // modes found beyond those kept, so that a gap to count at is among them
constexpr double kRough = 1e4;  // [-] of the highest frequency over one that is not rough
constexpr int kMostRestarts = 4;
constexpr int kMostRefinements = 3;
constexpr int kHalfSlice = 72;        // modes below a shift that are not yet found
constexpr double kNearLowest = 0.05;  // [-] of the shift: the sixth lowest of the modes is not below
constexpr int kFirstLook = 120;       // [columns]
constexpr int kFirstColumns = 300;    // of the first slice: further away a shift among the modes is cheaper
constexpr int kSmoothed = 24;         // columns at once: a solution of many costs less of each
constexpr Eigen::Index kRowsAtOnce = 4096;

// R of the rows times some columns, Q R by Householder, some rows at a time under what is there
Eigen::MatrixXd triangle_of(const SparseRows& rows, const Eigen::MatrixXd& columns,
                            const std::vector<Eigen::Index>& some) {
  const auto size = static_cast<Eigen::Index>(some.size());
  Eigen::MatrixXd triangle = Eigen::MatrixXd::Zero(size, size);  // mechanisms strain nothing
  for (Eigen::Index row = 0; row < rows.rows(); row += kRowsAtOnce) {
    const Eigen::Index height = std::min(kRowsAtOnce, rows.rows() - row);
    Eigen::MatrixXd stack(size + height, size);
    stack << triangle, exact_product(rows, row, height, columns, some);
    const Eigen::HouseholderQR<Eigen::MatrixXd> qr(stack);
    triangle = qr.matrixQR().topRows(size).triangularView<Eigen::Upper>();
  }
  return triangle;
}

}  // namespace

LowestModes::LowestModes(const Scene& scene, const SparseSystem& system, const SetupProgress& progress,
                         Faults& faults)
    : scene_(scene), system_(system), progress_(progress), faults_(faults) {
  op_.weigh = [&](const Eigen::MatrixXd& x) { return Eigen::MatrixXd(system_.mass * x); };
  op_.apply = [&](const Eigen::MatrixXd& mass_times_x) {
    return inverse_->apply(mass_times_x, refinements_);
  };
  op_.known.append(system_.rigid);
}

bool LowestModes::find(const ModesWanted& wanted) {
  if (system_.rows.nonZeros() == 0) return fail("the scene has no elastic link; nothing deforms; add one");
  if (!choose_shift() || !choose_count(wanted)) return false;
  if (!find_slices()) return false;
  for (int round = 0; round < kMostRestarts; ++round) {
    sort();
    if (!cut()) return false;
    const int missing = count_missing();
    if (missing <= 0) return missing == 0;
    // what the starts so far had no part of, about the shift of the count
    if (!run_lanczos(missing, missing + kBeyond)) return false;
  }
  return fail("modes stay missing after a count by inertia; take another band");
}

Eigen::MatrixXd LowestModes::take_shapes() {
  Eigen::MatrixXd shapes(system_.num_all(), keep_);
  for (Eigen::Index k = 0; k < keep_; ++k)
    shapes.col(k) = op_.known.range(system_.rigid.cols() + sorted_[static_cast<std::size_t>(k)], 1);
  op_.known = {};
  return shapes;
}

ShiftedInverse* LowestModes::lowest_inverse() { return factor_at(lowest_sigma_) ? inverse_.get() : nullptr; }

bool LowestModes::fail(const std::string& message) {
  add_error(faults_, scene_.points.front().origin, message);
  return false;
}

bool LowestModes::say(const std::string& what, double done) {
  if (!progress_.say || progress_.say(what, done)) return true;
  return fail(kSetupEnded);
}

// beside the factor: a basis and the modes; or these twice, as shapes
bool LowestModes::fits(Eigen::Index columns) {
  const double column = 8e-6 * static_cast<double>(system_.num_all());
  const double most = static_cast<double>(std::max(columns + count_, 2 * Eigen::Index{count_}));
  const double particles = 24e-6 * num_particles() * static_cast<double>(count_);
  const double all = wanted_MB_ = most * column + particles + factor_MB_;
  if (progress_.memory_MB == 0.0 || all <= kMemoryShare * progress_.memory_MB) return true;
  return fail(join_text("the set-up of ", scene_.points.size(), " points with ", count_, " modes takes some ",
                        std::ceil(all), " MB (", std::ceil(factor_MB_), " of them to factor, ",
                        std::ceil(particles), " for mass that is spread over links), of ",
                        std::floor(progress_.memory_MB),
                        " MB that the machine has or a limit leaves (ulimit -v), a fifth of them not for it; "
                        "ask for fewer with modes: {count: N}"));
}

// what find_particles lays out
double LowestModes::num_particles() const {
  if (are_point_masses(scene_)) return 0.0;
  double number = 4.0 * static_cast<double>(scene_.points.size());
  for (int i = 0; i < static_cast<int>(scene_.links.size()); ++i)
    number += static_cast<double>(spread_masses(scene_, i).size());
  return number;
}

// X171: assembled where what rounds its entries is small beside the shift, else augmented
bool LowestModes::factor_at(double sigma) {
  constexpr double kGoodEnough = 1e-7;  // [-] of the shift; a tenth of half a gap of kTogether, for counts
  constexpr double kExact =
      5e-12;  // [-] what it leaves of frequencies is its square over gaps of Ritz values
  const double size = std::abs(sigma);
  const bool is_assembled = rounding_ <= kGoodEnough * size;
  std::vector<int>& order = is_assembled ? assembled_order_ : augmented_order_;
  inverse_.reset();
  inverse_ = std::make_unique<ShiftedInverse>(
      system_, -sigma, is_assembled ? SystemForm::kAssembled : SystemForm::kAugmented, order);
  if (order.empty()) order = inverse_->order();
  factor_MB_ = inverse_->expected_MB();
  if (!say(join_text("factoring the structure, some ", std::ceil(factor_MB_), " MB"), 0.0) || !fits(0))
    return false;
  const bool is_factored = inverse_->factor();
  if (is_assembled && sigma < 0.0) {
    const bool is_definite = is_factored && inverse_->num_below() == 0;
    rounding_ = std::max(rounding_, size * (is_definite ? inverse_->first_change() : 1.0));
    if (rounding_ > kGoodEnough * size) return factor_at(sigma);
  }
  refinements_ = is_assembled && rounding_ <= kExact * size ? 0 : kMostRefinements;
  return is_factored || fail("the structure cannot be factored: " + inverse_->problem());
}

// X173: frequencies of a few vectors that the shifted inverse smooths, until the shift is among the lowest
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
  if (!(shift > 0.0) || !std::isfinite(shift)) return fail("the frequencies are not finite");
  stiffest_ = shift;
  shift *= 1e-4;
  for (int k = 0; k < kMostTries; ++k) {
    if (!factor_at(-shift)) return false;
    const int refinements = std::exchange(refinements_, 0);
    BlockLanczos trial(op_, system_.num_all(), kBlock, 17);
    for (int step = 0; step < 3 && trial.step(); ++step) continue;
    if (trial.has_failed()) return fail("the structure cannot be solved: " + inverse_->problem());
    const RitzPairs few = trial.pairs(kConverged);
    if (few.theta.size() == 0) return fail("the structure cannot be solved");
    // the sixth lowest of them: mechanisms are seldom so many
    const Eigen::Index at = std::min<Eigen::Index>(5, few.theta.size() - 1);
    const double lowest = std::max(1.0 / few.theta[at] - shift, 0.0);
    lowest_sigma_ = -shift;
    if (lowest >= kNearLowest * shift) {
      refinements_ = refinements;
      return true;
    }
    if (k + 1 == kMostTries || lowest <= 0.0) return too_loose();
    shift = std::max(lowest, 1e-6 * shift);
  }
  return true;
}

bool LowestModes::too_loose() {
  return fail(
      join_text("more than five mechanisms: the structure falls apart into parts that links do not "
                "hold, and one of ",
                scene_.points.size(), " points is not looked into for them; add links"));
}

// modes below, mechanisms among them   (X174)
std::optional<int> LowestModes::count_below(double omega) {
  if (!factor_at(omega * omega)) return std::nullopt;
  return inverse_->num_below() - static_cast<int>(system_.rigid.cols());
}

bool LowestModes::choose_count(const ModesWanted& wanted) {
  count_ = wanted.count;
  if (wanted.below > 0.0) {
    const std::optional<int> inside = count_below(2.0 * std::numbers::pi * wanted.below * (1.0 + kTogether));
    if (!inside) return false;
    if (*inside < 0) return fail("the modes cannot be counted: fewer than rigid motions");
    if (wanted.count == 0 && *inside > kMaxElastic)
      return fail(join_text("below ", wanted.below, " Hz the structure has ", *inside, " modes, at most ",
                            kMaxElastic, " are taken; take a lower frequency"));
    if (wanted.count == 0 || *inside <= wanted.count) {
      count_ = *inside;
      asked_below_ = 2.0 * std::numbers::pi * wanted.below;
    }
    if (!factor_at(lowest_sigma_)) return false;
  }
  return fits(kFirstColumns + 8 * kBlock);
}

// X179. The first shift is below all modes, if it is near enough to the lowest.
bool LowestModes::find_slices() {
  const Eigen::Index target = count_ + kBeyond;
  const double root = std::sqrt(-lowest_sigma_);
  const std::optional<int> near = count_below(root);
  if (!near) return false;
  if (*near < kHalfSlice && (!factor_at(lowest_sigma_) || !run_lanczos(0, target))) return false;
  double spacing = *near > 0 ? root / *near : root;
  while (num_found() < target && !is_complete_) {
    const std::optional<int> below = move_up(spacing);
    if (!below || !run_lanczos(*below, target - num_found())) return false;
  }
  return true;
}

// X179: a shift with about half a slice below it, by the spacing [rad/s] of the highest modes found
// \return modes below it that are not found; nothing: a fault was added
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
    if (static_cast<double>(inside) <= 2.5 * wanted) {
      if (inside >= 0) return static_cast<int>(inside);
      fail(join_text("below ", (last + step) / (2.0 * std::numbers::pi), " Hz inertia counts ", *below,
                     " modes and ", found,
                     " were found: stiffnesses are too far apart for a count; take another band"));
      return std::nullopt;
    }
    step *= wanted / static_cast<double>(inside);
  }
  fail(join_text("the modes above ", last / (2.0 * std::numbers::pi), " Hz are too close to be told apart"));
  return std::nullopt;
}

// Until those below the shift are found, and some above, but no more than `most`; of the first slice what a
// number of columns gives.
bool LowestModes::run_lanczos(Eigen::Index below, Eigen::Index most) {
  std::optional<Eigen::MatrixXd> vectors = find_vectors(below, most);
  return vectors && take(std::move(*vectors));
}

std::optional<Eigen::MatrixXd> LowestModes::find_vectors(Eigen::Index below, Eigen::Index most) {
  BlockLanczos lanczos(op_, system_.num_all(), kBlock, 1 + static_cast<unsigned>(op_.known.size()));
  const bool is_first = inverse_->shift() > 0.0;
  const Eigen::Index target = count_ + kBeyond, before = num_found();
  const Eigen::Index enough =
      std::max<Eigen::Index>(kBlock, is_first ? most : std::min(most, below + below / 4));
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
    look = lanczos.num_columns() + Eigen::Index{2} * kBlock;
    if (!fits(look)) return std::nullopt;
    if (!say(join_text("finding modes: ", so_far, " of ", target, ", some ", std::ceil(wanted_MB_), " MB"),
             share))
      return std::nullopt;
  }
  if (lanczos.has_failed()) {
    fail("the structure cannot be solved: " + inverse_->problem());
    return std::nullopt;
  }
  if (!is_latest) ritz = lanczos.pairs(kConverged);
  is_complete_ = lanczos.is_complete();
  return lanczos.vectors(ritz, is_complete_ ? ritz.theta.size() : ritz.num_converged);
}

// frequencies by the factor   (X175)
bool LowestModes::take(Eigen::MatrixXd vectors) {
  const Eigen::Index before = found_omega_.size(), added = vectors.cols();
  found_omega_.conservativeResize(before + added);
  std::vector<Eigen::Index> rough;
  for (Eigen::Index k = 0; k < added; ++k) {
    found_omega_[before + k] = frequency(vectors.col(k));
    if (kRough * found_omega_[before + k] < std::sqrt(stiffest_)) rough.push_back(k);
  }
  if (!rough.empty()) {
    if (!smooth(vectors, rough)) return false;
    for (const Eigen::Index k : rough) found_omega_[before + k] = frequency(vectors.col(k));
  }
  op_.known.append(vectors);
  return true;
}

// X175. What a vector has of the stiffest motions, by rounding or since solutions are not refined, counts by
// the square of the highest frequency over its own: the inverse takes it away, and leaves columns orthonormal
// to the square of their residuals. Modes far below the shift are all one to it: the factor tells them apart.
bool LowestModes::smooth(Eigen::MatrixXd& vectors, const std::vector<Eigen::Index>& rough) {
  const auto count = static_cast<Eigen::Index>(rough.size());
  for (Eigen::Index begin = 0; begin < count; begin += kSmoothed) {
    const std::vector<Eigen::Index> some(rough.begin() + begin,
                                         rough.begin() + std::min<Eigen::Index>(begin + kSmoothed, count));
    const Eigen::MatrixXd image = inverse_->apply(op_.weigh(vectors(Eigen::all, some)));
    if (image.cols() == 0) return fail("the structure cannot be solved: " + inverse_->problem());
    const Eigen::MatrixXd weighed = op_.weigh(image);
    const Eigen::VectorXd lengths = image.cwiseProduct(weighed).colwise().sum().cwiseSqrt();
    vectors(Eigen::all, some) = image * lengths.cwiseInverse().asDiagonal();
  }
  const Eigen::JacobiSVD<Eigen::MatrixXd> svd(triangle_of(system_.rows, vectors, rough), Eigen::ComputeFullV);
  const Eigen::MatrixXd turn = svd.matrixV().rowwise().reverse();
  for (Eigen::Index row = 0; row < vectors.rows(); row += kRowsAtOnce) {
    const auto rows = Eigen::seqN(row, std::min(kRowsAtOnce, vectors.rows() - row));
    vectors(rows, rough) = (vectors(rows, rough).eval() * turn).eval();
  }
  return true;
}

double LowestModes::frequency(const Eigen::MatrixXd& x) const {
  return exact_product(system_.rows, x).norm() / std::sqrt(x.col(0).dot(system_.mass * x.col(0)));
}

void LowestModes::sort() {
  sorted_.resize(static_cast<std::size_t>(found_omega_.size()));
  std::iota(sorted_.begin(), sorted_.end(), Eigen::Index{0});
  std::sort(sorted_.begin(), sorted_.end(),
            [&](Eigen::Index a, Eigen::Index b) { return found_omega_[a] < found_omega_[b]; });
  omega_ = found_omega_(sorted_);
}

// where the band ends: equal frequencies whole; and where to count, in a gap
bool LowestModes::cut() {
  Eigen::Index end = std::min<Eigen::Index>(count_, omega_.size());
  while (end > 0 && end < omega_.size() && omega_[end] - omega_[end - 1] <= kTogether * omega_[end]) ++end;
  if (end == omega_.size() && !is_complete_)
    return fail(join_text("more than ", kBeyond, " modes have the frequency at which the band ends, ",
                          omega_[end - 1] / (2.0 * std::numbers::pi), " Hz; ask for more"));
  keep_ = end;
  next_ = end < omega_.size() ? omega_[end] : 2.0 * omega_[end - 1];
  return true;
}

// how many of the modes below a gap are not among those found; < 0: a fault was added
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
    fail(join_text("below ", counted_below_ / (2.0 * std::numbers::pi), " Hz inertia counts ", *counted,
                   " modes and ", at,
                   " were found: stiffnesses are too far apart for a count; take another band"));
    return -1;
  }
  if (missing > 0) return missing;
  // where the gap is beyond the band, all below it are there, and the first that is not kept is known
  if (at > keep_) counted_below_ = (1.0 - kTogether) * next_;
  counted_below_ = std::max(counted_below_, asked_below_);
  omega_ = omega_.head(keep_).eval();
  return missing;
}

}  // namespace freeflex
