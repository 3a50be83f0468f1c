#include "tools/plot/motion_plot.hpp"

#include <algorithm>
#include <cmath>

#include "core/step/readout.hpp"

namespace freeflex::tools {
namespace {

constexpr std::size_t kMostPoints = 6, kMostModes = 6, kMostWheels = 6;

double length(const Vec3& v) { return std::sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]); }

/// Those farthest from the centre, which move most.
std::vector<std::int32_t> outer_points(const Plan& plan) {
  std::vector<std::int32_t> points = plan.published_points;
  const auto distance = [&](std::int32_t point) {
    return length(plan.points[static_cast<std::size_t>(point)].r);
  };
  std::stable_sort(points.begin(), points.end(),
                   [&](std::int32_t a, std::int32_t b) { return distance(a) > distance(b); });
  if (points.size() > kMostPoints) points.resize(kMostPoints);
  return points;
}

}  // namespace

MotionPlot::MotionPlot(const Plan& plan)
    : plan_(plan),
      points_(outer_points(plan)),
      num_modes_(std::min(kMostModes, static_cast<std::size_t>(plan.num_elastic))),
      samples_(1 + points_.size() + num_modes_ + 6 + std::min(kMostWheels, plan.wheels.all.size())) {
  const auto panel = [this](const std::string& label) {
    return panels_.push_back(label), panels_.size() - 1;
  };
  const std::size_t elastic = panel("elastic displacement [m]");
  curves_.push_back({elastic, "rms over the mass"});
  for (const std::int32_t point : points_)
    curves_.push_back({elastic, "|V| " + plan.points[static_cast<std::size_t>(point)].name});
  if (num_modes_ > 0) {
    const std::size_t modes = panel("elastic coordinates [m]");
    for (std::size_t l = 0; l < num_modes_; ++l) curves_.push_back({modes, "q" + std::to_string(l + 1)});
  }
  const std::size_t place = panel("centre of mass [m], world axes");
  for (const char* axis : {"x", "y", "z"}) curves_.push_back({place, axis});
  const std::size_t spin = panel("angular velocity [rad/s], body axes");
  for (const char* axis : {"x", "y", "z"}) curves_.push_back({spin, axis});
  if (plan.wheels.all.empty()) return;
  const std::size_t wheels = panel("momenta of wheels [N m s]");
  for (std::size_t k = 0; k < std::min(kMostWheels, plan.wheels.all.size()); ++k)
    curves_.push_back({wheels, plan.wheels.all[k].name});
}

void MotionPlot::take(const State& state) {
  values_.clear();
  double square = 0.0;
  for (int l = 0; l < active_plan(plan_, state).num_elastic; ++l)
    square += state.q[static_cast<std::size_t>(l)] * state.q[static_cast<std::size_t>(l)];
  values_.push_back(std::sqrt(square));
  for (const std::int32_t point : points_) values_.push_back(length(read_point(plan_, state, point).V_B));
  for (std::size_t l = 0; l < num_modes_; ++l) values_.push_back(state.q[l]);
  for (const double x : state.p_WB) values_.push_back(x);
  for (const double w : angular_velocity(plan_, state)) values_.push_back(w);
  for (std::size_t k = 0; k < std::min(kMostWheels, plan_.wheels.all.size()); ++k)
    values_.push_back(state.wheel_momentum[k]);
  samples_.take(static_cast<double>(state.tick) * plan_.period, values_);
}

std::string MotionPlot::write(const std::string& path) const {
  std::vector<Panel> panels;
  for (const std::string& label : panels_) panels.push_back({label, {}});
  for (std::size_t k = 0; k < curves_.size(); ++k)
    panels[curves_[k].panel].series.push_back({curves_[k].name, samples_.column(k)});
  return plot_panels(path, plan_.name, samples_.time(), panels);
}

}  // namespace freeflex::tools
