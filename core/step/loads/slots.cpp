#include "core/step/loads/slots.hpp"

#include <algorithm>
#include <cstring>
#include <limits>

namespace freeflex {
namespace {

/// Compares two slots by the bytes of the sender, then by the slot number.
int compare(const ForceCommand& a, const ForceCommand& b) noexcept {
  const int senders = std::memcmp(a.sender.data(), b.sender.data(), a.sender.size());
  if (senders != 0) return senders;
  return a.slot < b.slot ? -1 : (a.slot > b.slot ? 1 : 0);
}

/// Returns the index of the first active slot that does not come before the slot of the command in this
/// order.
std::int32_t lower_bound(const ForceCommand& command, std::span<const Slot> slots,
                         std::int32_t num_slots) noexcept {
  std::int32_t i = 0;
  while (i < num_slots && compare(slots[index(i)].command, command) < 0) ++i;
  return i;
}

bool holds(const ForceCommand& command, std::span<const Slot> slots, std::int32_t num_slots,
           std::int32_t i) noexcept {
  return i < num_slots && compare(slots[index(i)].command, command) == 0;
}

std::int64_t end_tick(std::int64_t tick, const ForceCommand& command) noexcept {
  const std::int64_t length = command.duration_ticks > 0 ? command.duration_ticks : command.lease_ticks;
  const std::int64_t room = std::numeric_limits<std::int64_t>::max() - tick;
  return tick + std::min(length, room);
}

}  // namespace

bool has_expiry(const State& state) noexcept {
  for (std::int32_t i = 0; i < state.num_slots; ++i)
    if (state.slots[index(i)].end_tick <= state.tick) return true;
  return false;
}

std::int32_t expire_slots(std::int64_t tick, std::span<Slot> slots, std::int32_t num_slots,
                          StepReport& report) noexcept {
  std::int32_t kept = 0;
  for (std::int32_t i = 0; i < num_slots; ++i) {
    const Slot& slot = slots[index(i)];
    if (slot.end_tick <= tick) {
      const ForceCommand& command = slot.command;
      report.expiries[index(report.num_expiries++)] = {command.sender, command.slot, command.sequence,
                                                       command.duration_ticks <= 0};
    } else {
      if (kept != i) slots[index(kept)] = slot;
      ++kept;
    }
  }
  return kept;
}

std::int32_t apply_command(std::int64_t tick, const ForceCommand& command, std::span<Slot> slots,
                           std::int32_t num_slots) noexcept {
  const std::int32_t i = lower_bound(command, slots, num_slots);
  const bool is_held = holds(command, slots, num_slots, i);
  const auto at = slots.begin() + i, end = slots.begin() + num_slots;
  if (is_clearing(command)) {
    if (!is_held) return num_slots;
    std::copy(at + 1, end, at);
    return num_slots - 1;
  }
  if (!is_held) {
    if (num_slots == kMaxSlots) return num_slots;
    std::copy_backward(at, end, end + 1);
    ++num_slots;
  }
  *at = {command, end_tick(tick, command)};
  return num_slots;
}

bool has_slot_for(const State& state, const ForceCommand& command) noexcept {
  return is_clearing(command) || state.num_slots < kMaxSlots ||
         holds(command, state.slots, state.num_slots, lower_bound(command, state.slots, state.num_slots));
}

void add_slots(const StepPlan& plan, std::span<const Slot> slots, LoadSums& sums) noexcept {
  for (const auto& [command, end_tick] : slots)
    add_loads(plan,
              {command.axes, std::span(command.points).first(index(command.num_points)),
               std::span(command.wrenches).first(index(command.num_wrenches)),
               std::span(command.torques).first(index(command.num_torques)),
               std::span(command.wheels).first(index(command.num_wheels))},
              sums);
}

}  // namespace freeflex
