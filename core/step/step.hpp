// The one function that advances time; core/step/budget.hpp has it with an error budget beside.
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "core/step/state.hpp"

namespace freeflex {

/// What takes effect at the current tick, in this order, after expiries.
struct Inputs {
  std::span<const ForceCommand> commands;
};

/// A slot that ended at this tick.
struct Expiry {
  std::array<char, kSenderSize> sender{};
  std::int32_t slot = 0;
  std::int64_t sequence = 0;  // of the command that ended
  bool was_lease = false;     // true: the sender failed to renew
};

enum class StepStatus : std::int32_t {
  kOk = 0,
  kNotFinite = 1,  // the next state is not finite: state is as it was before the call
};

struct StepReport {
  StepStatus status = StepStatus::kOk;
  std::int32_t num_expiries = 0;
  std::array<Expiry, kMaxSlots> expiries{};
};

/// True when the command would find a slot: it replaces one, clears one, or fewer than kMaxSlots are taken.
bool has_slot_for(const State& state, const ForceCommand& command) noexcept;

/// Advances state by one tick (THEORY section 6). Expiries first, then commands, then the motion.
/// Commands must have passed validation and has_slot_for; one without a slot is ignored.
/// Allocates nothing, calls no libm, gives one set of bits on every compiler and instruction set.
void step(const Plan& plan, State& state, const Inputs& inputs, Workspace& workspace,
          StepReport& report) noexcept;

}  // namespace freeflex
