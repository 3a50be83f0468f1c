// The section leave_out is read as written.
#include <algorithm>

#include "tests/scene/good_scene.hpp"

namespace freeflex::testing {
namespace {

TEST(ReadLeaveOut, ByDefaultTheToleranceIsZeroAndNoFeatureIsKept) {
  const LeaveOut leave_out = read_good(kTwoPoints).leave_out;
  EXPECT_EQ(leave_out.tolerance, 0.0);
  EXPECT_EQ(leave_out.on_need, OnNeed::kKeep);
  EXPECT_TRUE(std::none_of(leave_out.keeps.begin(), leave_out.keeps.end(), [](bool keeps) { return keeps; }));
}

TEST(ReadLeaveOut, EveryKeyIsRead) {
  const LeaveOut leave_out =
      read_good(kTwoPoints +
                "leave_out: {tolerance: 1e-3, horizon: 2.5, on_need: replan, keep: [damping, point_rows]}\n")
          .leave_out;
  EXPECT_EQ(leave_out.tolerance, 1e-3);
  EXPECT_EQ(leave_out.horizon, 2.5);
  EXPECT_EQ(leave_out.on_need, OnNeed::kReplan);
  for (int k = 0; k < kNumFeatures; ++k) {
    const auto feature = static_cast<Feature>(k);
    EXPECT_EQ(leave_out.keeps[static_cast<std::size_t>(k)],
              feature == Feature::kDamping || feature == Feature::kPointRows)
        << k;
  }
  EXPECT_EQ(leave_out.origin.line, 3);
}

TEST(ReadLeaveOut, KeepAllKeepsEveryFeature) {
  const LeaveOut leave_out = read_good(kTwoPoints + "leave_out: {keep: all, on_need: refuse}\n").leave_out;
  EXPECT_EQ(leave_out.on_need, OnNeed::kRefuse);
  EXPECT_TRUE(std::all_of(leave_out.keeps.begin(), leave_out.keeps.end(), [](bool keeps) { return keeps; }));
}

}  // namespace
}  // namespace freeflex::testing
