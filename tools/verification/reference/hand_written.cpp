#include "tools/verification/reference/hand_written.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace freeflex {
namespace {

/// Coefficients of Hermite's interpolation over a step, from the values at its start (0) and its end (1):
///   x(t) = x0 + dx (x1 - x0) + v0 x0' + v1 x1' + a0 x0'' + a1 x1''
/// The velocity has the same form without the term x0. The cubic is used for Verlet's method and the
/// Runge-Kutta method (THEORY 13.2, 13.3), the quintic for Stoermer's and the composed method (THEORY 13.5,
/// 13.6).
struct Blend {
  double dx, v0, v1, a0, a1;
};
struct Blends {
  Blend position, velocity;
};

/// Returns the coefficients for x and v at both ends of a step of h [s], at the fraction s of the step.
Blends cubic(double s, double h) {
  const double r = 1.0 - s;
  return {{s * s * (3.0 - 2.0 * s), h * s * r * r, -h * s * s * r, 0.0, 0.0},
          {6.0 * s * r / h, r * (1.0 - 3.0 * s), s * (3.0 * s - 2.0), 0.0, 0.0}};
}

/// Returns the coefficients for x, v and a at both ends of a step of h [s], at the fraction s of the step.
Blends quintic(double s, double h) {
  const double r = 1.0 - s, s2 = s * s, r2 = r * r, half = 0.5 * h;
  return {{s * s2 * (1.0 + 3.0 * r + 6.0 * r2), h * s * r * r2 * (1.0 + 3.0 * s),
           -h * r * s * s2 * (1.0 + 3.0 * r), half * h * s2 * r * r2, half * h * r2 * s * s2},
          {30.0 * s2 * r2 / h, r2 * (1.0 - 3.0 * s) * (1.0 + 5.0 * s), s2 * (1.0 - 3.0 * r) * (1.0 + 5.0 * r),
           half * s * r2 * (2.0 - 5.0 * s), -half * r * s2 * (2.0 - 5.0 * r)}};
}

constexpr double kSlack = 1e-9;  // [-] slack for rounding errors, as a fraction of a step
constexpr const char* kUnstable =
    "the state is not finite, because the step exceeds the method's stability limit";

bool is_finite(const std::vector<double>& values) {
  return std::all_of(values.begin(), values.end(), [](double value) { return std::isfinite(value); });
}

}  // namespace

HandWritten::HandWritten(const HandTraits& traits, std::unique_ptr<SecondOrderSystem> system)
    : traits_(traits), system_(std::move(system)) {
  for (auto* values : {&x_, &v_, &f_, &start_.x, &start_.v, &end_.v, &x_read_, &v_read_})
    values->resize(system_->size());
  if (traits_.reads_by_quintic)
    for (auto* values : {&start_.a, &end_.a}) values->resize(system_->size());
}

void HandWritten::read_end(double h, End& end) const {
  const std::vector<double>& inverse_mass = system_->inverse_mass();
  const double lead = traits_.lead * h;
  for (std::size_t i = 0; i < end.v.size(); ++i) end.v[i] = v_[i] - lead * (inverse_mass[i] * f_[i]);
  for (std::size_t i = 0; i < end.a.size(); ++i) end.a[i] = inverse_mass[i] * f_[i];
}

void HandWritten::start_piece(double start, double h) {
  if (!traits_.keeps_forces) return;
  const double lead = traits_.lead * h;
  system_->forces(start, x_.data(), v_.data(), f_.data());
  for (std::size_t i = 0; i < x_.size(); ++i) v_[i] += lead * (system_->inverse_mass()[i] * f_[i]);
}

void HandWritten::step_and_read(double t, double h, std::span<const double> times, std::size_t& next,
                                const RivalSink& sink) {
  const double t_end = t + h * (1.0 + kSlack);
  start_.x = x_;
  read_end(h, start_);
  step(t, h);
  read_end(h, end_);
  for (; next < times.size() && times[next] <= t_end; ++next) {
    const double fraction = std::min(1.0, (times[next] - t) / h);
    const auto [x, v] = traits_.reads_by_quintic ? quintic(fraction, h) : cubic(fraction, h);
    for (std::size_t i = 0; i < x_.size(); ++i) {
      const double dx = x_[i] - start_.x[i], v0 = start_.v[i], v1 = end_.v[i];
      x_read_[i] = start_.x[i] + (x.dx * dx + x.v0 * v0 + x.v1 * v1);
      v_read_[i] = v.dx * dx + v.v0 * v0 + v.v1 * v1;
    }
    for (std::size_t i = 0; i < end_.a.size(); ++i) {
      x_read_[i] += x.a0 * start_.a[i] + x.a1 * end_.a[i];
      v_read_[i] += v.a0 * start_.a[i] + v.a1 * end_.a[i];
    }
    system_->to_world(times[next], x_read_, v_read_, state_);
    sink(next, state_);
  }
}

RivalRun HandWritten::run(std::span<const double> times, const RivalOptions& options, const RivalSink& sink) {
  // number of steps between two checks of is_stopped and of x for finite numbers
  constexpr long kLookEvery = 256;
  RivalRun run;
  run.memory = system_->memory() + traits_.arrays * x_.size() * sizeof(double);
  system_->initial(x_, v_);
  constexpr double kFraction = 1e-9;  // [-] of the deformation
  system_->set_accuracy(kFraction * options.scale.displacement);
  std::size_t next = 0;
  double start = 0.0;
  for (const double end : piece_ends(system_->system(), times.back())) {
    system_->begin_piece(start, end);
    const long count = std::lround(std::ceil((end - start) / options.step * (1.0 - kSlack)));
    const double h = (end - start) / static_cast<double>(count);
    start_piece(start, h);
    for (long k = 0; k < count; ++k) {
      const double t = start + static_cast<double>(k) * h;
      if (next < times.size() && times[next] <= t + h * (1.0 + kSlack))
        step_and_read(t, h, times, next, sink);
      else
        step(t, h);
      if (k % kLookEvery != kLookEvery - 1) continue;
      if (options.is_stopped && options.is_stopped()) run.error = "stopped";
      if (!is_finite(x_)) run.error = kUnstable;
      if (!run.error.empty()) return run;
    }
    run.num_steps += count;
    run.num_evaluations += count * traits_.evaluations + (traits_.keeps_forces ? 1 : 0);
    // the next piece starts from v at the time of x, so the lead of v is removed
    read_end(h, end_);
    v_ = end_.v;
    start = end;
  }
  if (!is_finite(x_)) run.error = kUnstable;
  return run;
}

}  // namespace freeflex
