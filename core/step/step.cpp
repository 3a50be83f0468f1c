#include "core/step/step.hpp"

#ifdef __FAST_MATH__
#error "-ffast-math changes the bits: recordings would not replay"
#endif

#include <algorithm>
#include <utility>

#include "core/step/coupled.hpp"
#include "core/step/external.hpp"
#include "core/step/field.hpp"
#include "core/step/kernels.hpp"
#include "core/step/mixing.hpp"
#include "core/step/readout.hpp"
#include "core/step/scope.hpp"
#include "core/step/slots.hpp"
#include "core/step/vector.hpp"

namespace freeflex {
namespace {

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
    add_loads(plan,
              {command.axes, std::span(command.points).first(index(command.num_points)),
               std::span(command.wrenches).first(index(command.num_wrenches)),
               std::span(command.torques).first(index(command.num_torques)),
               std::span(command.wheels).first(index(command.num_wheels))},
              workspace.sums);
  }
  set_pattern(plan, workspace.group_rows, workspace.sums, workspace.next_pattern);
  set_arms(plan, workspace.sums, workspace.next_arms);
  workspace.next_size = size_of_forces(workspace.sums);
  return num_slots;
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

/// A step's result before it is known to be finite; elastic coordinates and loads stand in the workspace.
struct Result {
  Frame frame;
  Vec3 force_W;        // [N] at the end
  Vec3 moment_B;       // [N m] at the end
  DependentLoad kick;  // of feedback over the second half, when modes are split
  bool is_finite;
};

/// Every mode one period on, from the state into the workspace, under the workspace's loads.
bool advance_elastic(const Plan& plan, const MotionState& state, const Array& Q_start, Workspace& workspace,
                     DependentLoad& last_kick) noexcept {
  const ModalState from{state.q.data(), state.q_low.data(), state.q_dot.data(), state.q_dot_low.data()};
  const ModalResult to{workspace.next_q.data(), workspace.next_q_low.data(), workspace.next_q_dot.data(),
                       workspace.next_q_dot_low.data()};
  return advance_linear(plan, from, Q_start.data(), workspace.Q_left.data(), workspace.kicked,
                        workspace.scratch, to, last_kick);
}

/// Resultant and moment at the end, for accelerations.
void set_read_out(const Plan& plan, const Mat3& R_WB, const RigidLoad& load, const WheelMomentum& wheels,
                  Result& result) noexcept {
  result.force_W = resultant_W(load, R_WB);
  result.moment_B = moment_B(load, R_WB);
  // what motors do to the body, h' at the end   (X167)
  if (!plan.wheels.all.empty())
    result.moment_B = add_scaled(result.moment_B, -1.0 / plan.period,
                                 add_scaled(add_scaled(wheels.h[1], 2.0, wheels.h[2]), 3.0, wheels.h[3]));
  if (plan.attractor_mu == 0.0) return;
  const Vec3 rho = multiply_transposed(R_WB, sub(result.frame.p_WB, plan.attractor_W));
  result.moment_B = add(result.moment_B, gradient_torque(plan, rho));
}

/// Frame, then loads at the end, then modes.
Result advance_once(const External& external, const MotionState& state, const Array& Q_start,
                    const Mat3& R_start, const StepLoads& loads, const double* q_of_followers,
                    Workspace& workspace) noexcept {
  const Plan& plan = external.plan;
  Result result;
  result.frame = advance_frame(plan, state, R_start, loads);
  const Mat3 R_WB = rotation_matrix(result.frame.q_WB);
  set_read_out(plan, R_WB, loads.end(), loads.wheels, result);
  external.generalized(Instant::kEnd, result.frame, R_WB, state.wheel_momentum, workspace.Q_left);
  if (q_of_followers != nullptr) follow(plan, q_of_followers, external.tick, true, workspace.Q_left.data());
  result.is_finite = advance_elastic(plan, state, Q_start, workspace, result.kick) && is_finite(result.frame);
  return result;
}

/// The step when forces on the body follow the elastic motion: once with what is known at the start, then
/// with what this first end gives   (THEORY X73, X74).
Result advance_dependent(const External& external, const MotionState& state, const Mat3& R_start,
                         Workspace& workspace) noexcept {
  const Plan& plan = external.plan;
  const double *q = state.q.data(), *q_dot = state.q_dot.data();
  const bool is_split = plan.mixing.path == PlanMixing::Path::kSplit;
  StepLoads fixed = external.rigid();
  fixed.wheels = external.wheels(state.wheel_momentum);
  if (!fixed.later) fixed.later.emplace(StepLoads::Later{fixed.start, fixed.start});
  const auto with = [&](const DependentStep& followers, const DependentStep& feedback) {
    StepLoads loads = fixed;
    add(followers, loads);
    add(feedback, loads);
    return loads;
  };
  const double* const Q_start = workspace.Q_right.data();
  const DependentLoad turned = follow(plan, q, external.tick, false, workspace.Q_right.data());
  DependentLoad kicked;
  if (is_split) kicked = kick(plan, q, q_dot, workspace.scratch, workspace.kicked.data());
  const StepLoads guess =
      with({turned, turned},
           is_split ? DependentStep{kicked, kicked} : feed_back_over_step(plan, q, q_dot, Q_start, Q_start));
  const Result first = advance_once(external, state, workspace.Q_right, R_start, guess, q, workspace);
  if (!first.is_finite) return first;

  const DependentStep feedback = is_split
                                     ? DependentStep{kicked, first.kick}
                                     : feed_back_over_step(plan, q, q_dot, Q_start, workspace.Q_left.data());
  std::copy(workspace.next_q.begin(), workspace.next_q.end(), workspace.predicted_q.begin());
  const DependentLoad end =
      follow(plan, workspace.predicted_q.data(), external.tick, true, workspace.Q_left.data());
  Result result = advance_once(external, state, workspace.Q_right, R_start, with({turned, end}, feedback),
                               workspace.predicted_q.data(), workspace);
  // the load to read out is that of the instant
  RigidLoad load = fixed.end();
  add(end, load);
  add(feed_back(plan, workspace.next_q.data(), workspace.next_q_dot.data(), workspace.Q_left.data()), load);
  set_read_out(plan, rotation_matrix(result.frame.q_WB), load, fixed.wheels, result);
  return result;
}

/// Momenta of wheels at the end of a step or part of one, in the workspace   (X167).
void turn_wheels(const External& external, const MotionState& from, Workspace& workspace) noexcept {
  std::copy(from.wheel_momentum.begin(), from.wheel_momentum.end(), workspace.next_wheel.begin());
  std::copy(from.wheel_momentum_low.begin(), from.wheel_momentum_low.end(), workspace.next_wheel_low.begin());
  for (std::size_t k = 0; k < workspace.next_wheel.size(); ++k)
    add_compensated(workspace.next_wheel[k], workspace.next_wheel_low[k], external.wheel_gain(k));
}

/// The rungs below the coupled ones: the body first, the modes beside it.
Result advance_separated(const External& external, const MotionState& state, bool is_changed,
                         Workspace& workspace) noexcept {
  const Plan& plan = external.plan;
  turn_wheels(external, state, workspace);
  const Mat3 R_start = rotation_matrix(state.q_WB);
  const bool has_dependent = has_dependent_loads(plan);
  // loads at the start are those of the end of the last step unless something jumped
  const bool is_fresh = is_changed || state.tick == state.epoch_start_tick || external.jumps() ||
                        has_dependent || plan.mixing.path != PlanMixing::Path::kNone;
  if (is_fresh)
    external.generalized(Instant::kStart, state, R_start, state.wheel_momentum, workspace.Q_right);
  if (has_dependent) return advance_dependent(external, state, R_start, workspace);
  StepLoads loads = external.rigid();
  if (!plan.wheels.all.empty()) loads.wheels = external.wheels(state.wheel_momentum);
  return advance_once(external, state, is_fresh ? workspace.Q_right : state.Q, R_start, loads, nullptr,
                      workspace);
}

/// The coupled rungs, in as many parts as the plan divides the step into   (X93, X100).
Result advance_coupled(const External& external, const MotionState& state, bool is_changed,
                       Workspace& workspace) noexcept {
  const bool is_fresh = is_changed || external.jumps();
  const std::int32_t last = external.plan.coupled.num_parts - 1;
  const MotionState* from = &state;
  Result result;
  for (std::int32_t part = 0;; ++part) {
    const External at{external.plan, external.commands, external.tick, part};
    result.is_finite = advance_coupled_rung(at, *from, is_fresh && part == 0, workspace, result.frame,
                                            result.force_W, result.moment_B) &&
                       is_finite(result.frame);
    turn_wheels(at, *from, workspace);
    if (part == last || !result.is_finite) return result;
    MotionState& next = workspace.part;
    static_cast<Frame&>(next) = result.frame;
    next.force_W = result.force_W;
    next.q.swap(workspace.next_q);
    std::swap(next.coupled, workspace.coupled.next);
    next.wheel_momentum.swap(workspace.next_wheel);
    next.wheel_momentum_low.swap(workspace.next_wheel_low);
    from = &next;
  }
}

/// Moves the next state in; nothing allocates.
void commit(const External& external, const Result& result, State& state, Workspace& workspace) noexcept {
  const Plan& plan = external.plan;
  state.wheel_momentum.swap(workspace.next_wheel);
  state.wheel_momentum_low.swap(workspace.next_wheel_low);
  static_cast<Frame&>(state) = result.frame;
  state.q.swap(workspace.next_q);
  state.q_low.swap(workspace.next_q_low);
  state.q_dot.swap(workspace.next_q_dot);
  state.q_dot_low.swap(workspace.next_q_dot_low);
  state.Q.swap(workspace.Q_left);
  if (plan.mixing.path != PlanMixing::Path::kNone)
    add_mixing_forces(plan, state.q.data(), state.q_dot.data(), workspace.scratch, state.Q.data());
  state.force_W = result.force_W;
  state.moment_B = result.moment_B;
  if (is_coupled(plan)) std::swap(state.coupled, workspace.coupled.next);
  ++state.tick;
  if (state.tick % kFlushTicks == 0) {
    flush(state.q, state.q_low);
    flush(state.q_dot, state.q_dot_low);
    if (is_coupled(plan)) flush(state.coupled.momentum, state.q_dot_low);
  }
}

/// One tick in the plan that the state is in.
void step_in(const Plan& plan, State& state, const Inputs& inputs, Workspace& workspace,
             StepReport& report) noexcept {
  report.status = StepStatus::kOk;
  report.num_expiries = 0;
  // slots
  const bool is_changed = state.slots_changed || !inputs.commands.empty() || has_expiry(state);
  std::int32_t num_slots = state.num_slots;
  if (is_changed) num_slots = change_slots(plan, state, inputs, workspace, report);
  const External external{plan, is_changed ? workspace.next_pattern : state.commands_pattern,
                          state.tick - state.epoch_start_tick};
  const Result result = is_coupled(plan) ? advance_coupled(external, state, is_changed, workspace)
                                         : advance_separated(external, state, is_changed, workspace);
  if (!result.is_finite) {
    report = {.status = StepStatus::kNotFinite};
    return;
  }
  commit(external, result, state, workspace);
  if (is_changed) {
    state.slots.swap(workspace.next_slots);
    std::swap(state.commands_pattern, workspace.next_pattern);
    state.commands_arms.swap(workspace.next_arms);
    state.commands_size = workspace.next_size;
    state.num_slots = num_slots;
    state.slots_changed = false;
  }
}

}  // namespace

void step(const Plan& plan, State& state, const Inputs& inputs, Workspace& workspace,
          StepReport& report) noexcept {
  if (plan.wide.empty()) return step_in(plan, state, inputs, workspace, report);
  // a command that needs a part left out brings it back at its tick   (X125)
  Need need = Need::kNone;
  if (!state.is_wide)
    for (const ForceCommand& command : inputs.commands)
      if (need == Need::kNone) need = find_need(plan, command);
  if (need != Need::kNone) widen(plan, need, state);
  fit(plan, state, workspace);
  step_in(active_plan(plan, state), state, inputs, workspace, report);
  if (report.status != StepStatus::kOk && need != Need::kNone) narrow(plan, state);
}

}  // namespace freeflex
