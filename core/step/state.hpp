// The mutable state and the preallocated workspace.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "core/step/command.hpp"
#include "core/step/loads.hpp"
#include "core/step/plan.hpp"

namespace freeflex {

/// A slot in force: the command and the tick it took effect.
struct Slot {
  ForceCommand command;
  std::int64_t end_tick = 0;  // expires at this tick
};

/// What the coupled rungs carry beside the rest. Rates and what follows are those at the left limit of the
/// tick.
struct CoupledState {
  Array momentum;  // [m/s] (num_padded) elastic momenta over the mass   (THEORY X91); q_dot follows from them
  Array rate_q,
      rate_p;       // [m/s], [m/s^2] (num_padded) what of their rates is not the modes' own linear motion
  Vec3 w_B{};       // [rad/s] angular velocity of the frame, body axes
  Vec3 moment_B{};  // [N m] about the centre of mass, arms of the deformed body
  // where modes are not a complete set, else empty and zero   (THEORY X193)
  Array q_ddot;    // [m/s^2] (num_padded)
  Vec3 w_dot_B{};  // [rad/s^2] of w_B, as the frame sees it
  bool has_rates = false;
  bool operator==(const CoupledState&) const = default;
};

/// The floating frame. *_low carry what rounding left of the value before them (compensated sums), so value +
/// low is the state.
struct Frame {
  Vec3 p_WB{}, p_WB_low{};  // [m]
  Vec3 v_WB{}, v_WB_low{};  // [m/s]
  Quat q_WB{1.0, 0.0, 0.0, 0.0}, q_WB_low{};
  Vec3 H_W{}, H_W_low{};  // [kg m^2/s] angular momentum about the centre of mass, world axes
  bool operator==(const Frame&) const = default;
};

/// What moves, and all that is read out: a snapshot is this and is copied as one, so that no list of fields
/// beside it can miss one. A base of State, as Frame is of it, only so that `state.q_WB` stays short.
struct MotionState : Frame {
  std::int64_t tick = 0;              // never repeats within a session
  std::int64_t epoch = 0;             // raised by reset
  std::int64_t epoch_start_tick = 0;  // histories count from here
  Array q, q_low;                     // [m] (num_padded)
  Array q_dot, q_dot_low;             // [m/s] (num_padded)
  // loads at the left limit of this tick, those of fields, dashpots and feedback among them, for
  // accelerations and read-out
  Vec3 force_W{};   // [N] resultant without gravity
  Vec3 moment_B{};  // [N m] about the centre of mass, arms of the body at rest
  Array Q;          // [N] (num_padded)
  // [N m s] (num_wheels) about the axes of wheels, and what rounding left of it
  std::vector<double> wheel_momentum, wheel_momentum_low;
  CoupledState coupled;  // arrays empty below the coupled rungs
  // in the wide plan of Plan::wide since a command needed it; a reset ends it
  bool is_wide = false;
  std::int64_t wide_tick = -1;  // at which it came back; -1: never
  std::int32_t wide_need = 0;   // Need that brought it
  bool operator==(const MotionState&) const = default;
};
/// Those that have the size of the plan that the state is in.
inline std::array<Array*, 5> modal_arrays(MotionState& motion) noexcept {
  return {&motion.q, &motion.q_low, &motion.q_dot, &motion.q_dot_low, &motion.Q};
}

/// All that the future depends on besides plan and inputs.
struct State : MotionState {
  // command slots in force, sorted by (sender, slot): the order in which they are summed
  std::int32_t num_slots = 0;
  std::vector<Slot> slots;                       // capacity kMaxSlots, size kMaxSlots
  bool slots_changed = true;                     // commands_pattern must be rebuilt
  LoadPattern commands_pattern;                  // sum of the slots
  Array commands_arms;                           // [N] its arms, see set_arms
  double commands_size = 0.0;                    // [N] its size_of_forces
  bool operator==(const State&) const = delete;  // that of MotionState would pass over the slots
};

/// Scratch of one step on the coupled rungs.
struct CoupledWorkspace {
  std::vector<Vec3> V, W;                     // [m], [m/s] (num_points)
  std::vector<Vec3> force, drift;             // [N], [m/s] (num_points; forces on particles too)
  Array q, p, q_dot, Q;                       // (num_padded) of a stage
  std::array<std::array<Array, 2>, 4> rates;  // [m/s], [m/s^2] (num_padded) of q and p at each stage
  // where modes are not a complete set, else empty   (THEORY X190 to X194)
  Array C;                 // [kg m] (3 x num_padded)
  Array load, inertial;    // [N] (num_padded)
  Array C_dot_w;           // [N] (num_padded) what the rate of C takes, w . C'_l
  Array sums, sums_dot;    // (num_tables, 6 x num_padded) tables times q, times q'
  Array spare;             // (num_padded)
  std::vector<Vec3> arms;  // [kg m] (num_points)
  // of a stage: momenta of wheels [N m s] (num_wheels); theirs of the modes [m/s], then its rate
  // (num_padded); empty without any   (THEORY X168)
  std::vector<double> wheels;
  Array wheel_share;
  CoupledState next;
};

/// Scratch of one step: what it writes before it is known to be finite, then swapped with the state.
/// Nothing of the motion survives from one step to the next: only is_wide, which of the two plans the arrays
/// are sized for, and the group rows of either, which the plan fixes.
struct Workspace {
  Array Q_right;  // [N] (num_padded) at the right limit of this tick
  Array Q_left;   // [N] (num_padded) at the left limit of the next
  Array next_q, next_q_low, next_q_dot, next_q_dot_low;
  std::vector<double> next_wheel, next_wheel_low;  // [N m s] (num_wheels)
  Array predicted_q;             // [m] (num_padded) empty unless loads depend on the elastic motion
  Array kicked;                  // [m/s] (num_padded) q_dot after half a kick; empty but for split mixing
  Array scratch;                 // see mixing_scratch_size
  CoupledWorkspace coupled;      // empty below the coupled rungs
  MotionState part;              // after one part of a step; empty but where the plan divides it   (X100)
  std::vector<Slot> next_slots;  // size kMaxSlots
  LoadPattern next_pattern;
  Array next_arms;
  double next_size = 0.0;
  SumsOnPoints sums;
  Array group_rows;  // see make_group_rows
  // as the state's at the last step (fit); the arrays above have room for either plan
  bool is_wide = false;
  Array other_group_rows;  // of the plan that the workspace is not sized for
};
/// Those that have the size of the plan that the state is in.
inline std::array<Array*, 6> modal_arrays(Workspace& w) noexcept {
  return {&w.Q_right, &w.Q_left, &w.next_q, &w.next_q_low, &w.next_q_dot, &w.next_q_dot_low};
}

/// The plan that a state is in: the wide one once a command needed it   (THEORY X125).
inline const Plan& active_plan(const Plan& plan, const MotionState& state) noexcept {
  return state.is_wide ? plan.wide.front() : plan;
}

/// Allocates a state at the plan's initial values, tick 0, epoch 0.
State make_state(const Plan& plan);
Workspace make_workspace(const Plan& plan);

/// Back to the initial values and no slots; tick goes on, epoch is raised. Allocates nothing.
void reset_state(const Plan& plan, State& state);

}  // namespace freeflex
