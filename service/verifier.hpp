// The thread that opens commands under a key. It stands between the ingress, which may be in somebody else's
// hands, and the simulation: of what lies in the shared block it believes nothing but a right tag.
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

/// So many a second, and as many as one second brings in one burst, at least one.
class TokenBucket {
 public:
  explicit TokenBucket(double per_second);  // [1/s]
  /// True when there is one left.  \param now_ns  [ns] of a clock that never goes back
  bool take(std::int64_t now_ns) noexcept;

 private:
  double per_second_;
  double tokens_;
  std::int64_t filled_ns_ = 0;
};

/// Takes messages as bytes out of the ingress's ring, checks who sealed them, then what they say, and gives
/// the commands that may be obeyed to the simulation. Takes no other step than the tag's for what bears none:
/// no generated decode, no allocation but for a line of the log.
class Verifier {
 public:
  struct Options {
    std::int64_t session = 0;
    std::string channel_prefix;
  };
  struct Time {
    std::int64_t wall_us = 0;  // [us] CLOCK_REALTIME, which valid_until is held against
    std::int64_t now_ns = 0;   // [ns] CLOCK_BOOTTIME
  };

  /// \param names    copied: the ingress's own is not trusted
  /// \param ingress  whose inbound ring is read; it must outlive this
  Verifier(std::vector<Key> keys, const Options& options, const io::NameTable& names, SharedBlock& ingress,
           LimitedLog::Write write = write_line);

  /// Body of the thread; returns after request_stop().
  void run();
  /// Any thread.
  void request_stop() noexcept { is_stopping_.store(true, std::memory_order_relaxed); }

  /// Takes one message; false when there is none.
  bool take(const Time& time);

  /// What simulation and publisher read in place of the ingress's block: verified commands, rejections that
  /// are answered, counts.
  SharedBlock& block() { return *block_; }

 private:
  struct Holder {
    Key key;
    std::int64_t last_sequence = 0;  // in this session
    TokenBucket bucket;              // unused when the key has no rate
  };
  void verify(std::span<const std::byte> bytes, bool is_force, const Time& time);
  void verify_claim(const Envelope& envelope, Holder& holder, bool is_force, const Time& time);
  io::Admission admit(const Envelope& envelope, Holder& holder, bool is_force, const Time& time);
  void refuse_plain(std::span<const std::byte> bytes, const Time& time);
  Holder* find(std::string_view key_id) noexcept;
  void count(io::Reason reason) noexcept;
  void answer(const io::Admission& admission) noexcept;
  void count_lost() noexcept;

  std::vector<Holder> holders_;  // by id
  const std::int64_t session_;
  const std::string force_channel_, control_channel_;
  const io::NameTable names_;
  SharedBlock& ingress_;
  std::unique_ptr<SharedBlock> block_;
  LimitedLog log_;
  TokenBucket plain_answers_;
  std::int64_t num_lost_ = 0;  // of those the ingress had no room for, counted so far
  std::unique_ptr<InboundEntry> taken_, verified_;
  std::atomic<bool> is_stopping_{false};
};

/// kNotGranted or kOverKeyLimit with what was found and what the key may do.
io::Reason check_grants(const ForceCommand& command, const Key& key, std::span<char> text) noexcept;
io::Reason check_grants(const io::ControlCommand& command, const Key& key, std::span<char> text) noexcept;

}  // namespace freeflex::service
