#include "core/plan/damped_modes.hpp"

#include <algorithm>
#include <cmath>
#include <complex>
#include <optional>

#include "core/plan/coupled_roots.hpp"
#include "core/plan/mixing.hpp"
#include "core/plan/split_step.hpp"
#include "core/structure/decompositions.hpp"

namespace freeflex {
namespace {

using Complex = std::complex<double>;

// [-] frequencies and decays that differ by less are equal: roundings of a symmetric structure
constexpr double kEqualModes = 1e-12;
// [-] singular values of what couples equal modes, over the largest: below, a mode among them is free
constexpr double kFree = 1e-12;

DampedMode uncoupled(double omega, double decay) {
  DampedMode mode;
  if (omega == 0.0) return mode;  // its displacement stays
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

// equal modes that coupling acts on, and those combinations of them that it acts on
struct Cluster {
  std::vector<std::int32_t> modes;  // of the plan
  Eigen::MatrixXd turn;             // (modes x coupled combinations)
};

// the coupled equations without the combinations of equal modes that nothing couples
class Coupled {
 public:
  explicit Coupled(const Plan& plan) {
    const MixingForces forces = mixing_forces(plan);
    const std::vector<std::int32_t> mixed = mixed_modes(plan);
    const auto n = static_cast<Eigen::Index>(mixed.size());
    modes_.omega.resize(n), modes_.decay.resize(n);
    for (auto* rows : {&modes_.out, &modes_.by_q, &modes_.by_q_dot}) rows->resize(forces.out.rows(), n);
    for (std::size_t first = 0; first < mixed.size();) {
      const auto at = [&](std::size_t k) { return static_cast<std::size_t>(mixed[k]); };
      std::size_t last = first + 1;
      const double omega = plan.omega[at(first)], decay = plan.decay[at(first)];
      while (last < mixed.size() && plan.omega[at(last)] - omega <= kEqualModes * omega &&
             std::abs(plan.decay[at(last)] - decay) <= kEqualModes * decay)
        ++last;
      add({{mixed.begin() + static_cast<std::ptrdiff_t>(first),
            mixed.begin() + static_cast<std::ptrdiff_t>(last)},
           {}},
          forces, omega, decay);
      first = last;
    }
    modes_.omega.conservativeResize(size()), modes_.decay.conservativeResize(size());
    for (auto* rows : {&modes_.out, &modes_.by_q, &modes_.by_q_dot})
      rows->conservativeResize(Eigen::NoChange, size());
  }

  const CoupledModes& modes() const { return modes_; }
  Eigen::Index size() const { return static_cast<Eigen::Index>(mode_.size()); }
  /// Mode of the plan in whose place a coupled combination stands.
  std::int32_t mode(Eigen::Index l) const { return mode_[static_cast<std::size_t>(l)]; }
  /// A vector on the modes of the plan.
  Eigen::VectorXcd on_plan(const Eigen::VectorXcd& coupled, Eigen::Index num_elastic) const {
    Eigen::VectorXcd all = Eigen::VectorXcd::Zero(num_elastic);
    Eigen::Index l = 0;
    for (const Cluster& cluster : clusters_) {
      all(cluster.modes) += cluster.turn * coupled.segment(l, cluster.turn.cols());
      l += cluster.turn.cols();
    }
    return all;
  }

 private:
  void add(Cluster cluster, const MixingForces& forces, double omega, double decay) {
    const Eigen::MatrixXd* const blocks[] = {&forces.out, &forces.by_q, &forces.by_q_dot};
    Eigen::Index rank = 1;
    cluster.turn = Eigen::MatrixXd::Identity(1, 1);
    if (cluster.modes.size() > 1) {
      const Eigen::Index k = forces.out.rows();
      Eigen::MatrixXd all(3 * k, static_cast<Eigen::Index>(cluster.modes.size()));
      for (int block = 0; block < 3; ++block) {
        const double largest = blocks[block]->cwiseAbs().maxCoeff();
        all.middleRows(block * k, k) =
            (*blocks[block])(Eigen::all, cluster.modes) / (largest > 0.0 ? largest : 1.0);
      }
      const Eigen::JacobiSVD<Eigen::MatrixXd> svd(all, Eigen::ComputeThinV);
      rank = (svd.singularValues().array() > kFree * svd.singularValues()[0]).count();
      cluster.turn = svd.matrixV().leftCols(rank);
    }
    Eigen::MatrixXd* const mine[] = {&modes_.out, &modes_.by_q, &modes_.by_q_dot};
    for (int block = 0; block < 3; ++block)
      mine[block]->middleCols(size(), rank) = (*blocks[block])(Eigen::all, cluster.modes) * cluster.turn;
    modes_.omega.segment(size(), rank).setConstant(omega);
    modes_.decay.segment(size(), rank).setConstant(decay);
    mode_.insert(mode_.end(), cluster.modes.begin(), cluster.modes.begin() + rank);
    clusters_.push_back(std::move(cluster));
  }

  CoupledModes modes_;
  std::vector<std::int32_t> mode_;
  std::vector<Cluster> clusters_;
};

// what the split step makes of an eigenvector in a tick, to first order of its error   (X77)
double step_error(const SplitStep& step, const Coupled& coupled, const CoupledRoot& root, double period) {
  const Eigen::Index n = step.num_modes();
  Eigen::VectorXcd y(2 * n), left(2 * n);
  y << coupled.on_plan(root.q, n).cwiseProduct(step.size().cast<Complex>()), coupled.on_plan(root.q_dot, n);
  left << coupled.on_plan(root.left_q, n).cwiseQuotient(step.size().cast<Complex>()),
      coupled.on_plan(root.left_q_dot, n);
  Eigen::MatrixXd parts(2 * n, 2);
  parts << y.real(), y.imag();
  const Eigen::MatrixXd next = step(parts);
  const Eigen::VectorXcd after =
      next.col(0).cast<Complex>() + Complex(0.0, 1.0) * next.col(1).cast<Complex>();
  const Complex exact = std::exp(root.s * period),
                by_step = (left.array() * after.array()).sum() / (left.array() * y.array()).sum();
  const double change = std::abs(1.0 - std::abs(exact));
  return change > 0.0 ? std::abs(by_step - exact) / change : 0.0;
}

// an eigenvalue, and the modes that hold most of the energy of its eigenvector
struct Found {
  Complex s;
  double step_error = 0.0;
  bool is_known = true, is_taken = false;
};
struct Claim {
  double share = 0.0;
  std::size_t root = 0;
  Eigen::Index mode = 0;  // of the coupled ones
};

class Matching {
 public:
  explicit Matching(const CoupledModes& modes)
      : modes_(modes), roots_of_(static_cast<std::size_t>(modes.omega.size())) {}

  void add(const CoupledRoot& root, double error) {
    constexpr Eigen::Index kClaims = 8;
    const double off = root.error;
    const bool is_known = off <= std::max(1e-3 * std::abs(root.s.real()), 1e-9 * std::abs(root.s));
    found_.push_back({root.s, error, is_known, false});
    const Eigen::ArrayXd energy =
        modes_.omega.array().square() * root.q.array().abs2() + root.q_dot.array().abs2();
    const double sum = energy.sum();
    std::vector<Eigen::Index> order(static_cast<std::size_t>(energy.size()));
    for (std::size_t l = 0; l < order.size(); ++l) order[l] = static_cast<Eigen::Index>(l);
    const auto end = order.begin() + std::min<std::ptrdiff_t>(kClaims, energy.size());
    std::partial_sort(order.begin(), end, order.end(),
                      [&](Eigen::Index a, Eigen::Index b) { return energy[a] > energy[b]; });
    for (auto l = order.begin(); l != end; ++l) claims_.push_back({energy[*l] / sum, found_.size() - 1, *l});
  }

  // every eigenvalue to a mode that has room, the largest shares first; what is left by frequency
  void match() {
    std::stable_sort(claims_.begin(), claims_.end(),
                     [](const Claim& a, const Claim& b) { return a.share > b.share; });
    for (const Claim& claim : claims_)
      if (!found_[claim.root].is_taken && has_room(claim.mode, claim.root)) give(claim.root, claim.mode);
    for (std::size_t root = 0; root < found_.size(); ++root) {
      Eigen::Index nearest = -1;
      for (Eigen::Index l = 0; l < modes_.omega.size() && !found_[root].is_taken; ++l)
        if (has_room(l, root) && (nearest < 0 || distance(root, l) < distance(root, nearest))) nearest = l;
      if (nearest >= 0) give(root, nearest);
    }
  }

  DampedMode motion(Eigen::Index l) const {
    const std::vector<std::size_t>& mine = roots_of_[static_cast<std::size_t>(l)];
    DampedMode mode;
    if (is_loose(modes_, l)) return mode;
    const bool is_whole = !mine.empty() && (mine.size() == 2 || !is_real_root(found_[mine[0]].s));
    mode.is_known = is_whole && std::all_of(mine.begin(), mine.end(),
                                            [&](std::size_t root) { return found_[root].is_known; });
    if (!mode.is_known) return mode;
    const Found &one = found_[mine.front()], &other = found_[mine.back()];
    const Found& slow = -one.s.real() <= -other.s.real() ? one : other;
    mode.rate = -slow.s.real();
    mode.step_error = slow.step_error;
    if (mine.size() == 1) {
      mode.frequency = one.s.imag();
      mode.ratio = mode.rate / std::abs(one.s);
    } else if (const double product = std::abs(one.s.real() * other.s.real()); product > 0.0) {
      mode.ratio = -0.5 * (one.s.real() + other.s.real()) / std::sqrt(product);
    }
    return mode;
  }

 private:
  // a pair takes a whole mode, a real eigenvalue one half of it
  bool has_room(Eigen::Index l, std::size_t root) const {
    const std::vector<std::size_t>& mine = roots_of_[static_cast<std::size_t>(l)];
    if (mine.empty()) return is_real_root(found_[root].s) || !is_loose(modes_, l);
    return mine.size() == 1 && is_real_root(found_[mine[0]].s) && is_real_root(found_[root].s) &&
           !is_loose(modes_, l);
  }
  void give(std::size_t root, Eigen::Index l) {
    found_[root].is_taken = true;
    roots_of_[static_cast<std::size_t>(l)].push_back(root);
  }
  double distance(std::size_t root, Eigen::Index l) const {
    return std::abs(std::abs(found_[root].s) - modes_.omega[l]);
  }

  const CoupledModes& modes_;
  std::vector<Found> found_;
  std::vector<Claim> claims_;
  std::vector<std::vector<std::size_t>> roots_of_;
};

}  // namespace

bool couples_modes(const Plan& plan) {
  return plan.num_elastic > 0 && (plan.mixing.num_damping > 0 || !plan.feedbacks.empty());
}

std::vector<DampedMode> damped_modes(const Plan& plan) {
  std::vector<DampedMode> all;
  for (std::size_t l = 0; l < static_cast<std::size_t>(plan.num_elastic); ++l)
    all.push_back(uncoupled(plan.omega[l], plan.decay[l]));
  if (!couples_modes(plan)) return all;
  const Coupled coupled(plan);
  if (coupled.size() == 0) return all;
  std::optional<SplitStep> step;
  if (plan.mixing.path == PlanMixing::Path::kSplit) step.emplace(plan);
  Matching matching(coupled.modes());
  const bool is_found = find_coupled_roots(coupled.modes(), [&](const CoupledRoot& root) {
    matching.add(root, step ? step_error(*step, coupled, root, plan.period) : 0.0);
  });
  matching.match();
  for (Eigen::Index l = 0; l < coupled.size(); ++l) {
    DampedMode& mode = all[static_cast<std::size_t>(coupled.mode(l))];
    mode = {};
    if (is_found)
      mode = matching.motion(l);
    else
      mode.is_known = false;
  }
  return all;
}

}  // namespace freeflex
