// Blocks for controllers: delays, sampling, noise and limits of sensors, wheels and thrusters. This header
// needs C++17 and freeflex.h. freeflex.blocks has the same blocks in Python. Both give the same bits if this
// one is compiled with -ffp-contract=off.
//
//   freeflex::blocks::Delay late(0.05);
//   freeflex::blocks::Noise gyro(of->seed, 1, 1e-4);
//   freeflex::blocks::Wheel wheel(0.2, 4.0);
//   const double torque = wheel(30.0 * late(state.time, gyro(spin)), momentum);
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <deque>
#include <limits>
#include <optional>
#include <stdexcept>
#include <string>

#include "freeflex.h"

namespace freeflex::blocks {

namespace detail {
inline void require(bool is_good, const char* what, double found, const char* allowed) {
  if (!is_good)
    throw std::invalid_argument(std::string(what) + " is " + std::to_string(found) + ", but must be " +
                                allowed);
}
// [s] half a nanosecond, because times are multiples of a period that may not be a binary fraction
inline constexpr double kTimeRounding = 0.5e-9;
}  // namespace detail

/// Gives each value after `delay` [s]: the newest one that is at least that old, at first the first one.
/// \tparam Value  a number, or a std::array of numbers
template <class Value = double>
class Delay {
 public:
  explicit Delay(double delay) : delay_(delay) { detail::require(delay >= 0.0, "delay [s]", delay, ">= 0"); }
  Value operator()(double time, const Value& value) {
    waiting_.push_back({time + delay_ - detail::kTimeRounding, value});
    if (!now_) now_ = value;
    while (!waiting_.empty() && waiting_.front().due <= time) {
      now_ = waiting_.front().value;
      waiting_.pop_front();
    }
    return *now_;
  }

 private:
  struct Waiting {
    double due;
    Value value;
  };
  double delay_;
  std::deque<Waiting> waiting_;
  std::optional<Value> now_;
};

/// Takes a value at multiples of `period` [s] and holds it in between.
template <class Value = double>
class Sampled {
 public:
  explicit Sampled(double period) : period_(period) {
    detail::require(period > 0.0, "period [s]", period, "> 0");
  }
  Value operator()(double time, const Value& value) {
    const double number = std::floor((time + detail::kTimeRounding) / period_);
    if (!held_ || number != number_) held_ = value;
    number_ = number;
    return *held_;
  }

 private:
  double period_, number_ = 0.0;
  std::optional<Value> held_;
};

/// Adds a constant bias and normal noise. The noise depends only on the case, the number of the sensor and
/// the number of the call.
class Noise {
 public:
  /// \param seed  of the freeflex_case
  /// \param sd    standard deviation, >= 0
  Noise(std::uint64_t seed, std::uint64_t sensor, double sd, double bias = 0.0)
      : seed_(seed), sensor_(sensor), sd_(sd), bias_(bias) {
    detail::require(sd >= 0.0, "sd", sd, ">= 0");
  }
  double operator()(double value) {
    return value + bias_ + sd_ * freeflex_random_normal(seed_, sensor_, count_++);
  }

 private:
  std::uint64_t seed_, sensor_;
  double sd_, bias_;
  std::uint64_t count_ = 0;
};

/// Rounds to multiples of `step`.
class Quantized {
 public:
  explicit Quantized(double step) : step_(step) { detail::require(step > 0.0, "step", step, "> 0"); }
  double operator()(double value) const { return std::floor(value / step_ + 0.5) * step_; }

 private:
  double step_;
};

/// Limits a number to -limit .. limit.
class Saturation {
 public:
  explicit Saturation(double limit) : limit_(limit) { detail::require(limit >= 0.0, "limit", limit, ">= 0"); }
  double operator()(double value) const { return std::min(std::max(value, -limit_), limit_); }

 private:
  double limit_;
};

/// Limits the torque of a motor [N m] to `max_torque`. While the momentum of the wheel is at or beyond
/// `max_momentum` [N m s], gives no torque that increases it further.
class Wheel {
 public:
  explicit Wheel(double max_torque, double max_momentum = std::numeric_limits<double>::infinity())
      : saturation_(max_torque), max_momentum_(max_momentum) {
    detail::require(max_momentum > 0.0, "max_momentum [N m s]", max_momentum, "> 0");
  }
  double operator()(double torque, double momentum) const {
    const bool is_full =
        (torque > 0.0 && momentum >= max_momentum_) || (torque < 0.0 && momentum <= -max_momentum_);
    return is_full ? 0.0 : saturation_(torque);
  }

 private:
  Saturation saturation_;
  double max_momentum_;
};

/// An on-off thruster of `force` [N], which the demanded mean force over the next `period` [s] turns on for a
/// part of that period. It gives nothing for less than `min_on` [s], and keeps what it could not give for the
/// next period.
class Thruster {
 public:
  Thruster(double force, double period, double min_on = 0.0)
      : force_(force), period_(period), min_on_(min_on) {
    detail::require(force > 0.0, "force [N]", force, "> 0");
    detail::require(period > 0.0, "period [s]", period, "> 0");
    detail::require(min_on >= 0.0 && min_on <= period, "min_on [s]", min_on, "from 0 to period");
  }
  /// Returns how long the thruster is on [s].
  double operator()(double demanded) {
    const double wanted = std::max(demanded, 0.0) * period_ / force_ + owed_;
    double on = std::min(wanted, period_);
    if (on < min_on_ || on <= 0.0) on = 0.0;
    // what is owed is at most one period, so that a demand beyond the force does not last after its end
    owed_ = std::min(wanted - on, period_);
    return on;
  }

 private:
  double force_, period_, min_on_, owed_ = 0.0;
};

}  // namespace freeflex::blocks
