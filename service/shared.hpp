// Memory shared by the daemon and its ingress process. Trivially copyable, address-free.
#pragma once

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <type_traits>

#include "core/step/command.hpp"
#include "service/io/wire/codec.hpp"

namespace freeflex::service {

/// Single-producer single-consumer ring of trivially copyable entries. The consumer treats the producer as
/// untrusted: a distance outside [0, Capacity] is a fault of the producer and empties the ring; every index
/// is taken modulo Capacity, so whatever stands in head_ and tail_ no access leaves the array; an entry is
/// copied out before anything looks at it. Overwriting tail_ gains a hostile producer nothing that pushing
/// would not: entries again, entries lost, a ring that is never empty. The consumer therefore takes a bounded
/// number of entries at a time and checks each (io::is_sane).
template <class Entry, int Capacity>
class Ring {
  static_assert(std::is_trivially_copyable_v<Entry>);
  static_assert((Capacity & (Capacity - 1)) == 0, "power of two");

 public:
  static constexpr int kCapacity = Capacity;

  /// Producer only. False when full.
  bool try_push(const Entry& entry) noexcept {
    const std::uint64_t head = head_.load(std::memory_order_relaxed);
    if (head - tail_.load(std::memory_order_acquire) >= Capacity) return false;
    entries_[head % Capacity] = entry;
    head_.store(head + 1, std::memory_order_release);
    return true;
  }
  /// Producer only. Entries that try_push would take now; the consumer can only raise it.
  int num_free() const noexcept {
    return Capacity -
           static_cast<int>(head_.load(std::memory_order_relaxed) - tail_.load(std::memory_order_acquire));
  }
  /// Consumer only. False when empty.
  bool try_pop(Entry& entry) noexcept {
    const std::uint64_t tail = tail_.load(std::memory_order_relaxed);
    const std::uint64_t head = head_.load(std::memory_order_acquire);
    if (head == tail) return false;
    if (head - tail > Capacity) {  // producer's index is wild: drop what it claims
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

/// [B] of the longest command as it is sent: sender and 22 fields beside the lists, then 28 B a force or
/// torque, 52 B a wrench and 12 B a wheel. An entry has room for as many.
inline constexpr std::size_t kMaxCommandBytes = 8760;
/// [B] of the longest under a key: that in an envelope_t with the longest key id.
inline constexpr int kMaxRawBytes = static_cast<int>(kMaxCommandBytes) + 104;
/// What of an InboundEntry counts: a command, or where keys are required the bytes of a message on FORCE or
/// CONTROL. In shared memory it may hold any other number.
enum class InboundKind : std::int32_t { kForce = 1, kControl = 2, kRawForce = 3, kRawControl = 4 };
/// Ingress -> simulation, or ingress -> verifier -> simulation.
struct InboundEntry {
  std::int64_t received_ns;  // CLOCK_BOOTTIME
  InboundKind kind;
  std::int32_t num_raw_bytes;  // of the message; one above kMaxRawBytes was not copied
  union {
    ForceCommand force;
    std::array<std::byte, kMaxRawBytes> raw;
  };
  io::ControlCommand control;
};
static_assert(sizeof(ForceCommand) >= kMaxRawBytes, "raw bytes take no room of their own");
/// Ingress -> publisher: a rejection to answer.
struct RejectionEntry {
  io::Admission admission;
};

/// What the ingress must know. It maps them read-only and nobody can write to them any more.
struct IngressSettings {
  std::int64_t session = 0;
  std::int32_t daemon_pid = 0;  // the ingress ends when this is no longer its parent
  bool are_keys_required = false;
  std::array<char, 64> channel_prefix{};
  io::NameTable names;
};

/// Last sequence of each sender in this session. The ingress uses it; it stands here to outlive a restart.
/// When the places for any sender are taken, one that was silent for kForget gives way; one that only sends
/// controls has a place in any case, for which the one that was silent longest among those gives way: nobody
/// can keep a STOP out with invented names.
struct SenderTable {
  static constexpr int kMaxSenders = 64;                   // of any command
  static constexpr int kMaxControls = 16;                  // of controls, when the others are taken
  static constexpr std::int64_t kForget = 60'000'000'000;  // [ns]
  struct Record {
    std::array<char, kSenderSize> sender{};  // empty: nobody's
    std::atomic<std::int64_t> last_sequence{0};
    std::atomic<std::int64_t> heard_ns{0};  // CLOCK_BOOTTIME
  };
  std::array<Record, kMaxSenders + kMaxControls> records{};
};
/// Lets new senders have the places of those that target names, as of CLEAR. Their sequences stay until then:
/// a copy of an old command is refused as before. For the daemon's side: it changes nothing but times.
void release_places(SenderTable& senders, const std::array<char, kSenderSize>& target) noexcept;

/// One process's place in the block: the one that receives has one, the one that stands by the other.
struct IngressSeat {
  // raised at every turn of its loop, 50 times a second or more; 0: not ready yet
  alignas(64) std::atomic<std::uint64_t> beat{0};
  std::atomic<std::uint32_t> lacks{0};  // what confine() could not do
};

/// The daemon makes it, the ingress fills it. All of it is untrusted by the daemon. Where keys are required
/// the verifier fills another one, in the daemon's own memory, for simulation and publisher.
struct SharedBlock {
  std::array<IngressSeat, 2> seats;
  std::atomic<std::int64_t> received{0};         // messages on FORCE and CONTROL
  std::atomic<std::int64_t> dropped_answers{0};  // the ring of rejections was full
  std::atomic<std::int64_t> other_session{0};    // of another daemon's STATUS on this prefix
  std::array<std::atomic<std::int64_t>, io::kNumReasons> rejections{};  // by reason
  SenderTable senders;
  static constexpr int kControlPlaces = 64;  // of inbound, that forces leave free
  Ring<InboundEntry, 1024> inbound;
  Ring<RejectionEntry, 1024> rejected;

  /// Of inbound, for this kind.
  static constexpr int num_places(InboundKind kind) noexcept {
    const bool is_control = kind == InboundKind::kControl || kind == InboundKind::kRawControl;
    return decltype(inbound)::kCapacity - (is_control ? 0 : kControlPlaces);
  }
  /// Producer of inbound only. False when there is no place for it.
  bool try_push(const InboundEntry& entry) noexcept {
    const int num_kept = decltype(inbound)::kCapacity - num_places(entry.kind);
    return inbound.num_free() > num_kept && inbound.try_push(entry);
  }
};
static_assert(std::atomic<std::int64_t>::is_always_lock_free, "shared between processes");

/// What the supervisor counts and the status tells.
struct IngressCounts {
  std::atomic<std::int64_t> restarts{0};  // processes replaced
  std::atomic<std::int64_t> hangs{0};     // of them, those that hung
};

}  // namespace freeflex::service
