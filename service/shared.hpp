// Types in the memory that the daemon shares with its ingress process. These types are trivially copyable and
// contain no addresses.
#pragma once

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <type_traits>

#include "core/step/command.hpp"
#include "service/io/wire/codec.hpp"

namespace freeflex::service {

/// Single-producer single-consumer ring of trivially copyable entries. The consumer does not trust the
/// producer. A distance head_ - tail_ outside [0, Capacity] is a fault of the producer, and the consumer
/// empties the ring. Every index is taken modulo Capacity, so no value of head_ or tail_ leads to an access
/// outside the array. An entry is copied out before it is examined. If a hostile producer overwrites tail_,
/// it can only repeat entries, lose entries or keep the ring from becoming empty, which it could also do by
/// pushing. The consumer therefore takes a limited number of entries at a time and checks each of them
/// (io::is_sane).
template <class Entry, int Capacity>
class Ring {
  static_assert(std::is_trivially_copyable_v<Entry>);
  static_assert((Capacity & (Capacity - 1)) == 0, "power of two");

 public:
  static constexpr int kCapacity = Capacity;

  /// Only the producer calls this function. Adds an entry, or returns false if the ring is full.
  bool try_push(const Entry& entry) noexcept {
    const std::uint64_t head = head_.load(std::memory_order_relaxed);
    if (head - tail_.load(std::memory_order_acquire) >= Capacity) return false;
    entries_[head % Capacity] = entry;
    head_.store(head + 1, std::memory_order_release);
    return true;
  }
  /// Only the producer calls this function. Returns the number of free entries. The consumer can only
  /// increase this number.
  int num_free() const noexcept {
    return Capacity -
           static_cast<int>(head_.load(std::memory_order_relaxed) - tail_.load(std::memory_order_acquire));
  }
  /// Only the consumer calls this function. Takes the oldest entry, or returns false if the ring is empty.
  bool try_pop(Entry& entry) noexcept {
    const std::uint64_t tail = tail_.load(std::memory_order_relaxed);
    const std::uint64_t head = head_.load(std::memory_order_acquire);
    if (head == tail) return false;
    if (head - tail > Capacity) {  // the producer's index is impossible, so empty the ring
      tail_.store(head, std::memory_order_release);
      return false;
    }
    entry = entries_[tail % Capacity];
    tail_.store(tail + 1, std::memory_order_release);
    return true;
  }

 private:
  alignas(64) std::atomic<std::uint64_t> head_{0};
  alignas(64) std::atomic<std::uint64_t> tail_{0};
  alignas(64) std::array<Entry, Capacity> entries_{};
};

/// [B] Size of the longest command on the wire. The command consists of the sender and 22 fields outside the
/// lists, 28 B for each force or torque, 52 B for each wrench and 12 B for each wheel. An entry has room for
/// a command of this size.
inline constexpr std::size_t kMaxCommandBytes = 8760;
/// [B] Size of the longest sealed command, which is the longest command in an envelope_t with the longest key
/// id.
inline constexpr int kMaxRawBytes = static_cast<int>(kMaxCommandBytes) + 104;
/// States which member of an InboundEntry is valid: a command or, if keys are required, the bytes of a
/// message on FORCE or CONTROL. In shared memory the value may be any other number.
enum class InboundKind : std::int32_t { kForce = 1, kControl = 2, kRawForce = 3, kRawControl = 4 };
/// An entry of the ring from the ingress to the simulation. If keys are required, the ring from the ingress
/// ends at the verifier, and a second ring leads from the verifier to the simulation.
struct InboundEntry {
  std::int64_t received_ns;  // [ns] CLOCK_BOOTTIME of reception
  InboundKind kind;
  std::int32_t num_raw_bytes;  // size of the message, which was not copied if the size is above kMaxRawBytes
  union {
    ForceCommand force;
    std::array<std::byte, kMaxRawBytes> raw;
  };
  io::ControlCommand control;
};
static_assert(sizeof(ForceCommand) >= kMaxRawBytes, "raw bytes take no room of their own");
/// The ingress sends this entry to the publisher. The entry is a rejection that the publisher answers.
struct RejectionEntry {
  io::Admission admission;
};

/// Settings for the ingress. The ingress maps these settings read-only. If they are in a file (SharedMemory),
/// no process can change them.
struct IngressSettings {
  std::int64_t session = 0;
  std::int32_t daemon_pid = 0;  // the ingress ends when this process is no longer its parent
  bool are_keys_required = false;
  std::array<char, 64> channel_prefix{};
  io::NameTable names;
};

/// Keeps the last sequence of each sender in this session, for the ingress. The table is in shared memory, so
/// it survives a restart of the ingress. If all places are taken, a new sender replaces a sender that was
/// silent for kForget. A sender of a control always gets a place: if no other place is free, it replaces the
/// sender in the kMaxControls extra places that was silent for longest. Therefore nobody can prevent a STOP
/// by using many names.
struct SenderTable {
  static constexpr int kMaxSenders = 64;                   // places for senders of any command
  static constexpr int kMaxControls = 16;                  // extra places for controls
  static constexpr std::int64_t kForget = 60'000'000'000;  // [ns]
  struct Record {
    std::array<char, kSenderSize> sender{};  // empty if the place is free
    std::atomic<std::int64_t> last_sequence{0};
    std::atomic<std::int64_t> heard_ns{0};  // CLOCK_BOOTTIME
  };
  std::array<Record, kMaxSenders + kMaxControls> records{};
};
/// Makes the places of cleared senders available to new senders. The target of the CLEAR selects the cleared
/// senders. Until a new sender takes a place, the sequence in it stays, so a copy of an old command is still
/// refused. The table belongs to the ingress, but the daemon may call this function, because it changes only
/// times, which are atomic.
void release_places(SenderTable& senders, const std::array<char, kSenderSize>& target) noexcept;

/// State of one ingress process, the receiving one or the standby, in the block.
struct IngressSeat {
  // the process increments this count in every iteration of its loop, at least 50 times a second. 0 means not
  // ready yet.
  alignas(64) std::atomic<std::uint64_t> beat{0};
  std::atomic<std::uint32_t> lacks{0};  // parts of the confinement that failed
};

/// Block that the daemon creates and the ingress fills. The daemon trusts none of the contents of the block.
/// If keys are required, the verifier fills a second block, in the daemon's own memory, for simulation and
/// publisher.
struct SharedBlock {
  std::array<IngressSeat, 2> seats;
  std::atomic<std::int64_t> received{0};         // number of messages on FORCE and CONTROL
  std::atomic<std::int64_t> dropped_answers{0};  // rejections lost because their ring was full
  std::atomic<std::int64_t> other_session{0};    // session in the STATUS of another daemon on this prefix
  std::array<std::atomic<std::int64_t>, io::kNumReasons> rejections{};  // by reason
  SenderTable senders;
  static constexpr int kControlPlaces = 64;  // places of inbound that are reserved for controls
  Ring<InboundEntry, 1024> inbound;
  Ring<RejectionEntry, 1024> rejected;

  /// Returns how many places in `inbound` entries of this kind may fill. The last kControlPlaces are for
  /// controls only.
  static constexpr int num_places(InboundKind kind) noexcept {
    const bool is_control = kind == InboundKind::kControl || kind == InboundKind::kRawControl;
    return decltype(inbound)::kCapacity - (is_control ? 0 : kControlPlaces);
  }
  /// Only the producer of inbound calls this function. Adds an entry, or returns false if there is no place
  /// for this kind of entry.
  bool try_push(const InboundEntry& entry) noexcept {
    const int num_kept = decltype(inbound)::kCapacity - num_places(entry.kind);
    return inbound.num_free() > num_kept && inbound.try_push(entry);
  }
};
static_assert(std::atomic<std::int64_t>::is_always_lock_free, "shared between processes");

/// Counts that the supervisor keeps for the status.
struct IngressCounts {
  std::atomic<std::int64_t> restarts{0};  // processes replaced
  std::atomic<std::int64_t> hangs{0};     // how many of these processes hung
};

}  // namespace freeflex::service
