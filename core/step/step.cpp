#include "core/step/step.hpp"

#ifdef __FAST_MATH__
#error "-ffast-math changes the bits, so recordings would not replay"
#endif

#include <algorithm>
#include <utility>

#include "core/step/coupled/coupled.hpp"
#include "core/step/linear/kernels.hpp"
#include "core/step/linear/modal_coupling.hpp"
#include "core/step/loads/field.hpp"
#include "core/step/loads/slots.hpp"
#include "core/step/loads/step_loads.hpp"
#include "core/step/massless/massless_motion.hpp"
#include "core/step/points/points.hpp"
#include "core/step/points/reading.hpp"
#include "core/step/readout.hpp"
#include "core/step/scope.hpp"
#include "core/step/vector.hpp"

namespace freeflex {
namespace {

/// Removes expired slots and applies the commands. Writes the resulting slots and the pattern of their loads
/// to the workspace. Returns the number of active slots.
std::int32_t change_slots(const StepPlan& plan, const State& state, const Inputs& inputs,
                          Workspace& workspace, StepReport& report) noexcept {
  std::copy_n(state.slots.begin(), state.num_slots, workspace.next_slots.begin());
  std::int32_t num_slots = expire_slots(state.tick, workspace.next_slots, state.num_slots, report);
  for (const ForceCommand& command : inputs.commands)
    num_slots = apply_command(state.tick, command, workspace.next_slots, num_slots);
  clear(workspace.sums);
  add_slots(plan, std::span(workspace.next_slots).first(index(num_slots)), workspace.sums);
  set_pattern(plan, workspace.group_rows, workspace.sums, workspace.next_pattern);
  return num_slots;
}

bool is_finite(const Frame& frame) noexcept {
  double sum = 0.0;
  for (const Vec3* v : {&frame.p_WB, &frame.v_WB, &frame.H_W})
    for (const double x : *v) sum += x - x;
  for (const double x : frame.q_WB) sum += x - x;
  return sum == 0.0;
}

/// Coordinates and rates below this size [m], [m/s] are set to zero. Otherwise these values would decay to
/// denormal numbers, and computing with denormal numbers is slow. Values above this size have fourth powers
/// that are normal numbers, so that true geometry does not become slow either.
constexpr double kNegligible = 1e-70;
constexpr std::int64_t kFlushTicks = 256;

void flush(Array& value, Array& low) noexcept {
  for (std::size_t l = 0; l < value.size(); ++l) {
    const bool is_negligible = -kNegligible < value[l] && value[l] < kNegligible;
    value[l] = is_negligible ? 0.0 : value[l];
    low[l] = is_negligible ? 0.0 : low[l];
  }
}

/// Holds the result of a step until it is known to be finite. The elastic coordinates and the loads on the
/// modes are not in this struct, but in the workspace.
struct Result {
  Frame frame;
  Vec3 force_W;           // [N] resultant of the loads at the end of the step
  Vec3 moment_B;          // [N m] moment of the loads at the end of the step
  DependentLoad impulse;  // load of feedback on the body over the second half of the step, if the path is
                          // kSplit
  bool is_finite;
};

/// Advances every mode by one period, from the state into the workspace, under the loads of the workspace.
bool advance_elastic(const StepPlan& plan, const MotionState& state, const Array& Q_start,
                     Workspace& workspace, DependentLoad& last_impulse) noexcept {
  const ModalState from{state.q.data(), state.q_low.data(), state.q_dot.data(), state.q_dot_low.data()};
  const ModalResult to{workspace.next_q.data(), workspace.next_q_low.data(), workspace.next_q_dot.data(),
                       workspace.next_q_dot_low.data()};
  return advance_linear(plan, from, Q_start.data(), workspace.Q_left.data(), workspace.q_dot_after_impulse,
                        workspace.scratch, to, last_impulse);
}

/// Sets the resultant and the moment of the loads at the end of the step. Accelerations are computed from
/// them   (THEORY 9.3, 9.4).
void set_read_out(const StepPlan& plan, const Mat3& R_WB, const RigidLoad& load, const WheelMomentum& wheels,
                  Result& result) noexcept {
  result.force_W = resultant_W(load, R_WB);
  result.moment_B = moment_B(load, R_WB);
  // the torque of the motors on the body is -h', where h' = (h_1 + 2 h_2 + 3 h_3) / period is the rate of the
  // momentum of the wheels at the end   (THEORY 16.21)
  if (!plan.wheels.empty())
    result.moment_B = add_scaled(result.moment_B, -1.0 / plan.period,
                                 add_scaled(add_scaled(wheels.h[1], 2.0, wheels.h[2]), 3.0, wheels.h[3]));
  if (plan.attractor_mu == 0.0) return;
  const Vec3 rho = multiply_transposed(R_WB, sub(result.frame.p_WB, plan.attractor_W));
  result.moment_B = add(result.moment_B, gradient_torque(plan, rho));
}

/// Advances the frame, evaluates the loads at the end, and advances the modes.
Result advance_once(const StepLoads& step_loads, const MotionState& state, const Array& Q_start,
                    const Mat3& R_start, const RigidLoads& loads, const double* q_of_followers,
                    Workspace& workspace) noexcept {
  const StepPlan& plan = step_loads.plan;
  Result result;
  result.frame = advance_frame(plan, state, R_start, loads);
  const Mat3 R_WB = rotation_matrix(result.frame.q_WB);
  set_read_out(plan, R_WB, loads.end(), loads.wheels, result);
  step_loads.generalized(StageTime::kEnd, result.frame, R_WB, state.wheel_momentum, workspace.Q_left);
  if (q_of_followers != nullptr) follow(plan, q_of_followers, step_loads.tick, true, workspace.Q_left.data());
  result.is_finite =
      advance_elastic(plan, state, Q_start, workspace, result.impulse) && is_finite(result.frame);
  return result;
}

/// Makes the step in two passes, for plans in which loads on the body depend on the elastic motion. In the
/// first pass these loads keep their values at the start of the step. In the second pass they go linearly
/// from these values to those that follow from the result of the first pass ("Two passes" in THEORY section
/// 8). The load of feedback on the body is given by (THEORY 8.37), or by (THEORY 8.41) if the path is kSplit.
Result advance_dependent(const StepLoads& step_loads, const MotionState& state, const Mat3& R_start,
                         Workspace& workspace) noexcept {
  const StepPlan& plan = step_loads.plan;
  const double *q = state.q.data(), *q_dot = state.q_dot.data();
  const bool is_split = plan.modal_coupling.path == PlanModalCoupling::Path::kSplit;
  RigidLoads fixed = step_loads.rigid();
  fixed.wheels = step_loads.wheels(state.wheel_momentum);
  if (!fixed.later) fixed.later.emplace(RigidLoads::Later{fixed.start, fixed.start});
  const auto with = [&](const DependentStep& followers, const DependentStep& feedback) {
    RigidLoads loads = fixed;
    add(followers, loads);
    add(feedback, loads);
    return loads;
  };
  const double* const Q_start = workspace.Q_right.data();
  const DependentLoad followers_at_start = follow(plan, q, step_loads.tick, false, workspace.Q_right.data());
  DependentLoad impulse;
  if (is_split)
    impulse = apply_half_impulse(plan, q, q_dot, workspace.scratch, workspace.q_dot_after_impulse.data());
  const RigidLoads guess = with(
      {followers_at_start, followers_at_start},
      is_split ? DependentStep{impulse, impulse} : feed_back_over_step(plan, q, q_dot, Q_start, Q_start));
  const Result first = advance_once(step_loads, state, workspace.Q_right, R_start, guess, q, workspace);
  if (!first.is_finite) return first;

  const DependentStep feedback = is_split
                                     ? DependentStep{impulse, first.impulse}
                                     : feed_back_over_step(plan, q, q_dot, Q_start, workspace.Q_left.data());
  std::copy(workspace.next_q.begin(), workspace.next_q.end(), workspace.predicted_q.begin());
  const DependentLoad end =
      follow(plan, workspace.predicted_q.data(), step_loads.tick, true, workspace.Q_left.data());
  Result result =
      advance_once(step_loads, state, workspace.Q_right, R_start, with({followers_at_start, end}, feedback),
                   workspace.predicted_q.data(), workspace);
  // accelerations are computed from the true loads at the end of the step, not from the end values of the
  // loads that the step treats as linear in time
  RigidLoad load = fixed.end();
  add(end, load);
  add(feed_back(plan, workspace.next_q.data(), workspace.next_q_dot.data(), workspace.Q_left.data()), load);
  set_read_out(plan, rotation_matrix(result.frame.q_WB), load, fixed.wheels, result);
  return result;
}

/// Writes the momenta of the wheels at the end of a step or substep to the workspace   (THEORY 16.21).
void advance_wheels(const StepLoads& step_loads, const MotionState& from, Workspace& workspace) noexcept {
  std::copy(from.wheel_momentum.begin(), from.wheel_momentum.end(), workspace.next_wheel.begin());
  std::copy(from.wheel_momentum_low.begin(), from.wheel_momentum_low.end(), workspace.next_wheel_low.begin());
  for (std::size_t k = 0; k < workspace.next_wheel.size(); ++k)
    add_compensated(workspace.next_wheel[k], workspace.next_wheel_low[k], step_loads.wheel_gain(k));
}

/// Makes the step below the coupled rungs. Advances first the body, then the modes.
Result advance_separated(const StepLoads& step_loads, const MotionState& state, bool is_changed,
                         Workspace& workspace) noexcept {
  const StepPlan& plan = step_loads.plan;
  advance_wheels(step_loads, state, workspace);
  const Mat3 R_start = rotation_matrix(state.q_WB);
  const bool has_dependent = has_dependent_loads(plan);
  // unless a load may have jumped, the loads at the start of this step are those at the end of the last step
  const bool is_fresh = is_changed || state.tick == state.epoch_start_tick || step_loads.jumps() ||
                        has_dependent || plan.modal_coupling.path != PlanModalCoupling::Path::kNone;
  if (is_fresh)
    step_loads.generalized(StageTime::kStart, state, R_start, state.wheel_momentum, workspace.Q_right);
  if (has_dependent) return advance_dependent(step_loads, state, R_start, workspace);
  RigidLoads loads = step_loads.rigid();
  if (!plan.wheels.empty()) loads.wheels = step_loads.wheels(state.wheel_momentum);
  return advance_once(step_loads, state, is_fresh ? workspace.Q_right : state.Q, R_start, loads, nullptr,
                      workspace);
}

/// Makes the step on the coupled rungs, in the number of substeps that the plan gives   (THEORY 12.29).
Result advance_coupled(const StepLoads& step_loads, const MotionState& state, bool is_changed,
                       Workspace& workspace) noexcept {
  const bool is_fresh = is_changed || step_loads.jumps();
  const std::int32_t last = step_loads.plan.coupled.num_substeps - 1;
  const MotionState* from = &state;
  Result result;
  for (std::int32_t substep = 0;; ++substep) {
    const StepLoads substep_loads{step_loads.plan, step_loads.slots, step_loads.tick, substep,
                                  step_loads.over};
    result.is_finite = advance_coupled_rung(substep_loads, *from, is_fresh && substep == 0, workspace,
                                            result.frame, result.force_W, result.moment_B) &&
                       is_finite(result.frame);
    advance_wheels(substep_loads, *from, workspace);
    if (substep == last || !result.is_finite) return result;
    MotionState& next = workspace.substep;
    static_cast<Frame&>(next) = result.frame;
    next.force_W = result.force_W;
    next.q.swap(workspace.next_q);
    std::swap(next.coupled, workspace.coupled.next);
    next.wheel_momentum.swap(workspace.next_wheel);
    next.wheel_momentum_low.swap(workspace.next_wheel_low);
    from = &next;
  }
}

/// Swaps the results in the workspace with the state. Allocates nothing.
void commit(const StepLoads& step_loads, const Result& result, State& state, Workspace& workspace) noexcept {
  const StepPlan& plan = step_loads.plan;
  state.wheel_momentum.swap(workspace.next_wheel);
  state.wheel_momentum_low.swap(workspace.next_wheel_low);
  static_cast<Frame&>(state) = result.frame;
  state.q.swap(workspace.next_q);
  state.q_low.swap(workspace.next_q_low);
  state.q_dot.swap(workspace.next_q_dot);
  state.q_dot_low.swap(workspace.next_q_dot_low);
  state.Q.swap(workspace.Q_left);
  if (plan.modal_coupling.path != PlanModalCoupling::Path::kNone)
    add_modal_coupling_forces(plan, state.q.data(), state.q_dot.data(), workspace.scratch, state.Q.data());
  state.force_W = result.force_W;
  state.moment_B = result.moment_B;
  if (is_coupled(plan)) {
    std::swap(state.coupled, workspace.coupled.next);
    const StepLoads last{plan, step_loads.slots, step_loads.tick, plan.coupled.num_substeps - 1,
                         step_loads.over};
    set_massless_motion(last, workspace.coupled, state);
  }
  ++state.tick;
  if (state.tick % kFlushTicks == 0) {
    flush(state.q, state.q_low);
    flush(state.q_dot, state.q_dot_low);
    for (Array* each : {&state.coupled.momentum, &state.coupled.curved_q, &state.coupled.curved_p})
      flush(*each, state.q_dot_low);
  }
}

void commit_slots(std::int32_t num_slots, State& state, Workspace& workspace) noexcept {
  state.slots.swap(workspace.next_slots);
  std::swap(state.commands_pattern, workspace.next_pattern);
  ++state.num_slot_changes;
  state.num_slots = num_slots;
  state.slots_changed = false;
}

/// Makes one tick with the active plan.
void step_in(const StepPlan& plan, State& state, const Inputs& inputs, Workspace& workspace,
             StepReport& report) noexcept {
  report.status = StepStatus::kOk;
  report.num_expiries = 0;
  const bool is_changed = state.slots_changed || !inputs.commands.empty() || has_expiry(state);
  std::int32_t num_slots = state.num_slots;
  if (is_changed) num_slots = change_slots(plan, state, inputs, workspace, report);
  const StepLoads step_loads{plan, is_changed ? workspace.next_pattern : state.commands_pattern,
                             state.tick - state.epoch_start_tick, 0, inputs.over};
  if (integrates_points(plan)) {
    const bool is_fresh = (is_changed && !(step_loads.slots.sums == state.commands_pattern.sums)) ||
                          step_loads.jumps() || step_loads.bends();
    if (!advance_points(step_loads, is_fresh, state, workspace)) {
      report = {.status = StepStatus::kNotFinite};
      return;
    }
    ++state.tick;
    if (is_changed) commit_slots(num_slots, state, workspace);
    return;
  }
  const Result result = is_coupled(plan) ? advance_coupled(step_loads, state, is_changed, workspace)
                                         : advance_separated(step_loads, state, is_changed, workspace);
  if (!result.is_finite) {
    report = {.status = StepStatus::kNotFinite};
    const BallJoints* ball_joints = is_coupled(plan) ? &workspace.coupled.ball_joints : nullptr;
    if (ball_joints != nullptr && ball_joints->is_open) {
      report.status = StepStatus::kOpenJoint;
      report.joint_point = ball_joints->all[index(ball_joints->widest)].point;
    } else if (is_coupled(plan) && workspace.coupled.turned_body >= 0) {
      const PlanTurning& turning = plan.coupled.turning;
      const PlanTurningBody& body = turning.bodies[index(workspace.coupled.turned_body)];
      report.status = StepStatus::kTurnedTooFar;
      report.joint_point = body.count > 0 ? turning.points[index(body.first)] : body.first;
    } else if (is_coupled(plan) && workspace.coupled.has_no_frame) {
      report.status = StepStatus::kNoFrame;
    } else if (is_coupled(plan) && workspace.coupled.joints.unsolved >= 0) {
      report.status = StepStatus::kNoEquilibrium;
      report.joint_point = unsolved_point(plan.coupled.links.joints, workspace.coupled.joints);
    }
    return;
  }
  commit(step_loads, result, state, workspace);
  if (is_changed) commit_slots(num_slots, state, workspace);
}

}  // namespace

void step(const StepPlan& plan, State& state, const Inputs& inputs, Workspace& workspace,
          StepReport& report) noexcept {
  step_unread(plan, state, inputs, workspace, report);
  read_modes(plan, state, workspace);
}

void step_unread(const StepPlan& plan, State& state, const Inputs& inputs, Workspace& workspace,
                 StepReport& report) noexcept {
  if (plan.fallback.empty()) return step_in(plan, state, inputs, workspace, report);
  // if a command of this tick needs an omitted feature, the state is switched to the fallback plan before the
  // step   (THEORY 14.16)
  Need need = Need::kNone;
  if (!state.uses_fallback)
    for (const ForceCommand& command : inputs.commands)
      if (need == Need::kNone) need = find_need(plan, command);
  if (need != Need::kNone) switch_to_fallback(plan, need, state);
  fit(plan, state, workspace);
  step_in(active_plan(plan, state), state, inputs, workspace, report);
  if (report.status != StepStatus::kOk && need != Need::kNone) switch_back(plan, state);
}

}  // namespace freeflex
