#include "core/step/external.hpp"

#include <algorithm>

#include "core/step/field.hpp"
#include "core/step/history.hpp"
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

void External::generalized(Instant instant, const Frame& frame, const Mat3& R_WB, Array& Q) const noexcept {
  bool has_any = project(plan, commands, R_WB, 1.0, false, Q.data());
  for (const PlanHistory& history : plan.histories)
    if (const double now = amplitude(history, instant); now != 0.0)
      has_any |= project(plan, history.pattern, R_WB, now, has_any, Q.data());
  if (!has_any) std::fill(Q.begin(), Q.end(), 0.0);
  if (has_field(plan)) add_field(plan, R_WB, frame.H_W, frame.p_WB, Q.data());
}

void External::on_points(Instant instant, const Mat3& R_WB, std::span<Vec3> forces) const noexcept {
  std::fill(forces.begin(), forces.end(), Vec3{});
  add_point_forces(plan, commands, R_WB, 1.0, forces);
  for (const PlanHistory& history : plan.histories)
    add_point_forces(plan, history.pattern, R_WB, amplitude(history, instant), forces);
}

}  // namespace freeflex
