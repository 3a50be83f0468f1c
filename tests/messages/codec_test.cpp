// Commands and messages are the same thing to the bit.
#include <gtest/gtest.h>

#include <cstring>

#include "freeflex_msgs/status_t.hpp"
#include "tests/messages/commands.hpp"

namespace freeflex::testing {
namespace {

using io::Reason;

TEST(Codec, AForceComesThroughTheWireToTheBit) {
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
    EXPECT_EQ(std::memcmp(&again, &command, sizeof(command)), 0) << "unused parts are zero on both ways";
  }
}

TEST(Codec, FieldsArriveUnderTheirNames) {
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

TEST(Codec, AControlComesThroughWithItsCount) {
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

TEST(Codec, TheSessionOfAStatusIsReadOnlyFromAStatus) {
  freeflex_msgs::status_t status{};
  status.session = kSession;
  const std::vector<std::byte> bytes = io::encode(status);
  EXPECT_EQ(io::read_status_session(bytes), kSession);
  EXPECT_EQ(io::read_status_session(io::encode(make_force())), std::nullopt);
  for (std::size_t size = 0; size < 24; ++size) {
    EXPECT_EQ(io::read_status_session(std::span(bytes).first(size)), std::nullopt) << size;
  }
}

TEST(NameTable, SaysWhatCommandsMayName) {
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
  names.is_pushable[7] = 1;  // left over from before
  io::fill_name_table(plan, names);
  EXPECT_EQ(names.num_points, 4);
  EXPECT_EQ(names.num_groups, 2);
  EXPECT_EQ(names.force_limit, 3.0);
  EXPECT_EQ(names.torque_limit, 4.0);
  EXPECT_EQ(names.is_pushable[0] + names.is_pushable[1], 2);
  EXPECT_EQ(names.is_pushable[2] + names.is_pushable[3] + names.is_pushable[7], 0);
  EXPECT_EQ(names.groups[0].is_pushable, 1);
  EXPECT_EQ(names.groups[0].torque_rank, 2);
  EXPECT_EQ(names.groups[0].line, (Vec3{0.0, 1.0, 0.0}));
  EXPECT_EQ(names.groups[1].is_pushable, 0) << "point 3 has no rows";
}

}  // namespace
}  // namespace freeflex::testing
