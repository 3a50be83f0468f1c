// These tests check the rules for sealed commands, and the answers to commands that break a rule.
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <functional>
#include <iterator>
#include <new>
#include <span>
#include <thread>

#include "tests/service/verifier_rig.hpp"

namespace freeflex::testing {
namespace {

using freeflex_msgs::control_t;
using freeflex_msgs::force_t;
using io::Reason;
using service::InboundKind;
using service::Key;

const Key kAlice = make_key("alice"), kBob = make_key("bob");

class VerifierTest : public ::testing::Test {
 protected:
  /// Expects one refusal with an answer to alice, and no accepted command. Returns the text of the answer.
  std::string refused(Reason reason, std::int64_t sequence) {
    EXPECT_FALSE(rig_.next_command());
    const io::Admission answer = rig_.next_answer();
    EXPECT_EQ(answer.reason, reason) << answer.text.data();
    EXPECT_STREQ(answer.sender.data(), "alice");
    EXPECT_EQ(answer.sequence, sequence);
    EXPECT_TRUE(io::is_sane(answer));
    return answer.text.data();
  }
  /// Expects `count` refusals so far for this reason, without an answer.
  void dropped(Reason reason, std::int64_t count = 1) {
    EXPECT_FALSE(rig_.next_command());
    EXPECT_EQ(rig_.next_answer().reason, Reason::kAccepted);
    EXPECT_EQ(rig_.count(reason), count) << io::reason_name(reason);
  }
  bool accepts(std::int64_t sequence) {
    rig_.seal_and_deliver(force_of(sequence), kAlice);
    const auto entry = rig_.next_command();
    return entry && entry->force.sequence == sequence;
  }
  VerifierRig rig_{{kAlice, kBob}};
};

TEST_F(VerifierTest, PassesOnASealedCommandUnchanged) {
  rig_.seal_and_deliver(force_of(7), kAlice);
  const auto force = rig_.next_command();
  ASSERT_TRUE(force);
  EXPECT_EQ(force->kind, InboundKind::kForce);
  force_t sent = force_of(7);
  sent.sender = "alice";
  EXPECT_EQ(io::encode(io::to_message(force->force, sent.session, sent.utime)), io::encode(sent));
  EXPECT_GT(force->received_ns, 0);
  EXPECT_LE(force->received_ns, rig_.time.now_ns);
  rig_.seal_and_deliver(control_of(8), kAlice);
  const auto control = rig_.next_command();
  ASSERT_TRUE(control);
  EXPECT_EQ(control->kind, InboundKind::kControl);
  EXPECT_EQ(control->control.command, control_t::RUN);
  EXPECT_STREQ(control->control.sender.data(), "alice");
  EXPECT_EQ(rig_.verifier->block().received.load(), 2);
  EXPECT_EQ(rig_.next_answer().reason, Reason::kAccepted);
}

TEST_F(VerifierTest, TheAnswerToAPlainCommandSaysThatAKeyIsRequired) {
  rig_.deliver(io::encode(force_of(7)));
  const io::Admission answer = rig_.next_answer();
  EXPECT_EQ(answer.reason, Reason::kKeyRequired);
  EXPECT_STREQ(answer.sender.data(), "pusher-1.a_B");
  EXPECT_EQ(answer.sequence, 7);
  EXPECT_STREQ(answer.text.data(), "this daemon accepts only commands with a key; seal it in an envelope_t");
  rig_.deliver(io::encode(control_of(8)), false);
  EXPECT_EQ(rig_.next_answer().reason, Reason::kKeyRequired);
  EXPECT_FALSE(rig_.next_command());
}

TEST_F(VerifierTest, PlainCommandsGetAtMostTenAnswersASecondAndNoneUnderAKeyId) {
  force_t plain = force_of(7);
  plain.sender = "alice";
  rig_.deliver(io::encode(plain));
  dropped(Reason::kKeyRequired, 1);
  const auto answers = [this] {
    int num_answers = 0;
    for (int i = 0; i < 1000; ++i) rig_.deliver(io::encode(force_of(8)));
    while (rig_.next_answer().reason == Reason::kKeyRequired) ++num_answers;
    return num_answers;
  };
  EXPECT_EQ(answers(), 10);
  rig_.time.now_ns += 500'000'000;
  EXPECT_EQ(answers(), 5);
  rig_.time.now_ns += 3'600'000'000'000;
  EXPECT_EQ(answers(), 10);
  EXPECT_EQ(rig_.count(Reason::kKeyRequired), 3001);
}

TEST_F(VerifierTest, AForgedTagIsCountedAndNotAnswered) {
  Key thief = kBob;
  thief.sealing.id = "alice";
  rig_.seal_and_deliver(force_of(7), thief);
  dropped(Reason::kBadTag);
  ASSERT_EQ(rig_.log.size(), 1u);
  EXPECT_NE(rig_.log[0].find("a command on TEST_FORCE that names key 'alice' was not sealed with it"),
            std::string::npos)
      << rig_.log[0];
  EXPECT_TRUE(accepts(7)) << "a forgery does not use up the sequence";
}

TEST_F(VerifierTest, ACommandUnderAnUnknownKeyIsCountedAndNotAnswered) {
  rig_.seal_and_deliver(force_of(7), make_key("mallory"));
  dropped(Reason::kUnknownKey);
}

TEST_F(VerifierTest, ACommandSealedForOneChannelIsRefusedOnTheOther) {
  rig_.deliver(seal(force_of(7), kForceChannel, kAlice.sealing, rig_.valid_until()), false);
  dropped(Reason::kBadTag, 1);
  rig_.deliver(seal(control_of(8), kControlChannel, kAlice.sealing, rig_.valid_until()), true);
  dropped(Reason::kBadTag, 2);
  rig_.deliver(seal(force_of(9), "TEST2_FORCE", kAlice.sealing, rig_.valid_until()), true);
  dropped(Reason::kBadTag, 3);
}

TEST_F(VerifierTest, ACommandIsAcceptedOnceAndItsCopyIsNotAnswered) {
  const auto sealed = seal(force_of(7), kForceChannel, kAlice.sealing, rig_.valid_until());
  rig_.deliver(sealed);
  EXPECT_TRUE(rig_.next_command());
  rig_.deliver(sealed);
  dropped(Reason::kStaleSequence, 1);
  rig_.seal_and_deliver(force_of(6), kAlice);
  dropped(Reason::kStaleSequence, 2);
  rig_.seal_and_deliver(control_of(7), kAlice);
  dropped(Reason::kStaleSequence, 3);
  EXPECT_TRUE(accepts(8));
  rig_.seal_and_deliver(force_of(7), kBob);
  EXPECT_TRUE(rig_.next_command()) << "each key has its own sequences";
  rig_.seal_and_deliver(force_of(0), make_key("bob"));
  dropped(Reason::kStaleSequence, 4);
}

TEST_F(VerifierTest, ARestartedIngressDoesNotResetTheSequenceNumbers) {
  ASSERT_TRUE(accepts(7));
  new (rig_.ingress.get()) service::SharedBlock;
  rig_.seal_and_deliver(force_of(7), kAlice);
  dropped(Reason::kStaleSequence);
}

TEST_F(VerifierTest, ACommandForAnotherSessionIsCountedAndNotAnswered) {
  force_t other = force_of(7);
  other.session = kSession - 1;
  rig_.seal_and_deliver(other, kAlice);
  dropped(Reason::kWrongSession);
  EXPECT_TRUE(accepts(7));
}

TEST_F(VerifierTest, EnvelopesThatExpiredOrExpireTooLateAreRefused) {
  const std::int64_t now = rig_.time.wall_us;
  const auto send = [this](std::int64_t sequence, std::int64_t valid_until) {
    rig_.deliver(seal(force_of(sequence), kForceChannel, kAlice.sealing, valid_until));
  };
  send(1, now - 1);
  EXPECT_EQ(refused(Reason::kExpired, 1),
            "valid_until is 1699999999999999 us, but the daemon's clock is at 1700000000000000 us; send the "
            "command sooner after sealing it, or correct the clocks");
  send(2, now + io::kMaxValidity + 1);
  EXPECT_EQ(
      refused(Reason::kValidTooLong, 2),
      "valid_until is 1700000060000001 us, more than 60 s ahead of the daemon's clock (1700000000000000 "
      "us); use a shorter validity, or correct the clocks");
  send(3, INT64_MIN);
  refused(Reason::kExpired, 3);
  send(4, INT64_MAX);
  refused(Reason::kValidTooLong, 4);
  send(5, now);
  EXPECT_TRUE(rig_.next_command());
  send(6, now + io::kMaxValidity);
  EXPECT_TRUE(rig_.next_command());
  send(1, now);
  dropped(Reason::kStaleSequence);
}

TEST_F(VerifierTest, ACommandMustHaveTheSenderAndSequenceNumberOfItsEnvelope) {
  // builds the envelope by hand, because seal() never makes an envelope whose sender or sequence differs from
  // that of its command
  const auto send = [this](const std::string& sender, std::int64_t inner, std::int64_t outer) {
    freeflex_msgs::envelope_t envelope{};
    force_t force = force_of(inner);
    force.sender = sender;
    const auto body = io::encode(force);
    envelope.key_id = "alice";
    envelope.session = kSession;
    envelope.sequence = outer;
    envelope.valid_until = rig_.valid_until();
    for (const std::byte byte : body) envelope.body.push_back(std::to_integer<std::uint8_t>(byte));
    envelope.num_bytes = static_cast<std::int32_t>(body.size());
    auto sealed = io::encode(envelope);
    const SealTag tag = make_tag(std::span(sealed).first(sealed.size() - 32), kForceChannel, kAlice.sealing);
    for (std::size_t i = 0; i < 32; ++i) sealed[sealed.size() - 32 + i] = static_cast<std::byte>(tag[i]);
    rig_.deliver(sealed);
  };
  send("bob", 1, 1);
  EXPECT_EQ(refused(Reason::kKeyMismatch, 1),
            "the command has sender bob and sequence number 1, but must have alice and 1 as on its envelope");
  send("alice", 9, 2);
  refused(Reason::kKeyMismatch, 2);
  send("alice", 3, 3);
  EXPECT_TRUE(rig_.next_command());
}

TEST_F(VerifierTest, ASealedCommandIsCheckedLikeAPlainOne) {
  force_t far = force_of(1);
  far.forces[1].point = 300;
  rig_.seal_and_deliver(far, kAlice);
  EXPECT_EQ(refused(Reason::kUnknownPoint, 1),
            "forces[1]: point 300 does not exist; the scene has points 0 to 299");
  control_t odd = control_of(2);
  odd.command = 99;
  rig_.seal_and_deliver(odd, kAlice);
  refused(Reason::kBadControl, 2);
  // a control that is sealed for the channel FORCE is refused
  rig_.deliver(seal(control_of(3), kForceChannel, kAlice.sealing, rig_.valid_until()));
  refused(Reason::kWrongType, 3);
}

TEST_F(VerifierTest, BytesThatAreNotAnEnvelopeAreCountedAndNotAnswered) {
  rig_.deliver({});
  dropped(Reason::kMalformed, 1);
  auto sealed = seal(force_of(7), kForceChannel, kAlice.sealing, rig_.valid_until());
  sealed.pop_back();
  rig_.deliver(sealed);
  dropped(Reason::kMalformed, 2);
  rig_.deliver(std::vector<std::byte>(service::kMaxRawBytes + 1));
  dropped(Reason::kMalformed, 3);
  rig_.deliver(io::encode(control_of(8)), true);
  dropped(Reason::kWrongType, 1);
}

TEST_F(VerifierTest, RingEntriesThatOnlyAHostileIngressMakesAreCounted) {
  auto entry = std::make_unique<service::InboundEntry>();
  for (const std::int32_t kind : {0, 1, 2, 5, -1}) {
    entry->kind = static_cast<InboundKind>(kind);
    rig_.ingress->inbound.try_push(*entry);
  }
  entry->kind = InboundKind::kRawForce;
  for (const std::int32_t size : {-1, service::kMaxRawBytes + 1, INT32_MAX, INT32_MIN}) {
    entry->num_raw_bytes = size;
    rig_.ingress->inbound.try_push(*entry);
  }
  while (rig_.verifier->take(rig_.time)) continue;
  dropped(Reason::kMalformed, 9);
}

class GrantsTest : public VerifierTest {
 protected:
  /// Replaces the rig's verifier by a verifier that knows only alice's key, with these limits.
  void grant(const std::function<void(service::Grants&)>& limit) {
    Key key = kAlice;
    limit(key.grants);
    rig_.verifier = std::make_unique<service::Verifier>(
        std::vector{key}, service::Verifier::Options{.session = kSession, .channel_prefix = "TEST"},
        make_names(), *rig_.ingress, [](service::LineKind, const std::string&) {});
  }
};

TEST_F(GrantsTest, GrantsLimitChannelsAndControls) {
  grant([](service::Grants& grants) { grants.has_force = false, grants.controls = 1U << control_t::STOP; });
  rig_.seal_and_deliver(force_of(1), kAlice);
  EXPECT_EQ(refused(Reason::kNotGranted, 1),
            "FORCE is not among the channels of key alice; add it there, or use another key");
  rig_.seal_and_deliver(control_of(2), kAlice);
  EXPECT_EQ(refused(Reason::kNotGranted, 2),
            "control command 1 is not among the controls of key alice; add it there, or use another key");
  control_t stop = control_of(3);
  stop.command = control_t::STOP;
  rig_.seal_and_deliver(stop, kAlice);
  EXPECT_TRUE(rig_.next_command());
  grant([](service::Grants& grants) { grants.has_control = false; });
  rig_.seal_and_deliver(control_of(4), kAlice);
  EXPECT_EQ(refused(Reason::kNotGranted, 4),
            "CONTROL is not among the channels of key alice; add it there, or use another key");
}

TEST_F(GrantsTest, OnlyAKeyThatListsClearMayClear) {
  control_t clear = control_of(1);
  clear.command = control_t::CLEAR;
  clear.target = "bob";
  rig_.seal_and_deliver(clear, kAlice);
  EXPECT_EQ(refused(Reason::kNotGranted, 1),
            "control command 8 is not among the controls of key alice; add it there, or use another key");
  grant([](service::Grants& grants) { grants.controls = 1U << control_t::CLEAR; });
  clear.sequence = 2;
  rig_.seal_and_deliver(clear, kAlice);
  EXPECT_TRUE(rig_.next_command());
}

TEST_F(GrantsTest, GrantsLimitPointsGroupsAndSlots) {
  grant([](service::Grants& grants) {
    grants.points.assign(300, false);
    grants.points[0] = grants.points[298] = true;
  });
  rig_.seal_and_deliver(force_of(1), kAlice);
  EXPECT_EQ(refused(Reason::kNotGranted, 1),
            "forces[2]: point 17 is not among the points of key alice; add it there, or use another key");
  grant([](service::Grants& grants) { grants.groups = {true, false, false, false}; });
  rig_.seal_and_deliver(force_of(2), kAlice);
  EXPECT_EQ(refused(Reason::kNotGranted, 2),
            "wrenches[1]: group 1 is not among the groups of key alice; add it there, or use another key");
  grant([](service::Grants& grants) { grants.num_slots = 5; });
  rig_.seal_and_deliver(force_of(3), kAlice);
  EXPECT_EQ(refused(Reason::kNotGranted, 3), "slot is 5, but key alice may use only 0 to 4");
}

TEST_F(GrantsTest, GrantsLimitTheForceAndTorqueOfAnEntry) {
  // the largest values of make_force() are |forces[2]| = 60.0009 N and |wrenches[1].torque| = sqrt(113) N m
  grant([](service::Grants& grants) { grants.largest_force = 59.0; });
  rig_.seal_and_deliver(force_of(1), kAlice);
  EXPECT_EQ(refused(Reason::kOverKeyLimit, 1),
            "forces[2]: point 17 has |force| 60.00092592 N, but key alice may use at most 59 N");
  grant([](service::Grants& grants) { grants.largest_torque = 10.0; });
  rig_.seal_and_deliver(force_of(2), kAlice);
  EXPECT_EQ(refused(Reason::kOverKeyLimit, 2),
            "wrenches[1]: group 1 has |torque| 10.63014581 N m, but key alice may use at most 10 N m");
  grant([](service::Grants& grants) { grants.largest_force = std::hypot(1.0 / 3.0, 0.0, 60.0); });
  EXPECT_TRUE(accepts(3)) << "a command exactly at the limit is accepted";
}

TEST_F(GrantsTest, GrantsLimitTheRateAndAllowABurstOfOneSecond) {
  grant([](service::Grants& grants) { grants.commands_per_second = 5.0; });
  std::int64_t sequence = 0;
  const auto burst = [&] {
    int num_accepted = 0;
    for (int i = 0; i < 20; ++i) num_accepted += accepts(++sequence) ? 1 : 0;
    return num_accepted;
  };
  EXPECT_EQ(burst(), 5);
  const io::Admission answer = rig_.next_answer();
  EXPECT_EQ(answer.reason, Reason::kTooFast);
  EXPECT_STREQ(answer.text.data(), "commands come too fast, because key alice may send only 5 a second");
  rig_.time.now_ns += 400'000'000;
  EXPECT_EQ(burst(), 2);
  rig_.time.now_ns += 60'000'000'000;
  EXPECT_EQ(burst(), 5);
}

TEST_F(VerifierTest, ANestedEnvelopeIsRefused) {
  freeflex_msgs::envelope_t outer{};
  outer.key_id = "alice";
  outer.session = kSession;
  outer.sequence = 7;
  outer.valid_until = rig_.valid_until();
  for (const std::byte byte : seal(force_of(7), kForceChannel, kAlice.sealing, rig_.valid_until()))
    outer.body.push_back(std::to_integer<std::uint8_t>(byte));
  outer.num_bytes = static_cast<std::int32_t>(outer.body.size());
  std::vector<std::byte> bytes = io::encode(outer);
  const auto before_tag = std::span(bytes).first(bytes.size() - crypto_auth_BYTES);
  const SealTag tag = make_tag(before_tag, kForceChannel, kAlice.sealing);
  std::memcpy(bytes.data() + before_tag.size(), tag.data(), tag.size());
  rig_.deliver(bytes);
  EXPECT_FALSE(rig_.next_command());
  EXPECT_EQ(rig_.next_answer().reason, Reason::kWrongType);
}

TEST_F(VerifierTest, AMessageInFragmentsIsCountedAsMalformed) {
  // the first of two fragments, which contains the name of the channel
  std::vector<std::byte> packet(20 + kForceChannel.size() + 1 + 8);
  const std::uint32_t words[] = {0x4c433033, 1, 70'000, 0};  // magic, number, size, offset
  for (std::size_t i = 0; i < std::size(words); ++i)
    for (std::size_t k = 0; k < 4; ++k)
      packet[4 * i + k] = static_cast<std::byte>(words[i] >> (24 - 8 * k) & 0xFFU);
  packet[19] = std::byte{2};
  std::memcpy(packet.data() + 20, kForceChannel.c_str(), kForceChannel.size() + 1);
  rig_.settings->channel_prefix = {'T', 'E', 'S', 'T'};
  service::PacketHandler packet_handler(*rig_.ingress, *rig_.settings);
  packet_handler.on_packet(packet, rig_.time.now_ns);
  EXPECT_TRUE(rig_.verifier->take(rig_.time));
  dropped(Reason::kMalformed);
}

TEST_F(VerifierTest, ForcesLeaveRoomInTheRingForControls) {
  const auto force = seal(force_of(7), kForceChannel, kAlice.sealing, rig_.valid_until());
  for (int i = 0; i < 1030; ++i) rig_.packet_handler.on_force(force, rig_.time.now_ns);
  rig_.packet_handler.on_control(seal(control_of(8), kControlChannel, kAlice.sealing, rig_.valid_until()),
                                 rig_.time.now_ns);
  while (rig_.verifier->take(rig_.time)) continue;
  ASSERT_TRUE(rig_.next_command());
  const auto control = rig_.next_command();
  ASSERT_TRUE(control);
  EXPECT_EQ(control->kind, service::InboundKind::kControl);
}

TEST_F(VerifierTest, CommandsWithoutRoomInTheRingAreCounted) {
  const auto sealed = seal(force_of(7), kForceChannel, kAlice.sealing, rig_.valid_until());
  constexpr int kSent = 1030;
  constexpr int kLost = kSent - service::SharedBlock::num_places(service::InboundKind::kRawForce);
  for (int i = 0; i < kSent; ++i) rig_.packet_handler.on_force(sealed, rig_.time.now_ns);
  std::thread running([this] { rig_.verifier->run(); });
  while (rig_.count(Reason::kQueueFull) < kLost || rig_.verifier->block().received.load() < kSent)
    std::this_thread::yield();
  rig_.verifier->request_stop();
  running.join();
  EXPECT_EQ(rig_.count(Reason::kQueueFull), kLost);
  EXPECT_EQ(rig_.verifier->block().received.load(), kSent);
}

}  // namespace
}  // namespace freeflex::testing
