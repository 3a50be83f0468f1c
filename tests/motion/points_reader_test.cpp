// Points that are read in several states at once have the bits of those that are read one by one.
#include <algorithm>
#include <array>

#include "core/plan/make_plan.hpp"
#include "tests/motion/verdict_kinds.hpp"

namespace freeflex::testing {
namespace {

class PointsReaderOnKinds : public ::testing::TestWithParam<Family> {};

TEST_P(PointsReaderOnKinds, GivesTheBitsOfReadPoint) {
  int num_compared = 0;
  for (const Fidelity rung : {Fidelity::kRigid, Fidelity::kSeparated, Fidelity::kSpinLoaded,
                              Fidelity::kCoupled, Fidelity::kCorotational, Fidelity::kFull})
    for (const IntegrateBy by : {IntegrateBy::kModes, IntegrateBy::kAuto}) {
      const RandomMotion random(GetParam(), 3);
      Scene scene = random.specimen().scene;
      scene.fidelity = rung;
      scene.integration.by = by;
      Faults faults;
      const auto structure = build_structure(scene, faults);
      const auto plan = structure ? make_plan(scene, *structure, faults) : std::nullopt;
      if (!plan) continue;
      Motion motion(*plan, kMotionAlone);
      PointsReader reader(*plan);
      std::vector<MotionState> states;
      for (int k = 0; k < 5; ++k) {
        for (int tick = 0; tick < 3; ++tick) ASSERT_EQ(motion.advance().status, StepStatus::kOk);
        states.push_back(motion.state_of_points());
      }
      std::vector<const MotionState*> all;
      for (const MotionState& state : states) all.push_back(&state);
      std::vector<PointState> points(all.size() * plan->published_points.size());
      reader.read(all, plan->published_points, points.data());
      const PointState* read = points.data();
      for (const std::int32_t point : plan->published_points)
        for (const MotionState& state : states) {
          const PointState one = read_point(*plan, state, point);
          EXPECT_EQ(read->p_W, one.p_W);
          EXPECT_EQ(read->v_W, one.v_W);
          EXPECT_EQ(read->a_W, one.a_W);
          EXPECT_EQ(read->V_B, one.V_B);
          ++read, ++num_compared;
        }
    }
  EXPECT_GT(num_compared, 40) << "the scenes of this kind are refused, or publish no points";
}

INSTANTIATE_TEST_SUITE_P(All, PointsReaderOnKinds, ::testing::ValuesIn(all_families()),
                         [](const auto& instance) { return std::string(instance.param.name); });

}  // namespace
}  // namespace freeflex::testing
