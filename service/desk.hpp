// Decides on a force command what depends on the tick, and keeps the accepted ones until theirs comes.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "core/command_limits.hpp"
#include "core/step/step.hpp"
#include "service/io/wire/operator_address.hpp"
#include "service/io/wire/reason.hpp"

namespace freeflex::service {

/// Slots and places for waiting commands are shared: a quarter of each is kept for the operator's socket; of
/// the rest, which is the bus's, one sender has at most its share. A sender on the bus can be anybody, so
/// whoever has many names can still take all of the bus's part. Simulation thread only. Allocates in the
/// constructor and never again.
class CommandDesk {
 public:
  static constexpr int kMaxPending = 256;
  static constexpr int kOperatorSlots = kMaxSlots / 4, kOperatorPending = kMaxPending / 4;
  static constexpr int kBusSlots = kMaxSlots - kOperatorSlots, kBusPending = kMaxPending - kOperatorPending;

  /// \param sender_share   [-] of all slots and of all waiting commands, for one sender on the bus, at least
  /// one
  /// \param max_bus_ahead  [ticks] longest time that a command from the bus may wait for its start
  explicit CommandDesk(double sender_share = CommandLimits{}.sender_share,
                       std::int64_t max_bus_ahead = io::kMaxAheadTicks);

  struct Decision {
    io::Reason reason = io::Reason::kAccepted;
    std::int64_t tick = 0;   // accepted: takes effect at this tick
    std::int64_t found = 0;  // rejected: start_tick, or how many the sender may have
    std::int64_t most = 0;   // kTooFarAhead: [ticks] that this sender may be ahead
  };
  /// Accepts a command or says why not: kLate, kTooFarAhead, kNoSlotFree, kQueueFull.
  /// An accepted command is sure of its slot and of its entries on APPLIED.
  /// \param received_ns  [ns] CLOCK_BOOTTIME, reception
  /// \param tick         next tick to be executed
  /// \param applied_free entries that the APPLIED ring would take now
  Decision submit(const ForceCommand& command, std::int64_t received_ns, std::int64_t tick, int applied_free);

  /// What takes effect at this tick: num_due_clearances() commands that empty the slots of cleared senders,
  /// then the accepted commands in the order of (start tick, arrival). All stay until settle().
  std::span<const ForceCommand> take_due(std::int64_t tick);
  int num_due_clearances() const { return num_due_clearances_; }
  /// The step with the commands of the last take_due was made.
  void settle(const StepReport& report);
  /// [ns] reception of the commands of the last take_due that did not wait for a tick of their own choice.
  std::span<const std::int64_t> due_received_ns() const {
    return {due_received_ns_.data(), static_cast<std::size_t>(num_due_received_)};
  }

  int num_pending() const { return num_pending_; }
  /// Most entries that the accepted commands can still put on APPLIED: each itself and its end; of a slot
  /// that is cleared the clearance and, where both are due at one tick, the end.
  int num_owed() const { return 2 * num_pending_ + num_in_force_ + 2 * num_clearances_; }
  /// True when APPLIED has room for clear_senders().
  bool can_clear(int applied_free) const { return applied_free >= num_owed() + num_in_force_ + 1; }
  /// A pending command, in order; for the answers when a reset ends the epoch.
  const ForceCommand& pending(int index) const {
    return pool_[order_[static_cast<std::size_t>(index)].place];
  }
  /// Forgets the waiting commands of the senders that target names, and ends their slots with the next step.
  /// What they had is free at once. \pre can_clear()  \param target  as of CLEAR
  void clear_senders(const std::array<char, kSenderSize>& target);
  /// Forgets every command and slot (reset).
  void clear();

 private:
  /// A slot spoken for: in force, or named by a pending command that fills it.
  struct Claim {
    std::array<char, kSenderSize> sender;
    std::int32_t slot;
    std::int32_t num_pending;
    bool is_in_force;
    std::int64_t sequence;  // in force: of the command
  };
  /// A slot in force whose sender was cleared, until the next step.
  struct Clearance {
    std::array<char, kSenderSize> sender;
    std::int32_t slot;
    std::int64_t sequence;
  };
  struct Pending {
    std::array<char, kSenderSize> sender;
    std::int64_t tick;
    std::int64_t received_ns;  // 0: waited for its start tick
    std::size_t place;         // in pool_
  };
  /// How many of something a sender may have: by itself, and with the others on its side.
  struct Share {
    int own;
    int side;
  };
  Share slot_share(const std::array<char, kSenderSize>& sender) const;
  Share pending_share(const std::array<char, kSenderSize>& sender) const;
  /// Empty, or the share that one more would exceed. Of the first `count` of the items, that have a sender.
  template <class Item>
  static std::optional<int> find_exceeded(const Item* items, int count,
                                          const std::array<char, kSenderSize>& sender, Share share);
  Claim* find_claim(const std::array<char, kSenderSize>& sender, std::int32_t slot);
  void drop_if_idle(Claim& claim);
  void insert(const ForceCommand& command, const Pending& entry);

  const double sender_share_;
  const std::int64_t max_bus_ahead_;
  std::vector<ForceCommand> pool_;          // (kMaxPending)
  std::vector<std::size_t> free_places_;    // stack, num_free = kMaxPending - num_pending_
  std::array<Pending, kMaxPending> order_;  // first num_pending_, by (tick, arrival)
  int num_pending_ = 0;
  std::array<Clearance, kMaxSlots> clearances_;  // of slots that the state still has
  int num_clearances_ = 0;
  std::vector<ForceCommand> due_;  // (kMaxSlots + kMaxPending) commands of the tick, side by side
  int num_due_clearances_ = 0;     // the first of due_
  int num_due_ = 0;                // those behind them
  std::array<std::int64_t, kMaxPending> due_received_ns_{};
  int num_due_received_ = 0;
  std::array<Claim, kMaxSlots> claims_;
  int num_claims_ = 0;
  int num_in_force_ = 0;
};

}  // namespace freeflex::service
