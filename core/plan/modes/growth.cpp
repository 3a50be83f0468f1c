// Stability check of the step of coupled modes and of the split step. The messages of the check give the gain
// that causes the growth (THEORY 8.34, 8.38).
#include <algorithm>
#include <cmath>
#include <random>

#include "core/faults.hpp"
#include "core/plan/modes/modal_coupling.hpp"
#include "core/plan/modes/split_step.hpp"
#include "core/plan/rungs/rates.hpp"
#include "core/structure/modes/dense/decompositions.hpp"

namespace freeflex {
namespace {

// [-] Growth of an amplitude in a tick above which the growth is not a rounding error, for the exact step and
// for the split step. If there are mechanisms, the split step has double eigenvalues, which are accurate only
// to the square root of the rounding error.
constexpr double kExactGrowth = 1e-9;
constexpr double kSplitGrowth = 1e-7;

// [-] Growth of an amplitude in a tick above which the growth is an error. At this growth, an amplitude
// doubles in 70,000 ticks.
constexpr double kHarmless = 1e-5;

// The largest number of modes whose eigenvalues are computed. This computation takes some seconds.
constexpr Eigen::Index kMaxEigenModes = 256;

// [-] gain h / m or gain h^2 / m above which splitting is inaccurate
constexpr double kCoarse = 0.1;

// Returns the largest growth of an amplitude in a tick, found by stepping a random motion. If no growth
// shows, returns 1.
double stepped_growth(const SplitStep& step) {
  constexpr double kBudget = 1e9;  // [flop]
  const int num_steps = static_cast<int>(std::clamp(kBudget / step.cost(), 128.0, 20000.0));
  std::mt19937_64 engine(1);
  std::normal_distribution<double> normal;
  Eigen::MatrixXd y = Eigen::MatrixXd::NullaryExpr(2 * step.num_modes(), 1, [&] { return normal(engine); });
  // mean logarithms of the size of the motion over the second and over the last quarter of the steps. Half of
  // all steps lie between the middles of these two quarters.
  double log_size = 0.0, early = 0.0, late = 0.0;
  const int quarter = num_steps / 4;
  for (int k = 0; k < 4 * quarter; ++k) {
    y = step(y);
    const double size = y.norm();
    if (!(size > 0.0) || !std::isfinite(size)) return size > 0.0 ? HUGE_VAL : 1.0;
    y /= size;
    log_size += std::log(size);
    if (k / quarter == 1) early += log_size / quarter;
    if (k / quarter == 3) late += log_size / quarter;
  }
  const double gained = late - early;
  return gained > 1.0 ? std::exp(gained / (2 * quarter)) : 1.0;
}

// Returns the largest absolute eigenvalue of the split step S_c(h/2) S_m(h) S_c(h/2)   (THEORY 8.38).
double split_growth(const StepPlan& plan) {
  const SplitStep step(plan);
  const Eigen::Index n = step.num_modes();
  if (n > kMaxEigenModes) return stepped_growth(step);
  const Eigen::MatrixXd once = step(Eigen::MatrixXd::Identity(2 * n, 2 * n));
  return once.allFinite() ? once.eigenvalues().cwiseAbs().maxCoeff() : HUGE_VAL;
}

// Returns the largest absolute eigenvalue of phi_0(h A), the step without loads   (THEORY 8.34).
double exact_growth(const StepPlan& plan) {
  const auto n = static_cast<Eigen::Index>(plan.modal_coupling.modes.size());
  const Eigen::Index stride = static_cast<Eigen::Index>(plan.modal_coupling.columns.size()) / (4 * n);
  const Eigen::MatrixXd once =
      Eigen::Map<const Eigen::MatrixXd>(plan.modal_coupling.columns.data(), stride, 4 * n)
          .topLeftCorner(2 * n, 2 * n);
  return once.allFinite() ? once.eigenvalues().cwiseAbs().maxCoeff() : HUGE_VAL;
}

// Holds the feedback whose force changes most within a tick.
struct Stiffest {
  const Feedback* feedback = nullptr;
  // for example "feedback 'f' has a velocity gain of -5 on a point of 2 kg, so gain tick / mass is 0.0025"
  std::string what;
  double size = 0.0;  // [-] gain h / m or gain h^2 / m
};

Stiffest find_stiffest(const Scene& scene, double period) {
  Stiffest stiffest;
  for (std::size_t k = 0; k < scene.feedbacks.size(); ++k) {
    const Feedback& feedback = scene.feedbacks[k];
    const double mass = scene.points[index(feedback.point)].mass;
    const auto take = [&](const Eigen::Matrix3d& gain, const char* name, const char* share, double time) {
      Eigen::Index row = 0, column = 0;
      const double size = gain.cwiseAbs().maxCoeff(&row, &column) * time / mass;
      if (stiffest.feedback != nullptr && !(size > stiffest.size)) return;
      stiffest = {
          &feedback,
          join_text("feedback ", quoted(feedback.name, static_cast<int>(k)), " has a ", name, " gain of ",
                    gain(row, column), " on a point of ", mass, " kg, so ", share, " is ", size),
          size};
    };
    take(feedback.displacement_gain, "displacement", "gain tick^2 / mass", period * period);
    take(feedback.velocity_gain, "velocity", "gain tick / mass", period);
  }
  return stiffest;
}

void warn_of_drive(const Origin& origin, double growth, double period, Faults& faults) {
  const double per_second = std::exp(std::log(growth) / period);
  add_warning(faults, origin,
              join_text("the feedback drives a motion that grows by a factor of ",
                        std::isfinite(per_second) ? per_second : growth,
                        std::isfinite(per_second) ? " a second" : " a tick",
                        "; check the signs and sizes of its gains"));
}

// Returns the lowest rate [Hz] at which splitting adds no growth to the growth due to the feedback itself.
// Doubles the rate up to six times. Returns the present rate if splitting adds no growth at this rate, and 0
// if no such rate is found.
double sufficient_rate(const StepPlan& plan, double growth) {
  constexpr int kDoublings = 6;
  constexpr double kNegligibleGrowth = 1e-3;  // [-] growth per second, as a fraction of the growth at the
                                              // present rate
  std::array<double, kDoublings + 1> per_second{};
  const double rate = 1.0 / plan.period;
  StepPlan faster = plan;
  double factor = growth;
  for (int k = 0; k <= kDoublings; ++k) {
    if (k > 0) {
      set_rate(faster, std::ldexp(rate, k));
      factor = split_growth(faster);
    }
    per_second[index(k)] = std::log(factor) / faster.period;
    if (per_second[index(k)] <= kNegligibleGrowth * per_second[0]) return std::ldexp(rate, k);
  }
  if (factor > 2.0) return 0.0;  // a force held over half a tick is too large even at the highest rate
  // the growth that remains at the highest rate is the growth due to the feedback itself
  int enough = 0;
  while (!(per_second[index(enough)] <= 2.0 * per_second.back())) ++enough;
  return std::ldexp(rate, enough);
}

void check_split_growth(const Scene& scene, const StepPlan& plan, Faults& faults) {
  const double growth = split_growth(plan), rate = 1.0 / plan.period;
  const Stiffest stiffest = find_stiffest(scene, plan.period);
  const Origin& origin = stiffest.feedback->origin;
  if (growth <= 1.0 + kSplitGrowth) {
    if (stiffest.size > kCoarse)
      add_warning(
          faults, origin,
          join_text(
              stiffest.what, ". More than ", kMaxExactModes,
              " coupled modes are advanced by splitting, whose error grows with the square of this value; "
              "raise the rate, or compare with a run at another rate"));
    return;
  }
  const double enough = sufficient_rate(plan, growth);
  if (enough == rate) {
    warn_of_drive(scene.feedbacks.front().origin, growth, plan.period, faults);
    return;
  }
  const std::string what = join_text(
      stiffest.what, ". More than ", kMaxExactModes, " coupled modes are advanced by splitting, and at ",
      rate, " Hz this makes a motion grow by a factor of ", growth, " a tick; ",
      enough > 0.0 ? join_text("raise the rate to ", enough, " Hz, or use smaller gains")
                   : "use smaller gains");
  // A growth of at most kHarmless is only a warning.
  growth > 1.0 + kHarmless ? add_error(faults, origin, what) : add_warning(faults, origin, what);
}

}  // namespace

void check_growth(const Scene& scene, const StepPlan& plan, Faults& faults) {
  if (plan.feedbacks.empty()) return;
  if (plan.modal_coupling.path == PlanModalCoupling::Path::kSplit) check_split_growth(scene, plan, faults);
  if (plan.modal_coupling.path != PlanModalCoupling::Path::kExact) return;
  const double growth = exact_growth(plan);
  // find_inconsistency reports a step that is not finite
  if (growth > 1.0 + kExactGrowth && std::isfinite(growth))
    warn_of_drive(scene.feedbacks.front().origin, growth, plan.period, faults);
}

}  // namespace freeflex
