// Messages about rejections use the names in the scene and the options of `freeflex push`, whatever the
// reason for the rejection.
#include "tools/bus/push_words.hpp"

#include <gtest/gtest.h>

#include <memory>
#include <numeric>

#include "freeflex_msgs/control_t.hpp"
#include "service/io/wire/codec.hpp"
#include "service/publisher.hpp"
#include "tests/tools/shell.hpp"

namespace freeflex::testing {
namespace {

using io::Reason;

/// Returns the text for a rejection by the loop, as push prints it.
std::string loop_text(const service::AckEntry& entry) {
  return tools::in_push_words(service::make_ack(entry, service::Identity{}).text,
                              [](std::string_view, std::int64_t) { return std::string(); });
}

/// Returns the name of an item of a scene.
std::string name_of(std::string_view kind, std::int64_t index) {
  if (kind == "point") return index == 19 ? "RUN.20" : index == 4 ? "in point 19" : "";
  if (kind == "group") return index == 2 ? "start_tick" : "";
  return index == 1 ? "spin" : "";
}

/// Returns the text of check_command for a command, as push prints it. The table has 20 points and 3 groups.
std::string command_text(Reason reason, const std::function<void(ForceCommand&, io::NameTable&)>& change) {
  auto command = std::make_unique<ForceCommand>();
  auto table = std::make_unique<io::NameTable>();
  table->num_points = 20;
  table->num_groups = 3;
  table->num_pushable = 20;
  std::iota(table->pushable.begin(), table->pushable.begin() + 20, 0);
  for (auto& group : table->groups) group.torque_rank = 3, group.is_pushable = 1;
  table->force_limit = 10.0;
  table->torque_limit = 1.0;
  command->duration_ticks = 1;
  command->start_tick = -1;
  command->num_points = 2;
  command->points[1].point = 19;
  command->num_wrenches = 1;
  command->wrenches[0].group = 2;
  change(*command, *table);
  std::array<char, 160> text{};
  EXPECT_EQ(io::check_command(*command, *table, text), reason) << text.data();
  return tools::in_push_words(text.data(), name_of);
}

TEST(PushWords, IndicesAreReplacedByNames) {
  EXPECT_EQ(command_text(Reason::kOverLimit, [](auto& command, auto&) { command.points[1].force[2] = 20.0; }),
            "point 'RUN.20' has |force| 20 N, but the scene allows at most 10 N");
  EXPECT_EQ(
      command_text(Reason::kOverLimit, [](auto& command, auto&) { command.wrenches[0].torque[2] = 2.0; }),
      "group 'start_tick' has |torque| 2 N m, but the scene allows at most 1 N m");
  EXPECT_TRUE(command_text(Reason::kNotPushable, [](auto&, auto& table) {
                table.num_pushable = 19;
              }).starts_with("point 'RUN.20' may not be pushed"));
  EXPECT_TRUE(command_text(Reason::kUnreachableTorque, [](auto& command, auto& table) {
                table.groups[2].torque_rank = 0;
                command.wrenches[0].torque[0] = 0.5;
              }).starts_with("group 'start_tick' cannot take the torque"));
  EXPECT_TRUE(command_text(Reason::kDuplicatePoint, [](auto& command, auto&) {
                command.points[0].point = 19;
              }).starts_with("point 'RUN.20' is listed twice"));
  EXPECT_EQ(command_text(Reason::kPointTorque,
                         [](auto& command, auto&) {
                           command.num_torques = 1;
                           command.torques[0].point = 4;
                         }),
            "point 'in point 19' has no inertia and takes no torque; use a wrench on a group");
  EXPECT_EQ(command_text(Reason::kNotPushable,
                         [](auto& command, auto& table) {
                           table.num_pushable = 19;
                           table.num_wheels = 2;
                           table.wheel_points[1] = 19;
                           command.num_points = 1;
                           command.num_wheels = 1;
                           command.wheels[0].wheel = 1;
                         }),
            "wheel 'spin' is in point 'RUN.20', which may not be pushed; add it to 'commands: points'");
  EXPECT_EQ(command_text(Reason::kTooManyPoints, [](auto& command, auto&) { command.num_points = 257; }),
            "there are 257 points, but at most 256 are allowed");
}

TEST(PushWords, MessageFieldsAreReplacedByOptions) {
  EXPECT_EQ(
      loop_text({.reason = Reason::kLate, .tick = 3001, .found = 1}),
      "--at-tick 1 has passed, because the next tick is 3001; give a later tick or none, or add --late-ok");
  EXPECT_EQ(loop_text({.reason = Reason::kTooFarAhead, .tick = 5, .found = 200'000'000, .most = 100'000'000}),
            "--at-tick 200000000 is more than 100000000 ticks ahead of tick 5; send it later");
  EXPECT_EQ(
      loop_text({.reason = Reason::kTooFarAhead, .tick = 5, .found = 70'000, .most = 60'000}),
      "--at-tick 70000 is more than 60000 ticks ahead of tick 5; send it later ('commands: max_hold' of the "
      "scene is the limit)");
  EXPECT_EQ(command_text(Reason::kHeldTooLong,
                         [](auto& command, auto& table) {
                           table.max_hold = 60.0;
                           table.max_hold_ticks = 60'000;
                           command.duration_ticks = 70'000;
                         }),
            "--duration is 70000 ticks, but may be at most 60000 from the bus (60 s, 'commands: max_hold' of "
            "the scene); send "
            "it again before it ends");
  EXPECT_EQ(loop_text({.reason = Reason::kNotGranted, .command = freeflex_msgs::control_t::CLEAR}),
            "--clear-sender is accepted only over the operator's socket, or with a key whose controls "
            "include clear");
  using freeflex_msgs::control_t;
  EXPECT_EQ(loop_text({.reason = Reason::kBadControl, .command = control_t::SHAPES, .found = 7, .most = 6}),
            "--control shapes=7 must be a mode from 1 to 6");
  EXPECT_EQ(loop_text({.reason = Reason::kBadControl, .command = control_t::SCENE, .found = 4, .most = 3}),
            "--control scene=4 must be a page from 1 to 3, or scene without a number for all");
  EXPECT_EQ(loop_text({.reason = Reason::kQueueFull, .command = control_t::SHAPES, .found = 3}),
            "the publisher is behind; send again later");
  EXPECT_EQ(loop_text({.reason = Reason::kQueueFull, .found = 64}),
            "this sender, by itself or with others, already has 64 waiting commands, which is the limit; "
            "send again later");
  EXPECT_EQ(loop_text({.reason = Reason::kWrongMode, .command = control_t::RUN}),
            "--control run does not apply in lockstep; send --control step=N");
  EXPECT_EQ(loop_text({.reason = Reason::kWrongMode, .command = control_t::STEP}),
            "--control step=N applies only while holding; send --control hold first");
  EXPECT_EQ(loop_text({.reason = Reason::kWrongMode, .mode = service::Mode::kFault}),
            "the simulation is faulted, so only --control reset and --control stop are accepted");
}

TEST(PushWords, NoRejectionOfTheLoopShowsNamesOfMessageFields) {
  for (int reason = 1; reason < io::kNumReasons; ++reason) {
    const std::string text = loop_text({.reason = static_cast<Reason>(reason), .tick = 3, .found = 1});
    for (const char* word :
         {"start_tick", "late_policy", "SHAPES", "SCENE", "STEP", "RUN", "HOLD", "RESET", "STOP"})
      EXPECT_FALSE(contains(text, word)) << text;
  }
}

}  // namespace
}  // namespace freeflex::testing
