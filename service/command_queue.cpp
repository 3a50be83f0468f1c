#include "service/command_queue.hpp"

#include <algorithm>
#include <numeric>

namespace freeflex::service {

using io::Reason;

CommandQueue::CommandQueue(double sender_share, std::int64_t max_bus_ahead)
    : sender_share_(sender_share),
      max_bus_ahead_(std::min(max_bus_ahead, io::kMaxAheadTicks)),
      pool_(kMaxPending),
      free_places_(kMaxPending),
      due_(kMaxSlots + kMaxPending) {
  clear();
}

void CommandQueue::clear() {
  std::iota(free_places_.begin(), free_places_.end(), std::size_t{0});
  num_pending_ = num_due_ = num_due_received_ = num_claims_ = num_in_force_ = 0;
  num_clearances_ = num_due_clearances_ = 0;
}

CommandQueue::Share CommandQueue::slot_share(const std::array<char, kSenderSize>& sender) const {
  if (is_operator(sender)) return {kOperatorSlots, kOperatorSlots};
  return {std::clamp(static_cast<int>(sender_share_ * kMaxSlots), 1, kBusSlots), kBusSlots};
}

CommandQueue::Share CommandQueue::pending_share(const std::array<char, kSenderSize>& sender) const {
  if (is_operator(sender)) return {kOperatorPending, kOperatorPending};
  return {std::clamp(static_cast<int>(sender_share_ * kMaxPending), 1, kBusPending), kBusPending};
}

template <class Item>
std::optional<int> CommandQueue::find_exceeded(const Item* items, int count,
                                               const std::array<char, kSenderSize>& sender, Share share) {
  // if the total is below both limits, no item needs to be counted
  if (count < std::min(share.own, share.side)) return {};
  int num_own = 0;
  int num_side = 0;
  const bool is_of_operator = is_operator(sender);
  for (int i = 0; i < count; ++i) {
    num_own += items[i].sender == sender ? 1 : 0;
    num_side += is_operator(items[i].sender) == is_of_operator ? 1 : 0;
  }
  if (num_own >= share.own) return share.own;
  if (num_side >= share.side) return share.side;
  return {};
}

CommandQueue::Decision CommandQueue::submit(const ForceCommand& command, std::int64_t received_ns,
                                            std::int64_t tick, int applied_free) {
  const bool is_at_once = command.start_tick < 0;
  const bool is_late = !is_at_once && command.start_tick < tick;
  if (is_late && command.late_policy == 0) return {Reason::kLate, tick, command.start_tick};
  const std::int64_t most_ahead = is_operator(command.sender) ? io::kMaxAheadTicks : max_bus_ahead_;
  if (command.start_tick > tick + most_ahead)
    return {Reason::kTooFarAhead, tick, command.start_tick, most_ahead};
  // three entries of APPLIED are needed: for the command, for its end, and one that stays reserved for a
  // reset
  if (applied_free < num_owed() + 3) return {Reason::kQueueFull, tick, 0};
  if (const auto most =
          find_exceeded(order_.data(), num_pending_, command.sender, pending_share(command.sender)))
    return {Reason::kQueueFull, tick, *most};
  // slots in force plus reserved slots never exceed the slots of the step, so every accepted command gets its
  // slot
  if (!is_clearing(command)) {
    Claim* claim = find_claim(command.sender, command.slot);
    if (claim == nullptr) {
      if (const auto most =
              find_exceeded(claims_.data(), num_claims_, command.sender, slot_share(command.sender)))
        return {Reason::kNoSlotFree, tick, *most};
      claim = &claims_[index(num_claims_++)];
      *claim = {command.sender, command.slot, 0, false, 0};
    }
    ++claim->num_pending;
  }
  const bool waits = command.start_tick > tick;
  const std::int64_t start = waits ? command.start_tick : tick;
  insert(command, {command.sender, start, waits ? 0 : received_ns, 0});
  return {Reason::kAccepted, start, 0};
}

void CommandQueue::insert(const ForceCommand& command, const Pending& entry) {
  Pending* const first = order_.data();
  Pending* const last = first + num_pending_;
  Pending* const place = std::upper_bound(first, last, entry,
                                          [](const Pending& a, const Pending& b) { return a.tick < b.tick; });
  std::move_backward(place, last, last + 1);
  *place = entry;
  place->place = free_places_[index(kMaxPending - 1 - num_pending_)];
  ++num_pending_;
  pool_[place->place] = command;
}

std::span<const ForceCommand> CommandQueue::take_due(std::int64_t tick) {
  num_due_ = num_due_received_ = 0;
  num_due_clearances_ = num_clearances_;
  for (int i = 0; i < num_clearances_; ++i) {
    const Clearance& clearance = clearances_[index(i)];
    ForceCommand& command = due_[index(i)];
    command = {};
    command.sender = clearance.sender;
    command.slot = clearance.slot;
    command.sequence = clearance.sequence;
    command.start_tick = tick;
  }
  ForceCommand* const due = due_.data() + num_clearances_;
  while (num_due_ < num_pending_ && order_[index(num_due_)].tick <= tick) {
    const Pending& entry = order_[index(num_due_)];
    if (entry.received_ns != 0) due_received_ns_[index(num_due_received_++)] = entry.received_ns;
    due[num_due_++] = pool_[entry.place];
  }
  return {due_.data(), index(num_due_clearances_ + num_due_)};
}

void CommandQueue::settle(const StepReport& report) {
  // this code follows the order of the step, which processes ends before commands
  for (int i = 0; i < report.num_expiries; ++i) {
    const Expiry& expiry = report.expiries[index(i)];
    if (Claim* claim = find_claim(expiry.sender, expiry.slot); claim != nullptr && claim->is_in_force) {
      claim->is_in_force = false;
      --num_in_force_;
      drop_if_idle(*claim);
    }
  }
  for (int i = 0; i < num_due_; ++i) {
    const ForceCommand& command = due_[index(num_due_clearances_) + index(i)];
    Claim* claim = find_claim(command.sender, command.slot);
    if (claim == nullptr) continue;  // the command cleared an empty slot
    const bool fills = !is_clearing(command);
    if (fills) --claim->num_pending;
    num_in_force_ += static_cast<int>(fills) - static_cast<int>(claim->is_in_force);
    claim->is_in_force = fills;
    claim->sequence = command.sequence;
    drop_if_idle(*claim);
  }
  // puts the places of the due commands back on the stack of free places
  const auto num_free = index(kMaxPending) - index(num_pending_);
  for (std::size_t i = 0; i < index(num_due_); ++i) free_places_[num_free + i] = order_[i].place;
  std::move(order_.begin() + num_due_, order_.begin() + num_pending_, order_.begin());
  num_pending_ -= num_due_;
  num_clearances_ -= num_due_clearances_;
  num_due_ = num_due_received_ = num_due_clearances_ = 0;
}

void CommandQueue::clear_senders(const std::array<char, kSenderSize>& target) {
  const int num_before = num_pending_;
  num_pending_ = 0;
  int num_free = kMaxPending - num_before;  // size of the stack of free places
  for (int i = 0; i < num_before; ++i) {
    const Pending& entry = order_[index(i)];
    if (is_target(target, entry.sender))
      free_places_[index(num_free++)] = entry.place;
    else
      order_[index(num_pending_++)] = entry;
  }
  const int num_claims_before = num_claims_;
  num_claims_ = 0;
  for (int i = 0; i < num_claims_before; ++i) {
    const Claim& claim = claims_[index(i)];
    if (!is_target(target, claim.sender)) {
      claims_[index(num_claims_++)] = claim;
    } else if (claim.is_in_force) {
      clearances_[index(num_clearances_++)] = {claim.sender, claim.slot, claim.sequence};
      --num_in_force_;
    }
  }
}

CommandQueue::Claim* CommandQueue::find_claim(const std::array<char, kSenderSize>& sender,
                                              std::int32_t slot) {
  for (int i = 0; i < num_claims_; ++i) {
    Claim& claim = claims_[index(i)];
    if (claim.slot == slot && claim.sender == sender) return &claim;
  }
  return nullptr;
}

void CommandQueue::drop_if_idle(Claim& claim) {
  if (claim.is_in_force || claim.num_pending > 0) return;
  claim = claims_[index(--num_claims_)];
}

}  // namespace freeflex::service
