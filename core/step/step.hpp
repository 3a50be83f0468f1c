// The function that advances a state by one tick. core/motion.hpp also judges the motion.
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "core/step/state.hpp"

namespace freeflex {

/// Holds the commands that take effect at the current tick. The commands are applied in this order, after
/// expiries.
struct Inputs {
  std::span<const ForceCommand> commands;
  // loads in place of those of slots and of histories, for a plan whose steps are longer than the ticks of
  // the loads; nullptr: none
  const LoadsOverStep* over = nullptr;
};

/// Reports a slot that ended at this tick.
struct Expiry {
  std::array<char, kSenderSize> sender{};
  std::int32_t slot = 0;
  std::int64_t sequence = 0;  // sequence of the command that ended
  bool was_lease = false;     // true: the sender did not renew the slot in time
};

enum class StepStatus : std::int32_t {
  kOk = 0,
  kNotFinite = 1,  // the next state would not be finite, so the state is unchanged
  // the rotations of joints without inertia have no equilibrium that was found, so the state is unchanged
  // (THEORY 12.73)
  kNoEquilibrium = 2,
  // bodies have turned so far that the deformation no longer defines the axes of the frame, so the state is
  // unchanged (THEORY 12.87)
  kNoFrame = 3,
  // a body has turned against the frame by more than its rotation vector can hold, so the state is unchanged
  // (THEORY 12.86)
  kTurnedTooFar = 4,
  // a ball joint between rigid bodies could not be closed, so the state is unchanged (THEORY 12.124)
  kOpenJoint = 5,
};

struct StepReport {
  StepStatus status = StepStatus::kOk;
  // kNoEquilibrium: point of the joint that rotated most in the last attempt; kTurnedTooFar: first point of
  // the body; kOpenJoint: point of a ball joint
  std::int32_t joint_point = -1;
  std::int32_t num_expiries = 0;
  std::array<Expiry, kMaxSlots> expiries{};
};

/// Returns true if the state has a slot for the command: if the command replaces an active slot, if it clears
/// a slot, or if fewer than kMaxSlots slots are active.
bool has_slot_for(const State& state, const ForceCommand& command) noexcept;

/// Advances a state by one tick (THEORY section 6). First removes the slots that expire at this tick, then
/// applies the commands, then advances the motion. Commands must have passed validation and has_slot_for. A
/// command for which no slot is free is ignored. Allocates nothing, does not call libm, and gives the same
/// bits with every compiler and instruction set.
void step(const StepPlan& plan, State& state, const Inputs& inputs, Workspace& workspace,
          StepReport& report) noexcept;

/// As step(), but if the plan integrates points, this function leaves the motion of the points, the frame and
/// the modes unread, because reading them takes longer than the step. read_points(), read_frame() and
/// read_modes() find them   (THEORY 12.132 to 12.134). Motion does so.
void step_unread(const StepPlan& plan, State& state, const Inputs& inputs, Workspace& workspace,
                 StepReport& report) noexcept;

}  // namespace freeflex
