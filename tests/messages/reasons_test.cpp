// Each faulty command is rejected for the right reason, and the text says what was found and what is allowed.
// The reasons in this file do not depend on the tick.
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <functional>
#include <limits>
#include <ostream>
#include <set>

#include "tests/messages/commands.hpp"

namespace freeflex::testing {
namespace {

using freeflex_msgs::control_t;
using freeflex_msgs::force_t;
using io::Reason;

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinity = std::numeric_limits<double>::infinity();

struct BadForce {
  const char* name;
  Reason reason;
  const char* text;
  std::function<void(force_t&)> spoil;
};

void PrintTo(const BadForce& bad, std::ostream* out) { *out << bad.name; }

void set_forces(force_t& m, std::vector<freeflex_msgs::point_force_t> forces) {
  m.forces = std::move(forces);
  m.num_forces = static_cast<std::int32_t>(m.forces.size());
}
void set_wrench(force_t& m, const freeflex_msgs::wrench_t& wrench) {
  m.wrenches = {wrench};
  m.num_wrenches = 1;
}

const std::vector<BadForce> kBadForces = {
    {"OtherSession", Reason::kWrongSession,
     "session is 8, but must be 7000000001 as in status_t.session of this daemon",
     [](force_t& m) { m.session = 8; }},
    {"NoSender", Reason::kBadSender, "sender \"\" has 0 characters, but must be 1 to 31 of A-Z a-z 0-9 _ . -",
     [](force_t& m) { m.sender.clear(); }},
    {"SenderOf32", Reason::kBadSender, "has 32 characters, but must be 1 to 31",
     [](force_t& m) { m.sender.assign(32, 'a'); }},
    {"SenderWithEscape", Reason::kBadSender, "sender \"a?[31mb\" has 7 characters",
     [](force_t& m) { m.sender = "a\033[31mb"; }},
    {"SlotBelow", Reason::kBadSlot, "slot is -1, but must be 0 to 63", [](force_t& m) { m.slot = -1; }},
    {"SlotAbove", Reason::kBadSlot, "slot is 64, but must be 0 to 63", [](force_t& m) { m.slot = 64; }},
    {"Axes", Reason::kBadAxes, "axes is 2, but must be 0 (world) or 1 (body)",
     [](force_t& m) { m.axes = 2; }},
    {"StartBelow", Reason::kBadTiming, "start_tick is -2, but must be -1 (at once) or a tick",
     [](force_t& m) { m.start_tick = -2; }},
    {"LatePolicy", Reason::kBadTiming,
     "late_policy is 2, but must be 0 (reject) or 1 (apply at the next tick)",
     [](force_t& m) { m.late_policy = 2; }},
    {"NoEnd", Reason::kBadTiming,
     "duration_ticks is 0 and lease_ticks is 0, but one must be 0 and the other 1 to",
     [](force_t& m) { m.duration_ticks = 0; }},
    {"TwoEnds", Reason::kBadTiming, "duration_ticks is 77 and lease_ticks is 1,",
     [](force_t& m) { m.lease_ticks = 1; }},
    {"NegativeDuration", Reason::kBadTiming, "duration_ticks is -1 and",
     [](force_t& m) { m.duration_ticks = -1; }},
    {"EndlessDuration", Reason::kBadTiming, "the other 1 to 1000000000000000",
     [](force_t& m) { m.duration_ticks = std::numeric_limits<std::int64_t>::max(); }},
    {"TooManyForces", Reason::kTooManyPoints, "the message has 257 forces, but at most 256 are allowed",
     [](force_t& m) { set_forces(m, std::vector<freeflex_msgs::point_force_t>(257)); }},
    {"TooManyWrenches", Reason::kTooManyPoints, "the message has 17 wrenches, but at most 16 are allowed",
     [](force_t& m) { m.wrenches.resize(17), m.num_wrenches = 17; }},
    {"TooManyTorques", Reason::kTooManyPoints, "the message has 17 torques, but at most 16 are allowed",
     [](force_t& m) { m.torques.resize(17), m.num_torques = 17; }},
    {"TooManyWheels", Reason::kTooManyPoints, "the message has 17 wheels, but at most 16 are allowed",
     [](force_t& m) { m.wheels.resize(17), m.num_wheels = 17; }},
    {"PointTorque", Reason::kPointTorque,
     "torques[0]: point 17 has no inertia and takes no torque; use a wrench on a group",
     [](force_t& m) {
       m.torques = {{17, {0.0, 0.0, 1.0}}, {0, {}}};
       m.num_torques = 2;
     }},
    {"PointBelow", Reason::kUnknownPoint, "forces[1]: point -1 does not exist; the scene has points 0 to 299",
     [](force_t& m) { m.forces[1].point = -1; }},
    {"PointAbove", Reason::kUnknownPoint,
     "forces[2]: point 300 does not exist; the scene has points 0 to 299",
     [](force_t& m) { m.forces[2].point = 300; }},
    {"NotPushable", Reason::kNotPushable, "forces[0]: point 299 may not be pushed",
     [](force_t& m) { m.forces[0].point = 299; }},
    {"GroupWithoutRows", Reason::kNotPushable, "wrenches[0]: group 3 may not be pushed",
     [](force_t& m) { m.wrenches[0].group = 3; }},
    {"GroupBelow", Reason::kUnknownGroup,
     "wrenches[0]: group -1 does not exist; the scene has 4 groups, numbered from 0",
     [](force_t& m) { m.wrenches[0].group = -1; }},
    {"GroupAbove", Reason::kUnknownGroup, "wrenches[1]: group 4 does not exist; the scene has 4",
     [](force_t& m) { m.wrenches[1].group = 4; }},
    {"PointTwice", Reason::kDuplicatePoint, "forces[2]: point 0 is listed twice, but must be listed once",
     [](force_t& m) { m.forces[2].point = 0; }},
    {"GroupTwice", Reason::kDuplicatePoint, "wrenches[1]: group 0 is listed twice, but must be listed once",
     [](force_t& m) { m.wrenches[1].group = 0; }},
    {"ForceNaN", Reason::kNotFinite,
     "forces[1]: point 298 has the force (0, nan, 4.94066e-324) N, which must be finite",
     [](force_t& m) { m.forces[1].force[1] = kNaN; }},
    {"ForceInfinite", Reason::kNotFinite, "which must be finite",
     [](force_t& m) { m.forces[0].force[2] = -kInfinity; }},
    {"WrenchForceNaN", Reason::kNotFinite, "wrenches[0]: group 0: force (nan, 2, 3) N and torque",
     [](force_t& m) { m.wrenches[0].force[0] = kNaN; }},
    {"TorqueInfinite", Reason::kNotFinite, "wrenches[1]: group 1: force",
     [](force_t& m) { m.wrenches[1].torque[2] = kInfinity; }},
    {"ForceOverLimit", Reason::kOverLimit,
     "forces[0]: point 0 has |force| 100.0006 N, but the scene allows at most 100 N",
     [](force_t& m) {
       set_forces(m, {{0, {60.001, 80.0, 0.0}}});
     }},
    {"ForceOverLimitByLittle", Reason::kOverLimit,
     "forces[0]: point 0 has |force| 100.00000000093132 N, but the scene allows at most 100 N",
     [](force_t& m) {
       set_forces(m, {{0, {100.0 + 0x1p-30, 0.0, 0.0}}});
     }},
    {"ForceThatWouldOverflow", Reason::kOverLimit, "but the scene allows at most 100 N",
     [](force_t& m) {
       set_forces(m, {{0, {1e300, 1e300, 0.0}}});
     }},
    {"WrenchForceOverLimit", Reason::kOverLimit, "wrenches[0]: group 0 has |force| 101 N",
     [](force_t& m) {
       m.wrenches[0].force[2] = 101.0;
       m.wrenches[0].force[0] = m.wrenches[0].force[1] = 0.0;
     }},
    {"TorqueOverLimit", Reason::kOverLimit,
     "wrenches[0]: group 0 has |torque| 50.1 N m, but the scene allows at most 50 N m",
     [](force_t& m) {
       set_wrench(m, {0, {0.0, 0.0, 0.0}, {0.0, 50.1, 0.0}});
     }},
    {"TorqueAboutTheLine", Reason::kUnreachableTorque,
     "wrenches[0]: group 1 cannot take the torque (1e-06, 1, 0) N m; its points lie on a line",
     [](force_t& m) {
       set_wrench(m, {1, {0.0, 0.0, 0.0}, {1e-6, 1.0, 0.0}});
     }},
    {"TorqueOnOnePoint", Reason::kUnreachableTorque,
     "wrenches[0]: group 2 cannot take the torque (0, 0, 0.1) N m; it is a single point",
     [](force_t& m) {
       set_wrench(m, {2, {0.0, 0.0, 0.0}, {0.0, 0.0, 0.1}}), m.axes = 0;
     }},
};

class ForceIsRejected : public ::testing::TestWithParam<BadForce> {};

TEST_P(ForceIsRejected, AnInvalidForceIsRejectedWithAReasonAndItsText) {
  ASSERT_EQ(decode(make_force()).reason, Reason::kAccepted)
      << "the command is accepted before the fault is put in";
  force_t message = make_force();
  GetParam().spoil(message);
  const io::Admission admission = decode(message);
  EXPECT_EQ(admission.reason, GetParam().reason);
  EXPECT_NE(std::string(admission.text.data()).find(GetParam().text), std::string::npos)
      << admission.text.data();
  EXPECT_EQ(admission.sequence, 42);
  const bool has_good_sender = GetParam().reason != Reason::kBadSender;
  EXPECT_STREQ(admission.sender.data(), has_good_sender ? "pusher-1.a_B" : "");
  EXPECT_TRUE(io::is_sane(admission)) << "the answer itself is valid";
}

TEST_P(ForceIsRejected, AnInvalidForceFromALogIsRejectedForTheSameReason) {
  if (GetParam().reason == Reason::kWrongSession) return;  // from_message does not check the session
  force_t message = make_force();
  GetParam().spoil(message);
  ForceCommand command;
  EXPECT_EQ(io::from_message(message, make_names(), command).reason, GetParam().reason);
  if (!message.torques.empty()) return;  // for torques only the reason is checked
  EXPECT_FALSE(io::is_sane(command, make_names()) && GetParam().reason != Reason::kBadSender);
}

INSTANTIATE_TEST_SUITE_P(Each, ForceIsRejected, ::testing::ValuesIn(kBadForces),
                         [](const auto& tested) { return tested.param.name; });

TEST(Force, AControlMessageInPlaceOfAForceIsRejectedByItsFingerprint) {
  ForceCommand command;
  const io::Admission admission =
      io::decode_force(io::encode(make_control()), kSession, make_names(), command);
  EXPECT_EQ(admission.reason, Reason::kWrongType);
  EXPECT_NE(std::string(admission.text.data()).find("another type or version of the protocol"),
            std::string::npos);
  EXPECT_STREQ(admission.sender.data(), "");
}

TEST(Force, BoundaryValuesAreAccepted) {
  force_t message = make_force();
  message.sender.assign(31, 'z');
  message.slot = 63;
  message.start_tick = -1;
  message.duration_ticks = io::kMaxDurationTicks;
  // |(60, 80, 0)| = |(48, 60, 64)| = 100 is exactly the limit, as a sum of two squares and as a sum of three
  set_forces(message, {{0, {60.0, 80.0, 0.0}}, {1, {48.0, -60.0, 64.0}}, {2, {0.0, -100.0, 0.0}}});
  set_wrench(message, {1, {0.0, 0.0, 0.0}, {0.0, 30.0, 40.0}});
  const io::Admission admission = decode(message);
  EXPECT_EQ(admission.reason, Reason::kAccepted) << admission.text.data();
}

TEST(Force, AnEmptyForceCommandNeedsNoDuration) {
  force_t message = make_force();
  set_forces(message, {});
  message.wrenches.clear();
  message.num_wrenches = 0;
  message.duration_ticks = 0;
  EXPECT_EQ(decode(message).reason, Reason::kAccepted);
}

TEST(Force, AForceMessageWithTheMostForcesIsAccepted) {
  std::mt19937_64 engine(5);
  force_t message = random_force(engine);
  while (message.num_forces != 256) message = random_force(engine);
  EXPECT_EQ(decode(message).reason, Reason::kAccepted);
}

TEST(Force, ATorqueInWorldAxesMayPointAlongTheLineOfItsGroup) {
  force_t message = make_force();
  message.axes = 0;
  set_wrench(message, {1, {0.0, 0.0, 0.0}, {1.0, 0.0, 0.0}});
  EXPECT_EQ(decode(message).reason, Reason::kAccepted);
}

TEST(Force, AForceMayHaveAnyFiniteSizeIfTheSceneSetsNoLimits) {
  io::NameTable names = make_names();
  names.force_limit = names.torque_limit = 0.0;
  force_t message = make_force();
  message.forces[0].force[0] = 1e308;
  ForceCommand command;
  EXPECT_EQ(decode(message, names, command).reason, Reason::kAccepted);
}

TEST(Force, AForceFromTheBusMayNotLastLongerThanMaxHold) {
  io::NameTable names = make_names();
  names.max_hold = 60.0;
  names.max_hold_ticks = 30'000;
  const auto admission = [&](std::int64_t duration, std::int64_t lease) {
    force_t message = make_force();
    message.duration_ticks = duration;
    message.lease_ticks = lease;
    ForceCommand command;
    return decode(message, names, command);
  };
  EXPECT_EQ(admission(30'000, 0).reason, Reason::kAccepted);
  EXPECT_EQ(admission(0, 30'000).reason, Reason::kAccepted);
  const io::Admission lease = admission(0, 30'001);
  EXPECT_EQ(lease.reason, Reason::kHeldTooLong);
  EXPECT_STREQ(lease.text.data(),
               "lease_ticks is 30001, but may be at most 30000 from the bus (60 s, 'commands: max_hold' of "
               "the scene); renew it more often");
  const io::Admission duration = admission(io::kMaxDurationTicks, 0);
  EXPECT_EQ(duration.reason, Reason::kHeldTooLong);
  EXPECT_STREQ(duration.text.data(),
               "duration_ticks is 1000000000000000, but may be at most 30000 from the bus (60 s, 'commands: "
               "max_hold' of the scene); send it again before it ends");
  names.max_hold_ticks = 0;
  EXPECT_EQ(admission(io::kMaxDurationTicks, 0).reason, Reason::kAccepted)
      << "the limit does not apply to the operator";
}

TEST(Control, ClearNeedsATargetAndOtherControlsMustNotHaveOne) {
  const auto admission = [](std::int32_t command, const std::string& target) {
    control_t message = make_control();
    message.command = command;
    message.target = target;
    return decode(message);
  };
  for (const char* target : {"a", "local.a", "*", "a234567890123456789012345678901"})
    EXPECT_EQ(admission(control_t::CLEAR, target).reason, Reason::kAccepted) << target;
  for (const char* target : {"", "**", "a b", "a2345678901234567890123456789012"})
    EXPECT_EQ(admission(control_t::CLEAR, target).reason, Reason::kBadControl) << target;
  EXPECT_EQ(admission(control_t::HOLD, "a").reason, Reason::kBadControl);
  io::ControlCommand command{.sender = {'a'}, .sequence = 1, .command = control_t::CLEAR};
  command.target.fill('x');
  EXPECT_FALSE(io::is_sane(command)) << "a name without a terminator";
}

TEST(Control, AnUnknownControlOrACountOutOfRangeIsRejectedWithTheAllowedValues) {
  const std::vector<std::pair<std::int32_t, std::int64_t>> bad = {{0, 0},
                                                                  {9, 0},
                                                                  {-1, 0},
                                                                  {control_t::RUN, 1},
                                                                  {control_t::HOLD, -1},
                                                                  {control_t::RESET, 5},
                                                                  {control_t::STOP, 1},
                                                                  {control_t::STEP, 0},
                                                                  {control_t::STEP, 1'000'000'001},
                                                                  {control_t::SHAPES, 0},
                                                                  {control_t::SHAPES, -3},
                                                                  {control_t::SCENE, -1}};
  for (const auto& [command, count] : bad) {
    control_t message = make_control();
    message.command = command;
    message.count = count;
    const io::Admission admission = decode(message);
    EXPECT_EQ(admission.reason, Reason::kBadControl) << command << " " << count;
    EXPECT_NE(std::string(admission.text.data()).find("must be"), std::string::npos);
    EXPECT_STREQ(admission.sender.data(), "desk");
    EXPECT_FALSE(io::is_sane(io::ControlCommand{admission.sender, 3, command, count, {}}));
  }
}

TEST(Control, EachControlWithoutATargetIsAccepted) {
  for (const std::int32_t command : {1, 2, 3, 4, 5, 6, 7}) {
    control_t message = make_control();
    message.command = command;
    message.count = command == control_t::STEP || command == control_t::SHAPES ? 1 : 0;
    EXPECT_EQ(decode(message).reason, Reason::kAccepted) << command;
  }
}

TEST(Control, TheSessionTheSenderAndTheTypeOfAControlAreChecked) {
  control_t message = make_control();
  message.session = 1;
  EXPECT_EQ(decode(message).reason, Reason::kWrongSession);
  message = make_control();
  message.sender = "a b";
  EXPECT_EQ(decode(message).reason, Reason::kBadSender);
  io::ControlCommand command;
  EXPECT_EQ(io::decode_control(io::encode(make_force()), kSession, command).reason, Reason::kWrongType);
}

TEST(Reason, EachReasonHasAName) {
  std::set<std::string> names;
  for (int i = 0; i < io::kNumReasons; ++i) names.insert(io::reason_name(static_cast<Reason>(i)));
  EXPECT_EQ(names.size(), static_cast<std::size_t>(io::kNumReasons));
  EXPECT_EQ(names.count("unknown_reason"), 0u);
  EXPECT_STREQ(io::reason_name(static_cast<Reason>(io::kNumReasons)), "unknown_reason");
  EXPECT_STREQ(io::reason_name(static_cast<Reason>(-1)), "unknown_reason");
  EXPECT_STREQ(io::reason_name(Reason::kUnknownPoint), "unknown_point");
  EXPECT_STREQ(io::reason_name(Reason::kEpochEnded), "epoch_ended");
}

TEST(Reason, TheInterfaceDocumentListsEachReasonUnderItsNumber) {
  std::ifstream document(std::string(FREEFLEX_SOURCE_DIR) + "/messages/README.md");
  std::string line;
  int next = 0;
  while (std::getline(document, line)) {
    const std::string item =
        "- " + std::to_string(next) + " `" + io::reason_name(static_cast<Reason>(next)) + "`: ";
    if (line.starts_with(item)) ++next;
  }
  EXPECT_EQ(next, io::kNumReasons) << "the first reason that the document lacks";
}

/// The table is that of a plan that omits rotation, and at the end also motion out of the xy plane.
TEST(Reasons, ARejectionStatesTheOmittedFeatureThatTheCommandNeeds) {
  io::NameTable names = make_names();
  names.scope.lacks_rotation = true;
  names.scope.R_WB = {1, 0, 0, 0, 1, 0, 0, 0, 1};
  names.scope.normal_B = {0.0, 0.0, 1.0};
  names.point_arms[0] = {1.0, 0.0, 0.0};
  names.point_arms[1] = {-1.0, 0.0, 0.0};
  force_t message = make_force();
  message.wrenches.clear();
  message.num_wrenches = 0;
  const auto admission = [&](std::vector<freeflex_msgs::point_force_t> forces) {
    set_forces(message, std::move(forces));
    ForceCommand command;
    return io::from_message(message, names, command);
  };
  EXPECT_EQ(admission({{0, {3.0, 0.0, 0.0}}}).reason, Reason::kAccepted)
      << "a force through the centre of mass needs no rotation";
  EXPECT_EQ(admission({{0, {0.0, 2.0, 0.0}}, {1, {0.0, 2.0, 0.0}}}).reason, Reason::kAccepted)
      << "two forces without a moment need no rotation";
  const io::Admission turning = admission({{0, {0.0, 2.0, 0.0}}});
  EXPECT_EQ(turning.reason, Reason::kLeftOut);
  EXPECT_NE(
      std::string(turning.text.data()).find("a moment about the centre of mass, but the plan omits rotation"),
      std::string::npos)
      << turning.text.data();
  names.scope.lacks_out_of_plane = true;
  const io::Admission leaving = admission({{0, {3.0, 0.0, 1.0}}, {1, {0.0, 0.0, 1.0}}});
  EXPECT_EQ(leaving.reason, Reason::kLeftOut);
  EXPECT_NE(std::string(leaving.text.data()).find("a load leaves the plane (normal 0, 0, 1 in body axes)"),
            std::string::npos)
      << leaving.text.data();
  EXPECT_STREQ(io::reason_name(Reason::kLeftOut), "left_out");
}

}  // namespace
}  // namespace freeflex::testing
