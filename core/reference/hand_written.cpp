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

bool is_finite(const std::vector<double>& values) {
  return std::all_of(values.begin(), values.end(), [](double value) { return std::isfinite(value); });
}

}  // namespace

HandWritten::HandWritten(Rival rival, SpringNetwork network) : rival_(rival), network_(std::move(network)) {
  for (auto* values : {&x_, &v_, &f_, &x_at_, &a1_, &a2_, &a3_}) values->resize(network_.size());
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

RivalRun HandWritten::run(std::span<const double> times, const RivalOptions& options, const RivalSink& sink) {
  constexpr double kSlack = 1e-9;   // of a step: what rounding may add to it
  constexpr long kLookEvery = 256;  // steps between looks at the stop and at the numbers
  RivalRun run;
  run.memory = network_.memory() + (rival_ == Rival::kVerlet ? 3 : 7) * x_.size() * sizeof(double);
  const bool is_verlet = rival_ == Rival::kVerlet;
  network_.initial(x_, v_);
  std::vector<double> x0(x_.size()), v0(x_.size()), v1(x_.size()), x_read(x_.size()), v_read(x_.size());
  CartesianState state;
  std::size_t next = 0;
  double start = 0.0;
  for (const double end : piece_ends(network_.system(), times.back())) {
    network_.begin_piece(start, end);
    const long count = std::lround(std::ceil((end - start) / options.step * (1.0 - kSlack)));
    const double h = (end - start) / static_cast<double>(count);
    if (is_verlet) {
      network_.forces(start, x_.data(), f_.data());
      ++run.num_evaluations;
      for (std::size_t i = 0; i < x_.size(); ++i) v_[i] += 0.5 * h * (network_.inverse_mass()[i] * f_[i]);
    }
    for (long k = 0; k < count; ++k) {
      const double t = start + static_cast<double>(k) * h, t_end = t + h * (1.0 + kSlack);
      const bool reads = times[next] <= t_end;
      if (reads) {
        x0 = x_;
        read_velocity(h, v0);
      }
      step(t, h);
      if (reads) read_velocity(h, v1);
      for (; reads && next < times.size() && times[next] <= t_end; ++next) {
        const Hermite cubic{std::min(1.0, (times[next] - t) / h), h};
        for (std::size_t i = 0; i < x_.size(); ++i) {
          x_read[i] = cubic.position(x0[i], v0[i], x_[i], v1[i]);
          v_read[i] = cubic.velocity(x0[i], v0[i], x_[i], v1[i]);
        }
        network_.to_world(times[next], x_read, v_read, state);
        sink(next, state);
      }
      if (next == times.size()) break;
      if (k % kLookEvery == kLookEvery - 1) {
        if (options.is_stopped && options.is_stopped()) run.error = "stopped";
        if (!is_finite(x_)) run.error = "not finite: the step is beyond the method's stability";
        if (!run.error.empty()) return run;
      }
    }
    run.num_steps += count;
    run.num_evaluations += count * (is_verlet ? 1 : 4);
    if (is_verlet) read_velocity(h, v1), v_ = v1;
    start = end;
  }
  if (!is_finite(x_)) run.error = "not finite: the step is beyond the method's stability";
  return run;
}

}  // namespace freeflex
