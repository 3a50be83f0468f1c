// Pictures in files: what they keep of a long motion.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "tests/tools/shell.hpp"
#include "tools/plot/chart.hpp"

namespace freeflex::testing {
namespace {

using tools::Samples;

// an oscillation of 15.625 Hz has whole periods in 64 ticks of 1 kHz: every 64th of them is one value
TEST(Plot, NoPeakIsLostAndNothingLooksSlower) {
  Samples samples(2);
  const auto value = [](int tick) { return std::sin(2.0 * std::numbers::pi * 15.625e-3 * tick); };
  for (int tick = 0; tick <= 200'000; ++tick)
    samples.take(1e-3 * tick, {value(tick), tick == 123'457 ? 7.0 : tick == 150'001 ? NAN : 0.0});
  const std::vector<double> time = samples.time(), wave = samples.column(0), kick = samples.column(1);
  ASSERT_EQ(time.size(), wave.size());
  ASSERT_EQ(time.size(), kick.size());
  EXPECT_LE(time.size(), 4000u);
  EXPECT_GE(time.size(), 1000u);
  EXPECT_TRUE(std::is_sorted(time.begin(), time.end()));
  EXPECT_EQ(*std::max_element(kick.begin(), kick.end()), 7.0);
  const auto at = static_cast<std::size_t>(std::max_element(kick.begin(), kick.end()) - kick.begin());
  EXPECT_NEAR(time[at], 123.457, 200.0 / 500.0);
  // all but the last, which may be part of a period: from trough to crest
  for (std::size_t k = 0; k + 2 < wave.size(); k += 2) {
    EXPECT_LT(wave[k], -0.99) << k;
    EXPECT_GT(wave[k + 1], 0.99) << k;
  }
}

TEST(Plot, WhatFitsIsKeptAsItIs) {
  Samples samples(1);
  for (int tick = 0; tick < 1500; ++tick) samples.take(tick, {0.5 * tick});
  ASSERT_EQ(samples.time().size(), 1500u);
  EXPECT_EQ(samples.time()[777], 777.0);
  EXPECT_EQ(samples.column(0)[777], 388.5);
}

TEST(Plot, FilesAreWrittenOrItIsSaidWhyNot) {
  const TemporaryFolder folder;
  const std::string boom = kFreeflex + " run " + kScenes + "boom.yaml --until 1 ";
  for (const char* name : {"a.svg", "b.PNG"}) {
    const Outcome outcome = run(boom + "--plot " + folder / name);
    EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
    EXPECT_TRUE(contains(read_text(folder / name), std::string(name) == "a.svg" ? "<svg" : "PNG"));
  }
  const Outcome modes = run(kFreeflex + " modes " + kScenes + "boom.yaml --plot " + folder / "m.svg");
  EXPECT_EQ(modes.exit_code, 0) << modes.err;
  EXPECT_TRUE(contains(read_text(folder / "m.svg"), "<svg"));
  const Outcome nowhere = run(boom + "--plot " + folder / "no/c.svg");
  EXPECT_EQ(nowhere.exit_code, 1);
  EXPECT_TRUE(contains(nowhere.err, "no/c.svg")) << nowhere.err;
  EXPECT_FALSE(contains(nowhere.out, "ticks")) << nowhere.out;
  EXPECT_EQ(run(boom + "--plot " + folder / "c.gif").exit_code, 2);
  EXPECT_EQ(run(boom + "--prefix A --plot " + folder / "c.svg").exit_code, 2);
}

}  // namespace
}  // namespace freeflex::testing
