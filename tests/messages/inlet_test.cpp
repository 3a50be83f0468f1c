// What the ingress process does with messages, without a network.
#include <gtest/gtest.h>

#include <memory>

#include "freeflex_msgs/envelope_t.hpp"
#include "freeflex_msgs/status_t.hpp"
#include "service/ingress_inlet.hpp"
#include "tests/messages/commands.hpp"

namespace freeflex::testing {
namespace {

using io::Reason;
using service::InboundEntry;
using service::InboundKind;
using service::RejectionEntry;
using service::SharedBlock;

class InletTest : public ::testing::Test {
 protected:
  InletTest() : block_(std::make_unique<SharedBlock>()), inlet_(*block_) {
    block_->settings.session = kSession;
    block_->settings.names = make_names();
  }
  void send(const std::string& sender, std::int64_t sequence) {
    freeflex_msgs::force_t message = make_force();
    message.sender = sender;
    message.sequence = sequence;
    inlet_.on_force(io::encode(message));
  }
  /// The next rejection's reason; kAccepted when there is none.
  Reason next_rejection() {
    return block_->rejected.try_pop(rejection_) ? rejection_.admission.reason : Reason::kAccepted;
  }
  std::string text() const { return rejection_.admission.text.data(); }
  bool has_inbound() { return block_->inbound.try_pop(entry_); }
  std::int64_t count(Reason reason) const {
    return block_->rejections[static_cast<std::size_t>(reason)].load();
  }

  std::unique_ptr<SharedBlock> block_;
  service::Inlet inlet_;
  InboundEntry entry_{};
  RejectionEntry rejection_{};
};

TEST_F(InletTest, ASignedCommandUsesNoSequenceUp) {
  freeflex_msgs::force_t force = make_force();
  force.sender = "a";
  force.sequence = 5;
  freeflex_msgs::envelope_t envelope{};
  for (const std::byte byte : io::encode(force)) envelope.body.push_back(std::to_integer<std::uint8_t>(byte));
  envelope.num_bytes = static_cast<std::int32_t>(envelope.body.size());
  inlet_.on_force(io::encode(envelope));
  EXPECT_EQ(next_rejection(), Reason::kNoKeys);
  EXPECT_EQ(block_->senders.num_senders.load(), 0) << "anybody may write a name into an envelope";
  send("a", 5);
  EXPECT_TRUE(has_inbound());
}

TEST_F(InletTest, GoodCommandsGoOnWithTheTimeOfTheirReception) {
  send("a", 1);
  inlet_.on_control(io::encode(make_control()));
  ASSERT_TRUE(has_inbound());
  EXPECT_EQ(entry_.kind, InboundKind::kForce);
  EXPECT_EQ(entry_.force.sequence, 1);
  const std::int64_t first = entry_.received_ns;
  ASSERT_TRUE(has_inbound());
  EXPECT_EQ(entry_.kind, InboundKind::kControl);
  EXPECT_EQ(entry_.control.sequence, 3);
  EXPECT_GE(entry_.received_ns, first);
  EXPECT_GT(first, 0);
  EXPECT_EQ(block_->received.load(), 2);
  EXPECT_EQ(next_rejection(), Reason::kAccepted);
}

TEST_F(InletTest, ASequenceThatDoesNotRiseIsStale) {
  send("a", 10);
  send("a", 10);
  EXPECT_EQ(next_rejection(), Reason::kStaleSequence);
  EXPECT_EQ(text(), "sequence 10 of a, must be greater than 10");
  send("a", 9);
  EXPECT_EQ(next_rejection(), Reason::kStaleSequence);
  send("b", 9);
  send("a", 12);
  EXPECT_EQ(next_rejection(), Reason::kAccepted) << "another sender counts for itself, and gaps are allowed";
  EXPECT_EQ(count(Reason::kStaleSequence), 2);
}

TEST_F(InletTest, TheFirstSequenceIsAtLeastOne) {
  send("a", 0);
  EXPECT_EQ(next_rejection(), Reason::kStaleSequence);
  send("a", -5);
  EXPECT_EQ(next_rejection(), Reason::kStaleSequence);
  send("a", 1);
  EXPECT_EQ(next_rejection(), Reason::kAccepted);
}

TEST_F(InletTest, ForceAndControlShareTheSequenceOfASender) {
  freeflex_msgs::control_t control = make_control();
  control.sender = "a";
  control.sequence = 5;
  inlet_.on_control(io::encode(control));
  send("a", 5);
  EXPECT_EQ(next_rejection(), Reason::kStaleSequence);
}

TEST_F(InletTest, ARejectedCommandHasUsedItsSequence) {
  freeflex_msgs::force_t bad = make_force();
  bad.sender = "a";
  bad.sequence = 4;
  bad.forces[0].point = 1000;
  inlet_.on_force(io::encode(bad));
  EXPECT_EQ(next_rejection(), Reason::kUnknownPoint);
  inlet_.on_force(io::encode(bad));
  EXPECT_EQ(next_rejection(), Reason::kStaleSequence) << "a copy of it is not answered as if it were new";
  send("a", 4);
  EXPECT_EQ(next_rejection(), Reason::kStaleSequence);
}

TEST_F(InletTest, ACommandForAnotherSessionUsesNoSequence) {
  freeflex_msgs::force_t other = make_force();
  other.session = kSession - 1;
  other.sequence = 1'000'000;
  other.sender = "a";
  inlet_.on_force(io::encode(other));
  EXPECT_EQ(next_rejection(), Reason::kWrongSession);
  send("a", 1);
  EXPECT_EQ(next_rejection(), Reason::kAccepted);
}

TEST_F(InletTest, TheSixtyFifthSenderIsOneTooMany) {
  for (int i = 0; i < 64; ++i) send("sender-" + std::to_string(i), 1);
  EXPECT_EQ(next_rejection(), Reason::kAccepted);
  send("one-more", 1);
  EXPECT_EQ(next_rejection(), Reason::kTooManySenders);
  EXPECT_EQ(text(), "sender one-more is new and 64 are known already, the most of one session");
  send("sender-63", 2);
  EXPECT_EQ(next_rejection(), Reason::kAccepted);
}

TEST_F(InletTest, ANewIngressOnTheSameBlockKnowsTheSequences) {
  send("a", 7);
  service::Inlet restarted(*block_);
  freeflex_msgs::force_t message = make_force();
  message.sender = "a";
  message.sequence = 7;
  restarted.on_force(io::encode(message));
  EXPECT_EQ(next_rejection(), Reason::kStaleSequence);
}

TEST_F(InletTest, AFullRingIsAnsweredNotSilent) {
  for (int i = 1; i <= 1024; ++i) send("a", i);
  EXPECT_EQ(next_rejection(), Reason::kAccepted);
  send("a", 1025);
  EXPECT_EQ(next_rejection(), Reason::kQueueFull);
  EXPECT_EQ(count(Reason::kQueueFull), 1);
  ASSERT_TRUE(has_inbound());
  EXPECT_EQ(entry_.force.sequence, 1) << "what was taken stays";
}

TEST_F(InletTest, AnswersThatFindNoRoomAreCounted) {
  for (int i = 0; i < 1025; ++i) send("not valid", 1);
  EXPECT_EQ(block_->dropped_answers.load(), 1);
  EXPECT_EQ(count(Reason::kBadSender), 1025);
  EXPECT_EQ(block_->received.load(), 1025);
}

TEST_F(InletTest, AnotherDaemonsStatusIsNoted) {
  freeflex_msgs::status_t status{};
  status.session = kSession;
  inlet_.on_status(io::encode(status));
  EXPECT_EQ(block_->other_session.load(), 0) << "our own";
  status.session = 55;
  inlet_.on_status(io::encode(status));
  EXPECT_EQ(block_->other_session.load(), 55);
  EXPECT_EQ(block_->received.load(), 0) << "not a command";
}

}  // namespace
}  // namespace freeflex::testing
