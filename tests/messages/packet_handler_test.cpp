// The packet handler of the ingress process, without a network.
#include "service/packet_handler.hpp"

#include <gtest/gtest.h>

#include <cstring>
#include <memory>
#include <random>

#include "freeflex_msgs/envelope_t.hpp"
#include "freeflex_msgs/status_t.hpp"
#include "service/io/wire/operator_address.hpp"
#include "tests/messages/commands.hpp"

namespace freeflex::testing {
namespace {

using io::Reason;
using service::InboundEntry;
using service::InboundKind;
using service::IngressSettings;
using service::RejectionEntry;
using service::SharedBlock;

class PacketHandlerTest : public ::testing::Test {
 protected:
  void on_force(const freeflex_msgs::force_t& message) {
    packet_handler_.on_force(io::encode(message), kReceived);
  }
  void on_control(const freeflex_msgs::control_t& message) {
    packet_handler_.on_control(io::encode(message), kReceived);
  }
  void send(const std::string& sender, std::int64_t sequence, std::int64_t received_ns = kReceived) {
    freeflex_msgs::force_t message = make_force();
    message.sender = sender;
    message.sequence = sequence;
    packet_handler_.on_force(io::encode(message), received_ns);
  }
  /// Returns the reason of the next rejection, or kAccepted if there is none.
  Reason next_rejection() {
    return block_->rejected.try_pop(rejection_) ? rejection_.admission.reason : Reason::kAccepted;
  }
  std::string text() const { return rejection_.admission.text.data(); }
  bool has_inbound() { return block_->inbound.try_pop(entry_); }
  std::int64_t count(Reason reason) const {
    return block_->rejections[static_cast<std::size_t>(reason)].load();
  }

  static constexpr std::int64_t kReceived = 4711;  // [ns]
  static std::unique_ptr<IngressSettings> make_settings() {
    auto settings = std::make_unique<IngressSettings>();
    settings->session = kSession;
    settings->channel_prefix = {'P'};
    settings->names = make_names();
    return settings;
  }

  std::unique_ptr<IngressSettings> settings_ = make_settings();
  std::unique_ptr<SharedBlock> block_ = std::make_unique<SharedBlock>();
  service::PacketHandler packet_handler_{*block_, *settings_};
  InboundEntry entry_{};
  RejectionEntry rejection_{};
};

TEST_F(PacketHandlerTest, ASealedCommandDoesNotUseUpItsSequenceNumber) {
  freeflex_msgs::force_t force = make_force();
  force.sender = "a";
  force.sequence = 5;
  freeflex_msgs::envelope_t envelope{};
  for (const std::byte byte : io::encode(force)) envelope.body.push_back(std::to_integer<std::uint8_t>(byte));
  envelope.num_bytes = static_cast<std::int32_t>(envelope.body.size());
  packet_handler_.on_force(io::encode(envelope), kReceived);
  EXPECT_EQ(next_rejection(), Reason::kNoKeys);
  EXPECT_EQ(block_->senders.records[0].sender[0], '\0')
      << "the name in an envelope does not prove who sent it";
  send("a", 5);
  EXPECT_TRUE(has_inbound());
}

TEST_F(PacketHandlerTest, ValidCommandsArePassedOnWithTheirReceptionTime) {
  send("a", 1);
  on_control(make_control());
  ASSERT_TRUE(has_inbound());
  EXPECT_EQ(entry_.kind, InboundKind::kForce);
  EXPECT_EQ(entry_.force.sequence, 1);
  EXPECT_EQ(entry_.received_ns, kReceived);
  ASSERT_TRUE(has_inbound());
  EXPECT_EQ(entry_.kind, InboundKind::kControl);
  EXPECT_EQ(entry_.control.sequence, 3);
  EXPECT_EQ(block_->received.load(), 2);
  EXPECT_EQ(next_rejection(), Reason::kAccepted);
}

TEST_F(PacketHandlerTest, ASequenceNumberThatDoesNotIncreaseIsStale) {
  send("a", 10);
  send("a", 10);
  EXPECT_EQ(next_rejection(), Reason::kStaleSequence);
  EXPECT_EQ(text(), "sequence number 10 of sender a must be greater than 10, its last one");
  send("a", 9);
  EXPECT_EQ(next_rejection(), Reason::kStaleSequence);
  send("b", 9);
  send("a", 12);
  EXPECT_EQ(next_rejection(), Reason::kAccepted) << "each sender has its own sequences, and gaps are allowed";
  EXPECT_EQ(count(Reason::kStaleSequence), 2);
}

TEST_F(PacketHandlerTest, TheFirstSequenceNumberMustBeAtLeastOne) {
  send("a", 0);
  EXPECT_EQ(next_rejection(), Reason::kStaleSequence);
  send("a", -5);
  EXPECT_EQ(next_rejection(), Reason::kStaleSequence);
  send("a", 1);
  EXPECT_EQ(next_rejection(), Reason::kAccepted);
}

TEST_F(PacketHandlerTest, ForcesAndControlsOfASenderAreNumberedTogether) {
  freeflex_msgs::control_t control = make_control();
  control.sender = "a";
  control.sequence = 5;
  on_control(control);
  send("a", 5);
  EXPECT_EQ(next_rejection(), Reason::kStaleSequence);
}

TEST_F(PacketHandlerTest, ARejectedCommandUsesUpItsSequenceNumber) {
  freeflex_msgs::force_t bad = make_force();
  bad.sender = "a";
  bad.sequence = 4;
  bad.forces[0].point = 1000;
  on_force(bad);
  EXPECT_EQ(next_rejection(), Reason::kUnknownPoint);
  on_force(bad);
  EXPECT_EQ(next_rejection(), Reason::kStaleSequence) << "a copy is not treated as a new command";
  send("a", 4);
  EXPECT_EQ(next_rejection(), Reason::kStaleSequence);
}

TEST_F(PacketHandlerTest, ACommandForAnotherSessionDoesNotUseUpItsSequenceNumber) {
  freeflex_msgs::force_t other = make_force();
  other.session = kSession - 1;
  other.sequence = 1'000'000;
  other.sender = "a";
  on_force(other);
  EXPECT_EQ(next_rejection(), Reason::kWrongSession);
  send("a", 1);
  EXPECT_EQ(next_rejection(), Reason::kAccepted);
}

TEST_F(PacketHandlerTest, TheSixtyFifthSenderIsRefused) {
  for (int i = 0; i < 64; ++i) send("sender-" + std::to_string(i), 1);
  EXPECT_EQ(next_rejection(), Reason::kAccepted);
  send("one-more", 1);
  EXPECT_EQ(next_rejection(), Reason::kTooManySenders);
  EXPECT_EQ(text(),
            "sender one-more is new, but the daemon knows 64 senders already, and all of them sent within "
            "the last 60 s; send later");
  send("sender-63", 2);
  EXPECT_EQ(next_rejection(), Reason::kAccepted);
}

TEST_F(PacketHandlerTest, SixtyFourInventedSendersDoNotBlockControls) {
  for (int i = 0; i < 64; ++i) send("invented-" + std::to_string(i), 1);
  freeflex_msgs::control_t stop = make_control();
  stop.command = freeflex_msgs::control_t::STOP;
  // 100 more invented senders, which send controls, do not block controls either
  for (int i = 0; i < 100; ++i) {
    stop.sender = "controls-" + std::to_string(i);
    on_control(stop);
  }
  stop.sender = "operator";
  stop.sequence = 5;
  on_control(stop);
  EXPECT_EQ(next_rejection(), Reason::kAccepted);
  on_control(stop);
  EXPECT_EQ(next_rejection(), Reason::kStaleSequence) << "the sequence of `operator` is kept";
  send("invented-0", 1);
  EXPECT_EQ(next_rejection(), Reason::kStaleSequence) << "the sequences of the 64 are kept too";
}

TEST_F(PacketHandlerTest, ANewSenderReplacesASenderThatWasSilentForAMinute) {
  constexpr std::int64_t kMinute = 60'000'000'000;
  for (int i = 0; i < 64; ++i) send("sender-" + std::to_string(i), 7, kReceived + i);
  send("late", 1, kReceived + kMinute - 1);
  EXPECT_EQ(next_rejection(), Reason::kTooManySenders);
  send("late", 1, kReceived + kMinute);
  EXPECT_EQ(next_rejection(), Reason::kAccepted) << "it replaces sender-0";
  send("sender-1", 7, kReceived + kMinute);
  EXPECT_EQ(next_rejection(), Reason::kStaleSequence) << "sender-1 is kept because it was heard again";
  send("later", 1, kReceived + kMinute + 1);
  EXPECT_EQ(next_rejection(), Reason::kTooManySenders);
}

TEST_F(PacketHandlerTest, ClearedSendersKeepTheirSequenceNumbersUntilReplaced) {
  for (int i = 0; i < 64; ++i) send("sender-" + std::to_string(i), 7);
  send("late", 1);
  EXPECT_EQ(next_rejection(), Reason::kTooManySenders);
  service::release_places(block_->senders, {'s', 'e', 'n', 'd', 'e', 'r', '-', '5'});
  send("sender-5", 7);
  EXPECT_EQ(next_rejection(), Reason::kStaleSequence) << "a copy of an old command is stale";
  service::release_places(block_->senders, {'s', 'e', 'n', 'd', 'e', 'r', '-', '5'});
  send("late", 1);
  EXPECT_EQ(next_rejection(), Reason::kAccepted);
  send("later", 1);
  EXPECT_EQ(next_rejection(), Reason::kTooManySenders);
  service::release_places(block_->senders, service::kEverySender);
  for (int i = 0; i < 64; ++i) send("new-" + std::to_string(i), 1);
  EXPECT_EQ(next_rejection(), Reason::kAccepted);
}

TEST_F(PacketHandlerTest, SendersOnTheBusMayNotUseNamesOfTheOperatorsSocket) {
  send("local.me", 1);
  EXPECT_EQ(next_rejection(), Reason::kBadSender);
  EXPECT_EQ(text(),
            "sender local.me is refused, because names that begin with local. are reserved for the "
            "operator's socket");
  send("locals", 1);
  EXPECT_EQ(next_rejection(), Reason::kAccepted);
}

TEST_F(PacketHandlerTest, ForcesLeaveRoomInTheRingForControls) {
  for (int i = 1; i <= 1024; ++i) send("a", i);
  EXPECT_EQ(count(Reason::kQueueFull), 64);
  freeflex_msgs::control_t control = make_control();
  for (int i = 1; i <= 64; ++i) {
    control.sequence = i;
    on_control(control);
  }
  EXPECT_EQ(count(Reason::kQueueFull), 64);
  control.sequence = 65;
  on_control(control);
  EXPECT_EQ(count(Reason::kQueueFull), 65);
}

TEST_F(PacketHandlerTest, ARestartedIngressStillRefusesOldSequenceNumbers) {
  send("a", 7);
  service::PacketHandler restarted(*block_, *settings_);
  freeflex_msgs::force_t message = make_force();
  message.sender = "a";
  message.sequence = 7;
  restarted.on_force(io::encode(message), kReceived);
  EXPECT_EQ(next_rejection(), Reason::kStaleSequence);
}

TEST_F(PacketHandlerTest, ACommandIsRejectedWithAnAnswerIfTheRingIsFull) {
  for (int i = 1; i <= 960; ++i) send("a", i);
  EXPECT_EQ(next_rejection(), Reason::kAccepted);
  send("a", 961);
  EXPECT_EQ(next_rejection(), Reason::kQueueFull);
  EXPECT_EQ(count(Reason::kQueueFull), 1);
  ASSERT_TRUE(has_inbound());
  EXPECT_EQ(entry_.force.sequence, 1) << "accepted commands stay";
}

TEST_F(PacketHandlerTest, AnswersDroppedForLackOfRoomAreCounted) {
  for (int i = 0; i < 1025; ++i) send("not valid", 1);
  EXPECT_EQ(block_->dropped_answers.load(), 1);
  EXPECT_EQ(count(Reason::kBadSender), 1025);
  EXPECT_EQ(block_->received.load(), 1025);
}

/// Returns a short message as LCM sends it.
std::vector<std::byte> packet_of(const std::string& channel, const std::vector<std::byte>& payload) {
  const std::string head = std::string("LC02\0\0\0\0", 8) + channel + '\0';
  std::vector<std::byte> packet(head.size());
  std::memcpy(packet.data(), head.data(), head.size());
  packet.insert(packet.end(), payload.begin(), payload.end());
  return packet;
}

TEST_F(PacketHandlerTest, AcceptsOnlyMessagesOnItsChannels) {
  freeflex_msgs::force_t force = make_force();
  force.sequence = 1;
  packet_handler_.on_packet(packet_of("P_FORCE", io::encode(force)), kReceived);
  ASSERT_TRUE(has_inbound());
  EXPECT_EQ(entry_.kind, InboundKind::kForce);
  packet_handler_.on_packet(packet_of("P_CONTROL", io::encode(make_control())), kReceived);
  ASSERT_TRUE(has_inbound());
  EXPECT_EQ(entry_.kind, InboundKind::kControl);
  for (const char* channel : {"P_FORCES", "P_FORC", "Q_FORCE", "P_ACK", "", "p_force"})
    packet_handler_.on_packet(packet_of(channel, io::encode(force)), kReceived);
  EXPECT_EQ(block_->received.load(), 2);
}

TEST_F(PacketHandlerTest, CutPacketsAndRandomBytesAreHarmless) {
  // each packet is a heap block of exactly its size, so that a sanitizer reports any read beyond it
  const std::vector<std::byte> whole = packet_of("P_FORCE", io::encode(make_force()));
  for (std::size_t size = 0; size < whole.size(); ++size)
    packet_handler_.on_packet(
        std::vector<std::byte>(whole.begin(), whole.begin() + static_cast<std::ptrdiff_t>(size)), kReceived);
  std::mt19937_64 engine(3);
  for (int i = 0; i < 20'000; ++i) {
    std::vector<std::byte> packet(whole.begin(), whole.begin() + static_cast<std::ptrdiff_t>(engine() % 60));
    for (std::uint64_t n = engine() % 4; n > 0 && !packet.empty(); --n)
      packet[engine() % packet.size()] = static_cast<std::byte>(engine());
    packet_handler_.on_packet(packet, kReceived);
  }
  EXPECT_FALSE(has_inbound());
}

TEST_F(PacketHandlerTest, AStatusOfAnotherDaemonIsRecorded) {
  freeflex_msgs::status_t status{};
  status.session = kSession;
  packet_handler_.on_status(io::encode(status));
  EXPECT_EQ(block_->other_session.load(), 0) << "a status of the daemon's own session is ignored";
  status.session = 55;
  packet_handler_.on_status(io::encode(status));
  EXPECT_EQ(block_->other_session.load(), 55);
  EXPECT_EQ(block_->received.load(), 0) << "a status is not counted as a command";
}

}  // namespace
}  // namespace freeflex::testing
