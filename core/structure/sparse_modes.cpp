#include "core/structure/sparse_modes.hpp"

#include <algorithm>
#include <cmath>
#include <memory>
#include <numbers>
#include <optional>

#include "core/limits.hpp"
#include "core/rounding.hpp"
#include "core/scene/bodies.hpp"
#include "core/scene/faults.hpp"
#include "core/structure/block_lanczos.hpp"
#include "core/structure/decompositions.hpp"
#include "core/structure/loose_modes.hpp"
#include "core/structure/normal_modes.hpp"
#include "core/structure/particles.hpp"
#include "core/structure/sparse_system.hpp"
#include "core/structure/superelement.hpp"

namespace freeflex {
namespace {

constexpr int kBlock = 12;            // right sides at once, and copies of a frequency that one start finds
constexpr double kTogether = 1e-6;    // [-] frequencies this close are one pair: both are kept, or none
constexpr double kConverged = 1e-10;  // [-] of a Ritz value; frequencies have its square
constexpr int kBeyond = 6;  // modes found beyond those kept, so that a gap to count at is among them
constexpr int kMostRestarts = 4;

class SparseModes {
 public:
  SparseModes(const Scene& scene, const SparseSystem& system, const SetupProgress& progress, Faults& faults)
      : scene_(scene), system_(system), progress_(progress), faults_(faults) {
    op_.weigh = [&](const Eigen::MatrixXd& x) { return Eigen::MatrixXd(system_.mass * x); };
    op_.apply = [&](const Eigen::MatrixXd& mass_times_x) {
      return inverse_->apply(mass_times_x, refinements_);
    };
    op_.known = system_.rigid;
  }

  // false: a fault was added
  bool find(const ModesWanted& wanted) {
    if (system_.rows.nonZeros() == 0) return fail("the scene has no elastic link; nothing deforms; add one");
    if (!choose_shift() || !choose_count(wanted)) return false;
    if (!fits(2 * count_ + 4 * kBlock)) return false;
    for (int round = 0; round < kMostRestarts; ++round) {
      if (!run_lanczos() || !cut()) return false;
      const int missing = count_missing();
      if (missing == 0) return true;
      if (missing < 0) return false;
      // what was found is projected out, and what a start had no part of is looked for
      const Eigen::Index known = op_.known.cols();
      op_.known.conservativeResize(op_.known.rows(), known + found_.cols());
      op_.known.rightCols(found_.cols()) = found_;
    }
    return fail("modes stay missing after a count by inertia; take another band");
  }

  const Eigen::VectorXd& omega() const { return omega_; }
  const Eigen::MatrixXd& shapes() const { return found_; }
  double counted_below() const { return counted_below_; }
  Eigen::MatrixXd strains(const Eigen::MatrixXd& x) const { return exact_product(system_.rows, x); }
  // factored again where counting needed the room; nullptr: a fault was added
  ShiftedInverse* inverse() { return inverse_ || factor_at(shift_) ? inverse_.get() : nullptr; }
  double next_omega() const { return next_; }

 private:
  bool fail(const std::string& message) {
    add_error(faults_, scene_.points.front().origin, message);
    return false;
  }
  bool say(const std::string& what, double done) {
    if (!progress_.say || progress_.say(what, done)) return true;
    return fail(kSetupEnded);
  }

  // beside the factor: a basis and the vectors made of it; or vectors, shapes and what is passed on of them
  bool fits(Eigen::Index columns) {
    const double column = 8e-6 * static_cast<double>(system_.num_all());
    const double most = static_cast<double>(std::max(columns + count_, 3 * Eigen::Index{count_}));
    const double particles = 24e-6 * num_particles() * static_cast<double>(count_);
    const double all = wanted_MB_ = most * column + particles + factor_MB_;
    if (progress_.memory_MB == 0.0 || all <= kMemoryShare * progress_.memory_MB) return true;
    return fail(join_text(
        "the set-up of ", scene_.points.size(), " points with ", count_, " modes takes some ", std::ceil(all),
        " MB (", std::ceil(factor_MB_), " of them to factor, ", std::ceil(particles),
        " for mass that is spread over links), of ", std::floor(progress_.memory_MB),
        " MB that the machine has or a limit leaves (ulimit -v), a fifth of them not for it; "
        "ask for fewer with modes: {count: N}"));
  }

  // what find_particles lays out
  double num_particles() const {
    if (are_point_masses(scene_)) return 0.0;
    double number = 4.0 * static_cast<double>(scene_.points.size());
    for (int i = 0; i < static_cast<int>(scene_.links.size()); ++i)
      number += static_cast<double>(spread_masses(scene_, i).size());
    return number;
  }

  // X171: assembled while that is as good as positive definite and once refined, then augmented
  bool factor_at(double shift) {
    constexpr double kGoodEnough = 1e-9;  // [-] so that gaps of kTogether are wide for a count, too
    inverse_.reset();
    inverse_ = std::make_unique<ShiftedInverse>(system_, shift, form_, order_);
    if (order_.empty()) order_ = inverse_->order();
    shift_ = shift;
    factor_MB_ = inverse_->expected_MB();
    if (!say(join_text("factoring the structure, some ", std::ceil(factor_MB_), " MB"), 0.0)) return false;
    if (!fits(0)) return false;
    const bool is_factored = inverse_->factor();
    if (form_ == SystemForm::kAssembled && (!is_factored || inverse_->first_change() > kGoodEnough)) {
      form_ = SystemForm::kAugmented;
      order_.clear();
      return factor_at(shift);
    }
    return is_factored || fail("the structure cannot be factored: " + inverse_->problem());
  }

  // X173: frequencies of a few vectors that the shifted inverse smooths, until the shift is among the lowest
  bool choose_shift() {
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
    shift *= 1e-4;
    refinements_ = 0;
    for (int k = 0; k < kMostTries; ++k) {
      if (!factor_at(shift)) return false;
      BlockLanczos trial(op_, system_.num_all(), 6, 17);
      for (int step = 0; step < 3 && trial.step(); ++step) continue;
      if (trial.has_failed()) return fail("the structure cannot be solved: " + inverse_->problem());
      const RitzPairs few = trial.values(kConverged);
      if (few.theta.size() == 0) return fail("the structure cannot be solved");
      // the sixth lowest of them: mechanisms are seldom so many
      const Eigen::Index at = std::min<Eigen::Index>(5, few.theta.size() - 1);
      const double lowest = std::max(1.0 / few.theta[at] - shift, 0.0);
      refinements_ = lowest >= 0.05 * shift ? 3 : 0;
      if (refinements_ > 0) return true;
      if (k + 1 == kMostTries || lowest <= 0.0) return too_loose();
      shift = std::max(lowest, 1e-6 * shift);
    }
    return true;
  }

  bool too_loose() {
    return fail(
        join_text("more than five mechanisms: the structure falls apart into parts that links do not "
                  "hold, and one of ",
                  scene_.points.size(),
                  " points is not looked into for them; add "
                  "links"));
  }

  // eigenvalues of K - omega^2 M below zero, rigid motions among them   (X174)
  std::optional<int> count_below(double omega) {
    if (!say(join_text("counting the modes, some ", std::ceil(factor_MB_), " MB"), 0.0)) return std::nullopt;
    inverse_.reset();  // the room of one factor
    Mumps counter(entries_of(system_, -omega * omega, form_), order_);
    if (!counter.factor()) {
      fail("the modes cannot be counted: " + counter.problem());
      return std::nullopt;
    }
    return counter.num_negative() - num_negative_rows(system_, form_);
  }

  bool choose_count(const ModesWanted& wanted) {
    count_ = wanted.count;
    if (wanted.below > 0.0) {
      band_ = 2.0 * std::numbers::pi * wanted.below * (1.0 + kTogether);
      const std::optional<int> below = count_below(band_);
      if (!below) return false;
      const int inside = *below - static_cast<int>(system_.rigid.cols());
      if (inside < 0) return fail("the modes cannot be counted: fewer than rigid motions");
      if (wanted.count == 0 && inside > kMaxElastic)
        return fail(join_text("below ", wanted.below, " Hz the structure has ", inside, " modes, at most ",
                              kMaxElastic, " are taken; take a lower frequency"));
      is_by_band_ = wanted.count == 0 || inside <= wanted.count;
      count_ = is_by_band_ ? inside : wanted.count;
    }
    return true;
  }

  bool run_lanczos() {
    Eigen::MatrixXd vectors;
    if (inverse() == nullptr || !find_vectors(vectors)) return false;
    take(std::move(vectors));
    return true;
  }

  bool find_vectors(Eigen::MatrixXd& vectors) {
    BlockLanczos lanczos(op_, system_.num_all(), kBlock, 1 + static_cast<unsigned>(op_.known.cols()));
    // at least a block again where some were missing
    const Eigen::Index target =
        std::max<Eigen::Index>(kBlock, count_ + kBeyond - (op_.known.cols() - system_.rigid.cols()));
    Eigen::Index look = std::max<Eigen::Index>(4 * kBlock, target + target / 4);
    RitzPairs ritz;
    while (lanczos.step()) {
      if (lanczos.num_columns() < look) continue;
      ritz = lanczos.values(kConverged);
      if (ritz.num_converged >= target) break;
      const double share = static_cast<double>(std::max(ritz.num_converged, 1)) / static_cast<double>(target);
      look = lanczos.num_columns() + std::max<Eigen::Index>(kBlock, lanczos.num_columns() / 8);
      if (!fits(look)) return false;
      if (!say(join_text("finding modes: ", ritz.num_converged, " of ", target, ", some ",
                         std::ceil(wanted_MB_), " MB"),
               share))
        return false;
    }
    if (lanczos.has_failed()) return fail("the structure cannot be solved: " + inverse_->problem());
    ritz = lanczos.values(kConverged);
    is_complete_ = lanczos.is_complete();
    ritz = lanczos.pairs(
        kConverged, std::min<Eigen::Index>(target, is_complete_ ? ritz.theta.size() : ritz.num_converged));
    vectors = std::move(ritz.vectors);
    return true;
  }

  // adds vectors to those found, by rising frequency of the factor   (X175)
  void take(Eigen::MatrixXd all) {
    if (all.cols() == 0) return;
    if (const Eigen::Index before = op_.known.cols() - system_.rigid.cols(); before > 0) {
      const Eigen::Index size = all.cols();
      all.conservativeResize(all.rows(), size + before);
      all.rightCols(before) = op_.known.rightCols(before);
    }
    Eigen::VectorXd omega(all.cols());
    for (Eigen::Index k = 0; k < all.cols(); ++k) {
      const Eigen::MatrixXd x = all.col(k);
      omega[k] = exact_product(system_.rows, x).norm() / std::sqrt(x.col(0).dot(system_.mass * x.col(0)));
    }
    std::vector<Eigen::Index> order(static_cast<std::size_t>(all.cols()));
    for (std::size_t k = 0; k < order.size(); ++k) order[k] = static_cast<Eigen::Index>(k);
    std::sort(order.begin(), order.end(),
              [&](Eigen::Index a, Eigen::Index b) { return omega[a] < omega[b]; });
    found_ = all(Eigen::all, order);
    omega_ = omega(order);
  }

  // where the band ends: equal frequencies whole; and where to count, in a gap
  bool cut() {
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
  int count_missing() {
    Eigen::Index at = keep_;
    double widest = 0.0;
    for (Eigen::Index k = std::max<Eigen::Index>(keep_, 1); k < omega_.size(); ++k)
      if (const double gap = (omega_[k] - omega_[k - 1]) / omega_[k]; gap > 2.0 * widest || k == keep_) {
        widest = gap;
        at = k;
      }
    counted_below_ = at < omega_.size() ? 0.5 * (omega_[at - 1] + omega_[at]) : 1.5 * omega_[at - 1];
    const std::optional<int> counted = count_below(counted_below_);
    if (!counted) return -1;
    const int missing = *counted - static_cast<int>(system_.rigid.cols() + at);
    if (missing < 0) {
      fail(join_text("below ", counted_below_ / (2.0 * std::numbers::pi), " Hz inertia counts ",
                     *counted - static_cast<int>(system_.rigid.cols()), " modes and ", at,
                     " were found: stiffnesses are too far apart for a count; take another band"));
      return -1;
    }
    if (missing == 0) {
      omega_ = omega_.head(keep_).eval();
      found_ = found_.leftCols(keep_).eval();
    }
    return missing;
  }

  const Scene& scene_;
  const SparseSystem& system_;
  const SetupProgress& progress_;
  Faults& faults_;
  MassSymmetric op_;
  std::unique_ptr<ShiftedInverse> inverse_;
  SystemForm form_ = SystemForm::kAssembled;
  std::vector<int> order_;  // of the factor in this form, found once
  double shift_ = 0.0, factor_MB_ = 0.0, wanted_MB_ = 0.0;
  int refinements_ = 3;
  int count_ = 0;
  double band_ = 0.0;
  bool is_by_band_ = false, is_complete_ = false;
  Eigen::Index keep_ = 0;
  double next_ = 0.0, counted_below_ = 0.0;
  Eigen::VectorXd omega_;
  Eigen::MatrixXd found_;
};

// X176: what the lowest elastic frequency is off by: rounding of the rows, and what is left of the vector
double accuracy_of(const SparseSystem& system, SparseModes& modes, Eigen::Index first) {
  if (first >= modes.omega().size()) return 0.0;
  const Eigen::MatrixXd x = modes.shapes().col(first);
  const Eigen::VectorXd strain = modes.strains(x);
  double rounding = 0.0;
  for (Eigen::Index row = 0; row < system.rows.rows(); ++row) {
    double size = 0.0;
    for (SparseRows::InnerIterator it(system.rows, row); it; ++it)
      size += std::abs(it.value() * x(it.col(), 0));
    rounding += strain[row] * strain[row] * size * size;
  }
  const double square = strain.squaredNorm();
  rounding = 2.0 * kEpsilon * std::sqrt(rounding) / square;
  ShiftedInverse* const inverse = modes.inverse();
  if (inverse == nullptr) return 0.0;
  const double shift = inverse->shift(), theta = 1.0 / (square + shift);
  Eigen::VectorXd left = inverse->apply(system.mass * x).col(0) - theta * x.col(0);
  const double error = std::sqrt(std::max(0.0, left.dot(system.mass * left))) / theta;
  // to the next that is not its equal
  Eigen::Index next = first + 1;
  const Eigen::VectorXd& omega = modes.omega();
  while (next < omega.size() && omega[next] - omega[first] <= kTogether * omega[next]) ++next;
  const double beyond = next < omega.size() ? omega[next] : modes.next_omega();
  const double gap = 1.0 - (square + shift) / (beyond * beyond + shift);
  const double relative = error * (square + shift) / square;
  return std::max(rounding, std::min(relative, gap > 0.0 ? relative * error / gap : relative));
}

Eigen::VectorXd masses_of(const std::vector<PointMass>& points) {
  Eigen::VectorXd mass(static_cast<Eigen::Index>(points.size()));
  for (Eigen::Index i = 0; i < mass.size(); ++i) mass[i] = points[static_cast<std::size_t>(i)].mass;
  return mass;
}

}  // namespace

void find_sparse_modes(const Scene& scene, const LinkFactor& factor, const ModesWanted& wanted,
                       const SetupProgress& progress, Structure& structure, Faults& faults) {
  const Freedoms freedoms(scene);
  const MassProperties& body = structure.mass_properties;
  const SparseSystem system = sparse_system(scene, freedoms, factor, body, faults);
  if (has_error(faults)) return;
  SparseModes modes(scene, system, progress, faults);
  if (!modes.find(wanted)) return;
  structure.omega = modes.omega();
  Eigen::MatrixXd x = modes.shapes();
  const double rounding = direction_rounding(scene);
  const Eigen::Index num_loose = take_out_mechanisms(scene, system, freedoms, body, rounding, structure, x);
  structure.frequency_accuracy = std::max(accuracy_of(system, modes, num_loose), factor.matrices.accuracy);
  const double mass = std::sqrt(body.mass);
  structure.shapes = mass * x.topRows(system.num_displacements);
  const Eigen::VectorXd signs = fix_signs(structure.shapes);
  structure.turns = x.bottomRows(freedoms.num_rotations()) * (mass / system.length * signs).asDiagonal();
  turn_with_bodies(scene, freedoms, structure.shapes, structure.turns);
  if (num_loose < structure.omega.size())
    structure.conditioning = structure.omega[structure.omega.size() - 1] / structure.omega[num_loose];
  structure.kept.is_part = true;
  structure.kept.counted_below = modes.counted_below() / (2.0 * std::numbers::pi);
  structure.particles = {masses_of(scene.points), body.r, {}};
  if (!are_point_masses(scene)) structure.particles = find_particles(scene, freedoms, structure);
  structure.matrix_sums = matrix_sums(scene, freedoms, structure);
}

}  // namespace freeflex
