#include "core/step/external.hpp"

#include <algorithm>

#include "core/step/field.hpp"
#include "core/step/history.hpp"
#include "core/step/kernels.hpp"
#include "core/step/loads.hpp"

namespace freeflex {

double External::amplitude(const PlanHistory& history, Instant instant) const noexcept {
  if (history.kind == PlanHistory::Kind::kPulse) return amplitude_right(history, plan.period, tick);
  // num_parts is a power of two: the time of a part is not rounded
  const std::int32_t num_parts = plan.coupled.num_parts;
  const double period = plan.period / num_parts;
  const std::int64_t at = tick * num_parts + part;
  switch (instant) {
    case Instant::kStart:
      return amplitude_right(history, period, at);
    case Instant::kMiddle:
      return amplitude_middle(history, period, at);
    case Instant::kEnd:
      break;
  }
  return amplitude_left(history, period, at + 1);
}

bool External::jumps() const noexcept {
  for (const PlanHistory& history : plan.histories)
    if (amplitude_left(history, plan.period, tick) != amplitude_right(history, plan.period, tick))
      return true;
  return false;
}

StepLoads External::rigid() const noexcept {
  StepLoads loads;
  add_pattern(commands, 1.0, loads.start);
  if (plan.histories.empty()) return loads;
  // one that is zero adds nothing, and what stays as it is over the step needs no middle and end
  bool varies = false;
  for (const PlanHistory& history : plan.histories) {
    const double start = amplitude(history, Instant::kStart);
    varies |= amplitude(history, Instant::kMiddle) != start || amplitude(history, Instant::kEnd) != start;
  }
  if (varies) loads.later.emplace(StepLoads::Later{loads.start, loads.start});
  const auto add = [](const PlanHistory& history, double amplitude, RigidLoad& load) {
    if (amplitude != 0.0) add_pattern(history.pattern, amplitude, load);
  };
  for (const PlanHistory& history : plan.histories) {
    add(history, amplitude(history, Instant::kStart), loads.start);
    if (!varies) continue;
    add(history, amplitude(history, Instant::kMiddle), loads.later->middle);
    add(history, amplitude(history, Instant::kEnd), loads.later->end);
  }
  return loads;
}

double External::wheel_torque(std::size_t wheel, Instant instant) const noexcept {
  double torque = commands.wheels.torque[wheel];
  for (const PlanHistory& history : plan.histories)
    torque += amplitude(history, instant) * history.pattern.wheels.torque[wheel];
  return torque;
}

External::TorqueOverStep External::wheel_torques(std::size_t wheel) const noexcept {
  const double start = wheel_torque(wheel, Instant::kStart), middle = wheel_torque(wheel, Instant::kMiddle),
               end = wheel_torque(wheel, Instant::kEnd);
  const double bend = 2.0 * ((start + end) - 2.0 * middle);
  return {start, (end - start) - bend, bend};
}

double External::wheel_gain(std::size_t wheel) const noexcept {
  const auto [start, slope, bend] = wheel_torques(wheel);
  const double end = start + (slope + bend);
  return period() * (0.5 * (start + end) - bend / 6.0);
}

double External::wheel_momentum(std::size_t wheel, double at_start, Instant instant) const noexcept {
  if (instant == Instant::kStart) return at_start;
  if (instant == Instant::kEnd) return at_start + wheel_gain(wheel);
  const auto [start, slope, bend] = wheel_torques(wheel);
  return at_start + period() * (0.5 * start + 0.125 * slope + bend / 24.0);
}

WheelMomentum External::wheels(std::span<const double> momentum) const noexcept {
  WheelMomentum all;
  for (std::size_t k = 0; k < plan.wheels.all.size(); ++k) {
    const Vec3& axis = plan.wheels.all[k].axis;
    const auto [start, slope, bend] = wheel_torques(k);
    all.h[0] = freeflex::add_scaled(all.h[0], momentum[k], axis);
    all.h[1] = freeflex::add_scaled(all.h[1], period() * start, axis);
    all.h[2] = freeflex::add_scaled(all.h[2], 0.5 * period() * slope, axis);
    all.h[3] = freeflex::add_scaled(all.h[3], period() * bend / 3.0, axis);
  }
  return all;
}

namespace {

/// Q_l -= theta_l . (tau a + w x h a) of each wheel, what it does to its body   (X167).
void add_wheels(const External& external, Instant instant, const Vec3& w, std::span<const double> momentum,
                Array& Q) noexcept {
  const Plan& plan = external.plan;
  for (std::size_t k = 0; k < plan.wheels.all.size(); ++k) {
    const PlanWheel& wheel = plan.wheels.all[k];
    const double h = momentum[k] + (instant == Instant::kEnd ? external.wheel_gain(k) : 0.0);
    const Vec3 torque =
        add_scaled(scale(-external.wheel_torque(k, instant), wheel.axis), -h, cross(w, wheel.axis));
    combine_rows(turn_rows(plan, wheel.turning), torque, true, index(plan.num_padded), Q.data());
  }
}

}  // namespace

void External::generalized(Instant instant, const Frame& frame, const Mat3& R_WB,
                           std::span<const double> momentum, Array& Q) const noexcept {
  bool has_any = project(plan, commands, R_WB, 1.0, false, Q.data());
  for (const PlanHistory& history : plan.histories)
    if (const double now = amplitude(history, instant); now != 0.0)
      has_any |= project(plan, history.pattern, R_WB, now, has_any, Q.data());
  if (!has_any) std::fill(Q.begin(), Q.end(), 0.0);
  if (plan.wheels.all.empty()) {
    if (has_field(plan)) add_field(plan, R_WB, frame.H_W, frame.p_WB, Q.data());
    return;
  }
  const Vec3 h_B = wheels(momentum).at(instant == Instant::kEnd ? 1.0 : 0.0);
  const Vec3 H_W = sub(frame.H_W, multiply(R_WB, h_B));
  if (has_field(plan)) add_field(plan, R_WB, H_W, frame.p_WB, Q.data());
  add_wheels(*this, instant, multiply(plan.inverse_inertia, multiply_transposed(R_WB, H_W)), momentum, Q);
}

void External::on_points(Instant instant, const Mat3& R_WB, std::span<Vec3> forces) const noexcept {
  std::fill(forces.begin(), forces.end(), Vec3{});
  add_point_forces(plan, commands, R_WB, 1.0, forces);
  for (const PlanHistory& history : plan.histories)
    add_point_forces(plan, history.pattern, R_WB, amplitude(history, instant), forces);
}

}  // namespace freeflex
