#include "core/step/step.hpp"

#ifdef __FAST_MATH__
#error "-ffast-math changes the bits: recordings would not replay"
#endif

#include <algorithm>
#include <utility>

#include "core/step/frame.hpp"
#include "core/step/history.hpp"
#include "core/step/kernels.hpp"
#include "core/step/readout.hpp"
#include "core/step/slots.hpp"

namespace freeflex {
namespace {

std::size_t index(std::int32_t i) noexcept { return static_cast<std::size_t>(i); }

/// Slots after expiries and commands, and their pattern, in the workspace.
std::int32_t change_slots(const Plan& plan, const State& state, const Inputs& inputs, Workspace& workspace,
                          StepReport& report) noexcept {
  std::copy_n(state.slots.begin(), state.num_slots, workspace.next_slots.begin());
  std::int32_t num_slots = expire_slots(state.tick, workspace.next_slots, state.num_slots, report);
  for (const ForceCommand& command : inputs.commands)
    num_slots = apply_command(state.tick, command, workspace.next_slots, num_slots);
  clear(workspace.sums);
  for (std::int32_t i = 0; i < num_slots; ++i) {
    const ForceCommand& command = workspace.next_slots[index(i)].command;
    add_loads(command.axes, std::span(command.points).first(index(command.num_points)),
              std::span(command.wrenches).first(index(command.num_wrenches)), workspace.sums);
  }
  set_pattern(plan, workspace.group_rows, workspace.sums, workspace.next_pattern);
  return num_slots;
}

/// Everything that loads the body during one step: commands, constant over it, and built-in histories.
struct External {
  const Plan& plan;
  const LoadPattern& commands;
  std::int64_t tick;  // since the epoch began

  /// True when a history jumps at the start of the step.
  bool jumps() const noexcept {
    for (const PlanHistory& history : plan.histories)
      if (amplitude_left(history, plan.period, tick) != amplitude_right(history, plan.period, tick))
        return true;
    return false;
  }

  StepLoads rigid() const noexcept {
    StepLoads loads;
    add_pattern(commands, 1.0, loads.start);
    if (plan.histories.empty()) return loads;
    auto& [middle, end] = loads.later.emplace(StepLoads::Later{loads.start, loads.start});
    for (const PlanHistory& history : plan.histories) {
      add_pattern(history.pattern, amplitude_right(history, plan.period, tick), loads.start);
      add_pattern(history.pattern, amplitude_middle(history, plan.period, tick), middle);
      add_pattern(history.pattern, amplitude_left(history, plan.period, tick + 1), end);
    }
    return loads;
  }

  /// Generalized forces at the right limit of the step's start, or at the left limit of its end.
  void generalized(bool at_end, const Mat3& R_WB, Array& Q) const noexcept {
    bool has_any = project(plan, commands, R_WB, 1.0, false, Q.data());
    for (const PlanHistory& history : plan.histories) {
      const double amplitude = at_end ? amplitude_left(history, plan.period, tick + 1)
                                      : amplitude_right(history, plan.period, tick);
      has_any |= project(plan, history.pattern, R_WB, amplitude, has_any, Q.data());
    }
    if (!has_any) std::fill(Q.begin(), Q.end(), 0.0);
  }
};

Frame frame_of(const State& state) noexcept {
  return {state.p_WB, state.p_WB_low, state.v_WB, state.v_WB_low,
          state.q_WB, state.q_WB_low, state.H_W,  state.H_W_low};
}

bool is_finite(const Frame& frame) noexcept {
  double sum = 0.0;
  for (const Vec3* v : {&frame.p_WB, &frame.v_WB, &frame.H_W})
    for (const double x : *v) sum += x - x;
  for (const double x : frame.q_WB) sum += x - x;
  return sum == 0.0;
}

/// Motions this small are nothing, and would end in denormal numbers, which are slow: they are set to zero
/// [m], [m/s]. Their squares are still normal numbers.
constexpr double kNothing = 1e-140;
constexpr std::int64_t kFlushTicks = 256;

void flush(Array& value, Array& low) noexcept {
  for (std::size_t l = 0; l < value.size(); ++l) {
    const bool is_nothing = -kNothing < value[l] && value[l] < kNothing;
    value[l] = is_nothing ? 0.0 : value[l];
    low[l] = is_nothing ? 0.0 : low[l];
  }
}

/// Moves the next state in; nothing allocates.
void commit(const Frame& frame, const RigidLoad& load, const Mat3& R_WB, State& state,
            Workspace& workspace) noexcept {
  state.p_WB = frame.p_WB;
  state.p_WB_low = frame.p_WB_low;
  state.v_WB = frame.v_WB;
  state.v_WB_low = frame.v_WB_low;
  state.q_WB = frame.q_WB;
  state.q_WB_low = frame.q_WB_low;
  state.H_W = frame.H_W;
  state.H_W_low = frame.H_W_low;
  state.q.swap(workspace.next_q);
  state.q_low.swap(workspace.next_q_low);
  state.q_dot.swap(workspace.next_q_dot);
  state.q_dot_low.swap(workspace.next_q_dot_low);
  state.Q.swap(workspace.Q_left);
  state.force_W = resultant_W(load, R_WB);
  state.moment_B = moment_B(load, R_WB);
  ++state.tick;
  if (state.tick % kFlushTicks == 0) {
    flush(state.q, state.q_low);
    flush(state.q_dot, state.q_dot_low);
  }
}

}  // namespace

void step(const Plan& plan, State& state, const Inputs& inputs, Workspace& workspace,
          StepReport& report) noexcept {
  report.status = StepStatus::kOk;
  report.num_expiries = 0;
  // slots
  const bool is_changed = state.slots_changed || !inputs.commands.empty() || has_expiry(state);
  std::int32_t num_slots = state.num_slots;
  if (is_changed) num_slots = change_slots(plan, state, inputs, workspace, report);
  // loads at the start: those of the end of the last step unless something jumped
  const External external{plan, is_changed ? workspace.next_pattern : state.commands_pattern,
                          state.tick - state.epoch_start_tick};
  const Mat3 R_start = rotation_matrix(state.q_WB);
  const bool is_fresh = is_changed || state.tick == state.epoch_start_tick || external.jumps();
  if (is_fresh) external.generalized(false, R_start, workspace.Q_right);
  const StepLoads loads = external.rigid();
  // frame, then loads at the end, then modes
  const Frame frame = advance_frame(plan, frame_of(state), R_start, loads);
  const Mat3 R_end = rotation_matrix(frame.q_WB);
  external.generalized(true, R_end, workspace.Q_left);
  const std::size_t n = index(plan.num_padded);
  const bool modes_are_finite = advance_modes(
      plan.propagator, n, {state.q.data(), state.q_low.data(), state.q_dot.data(), state.q_dot_low.data()},
      is_fresh ? workspace.Q_right.data() : state.Q.data(), workspace.Q_left.data(),
      {workspace.next_q.data(), workspace.next_q_low.data(), workspace.next_q_dot.data(),
       workspace.next_q_dot_low.data()});
  if (!modes_are_finite || !is_finite(frame)) {
    report = {.status = StepStatus::kNotFinite};
    return;
  }
  commit(frame, loads.end(), R_end, state, workspace);
  if (is_changed) {
    state.slots.swap(workspace.next_slots);
    std::swap(state.commands_pattern, workspace.next_pattern);
    state.num_slots = num_slots;
    state.slots_changed = false;
  }
}

}  // namespace freeflex
