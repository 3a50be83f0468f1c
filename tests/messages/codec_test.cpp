// Commands and messages convert into each other without changing a bit.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>
#include <string>

#include "freeflex_msgs/ack_t.hpp"
#include "freeflex_msgs/envelope_t.hpp"
#include "freeflex_msgs/force_t.hpp"
#include "freeflex_msgs/scene_t.hpp"
#include "freeflex_msgs/state_t.hpp"
#include "freeflex_msgs/status_t.hpp"
#include "service/io/wire/versions.hpp"
#include "tests/messages/commands.hpp"

namespace freeflex::testing {
namespace {

using io::Reason;

TEST(Codec, AForceIsDecodedAndEncodedWithoutChangingABit) {
  const io::NameTable names = make_names();
  std::mt19937_64 engine(20260101);
  ForceCommand command;
  for (int i = 0; i < 500; ++i) {
    const freeflex_msgs::force_t sent = random_force(engine);
    const io::Admission admission = decode(sent, names, command);
    ASSERT_EQ(admission.reason, Reason::kAccepted) << admission.text.data();
    EXPECT_EQ(io::encode(io::to_message(command, sent.session, sent.utime)), io::encode(sent));
    ForceCommand again;
    ASSERT_EQ(io::from_message(sent, names, again).reason, Reason::kAccepted);
    EXPECT_EQ(std::memcmp(&again, &command, sizeof(command)), 0)
        << "unused members are zero in both commands";
  }
}

TEST(Codec, EachFieldOfAForceIsDecodedIntoTheMemberOfItsName) {
  ForceCommand command;
  ASSERT_EQ(decode(make_force(), make_names(), command).reason, Reason::kAccepted);
  EXPECT_STREQ(command.sender.data(), "pusher-1.a_B");
  EXPECT_EQ(command.sequence, 42);
  EXPECT_EQ(command.slot, 5);
  EXPECT_EQ(command.axes, 1);
  EXPECT_EQ(command.start_tick, 1000);
  EXPECT_EQ(command.late_policy, 1);
  EXPECT_EQ(command.duration_ticks, 77);
  EXPECT_EQ(command.lease_ticks, 0);
  ASSERT_EQ(command.num_points, 3);
  ASSERT_EQ(command.num_wrenches, 2);
  EXPECT_EQ(command.points[1].point, 298);
  EXPECT_EQ(command.points[2].force, (Vec3{1.0 / 3.0, 1e-300, -60.0}));
  EXPECT_EQ(command.wrenches[1].group, 1);
  EXPECT_EQ(command.wrenches[1].torque, (Vec3{0.0, 7.0, -8.0}));
}

TEST(Codec, AStepControlIsDecodedWithItsNumberOfTicks) {
  freeflex_msgs::control_t message = make_control();
  message.command = freeflex_msgs::control_t::STEP;
  message.count = 123'456'789;
  io::ControlCommand command;
  const io::Admission admission = io::decode_control(io::encode(message), kSession, command);
  ASSERT_EQ(admission.reason, Reason::kAccepted) << admission.text.data();
  EXPECT_STREQ(command.sender.data(), "desk");
  EXPECT_EQ(command.sequence, 3);
  EXPECT_EQ(command.command, freeflex_msgs::control_t::STEP);
  EXPECT_EQ(command.count, 123'456'789);
}

TEST(Codec, TheSessionNumberIsReadOnlyFromAStatusMessage) {
  freeflex_msgs::status_t status{};
  status.session = kSession;
  const std::vector<std::byte> bytes = io::encode(status);
  EXPECT_EQ(io::read_status_session(bytes), kSession);
  EXPECT_EQ(io::read_status_session(io::encode(make_force())), std::nullopt);
  for (std::size_t size = 0; size < 24; ++size) {
    EXPECT_EQ(io::read_status_session(std::span(bytes).first(size)), std::nullopt) << size;
  }
}

/// Returns an envelope around the command, with a tag of ones.
freeflex_msgs::envelope_t seal(const std::vector<std::byte>& command) {
  freeflex_msgs::envelope_t envelope{};
  envelope.key_id = "pilot-1";
  envelope.session = kSession;
  envelope.sequence = 7;
  envelope.num_bytes = static_cast<std::int32_t>(command.size());
  for (const std::byte byte : command) envelope.body.push_back(std::to_integer<std::uint8_t>(byte));
  std::fill(std::begin(envelope.tag), std::end(envelope.tag), std::uint8_t{1});
  return envelope;
}

TEST(Envelope, WithoutKeysAnEnvelopeIsRejectedButItsSenderIsRead) {
  const std::vector<std::byte> force = io::encode(seal(io::encode(make_force())));
  const std::vector<std::byte> control = io::encode(seal(io::encode(make_control())));
  ForceCommand command;
  io::ControlCommand other;
  const io::Admission of_force = io::decode_force(force, kSession, make_names(), command);
  EXPECT_EQ(of_force.reason, Reason::kNoKeys);
  EXPECT_STREQ(of_force.text.data(), "this daemon uses no keys; send the command without an envelope");
  EXPECT_STREQ(of_force.sender.data(), "pusher-1.a_B");
  EXPECT_EQ(of_force.sequence, 42);
  const io::Admission of_control = io::decode_control(control, kSession, other);
  EXPECT_EQ(of_control.reason, Reason::kNoKeys);
  EXPECT_STREQ(of_control.sender.data(), "desk");
  // an empty envelope contains no sender, and a truncated envelope is malformed
  const io::Admission empty = io::decode_force(io::encode(seal({})), kSession, make_names(), command);
  EXPECT_EQ(empty.reason, Reason::kNoKeys);
  EXPECT_STREQ(empty.sender.data(), "");
  for (std::size_t size = 0; size < force.size(); ++size) {
    const std::vector<std::byte> part(force.begin(), force.begin() + static_cast<std::ptrdiff_t>(size));
    EXPECT_EQ(io::decode_force(part, kSession, make_names(), command).reason, Reason::kMalformed) << size;
  }
}

TEST(Versions, TheRejectionOfACommandOfVersion03StatesItsVersion) {
  // these are the bytes that `freeflex push` of version 0.3 sent for 3 N along y and 1 N along z on point 2
  const char* const hex =
      "5eb2bea23d54be04000660d06f52a97018ea2e32b5103e66000000057075736800000660d06f52a97000000000"
      "00000000ffffffffffffffff0000000000000000000000960000000000000000000000010000000000000002"
      "000000000000000040080000000000003ff0000000000000";
  std::vector<std::byte> bytes;
  for (const char* at = hex; *at != '\0'; at += 2)
    bytes.push_back(static_cast<std::byte>(std::stoi(std::string(at, 2), nullptr, 16)));
  ASSERT_EQ(bytes.size(), 113u);
  ForceCommand command;
  const io::Admission admission = io::decode_force(bytes, kSession, make_names(), command);
  EXPECT_EQ(admission.reason, Reason::kWrongType);
  EXPECT_STREQ(admission.text.data(),
               "the message is of version 0.3 of the messages, but must be of 0.5; generate your code from "
               "the daemon's .lcm files");
  EXPECT_STREQ(admission.sender.data(), "push");
  EXPECT_EQ(admission.sequence, 0x000660d06f52a970);
  EXPECT_TRUE(io::is_sane(admission));
  EXPECT_EQ(io::explain_unread(bytes), "of version 0.3 of the messages, but this program reads version 0.5");
  bytes[0] ^= std::byte{1};
  EXPECT_EQ(io::explain_unread(bytes), "damaged, or of a version that is not known here");
}

TEST(Versions, AFingerprintOfVersion04IsReportedAsOfVersion04) {
  const auto bytes_of = [](std::uint64_t fingerprint) {
    std::vector<std::byte> bytes(100);
    for (std::size_t k = 0; k < 8; ++k)
      bytes[k] = static_cast<std::byte>(fingerprint >> (56 - 8 * k) & 0xFFu);
    return bytes;
  };
  // these are the fingerprints of state_t, status_t, force_t, scene_t and ack_t in version 0.4
  for (const std::uint64_t fingerprint : {0x63044e976c7680aaU, 0x4510492c6aeb2ba5U, 0xae2270de78c8ccb4U,
                                          0xa557f686a425475aU, 0xe3a93249e57edfb6U}) {
    const auto current = {freeflex_msgs::state_t::getHash(), freeflex_msgs::status_t::getHash(),
                          freeflex_msgs::force_t::getHash(), freeflex_msgs::scene_t::getHash(),
                          freeflex_msgs::ack_t::getHash()};
    const bool is_current =
        std::find(current.begin(), current.end(), static_cast<std::int64_t>(fingerprint)) != current.end();
    EXPECT_EQ(io::explain_unread(bytes_of(fingerprint)),
              is_current ? "damaged, or of a version that is not known here"
                         : "of version 0.4 of the messages, but this program reads version 0.5")
        << std::hex << fingerprint;
  }
}

TEST(Versions, TheRejectionOfAControlOfVersion04StatesItsVersion) {
  // a control of version 0.4 has the present fields except the last, `target`, whose empty string takes five
  // bytes
  std::vector<std::byte> bytes = io::encode(make_control());
  bytes.resize(bytes.size() - 5);
  constexpr std::uint64_t kFingerprint = 0x51aca0044b8a4ed6;
  for (std::size_t i = 0; i < 8; ++i) bytes[i] = static_cast<std::byte>(kFingerprint >> (56 - 8 * i) & 0xff);
  io::ControlCommand command;
  const io::Admission admission = io::decode_control(bytes, kSession, command);
  EXPECT_EQ(admission.reason, Reason::kWrongType);
  EXPECT_STREQ(admission.text.data(),
               "the message is of version 0.4 of the messages, but must be of 0.5; generate your code from "
               "the daemon's .lcm files");
  EXPECT_STREQ(admission.sender.data(), "desk");
  EXPECT_EQ(admission.sequence, 3);
}

TEST(Versions, TheSessionNumberIsReadFromAStatusOfVersion03) {
  freeflex_msgs::status_t status{};
  status.session = kSession;
  std::vector<std::byte> bytes = io::encode(status);
  const std::uint64_t fingerprint = 0xa207cd30e391dc9c;
  for (std::size_t i = 0; i < 8; ++i) bytes[i] = static_cast<std::byte>(fingerprint >> (56 - 8 * i) & 0xFFu);
  EXPECT_EQ(io::read_status_session(bytes), kSession) << "the leading fields are the same";
}

TEST(NameTable, ContainsThePointsAndGroupsThatCommandsMayUse) {
  Plan plan;
  plan.force_limit = 3.0;
  plan.torque_limit = 4.0;
  plan.points.resize(4);
  plan.points[0].pushable = plan.points[1].pushable = true;
  plan.points[0].row = 0;
  plan.points[1].row = 1;
  plan.points[2].row = 2;  // published only
  plan.groups.resize(2);
  plan.groups[0].points = {0, 1, 2};
  plan.groups[0].torque_rank = 2;
  plan.groups[0].line = {0.0, 1.0, 0.0};
  plan.groups[1].points = {0, 3};
  io::NameTable names;
  names.pushable[7] = 7, names.num_pushable = 8;  // stale entries
  io::fill_name_table(plan, names);
  EXPECT_EQ(names.num_points, 4);
  EXPECT_EQ(names.num_groups, 2);
  EXPECT_EQ(names.force_limit, 3.0);
  EXPECT_EQ(names.torque_limit, 4.0);
  EXPECT_EQ(names.num_pushable, 2);
  EXPECT_EQ(names.pushable[0], 0);
  EXPECT_EQ(names.pushable[1], 1);
  EXPECT_EQ(names.pushable[7], 0);
  EXPECT_EQ(names.groups[0].is_pushable, 1);
  EXPECT_EQ(names.groups[0].torque_rank, 2);
  EXPECT_EQ(names.groups[0].line, (Vec3{0.0, 1.0, 0.0}));
  EXPECT_EQ(names.groups[1].is_pushable, 0) << "point 3 has no rows";
}

TEST(NameTable, FindsPointsWithLargeNumbers) {
  constexpr std::int32_t kLast = 99'999;
  Plan plan;
  plan.points.resize(kLast + 1);
  for (const auto& [point, row] : {std::pair{40, 0}, std::pair{kLast, 1}}) {
    plan.points[static_cast<std::size_t>(point)].pushable = true;
    plan.points[static_cast<std::size_t>(point)].row = row;
  }
  const auto names = std::make_unique<io::NameTable>();
  io::fill_name_table(plan, *names);
  const auto reason_of = [&](std::int32_t point) {
    ForceCommand command{};
    command.sender[0] = 'a';
    command.start_tick = -1;
    command.duration_ticks = 1;
    command.num_points = 1;
    command.points[0] = {point, 0, {1.0, 0.0, 0.0}};
    return io::check_command(command, *names, {});
  };
  EXPECT_EQ(reason_of(kLast), io::Reason::kAccepted);
  EXPECT_EQ(reason_of(40), io::Reason::kAccepted);
  EXPECT_EQ(reason_of(41), io::Reason::kNotPushable);
  EXPECT_EQ(reason_of(kLast + 1), io::Reason::kUnknownPoint);
  EXPECT_EQ(reason_of(-1), io::Reason::kUnknownPoint);
  names->num_pushable = 1 << 30;  // a value that a hostile process may write into shared memory
  EXPECT_EQ(reason_of(41), io::Reason::kNotPushable);
}

}  // namespace
}  // namespace freeflex::testing
