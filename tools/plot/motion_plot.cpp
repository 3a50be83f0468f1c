#include "tools/plot/motion_plot.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>

#include "core/step/readout.hpp"
#include "core/step/vector.hpp"
#include "tools/terminal/console.hpp"

namespace freeflex::tools {
namespace {

constexpr std::size_t kMostPoints = 6, kMostModes = 6, kMostWheels = 6;

double length(const Vec3& v) { return std::sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]); }

/// Returns the published points farthest from the centre, which move most.
std::vector<std::int32_t> outer_points(const Plan& plan) {
  std::vector<std::int32_t> points = plan.published_points;
  const auto distance = [&](std::int32_t point) { return length(plan.points[index(point)].r); };
  std::stable_sort(points.begin(), points.end(),
                   [&](std::int32_t a, std::int32_t b) { return distance(a) > distance(b); });
  if (points.size() > kMostPoints) points.resize(kMostPoints);
  return points;
}

std::size_t num_wheels(const Plan& plan) { return std::min(kMostWheels, plan.wheels.size()); }

constexpr double kDegrees = 180.0 / std::numbers::pi;

// the columns are rms, position, rotation, rates and pointing error, and from kPoints on the displacements of
// points
constexpr std::size_t kRms = 0, kPosition = 1, kRotation = 4, kRates = 7, kPointing = 10, kPoints = 11;

}  // namespace

Vec3 rotation_between(const Quat& from, const Quat& to) {
  const Quat rotation = multiply({from[0], -from[1], -from[2], -from[3]}, to);
  const Vec3 vector{rotation[1], rotation[2], rotation[3]};
  const double sine = length(vector);
  if (sine == 0.0) return {};
  // q and -q are the same attitude
  const double scale = std::copysign(2.0 * std::atan2(sine, std::abs(rotation[0])) / sine, rotation[0]);
  return {scale * vector[0], scale * vector[1], scale * vector[2]};
}

MotionPlot::MotionPlot(const Plan& plan)
    : plan_(plan),
      modal_plan_(plan_of_all_modes(plan)),
      points_(outer_points(plan)),
      q_(index(modal_plan_.num_elastic)),
      energy_(q_.size()),
      most_energy_(q_.size()),
      samples_(kPoints + points_.size() + num_wheels(plan) + 2 * q_.size()) {}

/// Reads the modes of the active plan. Modes that the active plan omits get zero.
void MotionPlot::take_modes(const State& state) {
  const StepPlan& active = active_plan(plan_, state);
  const bool is_reduced = &active != &modal_plan_;
  std::fill(q_.begin(), q_.end(), 0.0);
  std::fill(energy_.begin(), energy_.end(), 0.0);
  for (std::size_t l = 0; l < index(active.num_elastic); ++l) {
    const std::size_t mode = is_reduced ? index(plan_.fallback_modes[l]) : l;
    const double rate = state.q_dot[l], spring = modal_plan_.omega[mode] * state.q[l];
    q_[mode] = state.q[l];
    energy_[mode] = 0.5 * modal_plan_.mass * (rate * rate + spring * spring);
    most_energy_[mode] = std::max(most_energy_[mode], energy_[mode]);
  }
}

void MotionPlot::take(const State& state) {
  if (!has_first_) first_ = state.q_WB;
  has_first_ = true;
  take_modes(state);
  double square = 0.0;
  for (const double q : q_) square += q * q;
  const Vec3 rotation = rotation_between(first_, state.q_WB), rates = angular_velocity(plan_, state);
  values_.assign(1, std::sqrt(square));
  values_.insert(values_.end(), state.p_WB.begin(), state.p_WB.end());
  for (const double angle : rotation) values_.push_back(kDegrees * angle);
  values_.insert(values_.end(), rates.begin(), rates.end());
  values_.push_back(kDegrees * length(rotation));
  for (const std::int32_t point : points_) values_.push_back(length(read_point(plan_, state, point).V_B));
  for (std::size_t k = 0; k < num_wheels(plan_); ++k) values_.push_back(state.wheel_momentum[k]);
  values_.insert(values_.end(), q_.begin(), q_.end());
  values_.insert(values_.end(), energy_.begin(), energy_.end());
  samples_.take(static_cast<double>(state.tick) * plan_.period, values_);
}

std::vector<Panel> MotionPlot::panels() const {
  const std::vector<double> time = samples_.time();
  std::vector<Panel> panels;
  const auto begin = [&](const std::string& label) { panels.push_back({label, time, {}}); };
  const auto add = [&](const std::string& name, std::size_t column) {
    panels.back().series.push_back({name, samples_.column(column)});
  };
  const auto add_axes = [&](const std::string& label, std::size_t column) {
    begin(label);
    for (const char* axis : {"x", "y", "z"}) add(axis, column++);
  };
  const std::size_t wheels = kPoints + points_.size(), modes = wheels + num_wheels(plan_);
  if (!q_.empty()) {
    begin("elastic displacement [m]");
    add("rms over the mass", kRms);
    for (std::size_t k = 0; k < points_.size(); ++k) add(plan_.points[index(points_[k])].name, kPoints + k);
    std::vector<std::size_t> ranked(q_.size());
    std::iota(ranked.begin(), ranked.end(), std::size_t{0});
    std::stable_sort(ranked.begin(), ranked.end(),
                     [this](std::size_t a, std::size_t b) { return most_energy_[a] > most_energy_[b]; });
    if (ranked.size() > kMostModes) ranked.resize(kMostModes);
    const auto add_modes = [&](const std::string& label, std::size_t column) {
      begin(label);
      for (const std::size_t mode : ranked)
        add(format_text("mode %zu, %.4g Hz", mode + 1, modal_plan_.omega[mode] / (2.0 * std::numbers::pi)),
            column + mode);
    };
    add_modes("elastic coordinates [m] of the modes with the largest peak energy", modes);
    add_modes("energies of these modes [J]: M/2 (q_dot^2 + omega^2 q^2)", modes + q_.size());
  }
  add_axes("centre of mass [m], world axes", kPosition);
  add_axes("attitude [deg]: rotation vector from the initial attitude, its body axes", kRotation);
  begin("pointing error [deg]: angle from the initial attitude");
  add("angle", kPointing);
  add_axes("angular velocity [rad/s], body axes", kRates);
  if (num_wheels(plan_) == 0) return panels;
  begin("angular momenta of wheels [N m s]");
  for (std::size_t k = 0; k < num_wheels(plan_); ++k) add(plan_.wheels[k].name, wheels + k);
  return panels;
}

std::string MotionPlot::write(const std::string& path) const {
  return plot_panels(path, plan_.name, "time [s]", panels());
}

}  // namespace freeflex::tools
