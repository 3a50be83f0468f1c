// The thread that verifies sealed commands. The verifier is placed between the ingress, which an attacker may
// control, and the simulation. The verifier trusts no message in the shared block that has no valid tag.
#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "service/envelope.hpp"
#include "service/keys.hpp"
#include "service/limited_log.hpp"
#include "service/shared.hpp"

namespace freeflex::service {

/// Limits a rate by tokens. A burst may use the tokens of one second, but always at least one token.
class TokenBucket {
 public:
  explicit TokenBucket(double per_second);  // [1/s]
  /// Takes a token, or returns false if there is none.  \param now_ns  [ns] time of a monotonic clock
  bool take(std::int64_t now_ns) noexcept;

 private:
  double per_second_;
  double tokens_;
  std::int64_t filled_ns_ = 0;
};

/// Takes messages as bytes from the ingress's ring, checks which key sealed them, then checks their contents,
/// and passes valid commands to the simulation. A message without a valid tag reaches no generated decoder,
/// and nothing is allocated for it except a log line.
class Verifier {
 public:
  struct Options {
    std::int64_t session = 0;
    std::string channel_prefix;
  };
  struct Time {
    std::int64_t wall_us = 0;  // [us] CLOCK_REALTIME, for valid_until
    std::int64_t now_ns = 0;   // [ns] CLOCK_BOOTTIME
  };

  /// \param names    names that are copied, because the ingress's table is not trusted
  /// \param ingress  block whose inbound ring is read; must outlive this object
  Verifier(std::vector<Key> keys, const Options& options, const io::NameTable& names, SharedBlock& ingress,
           LimitedLog::Write write = write_line);

  /// The body of the thread. It returns after request_stop().
  void run();
  /// Makes run() return. Any thread may call this function.
  void request_stop() noexcept { is_stopping_.store(true, std::memory_order_relaxed); }

  /// Takes and handles one message, or returns false if there is none.
  bool take(const Time& time);

  /// Returns the block that simulation and publisher read instead of the ingress's block. The block contains
  /// verified commands, rejections to answer and counts.
  SharedBlock& block() { return *block_; }

 private:
  struct Holder {
    Key key;
    std::int64_t last_sequence = 0;  // last sequence in this session
    TokenBucket bucket;              // unused if the key has no limit
  };
  void verify(std::span<const std::byte> bytes, bool is_force, const Time& time);
  void verify_claim(const Envelope& envelope, Holder& holder, bool is_force, const Time& time);
  io::Admission admit(const Envelope& envelope, Holder& holder, bool is_force, const Time& time);
  void refuse_plain(std::span<const std::byte> bytes, const Time& time);
  Holder* find(std::string_view key_id) noexcept;
  void count(io::Reason reason) noexcept;
  void answer(const io::Admission& admission) noexcept;
  void count_lost() noexcept;

  std::vector<Holder> holders_;  // ordered by id
  const std::int64_t session_;
  const std::string force_channel_, control_channel_;
  const io::NameTable names_;
  SharedBlock& ingress_;
  std::unique_ptr<SharedBlock> block_;
  LimitedLog log_;
  TokenBucket plain_answers_;
  std::int64_t num_lost_ = 0;  // messages counted as lost so far
  std::unique_ptr<InboundEntry> taken_, verified_;
  std::atomic<bool> is_stopping_{false};
};

/// Both functions return kAccepted, kNotGranted or kOverKeyLimit. Unless they return kAccepted, they write to
/// `text` what was found and what the key allows.
io::Reason check_grants(const ForceCommand& command, const Key& key, std::span<char> text) noexcept;
io::Reason check_grants(const io::ControlCommand& command, const Key& key, std::span<char> text) noexcept;

}  // namespace freeflex::service
