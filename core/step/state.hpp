// The mutable state and the preallocated workspace.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "core/step/command.hpp"
#include "core/step/coupled/curve.hpp"
#include "core/step/links/true_links.hpp"
#include "core/step/loads/loads.hpp"
#include "core/step/plan.hpp"
#include "core/step/points/history.hpp"
#include "core/step/turning/ball_joints.hpp"
#include "core/step/turning/spread.hpp"
#include "core/step/turning/turning.hpp"

namespace freeflex {

/// Holds the command of an active slot and the tick at which the slot ends.
struct Slot {
  ForceCommand command;
  std::int64_t end_tick = 0;
};

/// Holds the part of the state that only the coupled rungs need. All members except the momenta may jump at a
/// tick, and hold their values just before the tick (the left limit).
struct CoupledState {
  // [m/s] (num_padded) elastic momenta divided by the mass (THEORY 12.3, 12.33). q_dot follows from these
  // momenta.
  Array momentum;
  // [m/s], [m/s^2] (num_padded) rates of q and of `momentum`, minus the linear motion of each mode
  // (THEORY 12.13)
  Array rate_q, rate_p;
  Vec3 w_B{};       // [rad/s] angular velocity of the frame, body axes
  Vec3 moment_B{};  // [N m] moment of the loads about the centre of mass, with deformed arms r + V
  // [N m] sum r x F over points and of torques in the axes of bodies, those of links included; on complete
  // sets of modes, accelerations are computed from it
  Vec3 balance_B{};
  // Used only if the modes are not a complete set for point masses. Otherwise the array is empty and the
  // value is zero   (THEORY 12.41, 12.42)
  Array q_ddot;    // [m/s^2] (num_padded) accelerations of the elastic coordinates
  Vec3 w_dot_B{};  // [rad/s^2] rate of w_B, body axes
  // [m], [m/s] (PlanCurve::modes) slow motion of stiff modes, from which the filter measures, and its change
  // over the last substep; empty without links that bend
  Array slow_q, slow_p, slow_change;
  // [m], [m/s] (num_padded) curvilinear coordinates   (THEORY 12.79), and [m/s], [m/s^2] their rates with
  // which the next step begins, those at the filtered state if there is a filter; empty without links that
  // bend
  Array curved_q, curved_p, curved_rate_q, curved_rate_p;
  // rates of the frame at the filtered state
  Vec3 filtered_w_B{}, filtered_moment_B{}, filtered_force_W{};
  // [m], [m/s] (num_padded) motion that the filter has left out; empty without links that bend (THEORY 12.97)
  Array left_out_q, left_out_p;
  JointState joints;  // empty unless links at true geometry have joints
  // empty unless points without mass are held by links at true geometry   (THEORY 12.115)
  std::vector<MasslessMotion> massless;
  // [m] sum of the estimated errors of all steps since the start, rms over the mass; 0 without true geometry
  // (THEORY 12.95)
  double integration_error = 0.0;
  double filter_error = 0.0;  // [m] size of the motion that the filter has left out, rms over the mass
  bool has_rates = false;
  bool operator==(const CoupledState&) const = default;
};

/// Holds the floating frame. Each member *_low holds the rounding error of the member without _low
/// (compensated summation), so value + low is more accurate than the value.
struct Frame {
  Vec3 p_WB{}, p_WB_low{};                    // [m] position of the centre of mass
  Vec3 v_WB{}, v_WB_low{};                    // [m/s] velocity of the centre of mass
  Quat q_WB{1.0, 0.0, 0.0, 0.0}, q_WB_low{};  // [-] attitude
  Vec3 H_W{}, H_W_low{};  // [kg m^2/s] angular momentum about the centre of mass, world axes
  bool operator==(const Frame&) const = default;
};

/// Holds all moving quantities and all values that are read out. A snapshot is a copy of this struct, so that
/// no field can be forgotten. MotionState is a base of State, and Frame is a base of MotionState, only so
/// that expressions like `state.q_WB` stay short.
struct MotionState : Frame {
  std::int64_t tick = 0;              // number of the tick; never repeats within a session; a reset keeps it
  std::int64_t epoch = 0;             // number of the epoch; each reset raises it
  std::int64_t epoch_start_tick = 0;  // tick from which histories run
  Array q, q_low;                     // [m] (num_padded) elastic coordinates
  Array q_dot, q_dot_low;             // [m/s] (num_padded) rates of the elastic coordinates
  // The loads just before this tick, including the loads of fields, dashpots and feedback. Accelerations and
  // link forces are computed from them.
  Vec3 force_W{};   // [N] resultant force without gravity
  Vec3 moment_B{};  // [N m] moment about the centre of mass, with the arms of the undeformed structure
  Array Q;          // [N] (num_padded) generalized forces
  // [N m s] (num_wheels) momentum about the axis of each wheel
  std::vector<double> wheel_momentum, wheel_momentum_low;
  CoupledState coupled;  // its arrays are empty below the coupled rungs
  PointsAtTick points;   // empty unless the plan integrates points
  // false: the frame, or the rest of the members above, are those of an earlier tick, because the plan
  // integrates points and nothing has read them
  bool has_frame = true, has_modes = true;
  bool uses_fallback = false;       // true: a command needed the fallback plan, on which the state is stepped
                                    // until a reset
  std::int64_t fallback_tick = -1;  // tick of the switch to the fallback plan; -1: no switch
  std::int32_t fallback_need = 0;   // Need that caused the switch
  bool operator==(const MotionState&) const = default;
};
/// Returns the arrays whose size is the num_padded of the active plan.
inline std::array<Array*, 5> modal_arrays(MotionState& motion) noexcept {
  return {&motion.q, &motion.q_low, &motion.q_dot, &motion.q_dot_low, &motion.Q};
}

/// Holds the state: with the plan and the inputs of later ticks, it determines the later motion.
struct State : MotionState {
  // The active command slots, sorted by (sender, slot). Their loads are summed in this order.
  std::int32_t num_slots = 0;
  std::vector<Slot> slots;                       // capacity kMaxSlots, size kMaxSlots
  bool slots_changed = true;                     // true: commands_pattern must be computed again
  LoadPattern commands_pattern;                  // sum of the slots
  std::int64_t num_slot_changes = 0;             // number of times that commands_pattern was computed
  PointHistory point_history;                    // empty unless the plan integrates points
  bool operator==(const State&) const = delete;  // the operator of MotionState would ignore the slots
};

/// Holds scratch memory of one step on the coupled rungs.
struct CoupledWorkspace {
  std::vector<Vec3> V, W;          // [m], [m/s] (num_points)
  std::vector<Vec3> force, drift;  // [N], [m/s] (num_points; force also num_particles)
  Array q, p, q_dot, Q;            // (num_padded) of a stage
  Vec3 stiffened_w{};  // [rad/s] change of the angular velocity by the stiffness by fields   (THEORY 8.52)
  std::array<std::array<Array, 2>, 4> rates;  // [m/s], [m/s^2] (num_padded) of q and p at each stage
  // used only if the modes are not a complete set for point masses; otherwise empty
  Array C;                 // [kg m] (3 x num_padded) chi, angular momentum per rate of each coordinate
                           // (THEORY 12.35, 12.49)
  Array load, inertial;    // [N] (num_padded)
  Array C_dot_w;           // [N] (num_padded) w . C'_l   (THEORY 12.40, 12.51)
  Array sums, sums_dot;    // (num_tables, 6 x num_padded) tables times q; tables times q'
  Array spare;             // (num_padded)
  std::vector<Vec3> arms;  // [kg m] (num_points)
  // Values at a stage, empty without wheels: the momenta of the wheels [N m s] (num_wheels), and the
  // contribution of the wheels to the elastic momenta [m/s] (num_padded). accelerate() overwrites this
  // contribution with its rate times the mass [N]   (THEORY 16.30)
  std::vector<double> wheels;
  Array wheel_share;
  CurveWorkspace curve;          // empty unless the plan has curvilinear coordinates
  Mat3 spin{};                   // of angular_velocity()
  Array rate_q_dot;              // (num_padded)
  Array filtered_q, filtered_p;  // (num_padded)
  Array slow_start;  // [m] (PlanCurve::modes) slow motion at the start of the substep; empty without filter
  double slow_pace = 0.0;   // [m/s^2] by how much it moves in a substep, as forces over the mass
  double least_pace = 0.0;  // [m/s^2] the same in a vibration that is too small to matter   (THEORY 12.96)
  Array start_q, start_p;   // (num_padded) coordinates at the start of the step, if there are any
  // of turning bodies; empty without them
  std::vector<TurningMotion> bodies;
  Mat3 frame{};  // [kg m^2] factor of alpha in (THEORY 12.87) at the last evaluation
  SpreadWorkspace spread;
  BallJoints ball_joints;
  std::int32_t turned_body = -1;  // body that made the last step fail with StepStatus::kTurnedTooFar
  bool has_no_frame = false;      // true: the last step failed with StepStatus::kNoFrame
  std::vector<Vec3> x;            // [m] (num_points + num_particles) present positions, for torques on groups
  std::vector<Vec3> linear_V;     // [m] (num_points) displacements of the linear structure
  std::vector<Vec3> linear;       // [N] (num_points) forces of the linear links
  JointWorkspace joints;
  double last_turn = 0.0;   // [rad] result of relax_joints()
  JointState stage_joints;  // rotations of the joints at the last stage
  std::vector<Vec3> rest;   // [m] (num_points) rest positions, if there are links at true geometry
  // of add_strain_damping(): a workspace for a shape nearby, and the rates of the elastic forces beyond the
  // linear ones [N/s] (num_padded), of other links and of springs and bars; empty without such damping
  std::vector<CoupledWorkspace> probe;
  JointState probe_turn;  // difference of the rotations of joints to those of the last stage
  std::array<Array, 2> excess_rate;
  CoupledState next;
};

/// Returns whether a workspace is that of a plan with massless points.
inline bool has_massless(const CoupledWorkspace& w) noexcept { return !w.joints.massless.empty(); }
/// Returns the displacements of the linear structure, which differ from w.V on bodies and massless points.
inline std::span<const Vec3> linear_displacements(const CoupledWorkspace& w) noexcept {
  return w.bodies.empty() && !has_massless(w) ? w.V : w.linear_V;
}

/// Holds scratch memory of one step. The step writes its results to the workspace and swaps them with the
/// state once they are known to be finite. From one step to the next, the workspace keeps no motion. It keeps
/// only uses_fallback, which tells for which plan the arrays are sized, and the group rows of both plans,
/// which are constant.
struct Workspace {
  Array Q_right;  // [N] (num_padded) generalized forces at the right limit of this tick
  Array Q_left;   // [N] (num_padded) generalized forces at the left limit of the next tick
  Array next_q, next_q_low, next_q_dot, next_q_dot_low;
  std::vector<double> next_wheel, next_wheel_low;  // [N m s] (num_wheels)
  Array predicted_q;             // [m] (num_padded) q at the end of the first pass; empty unless loads on the
                                 // body depend on the elastic motion
  Array q_dot_after_impulse;     // [m/s] (num_padded) q' after the first splitting impulse of the step;
                                 // empty unless the path is kSplit
  Array scratch;                 // see modal_coupling_scratch_size
  CoupledWorkspace coupled;      // empty below the coupled rungs
  PointsWorkspace points;        // empty unless the plan integrates points
  MotionState substep;           // state after a substep; empty unless the plan divides the step
  std::vector<Slot> next_slots;  // size kMaxSlots
  LoadPattern next_pattern;
  SumsOnPoints sums;
  Array group_rows;            // see make_group_rows
  bool uses_fallback = false;  // value in the state at the last step; arrays have room for both plans
  Array other_group_rows;      // group rows of the plan for which the arrays are not sized
};
/// Returns the arrays whose size is the num_padded of the active plan.
inline std::array<Array*, 6> modal_arrays(Workspace& w) noexcept {
  return {&w.Q_right, &w.Q_left, &w.next_q, &w.next_q_low, &w.next_q_dot, &w.next_q_dot_low};
}

/// Returns the plan on which a state is stepped. This is the fallback plan if a command has needed it, and
/// otherwise the plan itself (THEORY 14.16).
inline const StepPlan& active_plan(const StepPlan& plan, const MotionState& state) noexcept {
  return state.uses_fallback ? plan.fallback.front() : plan;
}

/// Returns a state with the initial values of the plan, tick 0 and epoch 0.
State make_state(const StepPlan& plan);
/// Returns the workspace for a plan. A step with this workspace allocates nothing.
Workspace make_workspace(const StepPlan& plan);

/// Sets the state to the initial values and clears the slots. The tick continues, and the epoch increases by
/// one. Allocates nothing.
void reset_state(const StepPlan& plan, State& state);

}  // namespace freeflex
