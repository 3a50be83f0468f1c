// Accepts or rejects force commands by the rules that depend on the tick, and keeps accepted commands until
// their tick.
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

/// Divides the slots, and the places for waiting commands, among senders. A quarter of each is reserved for
/// the operator's socket. The other three quarters are for the bus, where one sender gets at most the
/// fraction sender_share of all slots and of all places. Names on the bus are not verified, so a program that
/// uses many names can still fill all places of the bus. Simulation thread only. Allocates in the constructor
/// only.
class CommandQueue {
 public:
  static constexpr int kMaxPending = 256;
  static constexpr int kOperatorSlots = kMaxSlots / 4, kOperatorPending = kMaxPending / 4;
  static constexpr int kBusSlots = kMaxSlots - kOperatorSlots, kBusPending = kMaxPending - kOperatorPending;

  /// \param sender_share   [-] largest fraction of all slots, and of all waiting commands, that one sender
  ///  on
  ///   the bus may have; at least one of each is always allowed
  /// \param max_bus_ahead  [ticks] longest time that a command from the bus may wait for its start
  explicit CommandQueue(double sender_share = CommandLimits{}.sender_share,
                        std::int64_t max_bus_ahead = io::kMaxAheadTicks);

  struct Decision {
    io::Reason reason = io::Reason::kAccepted;
    std::int64_t tick = 0;   // accepted: tick at which the command takes effect
    std::int64_t found = 0;  // rejected: start_tick, or the limit of slots or places that is reached
    std::int64_t most = 0;   // kTooFarAhead: [ticks] largest start_tick - tick for this sender
  };
  /// Accepts a command, or rejects it with kLate, kTooFarAhead, kNoSlotFree or kQueueFull.
  /// Reserves the slot and the APPLIED entries of an accepted command.
  /// \param received_ns  [ns] CLOCK_BOOTTIME of reception
  /// \param tick         next tick to be executed
  /// \param applied_free number of free entries in the APPLIED ring buffer
  Decision submit(const ForceCommand& command, std::int64_t received_ns, std::int64_t tick, int applied_free);

  /// Returns the commands that take effect at this tick: first num_due_clearances() commands that empty the
  /// slots of cleared senders, then the accepted commands ordered by (start tick, arrival). The span is valid
  /// until settle().
  std::span<const ForceCommand> take_due(std::int64_t tick);
  int num_due_clearances() const { return num_due_clearances_; }
  /// Removes the commands of the last take_due() after the step has applied them.
  void settle(const StepReport& report);
  /// Returns the reception times [ns] of those commands of the last take_due() that were due as soon as they
  /// were accepted.
  std::span<const std::int64_t> due_received_ns() const {
    return {due_received_ns_.data(), static_cast<std::size_t>(num_due_received_)};
  }

  int num_pending() const { return num_pending_; }
  /// Returns the largest number of APPLIED entries that accepted commands may still need: two for each
  /// waiting command (the command and its end), one for each slot in force (its end), and two for each slot
  /// that is being cleared (the clearance, and the end if it is due at the same tick).
  int num_owed() const { return 2 * num_pending_ + num_in_force_ + 2 * num_clearances_; }
  /// Returns true if APPLIED has room for clear_senders().
  bool can_clear(int applied_free) const { return applied_free >= num_owed() + num_in_force_ + 1; }
  /// Returns a waiting command by its position in the order of execution. A RESET and a CLEAR use this
  /// function to answer the commands that they remove.
  const ForceCommand& pending(int index) const {
    return pool_[order_[static_cast<std::size_t>(index)].place];
  }
  /// Removes the waiting commands of the senders that match the target, and ends the loads in these senders'
  /// slots with the next step. Other commands may use the places and slots at once.
  /// \pre can_clear()
  /// \param target  as in CLEAR
  void clear_senders(const std::array<char, kSenderSize>& target);
  /// Removes every command and slot, for a reset.
  void clear();

 private:
  /// A slot that is in force, or that a waiting command will fill.
  struct Claim {
    std::array<char, kSenderSize> sender;
    std::int32_t slot;
    std::int32_t num_pending;
    bool is_in_force;
    std::int64_t sequence;  // sequence of the command in force
  };
  /// A slot of a cleared sender, in force until the next step.
  struct Clearance {
    std::array<char, kSenderSize> sender;
    std::int32_t slot;
    std::int64_t sequence;
  };
  struct Pending {
    std::array<char, kSenderSize> sender;
    std::int64_t tick;
    std::int64_t received_ns;  // 0: the command waits for its start tick
    std::size_t place;         // in pool_
  };
  /// Largest number of slots, or of waiting commands, of one sender and of all senders on that sender's side
  /// (bus or operator).
  struct Share {
    int own;
    int side;
  };
  Share slot_share(const std::array<char, kSenderSize>& sender) const;
  Share pending_share(const std::array<char, kSenderSize>& sender) const;
  /// Returns the limit that one more item of the sender would exceed, or nullopt. Looks at the first `count`
  /// items only.
  template <class Item>
  static std::optional<int> find_exceeded(const Item* items, int count,
                                          const std::array<char, kSenderSize>& sender, Share share);
  Claim* find_claim(const std::array<char, kSenderSize>& sender, std::int32_t slot);
  void drop_if_idle(Claim& claim);
  void insert(const ForceCommand& command, const Pending& entry);

  const double sender_share_;
  const std::int64_t max_bus_ahead_;
  std::vector<ForceCommand> pool_;          // (kMaxPending)
  std::vector<std::size_t> free_places_;    // stack of kMaxPending - num_pending_ places
  std::array<Pending, kMaxPending> order_;  // first num_pending_ are valid, by (tick, arrival)
  int num_pending_ = 0;
  std::array<Clearance, kMaxSlots> clearances_;  // clearances of slots that are still in the state
  int num_clearances_ = 0;
  std::vector<ForceCommand> due_;  // (kMaxSlots + kMaxPending) commands of the tick, contiguous
  int num_due_clearances_ = 0;     // number of clearances at the front of due_
  int num_due_ = 0;                // number of accepted commands, which follow the clearances
  std::array<std::int64_t, kMaxPending> due_received_ns_{};
  int num_due_received_ = 0;
  std::array<Claim, kMaxSlots> claims_;
  int num_claims_ = 0;
  int num_in_force_ = 0;
};

}  // namespace freeflex::service
