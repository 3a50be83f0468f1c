#include "core/reference/hand_written.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace freeflex {
namespace {

/// Cubic through the positions and velocities at both ends of a step of h [s], at the share s of it.
struct Hermite {
  double s, h;
  double position(double x0, double v0, double x1, double v1) const {
    const double r = 1.0 - s;
    return r * r * (1.0 + 2.0 * s) * x0 + s * s * (3.0 - 2.0 * s) * x1 + h * s * r * (r * v0 - s * v1);
  }
  double velocity(double x0, double v0, double x1, double v1) const {
    const double r = 1.0 - s;
    return 6.0 * s * r * (x1 - x0) / h + r * (1.0 - 3.0 * s) * v0 + s * (3.0 * s - 2.0) * v1;
  }
};

constexpr double kSlack = 1e-9;  // of a step: what rounding may add to it
constexpr const char* kUnstable = "not finite: the step is beyond the method's stability";

bool is_finite(const std::vector<double>& values) {
  return std::all_of(values.begin(), values.end(), [](double value) { return std::isfinite(value); });
}

}  // namespace

HandWritten::HandWritten(Rival rival, SpringNetwork network) : rival_(rival), network_(std::move(network)) {
  for (auto* values : {&x_, &v_, &f_, &x_at_, &a1_, &a2_, &a3_, &x0_, &v0_, &v1_, &x_read_, &v_read_})
    values->resize(network_.size());
}

void HandWritten::step(double t, double h) {
  rival_ == Rival::kVerlet ? verlet_step(t, h) : runge_kutta_step(t, h);
}

// v stands at the middle of the step before and after
void HandWritten::verlet_step(double t, double h) {
  const std::size_t n = x_.size();
  double *x = x_.data(), *v = v_.data();
  const double *f = f_.data(), *inverse_mass = network_.inverse_mass().data();
  for (std::size_t i = 0; i < n; ++i) x[i] += h * v[i];
  network_.forces(t + h, x, f_.data());
  for (std::size_t i = 0; i < n; ++i) v[i] += h * (inverse_mass[i] * f[i]);
}

// forces do not depend on v, so the stages of v need not be kept
void HandWritten::runge_kutta_step(double t, double h) {
  const std::size_t n = x_.size();
  double *x = x_.data(), *v = v_.data(), *at = x_at_.data(), *f = f_.data();
  double *a1 = a1_.data(), *a2 = a2_.data(), *a3 = a3_.data();
  const double* inverse_mass = network_.inverse_mass().data();
  const double half = 0.5 * h, quarter = 0.25 * h * h, half_square = 0.5 * h * h;
  network_.forces(t, x, f);
  for (std::size_t i = 0; i < n; ++i) {
    a1[i] = inverse_mass[i] * f[i];
    at[i] = x[i] + half * v[i];
  }
  network_.forces(t + half, at, f);
  for (std::size_t i = 0; i < n; ++i) {
    a2[i] = inverse_mass[i] * f[i];
    at[i] = x[i] + half * v[i] + quarter * a1[i];
  }
  network_.forces(t + half, at, f);
  for (std::size_t i = 0; i < n; ++i) {
    a3[i] = inverse_mass[i] * f[i];
    at[i] = x[i] + h * v[i] + half_square * a2[i];
  }
  network_.forces(t + h, at, f);
  const double sixth = h / 6.0;
  for (std::size_t i = 0; i < n; ++i) {
    const double sum = a2[i] + a3[i];
    x[i] += h * (v[i] + sixth * (a1[i] + sum));
    v[i] += sixth * (a1[i] + 2.0 * sum + inverse_mass[i] * f[i]);
  }
}

void HandWritten::read_velocity(double h, std::vector<double>& v) const {
  const double lead = rival_ == Rival::kVerlet ? 0.5 * h : 0.0;
  for (std::size_t i = 0; i < v.size(); ++i) v[i] = v_[i] - lead * (network_.inverse_mass()[i] * f_[i]);
}

void HandWritten::start_piece(double start, double h) {
  if (rival_ != Rival::kVerlet) return;
  network_.forces(start, x_.data(), f_.data());
  for (std::size_t i = 0; i < x_.size(); ++i) v_[i] += 0.5 * h * (network_.inverse_mass()[i] * f_[i]);
}

void HandWritten::step_and_read(double t, double h, std::span<const double> times, std::size_t& next,
                                const RivalSink& sink) {
  const double t_end = t + h * (1.0 + kSlack);
  x0_ = x_;
  read_velocity(h, v0_);
  step(t, h);
  read_velocity(h, v1_);
  for (; next < times.size() && times[next] <= t_end; ++next) {
    const Hermite cubic{std::min(1.0, (times[next] - t) / h), h};
    for (std::size_t i = 0; i < x_.size(); ++i) {
      x_read_[i] = cubic.position(x0_[i], v0_[i], x_[i], v1_[i]);
      v_read_[i] = cubic.velocity(x0_[i], v0_[i], x_[i], v1_[i]);
    }
    network_.to_world(times[next], x_read_, v_read_, state_);
    sink(next, state_);
  }
}

RivalRun HandWritten::run(std::span<const double> times, const RivalOptions& options, const RivalSink& sink) {
  constexpr long kLookEvery = 256;  // steps between looks at the stop and at the numbers
  const bool is_verlet = rival_ == Rival::kVerlet;
  RivalRun run;
  run.memory = network_.memory() + (is_verlet ? 3 : 7) * x_.size() * sizeof(double);
  network_.initial(x_, v_);
  std::size_t next = 0;
  double start = 0.0;
  for (const double end : piece_ends(network_.system(), times.back())) {
    network_.begin_piece(start, end);
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
    run.num_evaluations += count * (is_verlet ? 1 : 4) + (is_verlet ? 1 : 0);
    // Verlet's velocities back from the middle of a step
    read_velocity(h, v1_);
    v_ = v1_;
    start = end;
  }
  if (!is_finite(x_)) run.error = kUnstable;
  return run;
}

}  // namespace freeflex
