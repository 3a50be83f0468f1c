#include "core/plan/integration/choose_method.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <limits>

#include "core/faults.hpp"
#include "core/plan/rungs/shadow.hpp"
#include "core/step/linear/kernels.hpp"
#include "core/step/links/rotations.hpp"
#include "core/step/loads/loads.hpp"
#include "core/step/points/history.hpp"

namespace freeflex {
namespace {

// Returns whether a load is smooth between ticks: whether the rows of its table, if any, are at ticks.
bool is_at_ticks(const PlanHistory& history, double period) {
  return std::ranges::all_of(history.times, [period](double time) {
    return std::abs(time / period - std::round(time / period)) < 1e-6;
  });
}

// Returns whether springs, bars and dashpots do all the damping: decay_l = beta omega_l^2 / 2, without the
// damping ratios of modes and without Rayleigh's alpha.
bool has_damped_springs_alone(const StepPlan& plan) {
  const PlanCoupled& coupled = plan.coupled;
  if (std::ranges::any_of(coupled.strain_times, [](double time) { return time != 0.0; })) return false;
  for (std::size_t l = 0; l < index(plan.num_elastic); ++l)
    if (std::abs(plan.decay[l] - 0.5 * coupled.beta * plan.omega[l] * plan.omega[l]) > 1e-9 * plan.decay[l])
      return false;
  return true;
}

}  // namespace

std::string find_no_points_method(const StepPlan& plan) {
  const PlanCoupled& coupled = plan.coupled;
  if (!traits_of(plan.fidelity).has_true_geometry) return "the rung has no true geometry";
  if (coupled.kinetics.form != PlanKinetics::Form::kComplete || plan.num_padded != plan.num_moving)
    return "the scene has rigid links, bodies, mass on links, or not all modes";
  if (plan.rigid_freedoms < 6) return "the points are on a line";
  if (plan.num_elastic == 0) return "the scene has no elastic modes";
  if (std::ranges::any_of(plan.points, [](const PlanPoint& point) { return point.mass == 0.0; }))
    return "the scene has massless points";
  if (coupled.links.has_joints() || !coupled.links.angles.empty() || !coupled.links.matrices.empty() ||
      coupled.links.joints.num_rotations > 0)
    return "the scene has other links than springs, bars and dashpots";
  if (!has_damped_springs_alone(plan))
    return "the scene has damping of modes or of the mass, or its links have the same viscous damping, which "
           "damps modes";
  if (plan.attractor_mu > 0.0) return "the scene has an attractor";
  if (!plan.feedbacks.empty()) return "the scene has feedback";
  if (!plan.wheels.empty()) return "the scene has wheels";
  if (!plan.fallback.empty()) return "the plan omits features";
  for (const PlanHistory& history : plan.histories) {
    if (!is_at_ticks(history, plan.period))
      return "the table of load '" + history.name + "' bends between two ticks";
    if (!history.followers.empty()) return "load '" + history.name + "' acts in local axes";
  }
  return {};
}

namespace {

// Fills plan.points_method except for what depends on the period.
void compile_points_method(double accuracy, StepPlan& plan) {
  PlanPoints& method = plan.points_method;
  method.accuracy = accuracy;
  method.steps = 1;
  for (const PlanBar& bar : plan.coupled.bars) {
    method.first.push_back(bar.first);
    method.second.push_back(bar.second);
    method.stiffness.push_back(bar.stiffness);
    method.inverse_square.push_back(1.0 / (bar.length * bar.length));
    method.tension.push_back(bar.stiffness * bar.length);
  }
  if (std::ranges::any_of(plan.coupled.bars, [](const PlanBar& bar) { return bar.damping > 0.0; }))
    for (const PlanBar& bar : plan.coupled.bars) method.damping.push_back(bar.damping);
  while (method.first.size() % 4 != 0) {
    method.first.push_back(method.first.back());
    method.second.push_back(method.second.back());
    method.inverse_square.push_back(method.inverse_square.back());
    method.stiffness.push_back(0.0);
    method.tension.push_back(0.0);
    if (!method.damping.empty()) method.damping.push_back(0.0);
  }
  for (const PlanPoint& point : plan.points) method.inverse_mass.push_back(1.0 / point.mass);
  method.inverse_mass.push_back(0.0);
  method.share.assign(size_over_points(method), 0.0);
  for (std::size_t i = 0; i < 3 * plan.points.size(); ++i)
    method.share[i] = plan.points[i / 3].mass / plan.mass;
}

// [-] Error of a displacement by rounding of positions, over the size of the structure. After 200 ticks 3 eps
// were measured (`freeflex stability`, size of forces).
constexpr double kRoundingOfPositions = 100.0 * std::numeric_limits<double>::epsilon();

// Returns the rms displacement over the mass that the initial motion and the loads cause, each load as a
// static one of its largest amplitude [m].
double displacement_by_loads(const StepPlan& plan) {
  double square = 0.0;
  for (std::size_t l = 0; l < plan.omega.size(); ++l) {
    square += plan.initial.q[l] * plan.initial.q[l];
    if (plan.omega[l] > 0.0) square += std::pow(plan.initial.q_dot[l] / plan.omega[l], 2.0);
  }
  std::vector<Vec3> forces(plan.points.size());
  Array Q(index(plan.num_moving)), other(Q.size());
  for (const PlanHistory& history : plan.histories) {
    double peak = history.kind == PlanHistory::Kind::kTable ? 0.0 : 1.0;
    for (const double value : history.values) peak = std::max(peak, std::abs(value));
    std::ranges::fill(forces, Vec3{});
    add_point_forces(plan, history.pattern, matrix_of(plan.initial.q_WB), peak, {}, forces);
    project_points(plan, forces, forces, Q.data(), other.data());
    for (std::size_t l = 0; l < plan.omega.size(); ++l)
      if (plan.omega[l] > 0.0) square += std::pow(Q[l] / (plan.mass * plan.omega[l] * plan.omega[l]), 2.0);
  }
  return std::sqrt(square);
}

// [s] Longest counted time of a tick on points that a scene may ask for.
constexpr double kLongestTick = 1.0;

// Sets the counted times of a tick by the multistep method, and of one after a change of the loads
// (THEORY 12.136).
void set_counted_times(const PlanPoints& method, PlanIntegration& report) {
  constexpr double kSpring = 2e-9, kComponent = 2e-9, kEvaluation = 50e-9;
  const double evaluation = kEvaluation + kSpring * static_cast<double>(method.first.size()) +
                            kComponent * static_cast<double>(3 * method.inverse_mass.size());
  const int columns = method.columns;
  const bool is_damped = !method.damping.empty();
  const int evaluations = method.pieces * ((is_damped ? columns * columns : columns * (columns + 1) / 2) + 1);
  report.after_change = evaluation * evaluations;
  report.on_points = is_damped ? report.after_change : evaluation * method.steps / method.ticks;
}

std::string to_one_digit(double x) {
  std::array<char, 16> text{};
  return {text.data(), std::to_chars(text.begin(), text.end(), x, std::chars_format::scientific, 0).ptr};
}

// Returns why points that could be integrated should not be, or an empty text.
// \param must  true: the scene asks for points
std::string find_reason_against(const Plan& plan, bool must) {
  const PlanPoints& method = plan.points_method;
  const PlanIntegration& report = plan.integration;
  if (std::max(method.steps, method.pieces) > kMostStepsPerTick ||
      report.on_points > (must ? kLongestTick : report.on_modes))
    return must ? join_text("a tick at this rate would take more than ", kMostStepsPerTick,
                            " steps or 1 s of computing, fewer at a higher rate")
                : "a tick is cheaper on modes";
  if (must) return {};
  constexpr double kMostAfterChange = 3.0;
  if (report.after_change > kMostAfterChange * report.on_modes)
    return "a tick after a change of the loads is cheaper on modes";
  const double floor = kRoundingOfPositions * radius_of(plan), expected = displacement_by_loads(plan);
  if (expected > 0.0 && floor > method.accuracy * expected)
    return join_text("the loads move the points by some ", to_one_digit(expected),
                     " m, of which rounding errors of positions are ", to_one_digit(floor), " m");
  return {};
}

}  // namespace

std::string choose_method(const Integration& asked, Plan& plan) {
  if (!traits_of(plan.fidelity).has_true_geometry) return {};
  const bool must = asked.by == IntegrateBy::kPoints;
  PlanIntegration& report = plan.integration;
  std::string& why = report.why_modes;
  why = asked.by == IntegrateBy::kModes ? "the scene asks for it" : find_no_points_method(plan);
  if (why.empty()) {
    const double usual = traits_of(plan.fidelity).divides_tick ? 1e-8 : 1e-6;
    compile_points_method(asked.accuracy > 0.0 ? asked.accuracy : usual, plan);
    set_points_period(plan);
    report.on_modes = seconds_of_step(plan);
    set_counted_times(plan.points_method, report);
    why = find_reason_against(plan, must);
  }
  if (why.empty()) return {};
  plan.points_method = {};
  return must ? why : std::string();
}

}  // namespace freeflex
