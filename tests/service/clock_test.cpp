// These tests check deadlines, overruns and slips with a simulated clock, and the histogram of durations.
#include "service/clock.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "core/plan/rungs/rates.hpp"
#include "service/histogram.hpp"
#include "tests/service/rig.hpp"

namespace freeflex::testing {
namespace {

using service::Histogram;
using service::Pacer;
using service::SlidingPercentiles;

constexpr std::int64_t kMillisecond = 1'000'000;  // [ns]

TEST(Pacer, DeadlinesOfANonIntegerPeriodDoNotDrift) {
  const double period = 1e9 / 3000.0;
  Pacer pacer(period);
  pacer.rebase(5);
  for (int i = 0; i < 3'000'000; ++i) pacer.finish_tick(0);
  EXPECT_EQ(pacer.deadline_ns(), 5 + 1'000'000'000'000);
}

TEST(Pacer, CountsATickThatEndsAfterTheNextDeadlineAsAnOverrun) {
  Pacer pacer(1e6);
  pacer.rebase(0);
  pacer.finish_tick(kMillisecond);  // exactly at the deadline
  EXPECT_EQ(pacer.num_overruns(), 0);
  pacer.finish_tick(2 * kMillisecond + 1);
  EXPECT_EQ(pacer.num_overruns(), 1);
  EXPECT_EQ(pacer.deadline_ns(), 2 * kMillisecond)
      << "the deadline is not moved, so the next tick catches up";
}

TEST(Pacer, SkipsLostTimeOnlyIfTheDelayExceedsTheBound) {
  static_assert(Pacer::kCatchUp >= 100 * kMillisecond);
  Pacer pacer(1e6);
  pacer.rebase(0);
  pacer.finish_tick(kMillisecond + Pacer::kCatchUp);
  EXPECT_EQ(pacer.num_slips(), 0);
  const std::int64_t now = 2 * kMillisecond + Pacer::kCatchUp + 1;
  pacer.finish_tick(now);
  EXPECT_EQ(pacer.num_slips(), 1);
  EXPECT_EQ(pacer.deadline_ns(), now);
}

TEST(Pacer, DistinguishesOneStallFromAPeriodThatIsTooShort) {
  // every tick takes 1.5 ms in a period of 1 ms, so the delay exceeds the bound after some 400 ticks
  Pacer slow(1e6);
  std::int64_t now = 0;
  slow.rebase(now);
  while (slow.num_slips() == 0) {
    now = std::max(now, slow.deadline_ns());
    slow.wake(now);
    slow.finish_tick(now += 1'500'000);
  }
  EXPECT_EQ(slow.slip_gap_ns(), 1'500'000);
  // one stall of 10 s in a loop that otherwise keeps its period
  Pacer stopped(1e6);
  stopped.rebase(now = 0);
  for (int i = 0; i < 100; ++i) {
    now = stopped.deadline_ns();
    stopped.wake(now);
    stopped.finish_tick(now += 300'000);
  }
  const std::int64_t late = 10'000 * kMillisecond;
  stopped.wake(now = stopped.deadline_ns() + late);
  stopped.finish_tick(now + 300'000);
  EXPECT_EQ(stopped.num_slips(), 1);
  EXPECT_EQ(stopped.slip_gap_ns(), late);
}

TEST(Pacer, ReportsTheCauseOfASlip) {
  EXPECT_NE(service::slip_text(1e-3, 1).find("does not hold the period of 1000 us"), std::string::npos);
  const std::string stood = service::slip_text(1e-3, 2, 10'040 * kMillisecond);
  EXPECT_NE(stood.find("did not run for 10.0 s"), std::string::npos) << stood;
  EXPECT_EQ(stood.find("period"), std::string::npos) << stood;
}

/// Runs 1000 ticks of 1 ms. The machine stalls once for stall_ns, at tick 100.
void run_with_stall(Rig& rig, std::int64_t stall_ns) {
  bool has_stalled = false;
  rig.clock.on_sleep = [&] {
    if (rig.tick() == 100 && !has_stalled) {
      has_stalled = true;
      rig.clock.pass(stall_ns);
    }
  };
  rig.run();
}

TEST(Loop, CatchesUpAfterAStallAndExecutesEveryTick) {
  const Plan plan = octahedron_plan();
  Rig rig(plan, {.until_tick = 1000});
  const std::int64_t start = rig.clock.now_ns();
  run_with_stall(rig, 50 * kMillisecond);
  EXPECT_EQ(rig.simulation.state().tick, 1000);
  EXPECT_EQ(rig.output->num_slips.load(), 0);
  // the ticks due at 100 to 149 ms all ended at 150 ms, the last one exactly at its deadline
  EXPECT_EQ(rig.output->num_overruns.load(), 49);
  EXPECT_EQ(rig.clock.now_ns() - start, 999 * kMillisecond) << "no time was lost";
}

TEST(Loop, SlipsOnceAfterALongStallAndStillExecutesEveryTick) {
  const Plan plan = octahedron_plan();
  Rig rig(plan, {.until_tick = 1000});
  const std::int64_t start = rig.clock.now_ns();
  run_with_stall(rig, 500 * kMillisecond);
  EXPECT_EQ(rig.simulation.state().tick, 1000);
  EXPECT_EQ(rig.output->num_slips.load(), 1);
  EXPECT_EQ(rig.output->num_overruns.load(), 1);
  // tick 100 ends at 600 ms, which becomes the new base of the deadlines. 899 ticks follow, the first of them
  // at the base
  EXPECT_EQ(rig.clock.now_ns() - start, 600 * kMillisecond + 898 * kMillisecond);
}

TEST(Loop, ObeysControlsBetweenSlowTicks) {
  // a tick lasts 100 s, and STOP is sent 5 s after the start of the first tick
  Plan plan = octahedron_plan();
  set_rate(plan, 0.01);
  Rig rig(plan, {});
  const std::int64_t start_ns = rig.clock.now_ns();
  std::int64_t told_ns = 0;
  rig.clock.on_sleep = [&] {
    if (told_ns != 0 || rig.tick() != 1 || rig.clock.now_ns() < start_ns + 5'000'000'000) return;
    rig.control(freeflex_msgs::control_t::STOP);
    told_ns = rig.clock.now_ns();
  };
  rig.run();
  EXPECT_EQ(rig.simulation.state().tick, 1)
      << "the first tick is at the start, and the loop stops before the second";
  EXPECT_LT(rig.clock.now_ns() - told_ns, 100'000'000);
  EXPECT_EQ(rig.output->num_overruns.load(), 0);
}

TEST(Loop, AHoldIsNotCountedAsAnOverrun) {
  const Plan plan = octahedron_plan();
  Rig rig(plan, {.starts_holding = true, .until_tick = 10});
  int num_sleeps = 0;
  rig.clock.on_sleep = [&] {
    if (++num_sleeps == 5000) rig.control(freeflex_msgs::control_t::RUN);
  };
  rig.run();
  EXPECT_EQ(rig.simulation.state().tick, 10);
  EXPECT_EQ(rig.output->num_overruns.load(), 0);
  EXPECT_EQ(rig.output->num_slips.load(), 0);
}

TEST(Histogram, RoundsDurationsUpByAtMostOnePartIn32) {
  std::mt19937_64 engine(7);
  std::uniform_real_distribution<double> exponent(std::log(64.0), std::log(1.3e11));
  for (int i = 0; i < 100'000; ++i) {
    const auto ns = static_cast<std::int64_t>(std::exp(exponent(engine)));
    const auto edge = Histogram::upper_edge(Histogram::bucket(ns));
    ASSERT_GT(edge, ns);
    // the width of a bucket is 1/32 of the lower limit of its octave
    ASSERT_LE(static_cast<double>(edge), static_cast<double>(ns) * (1.0 + 1.0 / 32.0) + 1.0);
  }
  EXPECT_EQ(Histogram::bucket(-5), 0);
  EXPECT_EQ(Histogram::bucket(INT64_MAX), Histogram::kNumBuckets - 1);
}

TEST(Histogram, PercentilesCoverOnlyTheSlidingWindow) {
  Histogram histogram;
  SlidingPercentiles percentiles(histogram);
  EXPECT_EQ(percentiles.read().count, 0);
  EXPECT_EQ(percentiles.read().us[3], 0.0);
  for (int i = 0; i < 985; ++i) histogram.record(10'000);
  for (int i = 0; i < 14; ++i) histogram.record(1'000'000);
  histogram.record(5'000'000);
  const service::Percentiles all = percentiles.read();
  EXPECT_EQ(all.count, 1000);
  const double width = 1.0 / 32.0;  // relative width of a bucket
  EXPECT_NEAR(all.us[0], 10.0, 10.0 * width);
  EXPECT_NEAR(all.us[1], 1000.0, 1000.0 * width);  // 990th of 1000
  EXPECT_NEAR(all.us[2], 1000.0, 1000.0 * width);  // 999th
  EXPECT_NEAR(all.us[3], 5000.0, 5000.0 * width);
  for (int i = 0; i < SlidingPercentiles::kSpan + 1; ++i) percentiles.advance();
  EXPECT_EQ(percentiles.read().count, 0) << "all records are older than the window";
}

}  // namespace
}  // namespace freeflex::testing
