#include "core/plan/small_modes.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "core/plan/reach.hpp"
#include "core/scene/faults.hpp"
#include "core/step/step.hpp"
#include "core/structure/reduce.hpp"

namespace freeflex {
namespace {

// ticks that are followed at most: a second or so for the largest scenes
constexpr std::int64_t kMostTicks = 200'000;

// [-] rounding of sums over thousands of modes, and of what they are compared with
constexpr double kSummed = 1.0 + 1e-9;

// looks at displacements during a run: each costs as much as hundreds of ticks
constexpr std::int64_t kLooks = 500;

// products of points, loads and modes above which a mode's largest displacement stands for that of each point
constexpr double kManyProducts = 2e9;

// |b_il| of the points that are read or loaded (points x modes)
Eigen::MatrixXd asked_sizes(const Structure& structure, const Plan& plan) {
  std::vector<int> asked;
  for (std::size_t i = 0; i < plan.points.size(); ++i)
    if (plan.points[i].row >= 0) asked.push_back(static_cast<int>(i));
  Eigen::MatrixXd sizes(static_cast<Eigen::Index>(asked.size()), structure.omega.size());
  for (std::size_t k = 0; k < asked.size(); ++k)
    sizes.row(static_cast<Eigen::Index>(k)) =
        structure.shapes.middleRows<3>(3 * Eigen::Index{asked[k]}).colwise().norm();
  return sizes;
}

// How far each mode swings under the built-in loads and from the initial state. A_l = hypot(q_l, q_l' /
// omega_l) holds for the free ringing after the last look as well.
struct Swings {
  Eigen::VectorXd whole;    // [m] A_l, of q_l   (X123)
  Eigen::VectorXd dynamic;  // [m] D_l, of q_l less its static value
  Eigen::VectorXd rate;     // [m/s] G_l, of q_l'
  double largest = 0.0;     // [m] displacement of an asked point seen
  double horizon = 0.0;     // [s]
  bool is_finite = true;
};

void take_swings(const Plan& plan, const State& state, Swings& swings) {
  for (Eigen::Index l = 0; l < swings.whole.size(); ++l) {
    const double omega = plan.omega[index(l)], q = state.q[index(l)], rate = state.q_dot[index(l)];
    if (omega == 0.0) continue;
    const double resting = state.Q[index(l)] / (plan.mass * omega * omega);
    swings.whole[l] = std::max(swings.whole[l], std::hypot(q, rate / omega));
    swings.dynamic[l] = std::max(swings.dynamic[l], std::hypot(q - resting, rate / omega));
    swings.rate[l] = std::max(swings.rate[l], std::hypot(rate, omega * (q - resting)));
  }
}

double largest_displacement(const Structure& structure, const Plan& plan, const State& state) {
  const Eigen::Map<const Eigen::VectorXd> q(state.q.data(), structure.omega.size());
  double largest = 0.0;
  for (std::size_t i = 0; i < plan.points.size(); ++i)
    if (plan.points[i].row >= 0)
      largest =
          std::max(largest, (structure.shapes.middleRows<3>(3 * static_cast<Eigen::Index>(i)) * q).norm());
  return largest;
}

bool has_motion(const Plan& plan) {
  const auto is_moved = [](const Array& values) {
    return std::any_of(values.begin(), values.end(), [](double v) { return v != 0.0; });
  };
  return !plan.histories.empty() || plan.has_spin_load || is_coupled(plan) || plan.attractor_mu > 0.0 ||
         is_moved(plan.initial.q) || is_moved(plan.initial.q_dot);
}

Swings follow_built_in(const Structure& structure, const Plan& plan, double horizon) {
  Swings swings;
  swings.whole = swings.dynamic = swings.rate = Eigen::VectorXd::Zero(structure.omega.size());
  swings.horizon = horizon;
  if (!has_motion(plan)) return swings;
  const auto wanted = static_cast<std::int64_t>(std::min(std::ceil(horizon / plan.period), 9e15));
  const std::int64_t ticks = std::min(wanted, kMostTicks);
  if (ticks < wanted) swings.horizon = static_cast<double>(ticks) * plan.period;
  State state = make_state(plan);
  Workspace workspace = make_workspace(plan);
  StepReport report;
  take_swings(plan, state, swings);
  swings.largest = largest_displacement(structure, plan, state);
  const std::int64_t look_every = std::max<std::int64_t>(1, ticks / kLooks);
  for (std::int64_t tick = 0; tick < ticks && swings.is_finite; ++tick) {
    step(plan, state, {}, workspace, report);
    swings.is_finite = report.status == StepStatus::kOk;
    take_swings(plan, state, swings);
    if (tick % look_every == 0)
      swings.largest = std::max(swings.largest, largest_displacement(structure, plan, state));
  }
  return swings;
}

// Pushes of one newton (torques of one newton metre) that commands may make, by rows over modes.
struct Pushes {
  Eigen::MatrixXd rows;       // (pushes x modes) s_l = |Q_l| / (M omega_l^2) [m]; 0 for mechanisms
  Eigen::VectorXd reference;  // [m] largest static displacement of an asked point under each
  Eigen::MatrixXd any;        // (points and groups x modes) the same rows for a force in any direction
};

Pushes find_pushes(const Scene& scene, const Structure& structure, const MotionScope& scope,
                   const Plan& plan) {
  Eigen::VectorXd flexibility(structure.omega.size());
  for (Eigen::Index l = 0; l < flexibility.size(); ++l) {
    const double omega = structure.omega[l];
    flexibility[l] = omega > 0.0 ? 1.0 / (plan.mass * omega * omega) : 0.0;
  }
  const Eigen::MatrixXd signed_rows =
      on_modes(command_directions(scene, structure, scope), structure.shapes) * flexibility.asDiagonal();
  Pushes pushes;
  pushes.rows = signed_rows.cwiseAbs();
  pushes.reference = Eigen::VectorXd::Zero(signed_rows.rows());
  for (std::size_t i = 0; i < plan.points.size(); ++i) {
    if (plan.points[i].row < 0) continue;
    const Eigen::MatrixXd V =
        structure.shapes.middleRows<3>(3 * static_cast<Eigen::Index>(i)) * signed_rows.transpose();
    pushes.reference = pushes.reference.cwiseMax(V.colwise().norm().transpose());
  }
  // forces on one point or group stand in a row, torques after them
  const Eigen::Index num_axes = scope.binds_plane ? 2 : 3, num_torques = scope.binds_plane ? 1 : 3;
  const auto num_points = static_cast<Eigen::Index>(scene.pushable.size()),
             num_groups = static_cast<Eigen::Index>(scene.groups.size());
  pushes.any.resize(num_points + num_groups, signed_rows.cols());
  for (Eigen::Index k = 0; k < num_points + num_groups; ++k) {
    const Eigen::Index first =
        k < num_points ? k * num_axes : num_points * num_axes + (k - num_points) * (num_axes + num_torques);
    pushes.any.row(k) = pushes.rows.middleRows(first, num_axes).colwise().norm();
  }
  return pushes;
}

// sum over the modes left out, largest over points, for each push
Eigen::VectorXd summed(const Eigen::MatrixXd& sizes, const Eigen::MatrixXd& rows,
                       const std::vector<int>& left_out) {
  const Eigen::MatrixXd b = sizes(Eigen::all, left_out), g = rows(Eigen::all, left_out);
  if (b.rows() == 0 || g.rows() == 0 || left_out.empty()) return Eigen::VectorXd::Zero(rows.rows());
  if (static_cast<double>(b.rows()) * static_cast<double>(g.rows()) * static_cast<double>(sizes.cols()) >
      kManyProducts)
    return g * b.colwise().maxCoeff().transpose();
  return (b * g.transpose()).colwise().maxCoeff().transpose();
}

double largest_of(const Eigen::VectorXd& values) { return values.size() > 0 ? values.maxCoeff() : 0.0; }

class Choice {
 public:
  Choice(const Scene& scene, const Structure& structure, const MotionScope& scope, const Plan& plan,
         double tolerance)
      : sizes_(asked_sizes(structure, plan)),
        swings_(follow_built_in(structure, plan, scene.leave_out.horizon)),
        pushes_(find_pushes(scene, structure, scope, plan)),
        tolerance_(tolerance) {
    order_modes(structure);
  }

  const Swings& swings() const { return swings_; }
  bool has_asked() const { return sizes_.rows() > 0; }

  // the most modes, smallest first, that may go
  std::vector<int> left_out() const {
    std::size_t fits = 0, fails = order_.size() + 1;
    while (fails - fits > 1) {
      const std::size_t middle = (fits + fails) / 2;
      (are_small(first(middle)) ? fits : fails) = middle;
    }
    return first(fits);
  }

  void account(const Structure& structure, const std::vector<int>& left_out, PlanPart& part) const {
    part.error = kSummed * built_in_error(left_out);
    if (swings_.largest > 0.0) part.share = part.error / swings_.largest;
    part.error_per_force = kSummed * largest_of(summed(sizes_, pushes_.any, left_out));
    part.share_per_force = push_share(left_out);
    for (const LinkForceRows& force : structure.link_forces)
      for (Eigen::Index k = 0; k < force.rows.rows(); ++k) {
        double error = 0.0;
        Eigen::VectorXd by_push = Eigen::VectorXd::Zero(pushes_.any.rows());
        for (const int l : left_out) {
          const double by_rate = force.rate_rows.rows() > 0 ? std::abs(force.rate_rows(k, l)) : 0.0;
          error += std::abs(force.rows(k, l)) * swings_.dynamic[l] + by_rate * swings_.rate[l];
          by_push += (std::abs(force.rows(k, l)) + by_rate * structure.omega[l]) * pushes_.any.col(l);
        }
        part.link_error = std::max(part.link_error, kSummed * error);
        part.link_error_per_force = std::max(part.link_error_per_force, kSummed * largest_of(by_push));
      }
  }

 private:
  void order_modes(const Structure& structure) {
    const Eigen::RowVectorXd most = sizes_.rows() > 0
                                        ? Eigen::RowVectorXd(sizes_.colwise().maxCoeff())
                                        : Eigen::RowVectorXd(Eigen::RowVectorXd::Zero(sizes_.cols()));
    Eigen::VectorXd score = Eigen::VectorXd::Zero(sizes_.cols());
    for (Eigen::Index l = 0; l < score.size(); ++l) {
      if (swings_.largest > 0.0) score[l] = most[l] * swings_.whole[l] / swings_.largest;
      for (Eigen::Index row = 0; row < pushes_.rows.rows(); ++row)
        if (pushes_.reference[row] > 0.0)
          score[l] = std::max(score[l], most[l] * pushes_.rows(row, l) / pushes_.reference[row]);
      if (structure.omega[l] > 0.0) order_.push_back(static_cast<int>(l));
    }
    std::sort(order_.begin(), order_.end(), [&](int a, int b) { return score[a] < score[b]; });
  }
  std::vector<int> first(std::size_t count) const {
    std::vector<int> modes(order_.begin(), order_.begin() + static_cast<std::ptrdiff_t>(count));
    std::sort(modes.begin(), modes.end());
    return modes;
  }
  double built_in_error(const std::vector<int>& left_out) const {
    if (left_out.empty() || !has_asked()) return 0.0;
    return (sizes_(Eigen::all, left_out) * swings_.whole(left_out)).maxCoeff();
  }
  double push_share(const std::vector<int>& left_out) const {
    const Eigen::VectorXd errors = summed(sizes_, pushes_.rows, left_out);
    double share = 0.0;
    for (Eigen::Index row = 0; row < errors.size(); ++row)
      if (pushes_.reference[row] > 0.0) share = std::max(share, errors[row] / pushes_.reference[row]);
    return share;
  }
  bool are_small(const std::vector<int>& modes) const {
    return built_in_error(modes) <= tolerance_ * swings_.largest && push_share(modes) <= tolerance_;
  }

  Eigen::MatrixXd sizes_;
  Swings swings_;
  Pushes pushes_;
  double tolerance_;
  std::vector<int> order_;  // modes with a frequency, smallest share first
};

// why modes of this scene are not judged; empty: they are
std::string find_obstacle(const Scene& scene, const MotionScope& scope, const Plan& plan) {
  if (plan.mixing.path != PlanMixing::Path::kNone || (is_coupled(plan) && plan.mixing.num_damping > 0) ||
      !plan.feedbacks.empty())
    return "dashpots or feedback join the modes";
  const auto has = [&](Axes axes) {
    return std::any_of(scene.loads.begin(), scene.loads.end(),
                       [&](const Load& load) { return load.axes == axes; });
  };
  if (has(Axes::kLocal)) return "follower forces join the modes";
  const bool is_commanded = !scene.pushable.empty() || !scene.groups.empty();
  if (is_commanded && scope.turns &&
      (has(Axes::kWorld) || plan.has_spin_load || is_coupled(plan) || plan.attractor_mu > 0.0))
    return "commands may turn the body, and with it the loads that are fixed in the world or go by its spin: "
           "their share is not known beforehand";
  return {};
}

}  // namespace

SmallModes find_small_modes(const Scene& scene, const Structure& structure, const MotionScope& scope,
                            const Plan& plan, double tolerance) {
  SmallModes small;
  small.part.part = Part::kSmallModes;
  small.kept.resize(index(structure.omega.size()));
  std::iota(small.kept.begin(), small.kept.end(), 0);
  small.horizon = scene.leave_out.horizon;
  if (tolerance == 0.0) {
    small.part.why = "no tolerance is given";
    return small;
  }
  if (small.part.why = find_obstacle(scene, scope, plan); !small.part.why.empty()) return small;
  const Choice choice(scene, structure, scope, plan, tolerance);
  small.horizon = choice.swings().horizon;
  if (!choice.has_asked()) {
    small.part.why = "no point is read or pushed: there is nothing to judge by";
    return small;
  }
  if (!choice.swings().is_finite) {
    small.part.why = "the motion is not finite";
    return small;
  }
  const std::vector<int> left_out = choice.left_out();
  if (left_out.empty()) {
    small.part.why = join_text("every mode has more than ", tolerance, " of what is asked for");
    return small;
  }
  std::vector<int> kept;
  std::set_difference(small.kept.begin(), small.kept.end(), left_out.begin(), left_out.end(),
                      std::back_inserter(kept));
  small.kept = std::move(kept);
  small.part.is_left_out = true;
  small.part.count = static_cast<std::int32_t>(left_out.size());
  small.part.why = join_text("together at most ", tolerance,
                             " of the displacements of the points that are read or pushed");
  choice.account(structure, left_out, small.part);
  small.size = choice.swings().whole(left_out).norm();
  return small;
}

}  // namespace freeflex
