// These tests check that the simulation loop gives the same motion in every timing. They also check controls,
// faults and outputs.
#include "service/loop.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <thread>

#include "tests/service/rig.hpp"

namespace freeflex::testing {
namespace {

using freeflex_msgs::applied_t;
using freeflex_msgs::control_t;
using io::Reason;
using service::LoopSettings;
using service::Mode;
using service::Timing;

TEST(Timing, EachNameIsReadBackAsItsTiming) {
  for (const char* name : {"realtime", "lockstep", "asap", "scaled=10", "scaled=0.25", "scaled=1e-3"}) {
    const auto timing = service::parse_timing(name);
    ASSERT_TRUE(timing) << name;
    const auto again = service::parse_timing(service::timing_name(*timing));
    ASSERT_TRUE(again) << service::timing_name(*timing);
    EXPECT_EQ(again->kind, timing->kind);
    EXPECT_EQ(again->scale, timing->scale);
  }
  for (const char* name : {"", "Realtime", "scaled", "scaled=", "scaled=0", "scaled=-1", "scaled=nan",
                           "scaled=inf", "scaled=2x", "asap "}) {
    EXPECT_FALSE(service::parse_timing(name)) << name;
  }
}

/// The results of a run: the last state, the published states by tick, and the APPLIED entries.
struct Course {
  std::vector<std::uint64_t> last;
  std::map<std::int64_t, std::vector<std::uint64_t>> published;
  std::vector<std::array<std::int64_t, 4>>
      applied;  // tick, kind, sequence of the command, sequence of the entry
};

/// Runs 400 ticks with commands for given ticks. The commands overlap in slots, use world and body axes, and
/// include an end, a lost lease and a clear.
Course run_course(const Plan& plan, const Timing& timing) {
  service::MonotonicClock clock;
  Rig rig(plan, {.timing = timing, .until_tick = 400}, clock);
  ForceCommand body = make_push(1, 0, 100, 2, 3.0);
  body.axes = 1;
  body.duration_ticks = 57;
  ForceCommand lease = make_push(2, 1, 111, 4, -5.0);
  lease.duration_ticks = 0;
  lease.lease_ticks = 80;
  ForceCommand clear = make_push(4, 2, 250);
  clear.num_points = 0;
  for (const ForceCommand& command : {body, lease, make_push(3, 2, 111, 1), clear, make_push(5, 0, 300, 5)}) {
    rig.push(command);
  }
  if (timing.kind == Timing::Kind::kLockstep)
    rig.control(control_t::STEP, 150), rig.control(control_t::STEP, 250);
  Course course;
  std::thread simulating([&rig] { rig.simulation.run(); });
  for (bool is_last = false; !is_last;) {
    is_last = rig.output->is_finished.load();
    if (const service::Snapshot* snapshot = rig.take_motion()) {
      course.published[snapshot->motion.tick] = motion_bits(snapshot->motion);
    }
    rig.output->status.take();
    std::this_thread::yield();
  }
  simulating.join();
  rig.collect();
  course.last = motion_bits(rig.simulation.state());
  for (const auto& entry : rig.applied) {
    const bool is_command = entry.kind == applied_t::FORCE;
    course.applied.push_back({entry.tick, entry.kind,
                              is_command ? entry.command.sequence : entry.expiry.sequence, entry.sequence});
  }
  return course;
}

TEST(Loop, TheMotionIsTheSameToTheBitForEveryTiming) {
  const Plan plan = octahedron_plan();
  const Course flat_out = run_course(plan, kAsap);
  const std::vector<std::array<std::int64_t, 4>> applied{
      {100, applied_t::FORCE, 1, 0},   {111, applied_t::FORCE, 2, 1},      {111, applied_t::FORCE, 3, 2},
      {157, applied_t::EXPIRED, 1, 3}, {191, applied_t::LEASE_LOST, 2, 4}, {250, applied_t::FORCE, 4, 5},
      {300, applied_t::FORCE, 5, 6}};
  EXPECT_EQ(flat_out.applied, applied);
  // without a pace no state is skipped, so the start and every twentieth tick are published
  for (std::int64_t tick = 0; tick <= 400; tick += 20) EXPECT_TRUE(flat_out.published.contains(tick)) << tick;
  EXPECT_NE(flat_out.published.at(100), flat_out.published.at(120));
  for (const Timing& timing : {Timing{Timing::Kind::kScaled, 10.0}, kRealtime, kLockstep}) {
    const Course course = run_course(plan, timing);
    EXPECT_EQ(course.last, flat_out.last) << service::timing_name(timing);
    EXPECT_EQ(course.applied, flat_out.applied) << service::timing_name(timing);
    int num_compared = 0;
    for (const auto& [tick, bits] : course.published) {
      const auto same = flat_out.published.find(tick);
      if (same == flat_out.published.end()) continue;
      EXPECT_EQ(bits, same->second) << service::timing_name(timing) << " tick " << tick;
      ++num_compared;
    }
    EXPECT_GE(num_compared, 2) << service::timing_name(timing);
  }
}

TEST(Loop, InLockstepAdvancesOnlyByStepAndPublishesAfterEachStep) {
  const Plan plan = octahedron_plan();
  Rig rig(plan, {.timing = kLockstep});
  std::vector<std::int64_t> published;
  int num_sleeps = 0;
  rig.clock.on_sleep = [&] {
    if (const auto* snapshot = rig.take_motion()) published.push_back(snapshot->motion.tick);
    if (++num_sleeps == 10) rig.control(control_t::STEP, 7);
    if (num_sleeps == 20) {
      EXPECT_EQ(rig.tick(), 7);
    }
    if (num_sleeps == 30) rig.control(control_t::STEP, 1);
    if (num_sleeps == 40) rig.control(control_t::RUN);
    if (num_sleeps == 60) rig.control(control_t::STOP);
  };
  rig.run();
  EXPECT_EQ(rig.simulation.state().tick, 8);
  EXPECT_EQ(published, (std::vector<std::int64_t>{0, 7, 8}));
  ASSERT_EQ(rig.acks.size(), 4u);
  EXPECT_EQ(rig.acks[0].reason, Reason::kAccepted);
  EXPECT_EQ(rig.acks[0].tick, 0);
  EXPECT_EQ(rig.acks[1].tick, 7);
  EXPECT_EQ(rig.acks[2].reason, Reason::kWrongMode);
  EXPECT_EQ(rig.acks[3].reason, Reason::kAccepted);
  EXPECT_EQ(rig.acks[3].mode, Mode::kStopped);
}

TEST(Loop, InRealTimeItHoldsThenStepsAndThenRunsAgain) {
  const Plan plan = octahedron_plan();
  Rig rig(plan, {.until_tick = 500});
  bool has_held = false;
  int num_idle = 0;
  rig.clock.on_sleep = [&] {
    if (rig.tick() == 100 && !has_held)
      has_held = rig.control(control_t::STEP, 1) && rig.control(control_t::HOLD);
    if (!has_held) return;
    if (++num_idle == 50) {
      EXPECT_EQ(rig.tick(), 100);
      rig.control(control_t::STEP, 3);
    }
    if (num_idle == 100) {
      EXPECT_EQ(rig.tick(), 103);
      rig.control(control_t::RUN);
    }
  };
  rig.run();
  EXPECT_EQ(rig.simulation.state().tick, 500);
  ASSERT_EQ(rig.acks.size(), 4u);
  EXPECT_EQ(rig.acks[0].reason, Reason::kWrongMode) << "STEP is not allowed while the loop runs";
  for (int i = 1; i < 4; ++i) EXPECT_EQ(rig.acks[static_cast<std::size_t>(i)].reason, Reason::kAccepted);
}

TEST(Loop, ResetReturnsToTheStartInANewEpochAndAnswersWaitingCommands) {
  const Plan plan = octahedron_plan();
  // nobody reads the states, so the loop waits a second for room for each
  Rig rig(plan, {.timing = kAsap, .until_tick = 300, .limits = {.max_age = 1e3}});
  rig.push(make_push(1, 0, -1));
  rig.push(make_push(2, 1, 290));
  bool has_reset = false;
  rig.clock.on_sleep = [&] {
    if (rig.tick() >= 200 && !has_reset)
      has_reset = rig.control(control_t::RESET) && rig.push(make_push(3, 0, -1));
  };
  rig.run();
  ASSERT_EQ(rig.acks.size(), 5u);
  EXPECT_EQ(rig.acks[2].sequence, 2);
  EXPECT_EQ(rig.acks[2].reason, Reason::kEpochEnded);
  EXPECT_EQ(rig.acks[2].found, 290);
  EXPECT_EQ(rig.acks[3].reason, Reason::kAccepted);
  const std::int64_t tick = rig.acks[3].tick;
  EXPECT_GE(tick, 200) << "the tick is not reset";
  ASSERT_EQ(rig.applied.size(), 3u);
  EXPECT_EQ(rig.applied[1].kind, applied_t::RESET);
  EXPECT_EQ(rig.applied[1].tick, tick);
  EXPECT_EQ(rig.applied[2].kind, applied_t::FORCE);
  EXPECT_EQ(rig.applied[2].tick, tick) << "the first command of the new epoch";
  EXPECT_EQ(rig.applied[2].sequence, 2);
  // the motion in the new epoch has the same bits as that of a new run
  Rig fresh(plan, {.timing = kAsap, .until_tick = 300 - tick});
  fresh.push(make_push(1, 0, -1));
  fresh.run();
  State state = rig.simulation.state();
  EXPECT_EQ(state.epoch, 1);
  EXPECT_EQ(state.epoch_start_tick, tick);
  state.tick -= tick, state.epoch = 0;
  EXPECT_EQ(motion_bits(state), motion_bits(fresh.simulation.state()));
}

TEST(Loop, HoldsTheLastFiniteStateAfterAFaultUntilAReset) {
  const Plan plan = octahedron_plan();
  Rig rig(plan, {});
  ForceCommand huge = make_push(1, 0, 50, 0, 5e307);
  for (int point = 1; point < 6; ++point) add_force(huge, point, Eigen::Vector3d(1e308, 1e308, 1e308));
  rig.push(huge);
  Mode seen = Mode::kStarting;
  std::int64_t fault_sequence = 0;
  Array held_q;
  int num_idle = 0;
  rig.clock.on_sleep = [&] {
    if (const auto* snapshot = rig.take_motion()) {
      seen = snapshot->mode;
      fault_sequence = snapshot->fault.sequence;
      held_q = snapshot->motion.q;
    }
    if (rig.tick() < 50) return;
    ++num_idle;
    if (num_idle == 50) {
      EXPECT_EQ(rig.tick(), 50);
      EXPECT_EQ(seen, Mode::kFault);
      EXPECT_EQ(fault_sequence, 1);
      for (const double q : held_q) EXPECT_TRUE(std::isfinite(q));
      rig.push(make_push(2));
      rig.control(control_t::RUN);
      rig.control(control_t::HOLD);
      rig.control(control_t::STEP, 1);
      rig.control(control_t::RESET);
    }
    if (rig.tick() == 120) rig.control(control_t::STOP);
  };
  rig.run();
  EXPECT_GE(rig.simulation.state().tick, 120) << "the loop runs before the fault and again after the reset";
  EXPECT_EQ(rig.simulation.state().epoch, 1);
  ASSERT_EQ(rig.acks.size(), 8u);
  EXPECT_EQ(rig.acks[0].reason, Reason::kAccepted);
  for (std::size_t i = 1; i < 5; ++i) EXPECT_EQ(rig.acks[i].reason, Reason::kWrongMode) << i;
  EXPECT_EQ(rig.acks[5].reason, Reason::kEpochEnded) << "this answers the command that was never applied";
  EXPECT_EQ(rig.acks[5].sequence, 1);
  EXPECT_EQ(rig.acks[6].reason, Reason::kAccepted);
  ASSERT_EQ(rig.applied.size(), 1u) << "the command that caused the fault was not applied";
  EXPECT_EQ(rig.applied[0].kind, applied_t::RESET);
}

TEST(Loop, AppliedMessagesAreNumberedWithoutGapsEvenIfNobodyReadsThem) {
  const Plan plan = octahedron_plan();
  Rig rig(plan, {.timing = kAsap, .until_tick = 3000});
  std::int64_t sequence = 1;
  rig.clock.on_sleep = [&] {
    // the test reads acknowledgements but not APPLIED
    for (service::AckEntry ack; rig.output->acks.try_pop(ack);) rig.acks.push_back(ack);
    for (int i = 0; i < 40; ++i) rig.push(make_push(sequence++, i % 8));
    rig.take_motion();
  };
  rig.run();
  std::int64_t num_accepted = 0, num_full = 0;
  for (const auto& ack : rig.acks) {
    num_accepted += ack.reason == Reason::kAccepted ? 1 : 0;
    num_full += ack.reason == Reason::kQueueFull ? 1 : 0;
  }
  EXPECT_EQ(num_accepted + num_full, static_cast<std::int64_t>(rig.acks.size()));
  EXPECT_GT(num_full, 0) << "the ring of APPLIED must fill up";
  // the sequence has no gap, and every accepted command is in it
  std::int64_t num_forces = 0;
  for (std::size_t i = 0; i < rig.applied.size(); ++i) {
    ASSERT_EQ(rig.applied[i].sequence, static_cast<std::int64_t>(i));
    num_forces += rig.applied[i].kind == applied_t::FORCE ? 1 : 0;
  }
  EXPECT_EQ(num_forces, num_accepted);
  EXPECT_EQ(rig.simulation.applied_count(), static_cast<std::int64_t>(rig.applied.size()));
}

TEST(Loop, StatesDroppedForLackOfRoomAreCountedAndOthersStayInOrder) {
  const Plan plan = octahedron_plan();
  Rig rig(plan, {.timing = kRealtime, .until_tick = 400}, 5);
  std::vector<std::int64_t> arrived;
  // the test reads nothing until tick 200, and then one state at each sleep
  rig.clock.on_sleep = [&] {
    if (rig.tick() < 200) return;
    if (const auto* snapshot = rig.take_motion()) arrived.push_back(snapshot->motion.tick);
  };
  rig.run();
  while (const auto* snapshot = rig.take_motion()) arrived.push_back(snapshot->motion.tick);
  // a state is due every 20 ticks and at the end, and the states of ticks 0 to 80 wait, but the states of
  // ticks 100 to 200 find no room
  const std::vector<std::int64_t> wanted{0,   20,  40,  60,  80,  220, 240, 260,
                                         280, 300, 320, 340, 360, 380, 400, 400};
  EXPECT_EQ(arrived, wanted);
  EXPECT_EQ(rig.output->num_dropped[kStateChannel].load(), 6);
}

TEST(Loop, PassesOnRequestsOnlyForModesAndPagesThatExist) {
  const Plan plan = octahedron_plan();
  Rig rig(plan, {.timing = kAsap, .until_tick = 5});
  rig.output->num_scene_pages = {3, 4};
  const std::vector<std::pair<std::int32_t, std::int64_t>> good{{control_t::SHAPES, 1},
                                                                {control_t::SHAPES, plan.num_elastic},
                                                                {control_t::SCENE, 0},
                                                                {control_t::SCENE, 3}};
  const std::vector<std::pair<std::int32_t, std::int64_t>> bad{{control_t::SHAPES, plan.num_elastic + 1},
                                                               {control_t::SCENE, 4}};
  for (const auto& [command, count] : good) rig.control(command, count);
  for (const auto& [command, count] : bad) rig.control(command, count);
  rig.run();
  ASSERT_EQ(rig.acks.size(), good.size() + bad.size());
  service::PageRequest request;
  for (std::size_t i = 0; i < good.size(); ++i) {
    EXPECT_EQ(rig.acks[i].reason, Reason::kAccepted);
    ASSERT_TRUE(rig.output->requests.try_pop(request));
    EXPECT_EQ(std::pair(request.command, std::int64_t{request.number}), good[i]);
  }
  EXPECT_FALSE(rig.output->requests.try_pop(request));
  for (std::size_t i = 0; i < bad.size(); ++i) {
    const service::AckEntry& ack = rig.acks[good.size() + i];
    EXPECT_EQ(ack.reason, Reason::kBadControl);
    EXPECT_EQ(ack.found, bad[i].second);
    EXPECT_EQ(ack.most, bad[i].second - 1);
  }
}

}  // namespace
}  // namespace freeflex::testing
