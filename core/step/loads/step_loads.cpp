#include "core/step/loads/step_loads.hpp"

#include <algorithm>

#include "core/step/linear/kernels.hpp"
#include "core/step/loads/field.hpp"
#include "core/step/loads/history.hpp"
#include "core/step/loads/loads.hpp"

namespace freeflex {

void add_resultant(const StepPlan& plan, const LoadPattern& pattern, double amplitude,
                   RigidLoad& load) noexcept {
  add_pattern(pattern, amplitude, load);
  if (!pattern.has_body || !is_coupled(plan)) return;
  const BodyResultant body = body_resultant(plan, pattern);
  load.force_B = add_scaled(load.force_B, amplitude, body.force);
  load.torque_B = add_scaled(load.torque_B, amplitude, body.torque);
}

double StepLoads::amplitude(const PlanHistory& history, StageTime stage_time) const noexcept {
  if (over != nullptr)
    return over->amplitudes[static_cast<std::size_t>(&history - plan.histories.data())]
                           [static_cast<std::size_t>(stage_time)];
  if (history.kind == PlanHistory::Kind::kPulse) return amplitude_right(history, plan.period, tick);
  // the number of substeps is a power of two, so the period is divided without rounding error
  const std::int32_t num_substeps = plan.coupled.num_substeps;
  const double period = plan.period / num_substeps;
  const std::int64_t at = tick * num_substeps + substep;
  switch (stage_time) {
    case StageTime::kStart:
      return amplitude_right(history, period, at);
    case StageTime::kMiddle:
      return amplitude_middle(history, period, at);
    case StageTime::kEnd:
      break;
  }
  return amplitude_left(history, period, at + 1);
}

bool StepLoads::jumps() const noexcept {
  if (over != nullptr) return over->jumps;
  for (const PlanHistory& history : plan.histories)
    if (amplitude_left(history, plan.period, tick) != amplitude_right(history, plan.period, tick))
      return true;
  return false;
}

bool StepLoads::bends() const noexcept {
  return std::any_of(plan.histories.begin(), plan.histories.end(),
                     [&](const PlanHistory& history) { return bends_at(history, plan.period, tick); });
}

RigidLoads StepLoads::rigid() const noexcept {
  RigidLoads loads;
  add_resultant(plan, commands(StageTime::kStart), 1.0, loads.start);
  if (plan.histories.empty() && over == nullptr) return loads;
  // Histories of amplitude zero are skipped. If all loads are constant over the step, the loads at its middle
  // and end are not stored.
  bool varies = over != nullptr;
  for (const PlanHistory& history : plan.histories) {
    const double start = amplitude(history, StageTime::kStart);
    varies |= amplitude(history, StageTime::kMiddle) != start || amplitude(history, StageTime::kEnd) != start;
  }
  if (varies) loads.later.emplace(RigidLoads::Later{loads.start, loads.start});
  if (over != nullptr) {
    loads.later.emplace();
    add_resultant(plan, commands(StageTime::kMiddle), 1.0, loads.later->middle);
    add_resultant(plan, commands(StageTime::kEnd), 1.0, loads.later->end);
  }
  const auto add = [this](const PlanHistory& history, double amplitude, RigidLoad& load) {
    if (amplitude != 0.0) add_resultant(plan, history.pattern, amplitude, load);
  };
  for (const PlanHistory& history : plan.histories) {
    add(history, amplitude(history, StageTime::kStart), loads.start);
    if (!varies) continue;
    add(history, amplitude(history, StageTime::kMiddle), loads.later->middle);
    add(history, amplitude(history, StageTime::kEnd), loads.later->end);
  }
  return loads;
}

double StepLoads::wheel_torque(std::size_t wheel, StageTime stage_time) const noexcept {
  double torque = commands(stage_time).wheel_torques[wheel];
  for (const PlanHistory& history : plan.histories)
    torque += amplitude(history, stage_time) * history.pattern.wheel_torques[wheel];
  return torque;
}

StepLoads::TorqueOverStep StepLoads::wheel_torques(std::size_t wheel) const noexcept {
  const double start = wheel_torque(wheel, StageTime::kStart),
               middle = wheel_torque(wheel, StageTime::kMiddle), end = wheel_torque(wheel, StageTime::kEnd);
  const double bend = 2.0 * ((start + end) - 2.0 * middle);
  return {start, (end - start) - bend, bend};
}

// integrates the parabola of the torque over the substep   (THEORY 16.21)
double StepLoads::wheel_gain(std::size_t wheel) const noexcept {
  const auto [start, slope, bend] = wheel_torques(wheel);
  const double end = start + (slope + bend);
  return period() * (0.5 * (start + end) - bend / 6.0);
}

double StepLoads::wheel_momentum(std::size_t wheel, double at_start, StageTime stage_time) const noexcept {
  if (stage_time == StageTime::kStart) return at_start;
  if (stage_time == StageTime::kEnd) return at_start + wheel_gain(wheel);
  const auto [start, slope, bend] = wheel_torques(wheel);
  return at_start + period() * (0.5 * start + 0.125 * slope + bend / 24.0);
}

// sum_w h_w a_w as a polynomial in s, with h_w = h_w^0 + h (start s + slope s^2 / 2 + bend s^3 / 3), where h
// is the length of the substep   (THEORY 16.21, 16.22)
WheelMomentum StepLoads::wheels(std::span<const double> momentum) const noexcept {
  WheelMomentum all;
  for (std::size_t k = 0; k < plan.wheels.size(); ++k) {
    const Vec3& axis = plan.wheels[k].axis;
    const auto [start, slope, bend] = wheel_torques(k);
    all.h[0] = freeflex::add_scaled(all.h[0], momentum[k], axis);
    all.h[1] = freeflex::add_scaled(all.h[1], period() * start, axis);
    all.h[2] = freeflex::add_scaled(all.h[2], 0.5 * period() * slope, axis);
    all.h[3] = freeflex::add_scaled(all.h[3], period() * bend / 3.0, axis);
  }
  return all;
}

namespace {

/// Adds the loads of the wheels on the modes: Q_l -= theta_l . (tau_w a_w + w x h_w a_w)   (THEORY 16.23).
void add_wheels(const StepLoads& step_loads, StageTime stage_time, const Vec3& w,
                std::span<const double> momentum, Array& Q) noexcept {
  const StepPlan& plan = step_loads.plan;
  for (std::size_t k = 0; k < plan.wheels.size(); ++k) {
    const PlanWheel& wheel = plan.wheels[k];
    const double h = momentum[k] + (stage_time == StageTime::kEnd ? step_loads.wheel_gain(k) : 0.0);
    const Vec3 torque =
        add_scaled(scale(-step_loads.wheel_torque(k, stage_time), wheel.axis), -h, cross(w, wheel.axis));
    combine_rows(rotation_rows(plan, wheel.attitude_index), torque, true, index(plan.num_padded), Q.data());
  }
}

}  // namespace

void StepLoads::generalized(StageTime stage_time, const Frame& frame, const Mat3& R_WB,
                            std::span<const double> momentum, Array& Q) const noexcept {
  bool has_any = project(plan, commands(stage_time), R_WB, 1.0, false, Q.data());
  for (const PlanHistory& history : plan.histories)
    if (const double now = amplitude(history, stage_time); now != 0.0)
      has_any |= project(plan, history.pattern, R_WB, now, has_any, Q.data());
  if (!has_any) std::fill(Q.begin(), Q.end(), 0.0);
  if (plan.wheels.empty()) {
    if (has_field(plan)) add_field(plan, R_WB, frame.H_W, frame.p_WB, Q.data());
    return;
  }
  const Vec3 h_B = wheels(momentum).at(stage_time == StageTime::kEnd ? 1.0 : 0.0);
  const Vec3 H_W = sub(frame.H_W, multiply(R_WB, h_B));
  if (has_field(plan)) add_field(plan, R_WB, H_W, frame.p_WB, Q.data());
  add_wheels(*this, stage_time, multiply(plan.inverse_inertia, multiply_transposed(R_WB, H_W)), momentum, Q);
}

bool StepLoads::turn_groups() const noexcept {
  const auto turns_group = [](const LoadPattern& pattern) {
    const auto is_any = [](const std::vector<Vec3>& torques) {
      return std::any_of(torques.begin(), torques.end(), [](const Vec3& each) { return !is_zero(each); });
    };
    return is_any(pattern.sums.group_torque_W) || is_any(pattern.sums.group_torque_B);
  };
  const auto any_turns_group = [&] {
    if (over == nullptr) return turns_group(slots);
    return std::any_of(over->commands.begin(), over->commands.end(), turns_group);
  };
  return any_turns_group() ||
         std::any_of(plan.histories.begin(), plan.histories.end(),
                     [&](const PlanHistory& history) { return turns_group(history.pattern); });
}

void StepLoads::on_points(StageTime stage_time, const Mat3& R_WB, std::span<const Vec3> x,
                          std::span<Vec3> forces) const noexcept {
  std::fill(forces.begin(), forces.end(), Vec3{});
  add_point_forces(plan, commands(stage_time), R_WB, 1.0, x, forces);
  for (const PlanHistory& history : plan.histories)
    add_point_forces(plan, history.pattern, R_WB, amplitude(history, stage_time), x, forces);
}

}  // namespace freeflex
