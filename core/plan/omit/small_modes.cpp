#include "core/plan/omit/small_modes.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "core/faults.hpp"
#include "core/motion.hpp"
#include "core/plan/omit/excitability.hpp"
#include "core/structure/reduce.hpp"

namespace freeflex {
namespace {

// The largest number of ticks in the run under built-in loads. A run of this length takes a second or so for
// the largest scenes.
constexpr std::int64_t kMostTicks = 200'000;

// [-] factor that allows for rounding errors of sums over thousands of modes and of the values with which the
// sums are compared
constexpr double kSummed = 1.0 + 1e-9;

// The number of samples of the displacements in a run. Each sample costs the same time as hundreds of ticks.
constexpr std::int64_t kNumSamples = 500;

// If points x loads x modes is above this number, the largest displacement of a mode over all points is used
// for every point, which takes less time.
constexpr double kManyProducts = 2e9;

// Returns |b_il| of the points that are read out or loaded (points x modes).
Eigen::MatrixXd asked_shape_sizes(const Structure& structure, const Plan& plan) {
  std::vector<int> asked;
  for (std::size_t i = 0; i < plan.points.size(); ++i)
    if (plan.points[i].row >= 0) asked.push_back(static_cast<int>(i));
  Eigen::MatrixXd sizes(static_cast<Eigen::Index>(asked.size()), structure.omega.size());
  for (std::size_t k = 0; k < asked.size(); ++k)
    sizes.row(static_cast<Eigen::Index>(k)) =
        structure.shapes.middleRows<3>(3 * Eigen::Index{asked[k]}).colwise().norm();
  return sizes;
}

// Holds the peak amplitudes of the modes under the built-in loads and from the initial state:
//   A_l = max_t (q_l^2 + q_l'^2 / omega_l^2)^(1/2), which also bounds the free vibration afterwards
//     (THEORY 14.6),
//   D_l = max_t ((q_l - s_l)^2 + q_l'^2 / omega_l^2)^(1/2), s_l = Q_l / (M omega_l^2), and
//   G_l = max_t (q_l'^2 + omega_l^2 (q_l - s_l)^2)^(1/2)   (THEORY 14.13).
struct PeakAmplitudes {
  Eigen::VectorXd amplitude;  // [m] A_l
  Eigen::VectorXd dynamic;    // [m] D_l
  Eigen::VectorXd rate;       // [m/s] G_l
  double largest = 0.0;       // [m] largest sampled displacement of a point that is read out or loaded
  double horizon = 0.0;       // [s] simulated time
  bool is_finite = true;
};

void update_peaks(const Plan& plan, const State& state, PeakAmplitudes& peaks) {
  for (Eigen::Index l = 0; l < peaks.amplitude.size(); ++l) {
    const double omega = plan.omega[index(l)], q = state.q[index(l)], rate = state.q_dot[index(l)];
    if (omega == 0.0) continue;
    const double quasi_static_q = state.Q[index(l)] / (plan.mass * omega * omega);
    peaks.amplitude[l] = std::max(peaks.amplitude[l], std::hypot(q, rate / omega));
    peaks.dynamic[l] = std::max(peaks.dynamic[l], std::hypot(q - quasi_static_q, rate / omega));
    peaks.rate[l] = std::max(peaks.rate[l], std::hypot(rate, omega * (q - quasi_static_q)));
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

PeakAmplitudes follow_built_in(const Structure& structure, const Plan& plan, double horizon) {
  PeakAmplitudes peaks;
  peaks.amplitude = peaks.dynamic = peaks.rate = Eigen::VectorXd::Zero(structure.omega.size());
  peaks.horizon = horizon;
  if (!has_motion(plan)) return peaks;
  const auto wanted = static_cast<std::int64_t>(std::min(std::ceil(horizon / plan.period), 9e15));
  const std::int64_t ticks = std::min(wanted, kMostTicks);
  if (ticks < wanted) peaks.horizon = static_cast<double>(ticks) * plan.period;
  Motion motion(plan, kMotionAlone);
  update_peaks(plan, motion.state(), peaks);
  peaks.largest = largest_displacement(structure, plan, motion.state());
  const std::int64_t sample_every = std::max<std::int64_t>(1, ticks / kNumSamples);
  for (std::int64_t tick = 0; tick < ticks && peaks.is_finite; ++tick) {
    peaks.is_finite = motion.advance().status == StepStatus::kOk;
    update_peaks(plan, motion.state(), peaks);
    if (tick % sample_every == 0)
      peaks.largest = std::max(peaks.largest, largest_displacement(structure, plan, motion.state()));
  }
  return peaks;
}

// Holds quasi-static responses to commands of 1 N (torques of 1 N m), as rows over modes (THEORY 14.8).
struct UnitCommands {
  Eigen::MatrixXd rows;  // (commands x modes) s_l = |Q_l| / (M omega_l^2) [m]; 0 for mechanisms
  // [m] largest quasi-static displacement of a point that is read out or loaded, for each command
  Eigen::VectorXd reference;
  Eigen::MatrixXd any;  // (points and groups x modes) s_l for a force in any direction
};

UnitCommands find_unit_commands(const Scene& scene, const Structure& structure, const MotionScope& scope,
                                const Plan& plan) {
  Eigen::VectorXd flexibility(structure.omega.size());
  for (Eigen::Index l = 0; l < flexibility.size(); ++l) {
    const double omega = structure.omega[l];
    flexibility[l] = omega > 0.0 ? 1.0 / (plan.mass * omega * omega) : 0.0;
  }
  const Eigen::MatrixXd signed_rows =
      on_modes(command_directions(scene, structure, scope), structure.shapes) * flexibility.asDiagonal();
  UnitCommands commands;
  commands.rows = signed_rows.cwiseAbs();
  commands.reference = Eigen::VectorXd::Zero(signed_rows.rows());
  for (std::size_t i = 0; i < plan.points.size(); ++i) {
    if (plan.points[i].row < 0) continue;
    const Eigen::MatrixXd V =
        structure.shapes.middleRows<3>(3 * static_cast<Eigen::Index>(i)) * signed_rows.transpose();
    commands.reference = commands.reference.cwiseMax(V.colwise().norm().transpose());
  }
  // First come the rows of the forces on one point or group, then the rows of the torques on the same point
  // or group.
  const Eigen::Index num_axes = scope.binds_plane ? 2 : 3, num_torques = scope.binds_plane ? 1 : 3;
  const auto num_points = static_cast<Eigen::Index>(scene.pushable.size()),
             num_groups = static_cast<Eigen::Index>(scene.groups.size());
  commands.any.resize(num_points + num_groups, signed_rows.cols());
  for (Eigen::Index k = 0; k < num_points + num_groups; ++k) {
    const Eigen::Index first =
        k < num_points ? k * num_axes : num_points * num_axes + (k - num_points) * (num_axes + num_torques);
    commands.any.row(k) = commands.rows.middleRows(first, num_axes).colwise().norm();
  }
  return commands;
}

// Returns max_i sum_l |b_il| s_l over the omitted modes, for each command   (THEORY 14.9).
Eigen::VectorXd errors_by_commands(const Eigen::MatrixXd& sizes, const Eigen::MatrixXd& rows,
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
      : sizes_(asked_shape_sizes(structure, plan)),
        peaks_(follow_built_in(structure, plan, scene.leave_out.horizon)),
        commands_(find_unit_commands(scene, structure, scope, plan)),
        tolerance_(tolerance) {
    order_modes(structure);
  }

  const PeakAmplitudes& peaks() const { return peaks_; }
  bool has_asked() const { return sizes_.rows() > 0; }

  // Returns as many modes as satisfy both conditions of (THEORY 14.10) together, taken in the order of their
  // contributions from the smallest on. The returned indices are ascending.
  std::vector<int> left_out() const {
    std::size_t fits = 0, fails = order_.size() + 1;
    while (fails - fits > 1) {
      const std::size_t middle = (fits + fails) / 2;
      (are_small(first(middle)) ? fits : fails) = middle;
    }
    return first(fits);
  }

  // Sets the errors that the omission of the modes causes. These are max_i sum_l |b_il| A_l and its ratio to
  // the largest displacement, the corresponding errors per unit command (THEORY 14.15), and the errors of
  // link forces, sum_l (|ds/dq_l| D_l + |ds/dq_l'| G_l) (THEORY 14.14).
  void report_errors(const Structure& structure, const std::vector<int>& left_out,
                     PlanFeature& feature) const {
    feature.error = kSummed * built_in_error(left_out);
    if (peaks_.largest > 0.0) feature.relative_error = feature.error / peaks_.largest;
    feature.error_per_force = kSummed * largest_of(errors_by_commands(sizes_, commands_.any, left_out));
    feature.relative_error_per_force = command_ratio(left_out);
    for (const LinkForceRows& force : structure.link_forces)
      for (Eigen::Index k = 0; k < force.rows.rows(); ++k) {
        double error = 0.0;
        Eigen::VectorXd by_command = Eigen::VectorXd::Zero(commands_.any.rows());
        for (const int l : left_out) {
          const double by_rate = force.rate_rows.rows() > 0 ? std::abs(force.rate_rows(k, l)) : 0.0;
          error += std::abs(force.rows(k, l)) * peaks_.dynamic[l] + by_rate * peaks_.rate[l];
          by_command += (std::abs(force.rows(k, l)) + by_rate * structure.omega[l]) * commands_.any.col(l);
        }
        feature.link_error = std::max(feature.link_error, kSummed * error);
        feature.link_error_per_force =
            std::max(feature.link_error_per_force, kSummed * largest_of(by_command));
      }
  }

 private:
  void order_modes(const Structure& structure) {
    const Eigen::RowVectorXd most = sizes_.rows() > 0
                                        ? Eigen::RowVectorXd(sizes_.colwise().maxCoeff())
                                        : Eigen::RowVectorXd(Eigen::RowVectorXd::Zero(sizes_.cols()));
    Eigen::VectorXd score = Eigen::VectorXd::Zero(sizes_.cols());
    for (Eigen::Index l = 0; l < score.size(); ++l) {
      if (peaks_.largest > 0.0) score[l] = most[l] * peaks_.amplitude[l] / peaks_.largest;
      for (Eigen::Index row = 0; row < commands_.rows.rows(); ++row)
        if (commands_.reference[row] > 0.0)
          score[l] = std::max(score[l], most[l] * commands_.rows(row, l) / commands_.reference[row]);
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
    return (sizes_(Eigen::all, left_out) * peaks_.amplitude(left_out)).maxCoeff();
  }
  double command_ratio(const std::vector<int>& left_out) const {
    const Eigen::VectorXd errors = errors_by_commands(sizes_, commands_.rows, left_out);
    double share = 0.0;
    for (Eigen::Index row = 0; row < errors.size(); ++row)
      if (commands_.reference[row] > 0.0) share = std::max(share, errors[row] / commands_.reference[row]);
    return share;
  }
  bool are_small(const std::vector<int>& modes) const {
    return built_in_error(modes) <= tolerance_ * peaks_.largest && command_ratio(modes) <= tolerance_;
  }

  Eigen::MatrixXd sizes_;
  PeakAmplitudes peaks_;
  UnitCommands commands_;
  double tolerance_;
  std::vector<int> order_;  // modes with nonzero frequency, smallest contribution first
};

// Returns why no mode of the scene may be omitted as small. If modes may be omitted, the text is empty
// (THEORY 14.10).
std::string find_obstacle(const Scene& scene, const MotionScope& scope, const Plan& plan) {
  if (plan.modal_coupling.path != PlanModalCoupling::Path::kNone ||
      (is_coupled(plan) && plan.modal_coupling.num_damping > 0) || !plan.feedbacks.empty())
    return "dashpots or feedback join the modes";
  const auto has = [&](Axes axes) {
    return std::any_of(scene.loads.begin(), scene.loads.end(),
                       [&](const Load& load) { return load.axes == axes; });
  };
  if (has(Axes::kLocal)) return "follower forces join the modes";
  const bool is_commanded = !scene.pushable.empty() || !scene.groups.empty();
  if (is_commanded && scope.has_rotation &&
      (has(Axes::kWorld) || plan.has_spin_load || is_coupled(plan) || plan.attractor_mu > 0.0))
    return "commands may turn the body, and with it the loads that are fixed in the world or go by its spin: "
           "their share is not known beforehand";
  return {};
}

}  // namespace

SmallModes find_small_modes(const Scene& scene, const Structure& structure, const MotionScope& scope,
                            const Plan& plan, double tolerance) {
  SmallModes small;
  small.feature.feature = Feature::kSmallModes;
  small.kept.resize(index(structure.omega.size()));
  std::iota(small.kept.begin(), small.kept.end(), 0);
  small.horizon = scene.leave_out.horizon;
  if (tolerance == 0.0) {
    small.feature.why = "no tolerance is given";
    return small;
  }
  if (small.feature.why = find_obstacle(scene, scope, plan); !small.feature.why.empty()) return small;
  const Choice choice(scene, structure, scope, plan, tolerance);
  small.horizon = choice.peaks().horizon;
  if (!choice.has_asked()) {
    small.feature.why = "no point is read or pushed: there is nothing to judge by";
    return small;
  }
  if (!choice.peaks().is_finite) {
    small.feature.why = "the motion is not finite";
    return small;
  }
  const std::vector<int> left_out = choice.left_out();
  if (left_out.empty()) {
    small.feature.why = join_text("every mode has more than ", tolerance, " of what is asked for");
    return small;
  }
  std::vector<int> kept;
  std::set_difference(small.kept.begin(), small.kept.end(), left_out.begin(), left_out.end(),
                      std::back_inserter(kept));
  small.kept = std::move(kept);
  small.feature.is_left_out = true;
  small.feature.count = static_cast<std::int32_t>(left_out.size());
  small.feature.why = join_text("together at most ", tolerance,
                                " of the displacements of the points that are read or pushed");
  choice.report_errors(structure, left_out, small.feature);
  return small;
}

}  // namespace freeflex
