#include "core/step/external.hpp"

#include <algorithm>

#include "core/step/field.hpp"
#include "core/step/history.hpp"
#include "core/step/loads.hpp"

namespace freeflex {

double External::amplitude(const PlanHistory& history, Moment moment) const noexcept {
  switch (moment) {
    case Moment::kStart:
      return amplitude_right(history, plan.period, tick);
    case Moment::kMiddle:
      return amplitude_middle(history, plan.period, tick);
    case Moment::kEnd:
      break;
  }
  return amplitude_left(history, plan.period, tick + 1);
}

bool External::jumps() const noexcept {
  for (const PlanHistory& history : plan.histories)
    if (amplitude_left(history, plan.period, tick) != amplitude_right(history, plan.period, tick)) return true;
  return false;
}

StepLoads External::rigid() const noexcept {
  StepLoads loads;
  add_pattern(commands, 1.0, loads.start);
  if (plan.histories.empty()) return loads;
  auto& [middle, end] = loads.later.emplace(StepLoads::Later{loads.start, loads.start});
  for (const PlanHistory& history : plan.histories) {
    add_pattern(history.pattern, amplitude(history, Moment::kStart), loads.start);
    add_pattern(history.pattern, amplitude(history, Moment::kMiddle), middle);
    add_pattern(history.pattern, amplitude(history, Moment::kEnd), end);
  }
  return loads;
}

void External::generalized(Moment moment, const Frame& frame, const Mat3& R_WB, Array& Q) const noexcept {
  bool has_any = project(plan, commands, R_WB, 1.0, false, Q.data());
  for (const PlanHistory& history : plan.histories)
    has_any |= project(plan, history.pattern, R_WB, amplitude(history, moment), has_any, Q.data());
  if (!has_any) std::fill(Q.begin(), Q.end(), 0.0);
  if (has_field(plan)) add_field(plan, R_WB, frame.H_W, frame.p_WB, Q.data());
}

void External::on_points(Moment moment, const Mat3& R_WB, std::span<Vec3> forces) const noexcept {
  std::fill(forces.begin(), forces.end(), Vec3{});
  add_point_forces(plan, commands, R_WB, 1.0, forces);
  for (const PlanHistory& history : plan.histories)
    add_point_forces(plan, history.pattern, R_WB, amplitude(history, moment), forces);
}

}  // namespace freeflex
