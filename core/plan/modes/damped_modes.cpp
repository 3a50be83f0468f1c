#include "core/plan/modes/damped_modes.hpp"

#include <algorithm>
#include <cmath>
#include <complex>
#include <optional>

#include "core/plan/modes/coupled_roots.hpp"
#include "core/plan/modes/free_forces.hpp"
#include "core/plan/modes/split_step.hpp"
#include "core/structure/modes/dense/decompositions.hpp"

namespace freeflex {
namespace {

using Complex = std::complex<double>;

// [-] Frequencies and decays are taken as equal below this relative difference, because in a symmetric
// structure such differences are rounding errors.
constexpr double kEqualModes = 1e-12;
// [-] The singular values of the coupling of equal modes belong to combinations of these modes. A combination
// is uncoupled if its singular value is below this fraction of the largest.
constexpr double kUncoupledModes = 1e-12;
// [-] a positive real eigenvalue below this fraction of the other eigenvalue of the mode is a rounding error
// and is not taken as growth
constexpr double kZeroRate = 1e-12;
// [-] smaller damping ratios are rounding errors
constexpr double kUndamped = 1e-15;
// Number of the lowest modes whose growth the set-up checks. Computing their eigenvalues takes some 0.3 s.
constexpr std::size_t kMostGrowing = 128;

DampedMode uncoupled(double omega, double decay) {
  DampedMode mode;
  if (omega == 0.0) return mode;  // the displacement of a mechanism does not decay
  mode.ratio = decay / omega;
  const double square = (omega - decay) * (omega + decay);
  if (square > 0.0) {
    mode.frequency = std::sqrt(square);
    mode.rate = decay;
  } else {
    mode.rate = omega * omega / (decay + std::sqrt(-square));
  }
  return mode;
}

// Holds modes of equal frequency and decay, and the combinations of them on which the coupling forces act.
struct Cluster {
  std::vector<std::int32_t> modes;  // indices in the plan
  Eigen::MatrixXd rotation;         // (modes x coupled combinations)
};

// Holds the coupled equations without the uncoupled combinations of equal modes. The axes of the body come
// after the modes (THEORY 8.42, 8.43).
class Coupled {
 public:
  /// \param most  number of modes to include at most, beginning with the lowest
  Coupled(const StepPlan& plan, const FreeForces& forces, std::size_t most) {
    const std::vector<std::int32_t> coupled_modes(
        forces.modes.begin(),
        forces.modes.begin() + static_cast<std::ptrdiff_t>(std::min(most, forces.modes.size())));
    const Eigen::Index n = static_cast<Eigen::Index>(coupled_modes.size()) + forces.num_body;
    modes_.omega.resize(n), modes_.decay.resize(n);
    for (auto* rows : {&modes_.out, &modes_.by_q, &modes_.by_q_dot}) rows->resize(forces.out.rows(), n);
    for (std::size_t first = 0; first < coupled_modes.size();) {
      const auto at = [&](std::size_t k) { return index(coupled_modes[k]); };
      std::size_t last = first + 1;
      const double omega = plan.omega[at(first)], decay = plan.decay[at(first)];
      while (last < coupled_modes.size() && plan.omega[at(last)] - omega <= kEqualModes * omega &&
             std::abs(plan.decay[at(last)] - decay) <= kEqualModes * decay)
        ++last;
      add({{coupled_modes.begin() + static_cast<std::ptrdiff_t>(first),
            coupled_modes.begin() + static_cast<std::ptrdiff_t>(last)},
           {}},
          forces, omega, decay);
      first = last;
    }
    const Eigen::Index all = size() + forces.num_body;
    modes_.is_gyroscopic = forces.num_body > 0;
    modes_.omega.conservativeResize(all), modes_.decay.conservativeResize(all);
    modes_.omega.tail(forces.num_body).setZero(), modes_.decay.tail(forces.num_body).setZero();
    for (auto [rows, from] : {std::pair{&modes_.out, &forces.out},
                              {&modes_.by_q, &forces.by_q},
                              {&modes_.by_q_dot, &forces.by_q_dot}}) {
      rows->conservativeResize(Eigen::NoChange, all);
      rows->rightCols(forces.num_body) = from->rightCols(forces.num_body);
    }
  }

  const CoupledModes& modes() const { return modes_; }
  /// Returns the number of coupled combinations of modes, without the axes of the body.
  Eigen::Index size() const { return static_cast<Eigen::Index>(mode_.size()); }
  /// Returns the mode of the plan that a coupled combination replaces.
  std::int32_t mode(Eigen::Index l) const { return mode_[index(l)]; }
  /// Expands a vector over the coupled combinations to a vector over the modes of the plan.
  Eigen::VectorXcd on_plan(const Eigen::VectorXcd& coupled, Eigen::Index num_elastic) const {
    Eigen::VectorXcd all = Eigen::VectorXcd::Zero(num_elastic);
    Eigen::Index l = 0;
    for (const Cluster& cluster : clusters_) {
      all(cluster.modes) += cluster.rotation * coupled.segment(l, cluster.rotation.cols());
      l += cluster.rotation.cols();
    }
    return all;
  }

 private:
  void add(Cluster cluster, const FreeForces& forces, double omega, double decay) {
    const Eigen::MatrixXd* const blocks[] = {&forces.out, &forces.by_q, &forces.by_q_dot};
    Eigen::Index rank = 1;
    cluster.rotation = Eigen::MatrixXd::Identity(1, 1);
    if (cluster.modes.size() > 1) {
      const Eigen::Index k = forces.out.rows();
      Eigen::MatrixXd all(3 * k, static_cast<Eigen::Index>(cluster.modes.size()));
      for (int block = 0; block < 3; ++block) {
        const double largest = blocks[block]->cwiseAbs().maxCoeff();
        all.middleRows(block * k, k) =
            (*blocks[block])(Eigen::all, cluster.modes) / (largest > 0.0 ? largest : 1.0);
      }
      const Eigen::JacobiSVD<Eigen::MatrixXd> svd(all, Eigen::ComputeThinV);
      rank = (svd.singularValues().array() > kUncoupledModes * svd.singularValues()[0]).count();
      cluster.rotation = svd.matrixV().leftCols(rank);
    }
    Eigen::MatrixXd* const mine[] = {&modes_.out, &modes_.by_q, &modes_.by_q_dot};
    for (int block = 0; block < 3; ++block)
      mine[block]->middleCols(size(), rank) = (*blocks[block])(Eigen::all, cluster.modes) * cluster.rotation;
    modes_.omega.segment(size(), rank).setConstant(omega);
    modes_.decay.segment(size(), rank).setConstant(decay);
    mode_.insert(mode_.end(), cluster.modes.begin(), cluster.modes.begin() + rank);
    clusters_.push_back(std::move(cluster));
  }

  CoupledModes modes_;
  std::vector<std::int32_t> mode_;
  std::vector<Cluster> clusters_;
};

// Returns the error of the split step S over the change that damping makes in the step, to first order:
//   |z - e^{s h}| / |1 - |e^{s h}||, z = left^T S y / (left^T y), y right and left eigenvector (THEORY 8.45).
double step_error(const SplitStep& step, const Coupled& coupled, const CoupledRoot& root, double period) {
  const Eigen::Index n = step.num_modes();
  Eigen::VectorXcd y(2 * n), left(2 * n);
  y << coupled.on_plan(root.q, n).cwiseProduct(step.size().cast<Complex>()), coupled.on_plan(root.q_dot, n);
  left << coupled.on_plan(root.left_q, n).cwiseQuotient(step.size().cast<Complex>()),
      coupled.on_plan(root.left_q_dot, n);
  Eigen::MatrixXd components(2 * n, 2);
  components << y.real(), y.imag();
  const Eigen::MatrixXd next = step(components);
  const Eigen::VectorXcd after =
      next.col(0).cast<Complex>() + Complex(0.0, 1.0) * next.col(1).cast<Complex>();
  const Complex exact = std::exp(root.s * period),
                by_step = (left.array() * after.array()).sum() / (left.array() * y.array()).sum();
  const double change = std::abs(1.0 - std::abs(exact));
  return change > 0.0 ? std::abs(by_step - exact) / change : 0.0;
}

// Holds an eigenvalue, the error of the split step for this eigenvalue, and whether the eigenvalue is known
// and already assigned.
struct Found {
  Complex s;
  double step_error = 0.0;
  bool is_known = true, is_taken = false;
  bool is_pair() const { return !is_real_root(s); }
};
struct Claim {
  double share = 0.0;
  std::size_t root = 0;
  std::size_t slot = 0;
};

// Assigns eigenvalues to modes   (THEORY 8.44). A mode receives a complex pair or two real eigenvalues. A
// zero-frequency mode receives one real eigenvalue. The body receives one real eigenvalue for each of its
// axes, or a complex pair for two of them.
class Matching {
 public:
  Matching(const CoupledModes& modes, Eigen::Index num_body)
      : modes_(modes), num_modes_(modes.omega.size() - num_body) {
    for (Eigen::Index l = 0; l < num_modes_; ++l) slots_.push_back({is_zero_frequency(modes, l) ? 1 : 2, {}});
    slots_.push_back({static_cast<int>(num_body), {}});
  }

  void add(const CoupledRoot& root, double error) {
    constexpr std::ptrdiff_t kClaims = 8;
    const double off = root.error;
    const bool is_known = off <= std::max(1e-3 * std::abs(root.s.real()), 1e-9 * std::abs(root.s));
    // a damping that may be a rounding error is set to zero
    const bool is_undamped =
        !is_real_root(root.s) && std::abs(root.s.real()) <= std::max(off, kUndamped * std::abs(root.s));
    found_.push_back({is_undamped ? Complex(0.0, root.s.imag()) : root.s, error, is_known, false});
    const Eigen::ArrayXd each =
        modes_.omega.array().square() * root.q.array().abs2() + root.q_dot.array().abs2();
    Eigen::ArrayXd energy(num_modes_ + 1);
    energy << each.head(num_modes_), each.tail(each.size() - num_modes_).sum();
    const double sum = energy.sum();
    std::vector<std::size_t> order(slots_.size());
    for (std::size_t l = 0; l < order.size(); ++l) order[l] = l;
    const auto end = order.begin() + std::min<std::ptrdiff_t>(kClaims, energy.size());
    std::partial_sort(order.begin(), end, order.end(), [&](std::size_t a, std::size_t b) {
      return energy[static_cast<Eigen::Index>(a)] > energy[static_cast<Eigen::Index>(b)];
    });
    for (auto l = order.begin(); l != end; ++l)
      claims_.push_back({energy[static_cast<Eigen::Index>(*l)] / sum, found_.size() - 1, *l});
  }

  // Assigns pairs first, because a mode that already has one real eigenvalue has no room for a pair. Within
  // each kind, the eigenvalues with the largest energy fractions come first. Any eigenvalue that is then left
  // is assigned to the mode of nearest frequency that has room.
  void match() {
    std::stable_sort(claims_.begin(), claims_.end(),
                     [](const Claim& a, const Claim& b) { return a.share > b.share; });
    for (const bool is_pair : {true, false}) {
      for (const Claim& claim : claims_)
        if (found_[claim.root].is_pair() == is_pair && !found_[claim.root].is_taken &&
            has_room(claim.slot, claim.root))
          give(claim.root, claim.slot);
      for (std::size_t root = 0; root < found_.size(); ++root) {
        if (found_[root].is_pair() != is_pair || found_[root].is_taken) continue;
        std::size_t nearest = slots_.size();
        for (std::size_t l = 0; l < slots_.size(); ++l)
          if (has_room(l, root) && (nearest == slots_.size() || distance(root, l) < distance(root, nearest)))
            nearest = l;
        if (nearest < slots_.size()) give(root, nearest);
      }
    }
  }

  DampedMode motion(Eigen::Index l) const {
    const Slot& slot = slots_[index(l)];
    const std::vector<std::size_t>& mine = slot.roots;
    DampedMode mode;
    mode.is_known = slot.room == 0 && std::all_of(mine.begin(), mine.end(),
                                                  [&](std::size_t root) { return found_[root].is_known; });
    if (!mode.is_known || mine.empty()) return mode;
    const Found &one = found_[mine.front()], &other = found_[mine.back()];
    const Found& slow = -one.s.real() <= -other.s.real() ? one : other;
    const double largest = std::max(std::abs(one.s), std::abs(other.s));
    if (one.is_pair()) {
      mode.rate = -one.s.real() + 0.0;
      mode.frequency = one.s.imag();
      mode.ratio = mode.rate / std::abs(one.s);
    } else if (slow.s.real() > kZeroRate * largest) {
      mode.rate = -slow.s.real();
      mode.ratio = -1.0;
    } else if (is_zero_frequency(modes_, l)) {
      return mode;  // a zero-frequency mode may come to rest at any displacement
    } else {
      mode.rate = -slow.s.real() + 0.0;
      if (const double product = one.s.real() * other.s.real(); product > 0.0)
        mode.ratio = -0.5 * (one.s.real() + other.s.real()) / std::sqrt(product);
    }
    mode.step_error = slow.step_error;
    return mode;
  }

  /// Returns the frequency of the complex pair that belongs to the body [rad/s]. Returns 0 if there is no
  /// such pair.
  double nutation() const {
    for (const std::size_t root : slots_.back().roots)
      if (found_[root].is_pair()) return found_[root].s.imag();
    return 0.0;
  }

 private:
  struct Slot {
    int room = 0;  // number of real eigenvalues that can still be assigned
    std::vector<std::size_t> roots;
  };

  bool has_room(std::size_t l, std::size_t root) const {
    if (!found_[root].is_pair()) return slots_[l].room > 0;
    return slots_[l].room >= 2 || (slots_[l].room == 1 && is_single(l) && second_single(l) < slots_.size());
  }
  void give(std::size_t root, std::size_t l) {
    found_[root].is_taken = true;
    slots_[l].roots.push_back(root);
    slots_[l].room -= 1;
    if (found_[root].is_pair()) slots_[slots_[l].room > 0 ? l : second_single(l)].room -= 1;
  }
  // Returns true for the slots of the body and of zero-frequency modes. If such a slot has room for one
  // eigenvalue only, a complex pair also uses the room of a second such slot.
  bool is_single(std::size_t l) const {
    return l + 1 == slots_.size() || is_zero_frequency(modes_, static_cast<Eigen::Index>(l));
  }
  std::size_t second_single(std::size_t l) const {
    for (std::size_t k = slots_.size(); k-- > 0;)
      if (k != l && is_single(k) && slots_[k].room > 0) return k;
    return slots_.size();
  }
  double distance(std::size_t root, std::size_t l) const {
    const double omega = l + 1 == slots_.size() ? 0.0 : modes_.omega[static_cast<Eigen::Index>(l)];
    return std::abs(std::abs(found_[root].s) - omega);
  }

  const CoupledModes& modes_;
  Eigen::Index num_modes_;
  std::vector<Found> found_;
  std::vector<Claim> claims_;
  std::vector<Slot> slots_;  // the slots of the modes, then the slot of the body
};

// Returns the largest growth rate [1/s], or 0 if no growth rate exceeds its rounding error.
double growth_under(const StepPlan& plan, const FreeForces& forces) {
  constexpr double kRounding = 1e-6, kRoundedStiffness = 1e-12;
  const Coupled coupled(plan, forces, kMostGrowing);
  const CoupledModes& modes = coupled.modes();
  if (modes.omega.size() == 0) return 0.0;
  // [1/s^2] stiffness over mass that rounding errors may give to a mechanism
  const double least = kRoundedStiffness *
                       (modes.out.colwise().norm().array() * modes.by_q.colwise().norm().array()).maxCoeff();
  double most = 0.0;
  find_coupled_roots(modes, [&](const CoupledRoot& root) {
    const double rate = root.s.real(), size = std::abs(root.s);
    if (rate > std::max(10.0 * root.error, kRounding * size) && rate * size > least)
      most = std::max(most, rate);
  });
  return most;
}

}  // namespace

bool couples_modes(const StepPlan& plan) {
  return plan.num_elastic > 0 && (plan.modal_coupling.num_damping > 0 || !plan.feedbacks.empty() ||
                                  !follower_loads(plan, true).empty() || has_gyroscopic_forces(plan));
}

FreeMotion free_motion(const StepPlan& plan) {
  FreeMotion motion;
  std::vector<DampedMode>& all = motion.modes;
  for (std::size_t l = 0; l < index(plan.num_elastic); ++l)
    all.push_back(uncoupled(plan.omega[l], plan.decay[l]));
  if (!couples_modes(plan)) return motion;
  motion.unknown = unknown_coupling(plan);
  if (!motion.unknown.empty()) {
    for (DampedMode& mode : all) mode = {.is_known = false};
    return motion;
  }
  const FreeForces forces = free_forces(plan);
  const Coupled coupled(plan, forces, forces.modes.size());
  if (coupled.size() == 0) return motion;
  // the error of splitting is known only if no follower couples the modes
  std::optional<SplitStep> step;
  if (plan.modal_coupling.path == PlanModalCoupling::Path::kSplit && follower_loads(plan, true).empty())
    step.emplace(plan);
  Matching matching(coupled.modes(), forces.num_body);
  const bool is_found = find_coupled_roots(coupled.modes(), [&](const CoupledRoot& root) {
    matching.add(root, step ? step_error(*step, coupled, root, plan.period) : 0.0);
  });
  matching.match();
  if (!is_found) motion.unknown = "there are too many modes and too many forces that couple them";
  motion.nutation = is_found ? matching.nutation() : 0.0;
  for (Eigen::Index l = 0; l < coupled.size(); ++l) {
    DampedMode& mode = all[index(coupled.mode(l))];
    mode = {};
    if (is_found)
      mode = matching.motion(l);
    else
      mode.is_known = false;
    if (is_found && !mode.is_known) motion.unknown = "the rounding error of the stiffest mode is too large";
  }
  return motion;
}

double growth_by_followers(const StepPlan& plan) {
  if (plan.num_elastic == 0 || follower_loads(plan, true).empty() || !unknown_coupling(plan).empty())
    return 0.0;
  const double with = growth_under(plan, free_forces(plan, true));
  if (with == 0.0) return 0.0;
  const double without = growth_under(plan, free_forces(plan, false));
  return with > 1.001 * without ? with : 0.0;
}

}  // namespace freeflex
