// These tests check the limit on repeated log lines, with a simulated clock.
#include "service/limited_log.hpp"

#include <gtest/gtest.h>

#include <random>
#include <vector>

#include "service/clock.hpp"

namespace freeflex::testing {
namespace {

using service::kSecond;
using service::LimitedLog;
using service::LineKind;

/// Collects the lines of a log together with their times.
class LimitedLogTest : public ::testing::Test {
 protected:
  struct Line {
    LineKind kind;
    std::int64_t time_ns;
    std::string text;
  };

  void write(LineKind kind, const std::string& text) { log_.write(kind, now_ns_, text); }
  /// Advances the time and lets the log write the lines that are due.
  void pass(std::int64_t ns) {
    now_ns_ += ns;
    log_.write_due(now_ns_);
  }
  std::vector<std::string> texts() const {
    std::vector<std::string> all;
    for (const Line& line : lines_) all.push_back(line.text);
    return all;
  }

  std::int64_t now_ns_ = 0;
  std::vector<Line> lines_;
  LimitedLog log_{[this](LineKind kind, const std::string& text) {
    lines_.push_back({kind, now_ns_, text});
  }};
};

TEST_F(LimitedLogTest, WritesEveryLineIfLinesAreRare) {
  for (int i = 0; i < 100; ++i) {
    write(LineKind::kSlip, "slip");
    pass(kSecond / LimitedLog::kMost);
  }
  EXPECT_EQ(texts(), std::vector<std::string>(100, "slip"));
}

TEST_F(LimitedLogTest, WritesTenLinesAndAfterASecondTheNumberOfSuppressedLines) {
  std::vector<std::string> expected;
  for (int i = 0; i < 247; ++i) {
    const std::string text = "session " + std::to_string(i);
    write(LineKind::kOtherDaemon, text);
    if (i < LimitedLog::kMost) expected.push_back(text);
  }
  EXPECT_EQ(texts(), expected);
  pass(kSecond - 1);
  EXPECT_EQ(texts(), expected);
  pass(1);
  expected.emplace_back("... and 237 more of this kind in the last second, the last: session 246");
  EXPECT_EQ(texts(), expected);
  pass(100 * kSecond);
  EXPECT_EQ(texts(), expected);
}

TEST_F(LimitedLogTest, WritesTheNumberOfSuppressedLinesBeforeTheNextLine) {
  for (int i = 0; i <= LimitedLog::kMost; ++i) write(LineKind::kFault, "fault");
  now_ns_ += kSecond;
  write(LineKind::kFault, "another");
  ASSERT_EQ(lines_.size(), 12u);
  EXPECT_EQ(lines_[10].text, "... and 1 more of this kind in the last second, the last: fault");
  EXPECT_EQ(lines_[11].text, "another");
}

TEST_F(LimitedLogTest, LimitsEachKindOfLineSeparately) {
  for (int i = 0; i < 1000; ++i) write(LineKind::kOtherDaemon, "flood");
  write(LineKind::kIngressEnded, "once");
  EXPECT_EQ(lines_.size(), 11u);
  EXPECT_EQ(lines_.back().text, "once");
  EXPECT_EQ(lines_.back().kind, LineKind::kIngressEnded);
}

TEST_F(LimitedLogTest, WritesTheNumberOfSuppressedLinesAtTheEnd) {
  for (int i = 0; i < 15; ++i) write(LineKind::kReplan, "back");
  log_.end();
  log_.end();
  ASSERT_EQ(lines_.size(), 11u);
  EXPECT_EQ(lines_.back().text, "... and 5 more of this kind in the last second, the last: back");
}

TEST_F(LimitedLogTest, WritesAtMostTenLinesInAnySecondAndCountsEveryLineOnce) {
  std::mt19937_64 engine(12);
  std::int64_t num_written = 0;
  for (int i = 0; i < 100'000; ++i) {
    // random intervals from 0 to 1.07 s, of all orders of magnitude
    const std::uint64_t exponent = engine() % 31;
    pass(static_cast<std::int64_t>(engine() % (std::uint64_t{1} << exponent)));
    write(LineKind::kFault, "fault");
    ++num_written;
  }
  log_.end();
  std::int64_t num_counted = 0;
  for (std::size_t i = 0; i < lines_.size(); ++i) {
    long long held = 0;
    const bool is_count = std::sscanf(lines_[i].text.c_str(), "... and %lld more", &held) == 1;
    num_counted += is_count ? held : 1;
    // the last line is excluded, because end() writes it without waiting
    if (i >= LimitedLog::kMost && i + 1 < lines_.size()) {
      EXPECT_GE(lines_[i].time_ns - lines_[i - LimitedLog::kMost].time_ns, kSecond) << i;
    }
  }
  EXPECT_EQ(num_counted, num_written);
  EXPECT_GT(lines_.size(), 1000u);
}

TEST_F(LimitedLogTest, InASteadyFloodWritesNineLinesAndOneCountASecond) {
  for (int i = 0; i < 60'000; ++i) {
    write(LineKind::kOtherDaemon, "flood");
    pass(kSecond / 1000);
  }
  // at first there are ten lines, then a count and nine lines every 1.01 s
  EXPECT_NEAR(static_cast<double>(lines_.size()), 600.0, 10.0);
}

}  // namespace
}  // namespace freeflex::testing
