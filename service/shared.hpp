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

/// [B] of the largest command under a key: a force_t of 8112 in an envelope_t with the longest key id.
inline constexpr int kMaxRawBytes = 8216;
/// What of an InboundEntry counts: a command, or where keys are required the bytes of a message on FORCE or
/// CONTROL. In shared memory it may hold any other number.
enum class InboundKind : std::int32_t { kForce = 1, kControl = 2, kRawForce = 3, kRawControl = 4 };
/// Ingress -> simulation, or ingress -> verifier -> simulation.
struct InboundEntry {
  std::int64_t received_ns;  // CLOCK_MONOTONIC
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

/// Written by the daemon before the ingress starts; the ingress maps it read-only.
struct IngressSettings {
  std::int64_t session = 0;
  std::int32_t daemon_pid = 0;  // the ingress ends when this is no longer its parent
  bool are_keys_required = false;
  std::array<char, 256> lcm_url{};
  std::array<char, 64> channel_prefix{};
  io::NameTable names;
};

/// Last sequence of each sender in this session. Only the ingress uses it; it stands here to outlive a
/// restart.
struct SenderTable {
  static constexpr int kMaxSenders = 64;
  struct Record {
    std::array<char, kSenderSize> sender{};
    std::atomic<std::int64_t> last_sequence{0};
  };
  std::atomic<std::int32_t> num_senders{0};  // raised after the record is complete
  std::array<Record, kMaxSenders> records{};
};

/// The daemon makes it, the ingress fills it. Past settings all of it is untrusted by the daemon. Where keys
/// are required the verifier fills another one, in the daemon's own memory, for simulation and publisher.
struct SharedBlock {
  static constexpr std::size_t kPageSize = 4096;  // [B]
  static constexpr std::size_t kSettingsSize =
      (sizeof(IngressSettings) + kPageSize - 1) / kPageSize * kPageSize;

  alignas(kPageSize) IngressSettings settings;
  // all below: written by the ingress
  alignas(kPageSize) std::atomic<std::uint32_t> is_ready{0};  // subscribed; 0 at each start
  std::atomic<std::int64_t> receive_buffer{0};                // [B] what the kernel gave the socket
  std::atomic<std::int64_t> received{0};                      // messages on FORCE and CONTROL
  std::atomic<std::int64_t> dropped_answers{0};               // the ring of rejections was full
  std::atomic<std::int64_t> other_session{0};                 // of another daemon's STATUS on this prefix
  std::array<std::atomic<std::int64_t>, io::kNumReasons> rejections{};  // by reason
  SenderTable senders;
  Ring<InboundEntry, 1024> inbound;
  Ring<RejectionEntry, 1024> rejected;
};
static_assert(std::atomic<std::int64_t>::is_always_lock_free, "shared between processes");

}  // namespace freeflex::service
