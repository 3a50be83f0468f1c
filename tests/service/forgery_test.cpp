// FREEFLEX_FORGERIES forged, copied, redirected and expired commands are sent between honest commands. No
// forgery is accepted, each is counted once, and every honest command arrives.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdio>
#include <random>

#include "tests/service/verifier_rig.hpp"

namespace freeflex::testing {
namespace {

using io::Reason;
using service::Key;
using Bytes = std::vector<std::byte>;

constexpr int kKinds = 14;

/// Makes the packets that somebody without alice's secret can send, with or without having overheard packets
/// of alice.
class Forger {
 public:
  explicit Forger(VerifierRig& rig) : rig_(rig) {}

  /// Returns a new packet from alice, which the forger stores for later.
  Bytes honest(bool is_force) {
    ++sequence_;
    heard_ = is_force ? seal(force(sequence_), kForceChannel, alice_.sealing, rig_.valid_until())
                      : seal(control_of(sequence_), kControlChannel, alice_.sealing, rig_.valid_until());
    heard_is_force_ = is_force;
    return heard_;
  }
  std::int64_t sequence() const { return sequence_; }

  void send(int kind) {
    const std::int64_t next = sequence_ + 1 + below(1000);
    const std::int64_t now = rig_.time.wall_us;
    switch (kind) {
      case 0: {  // a command with a random tag
        Bytes bytes = seal(force(next), kForceChannel, thief_.sealing, rig_.valid_until());
        for (std::size_t i = bytes.size() - 32; i < bytes.size(); ++i) bytes[i] = any_byte();
        return rig_.deliver(bytes);
      }
      case 1:  // a command sealed with another secret under alice's name
        return rig_.deliver(seal(force(next), kForceChannel, thief_.sealing, rig_.valid_until()));
      case 2:  // a command sealed under an unknown name
        return rig_.deliver(seal(force(next), kForceChannel, stranger_.sealing, rig_.valid_until()));
      case 3:  // alice's command, sent again unchanged
        return rig_.deliver(heard_, heard_is_force_);
      case 4: {  // alice's command with one bit changed
        Bytes bytes = heard_;
        bytes[below(bytes.size())] ^= static_cast<std::byte>(1u << below(8));
        return rig_.deliver(bytes, heard_is_force_);
      }
      case 5: {  // alice's command with another sequence (8 bytes after fingerprint, id and session)
        Bytes bytes = heard_;
        for (std::size_t i = 0; i < 8; ++i)
          bytes[26 + i] = static_cast<std::byte>(static_cast<std::uint64_t>(next) >> (56 - 8 * i));
        return rig_.deliver(bytes, heard_is_force_);
      }
      case 6:  // alice's command on the other channel
        return rig_.deliver(heard_, !heard_is_force_);
      case 7:  // alice's command for a daemon on another prefix
        return rig_.deliver(seal(force(next), "OTHER_FORCE", alice_.sealing, rig_.valid_until()));
      case 8: {  // alice's command for another session
        freeflex_msgs::force_t old = force(next);
        old.session = kSession - 1 - below(1000);
        return rig_.deliver(seal(old, kForceChannel, alice_.sealing, rig_.valid_until()));
      }
      case 9:  // alice's command, delayed until it was no longer valid
        ++sequence_;
        return rig_.deliver(
            seal(force(sequence_), kForceChannel, alice_.sealing, now - 1 - below(1'000'000)));
      case 10:  // alice's command whose validity is too long
        ++sequence_;
        return rig_.deliver(
            seal(force(sequence_), kForceChannel, alice_.sealing, now + io::kMaxValidity + 1 + below(1000)));
      case 11:  // a command without an envelope
        return rig_.deliver(io::encode(force(next)));
      case 12: {  // alice's command, cut or extended
        Bytes bytes = heard_;
        bytes.resize(below(2 * bytes.size()));
        if (bytes.size() == heard_.size()) bytes.pop_back();
        return rig_.deliver(bytes, heard_is_force_);
      }
      default:  // alice's command with random changes
        Bytes bytes = heard_;
        for (int n = 0; n < 3; ++n)
          for (std::size_t i = below(bytes.size()), end = std::min(bytes.size(), i + 8); i < end; ++i)
            bytes[i] = any_byte();
        if (bytes == heard_) bytes[0] ^= std::byte{1};
        return rig_.deliver(bytes, heard_is_force_);
    }
  }
  std::uint64_t below(std::uint64_t limit) { return engine_() % limit; }

 private:
  freeflex_msgs::force_t force(std::int64_t sequence) const { return force_of(sequence); }
  std::byte any_byte() { return static_cast<std::byte>(engine_() & 0xFFU); }
  static Key named(Key key, const std::string& id) {
    key.sealing.id = id;
    return key;
  }

  VerifierRig& rig_;
  std::mt19937_64 engine_{2026};
  const Key alice_ = make_key("alice"), thief_ = named(make_key("thief"), "alice"),
            stranger_ = make_key("stranger");
  std::int64_t sequence_ = 0;
  Bytes heard_;
  bool heard_is_force_ = true;
};

TEST(FREEFLEX_FORGERY_NAME, NoForgeryIsAcceptedAndEachIsCounted) {
  VerifierRig rig({make_key("alice"), make_key("bob")});
  Forger forger(rig);
  int num_honest = 0;
  for (int i = 0; i < FREEFLEX_FORGERIES; ++i) {
    if (i % 100 == 0) {
      const bool is_force = i % 200 == 0;
      rig.deliver(forger.honest(is_force), is_force);
      const auto command = rig.next_command();
      ASSERT_TRUE(command) << i;
      ASSERT_EQ(is_force ? command->force.sequence : command->control.sequence, forger.sequence());
      ++num_honest;
    }
    forger.send(i % kKinds);
    ASSERT_FALSE(rig.next_command()) << "forgery " << i << " of kind " << i % kKinds;
    rig.time.wall_us += 10;
    rig.time.now_ns += 10'000;
    // answers go only to alice, for new commands that she sealed, and to senders without a key
    for (io::Admission answer = rig.next_answer(); answer.reason != Reason::kAccepted;
         answer = rig.next_answer()) {
      ASSERT_TRUE(answer.reason == Reason::kExpired || answer.reason == Reason::kValidTooLong ||
                  answer.reason == Reason::kKeyRequired)
          << io::reason_name(answer.reason);
    }
    rig.log.clear();
  }
  std::int64_t num_refused = 0;
  for (int reason = 1; reason < io::kNumReasons; ++reason) {
    const std::int64_t count = rig.count(static_cast<Reason>(reason));
    num_refused += count;
    if (count > 0) std::printf("%-16s %8ld\n", io::reason_name(static_cast<Reason>(reason)), count);
  }
  EXPECT_EQ(num_refused, FREEFLEX_FORGERIES);
  EXPECT_EQ(rig.verifier->block().received.load(), FREEFLEX_FORGERIES + num_honest);
  for (const Reason reason :
       {Reason::kMalformed, Reason::kWrongType, Reason::kWrongSession, Reason::kStaleSequence,
        Reason::kKeyRequired, Reason::kUnknownKey, Reason::kBadTag, Reason::kExpired, Reason::kValidTooLong})
    EXPECT_GT(rig.count(reason), 0) << io::reason_name(reason);
}

}  // namespace
}  // namespace freeflex::testing
