// The scenes of the gallery have the figures that its page states (tools/docs/gallery.md).
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>

#include "core/motion.hpp"
#include "core/steady/relative_equilibrium.hpp"
#include "core/step/readout.hpp"
#include "service/io/scene/input.hpp"

namespace freeflex::testing {
namespace {

using Eigen::Vector3d;

Plan read_gallery(const std::string& name, const io::Settings& settings = {}) {
  io::PlanResult result =
      io::load_plan(FREEFLEX_SOURCE_DIR "/service/scenes/gallery/" + name + ".yaml", 0.0, {}, settings);
  for (const Fault& fault : result.faults) ADD_FAILURE() << io::format_fault(fault, result.sources);
  return result.plan.value();
}
Plan read_with(const std::string& name, const std::string& setting) {
  return read_gallery(name, {*io::parse_setting(setting)});
}

TEST(Gallery, SpinUp) {
  const Plan plan = read_gallery("spin_up");
  Motion motion(plan, kMotionAlone);
  double lag = 0.0, time = 0.0;
  const double rate = 1.0 / plan.period;
  for (long tick = 1; tick <= std::lround(8.0 * rate); ++tick) {
    ASSERT_EQ(motion.advance().status, StepStatus::kOk);
    const PointState hub = read_point(plan, motion.state(), 0), tip = read_point(plan, motion.state(), 20);
    const Quat& q = read_body(plan, motion.state(), 0).q_WP;
    const Vector3d arm(tip.p_W[0] - hub.p_W[0], tip.p_W[1] - hub.p_W[1], tip.p_W[2] - hub.p_W[2]);
    const double across = (Eigen::Quaterniond(q[0], q[1], q[2], q[3]).conjugate() * arm).y();
    if (across < lag) lag = across, time = static_cast<double>(tick) / rate;
  }
  EXPECT_NEAR(lag, -0.57492, 1e-4);  // the hub is 10 times lighter than in large_motion_test
  EXPECT_NEAR(time, 6.765, 0.003);
}

TEST(Gallery, Rocket) {
  const double unit = std::sqrt(1000.0 / 1e4);
  constexpr double expected[][3] = {
      {0, 22.330, 61.472}, {200, 19.496, 57.589}, {600, 13.595, 48.399}, {1000, 14.112, 33.876}};
  for (const auto& [thrust, first, second] : expected) {
    const Plan plan = read_with("rocket", "loads.thrust.forces.p0=[" + std::to_string(thrust) + ", 0, 0]");
    const RelativeEquilibrium found = RelativeEquilibria(plan, 0.0).find(Vector3d::Zero());
    ASSERT_EQ(found.error, "");
    EXPECT_NEAR(found.motions[0].rate.imag() / unit, first, 1e-3);
    EXPECT_NEAR(found.motions[2].rate.imag() / unit, second, 1e-3);
    EXPECT_NEAR(found.motions[0].rate.real(), 0.0, 1e-6);
  }
}

TEST(Gallery, GreatBend) {
  const Plan plan = read_gallery("great_bend");
  const RelativeEquilibrium found = RelativeEquilibria(plan, 0.0).find(Vector3d::Zero());
  ASSERT_EQ(found.error, "");
  const Vector3d bent = found.displacements.col(16) - found.displacements.col(0);
  EXPECT_NEAR(-bent.x(), 0.150975, 1e-6);
  EXPECT_NEAR(-bent.y(), 0.710576, 1e-6);
}

// A polygon of chords of equal length that each turn by 2 pi / 8 against the last one is closed.
TEST(Gallery, RollUp) {
  const RelativeEquilibrium found = RelativeEquilibria(read_gallery("roll_up"), 6.0).find(Vector3d::Zero());
  ASSERT_EQ(found.error, "");
  const Vector3d ends = Vector3d::UnitX() + found.displacements.col(8) - found.displacements.col(0);
  EXPECT_LT(ends.norm(), 1e-9);
  for (const SmallMotion& small : found.motions) EXPECT_LT(small.rate.real(), 1e-6);
}

TEST(Gallery, RollUpUnderSofterTorsionIsUnstable) {
  const Plan plan =
      read_gallery("roll_up", {*io::parse_setting("links.*.GJ=3"), *io::parse_setting("links.*.EIy=3"),
                               *io::parse_setting("damping.rayleigh.beta=0")});
  const RelativeEquilibrium found = RelativeEquilibria(plan, 6.0).find(Vector3d::Zero());
  ASSERT_EQ(found.error, "");
  double growth = 0.0;
  for (const SmallMotion& small : found.motions) growth = std::max(growth, small.rate.real());
  EXPECT_NEAR(growth, 6.43, 0.05);
}

// Impulses of force and torque give the momenta; the figures at 2.5 s and 5 s are those of the page.
TEST(Gallery, FreeFlyingBeam) {
  const Plan plan = read_gallery("free_flying_beam");
  Motion motion(plan, kMotionAlone);
  for (long tick = 1; tick <= std::lround(5.0 / plan.period); ++tick) {
    ASSERT_EQ(motion.advance().status, StepStatus::kOk);
    const PointState end = read_point(plan, motion.state(), 0);
    if (tick * 2 == std::lround(5.0 / plan.period)) {
      EXPECT_NEAR(end.p_W[0], 8.96369, 1e-5);
      EXPECT_NEAR(end.p_W[1], 7.53243, 1e-5);
    }
  }
  const PointState end = read_point(plan, motion.state(), 0);
  EXPECT_NEAR(motion.state().p_WB[0], 3.0 + 0.5 * 0.8 * 2.5 * 2.5 + 2.0 * 2.5, 1e-9);  // 0.8 m/s^2 for 2.5 s
  EXPECT_NEAR(end.p_W[0], 6.57405, 1e-4);
  EXPECT_NEAR(end.p_W[1], 1.00410, 1e-4);
}

// The moments grow slowly, and damping brings the ends together.
TEST(Gallery, RollUpInMotion) {
  const Plan plan = read_gallery("roll_up");
  Motion motion(plan, kMotionAlone);
  for (long tick = 1; tick <= std::lround(18.0 / plan.period); ++tick)
    ASSERT_EQ(motion.advance().status, StepStatus::kOk);
  const PointState first = read_point(plan, motion.state(), 0), last = read_point(plan, motion.state(), 8);
  const double gap = (Vector3d(first.p_W.data()) - Vector3d(last.p_W.data())).norm();
  std::printf("gap after 18 s: %.1e m\n", gap);
  EXPECT_LT(gap, 1e-6);
}

TEST(Gallery, TumblingBox) {
  const auto fastest = [](const Plan& plan) {
    const RelativeEquilibrium found = RelativeEquilibria(plan, std::nullopt).find({0.0, 1.0, 0.0});
    EXPECT_EQ(found.error, "");
    double growth = 0.0;
    for (const SmallMotion& small : found.motions) growth = std::max(growth, small.rate.real());
    return growth;
  };
  // the antennas change the moments of inertia by 5e-4
  EXPECT_NEAR(fastest(read_gallery("tumbling_box")), std::sqrt(1.0 / 3.0), 5e-4);
  EXPECT_LT(fastest(read_with("tumbling_box", "wheels.wheel.momentum=1.5")), 1e-6);
  EXPECT_GT(fastest(read_with("tumbling_box", "wheels.wheel.momentum=0.9")), 0.1);
  const Plan plan = read_gallery("tumbling_box");
  Motion motion(plan, kMotionAlone);
  int num_turns = 0;
  double last = 1.0;
  for (long tick = 1; tick <= std::lround(60.0 / plan.period); ++tick) {
    ASSERT_EQ(motion.advance().status, StepStatus::kOk);
    const double w = motion.state().coupled.w_B[1];
    num_turns += (w > 0.0) != (last > 0.0) ? 1 : 0;
    last = w;
  }
  EXPECT_EQ(num_turns, 2);
}

}  // namespace
}  // namespace freeflex::testing
