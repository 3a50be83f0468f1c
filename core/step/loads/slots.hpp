// Command slots, sorted by (sender, slot). A slot ends when it is replaced or cleared, or when it expires.
#pragma once

#include <cstdint>
#include <span>

#include "core/step/state.hpp"
#include "core/step/step.hpp"

namespace freeflex {

/// Returns true if an active slot expires at or before the tick of the state.
bool has_expiry(const State& state) noexcept;

/// Removes the slots that end at or before `tick` and reports them. Returns the number of slots that remain.
std::int32_t expire_slots(std::int64_t tick, std::span<Slot> slots, std::int32_t num_slots,
                          StepReport& report) noexcept;

/// Replaces, inserts or clears the slot of a command. Returns the number of active slots after the change.
std::int32_t apply_command(std::int64_t tick, const ForceCommand& command, std::span<Slot> slots,
                           std::int32_t num_slots) noexcept;

/// Adds the loads of slots to sums, in the order of the slots.
/// \pre the sums were sized for the plan
void add_slots(const StepPlan& plan, std::span<const Slot> slots, LoadSums& sums) noexcept;

}  // namespace freeflex
