// The set-up decides on a specification once, compiles it, and reports each fault once. The tests also check
// the lists of link kinds and rungs.
#include <gtest/gtest.h>

#include <algorithm>
#include <set>
#include <string>

#include "core/plan/compile.hpp"
#include "core/plan/file/plan_bytes.hpp"
#include "core/plan/rungs/rates.hpp"
#include "core/scene/link_kinds.hpp"
#include "tests/setup/make_scene.hpp"
#include "tests/support/structures.hpp"

namespace freeflex::testing {
namespace {

TEST(Spec, TheSameSpecGivesTheSamePlanToTheByte) {
  const Scene scene = truss_s5();
  const Structure structure = build(scene);
  for (const RungTraits& rung : kRungs) {
    const PlanSpec spec = full_spec(scene, structure, rung.rung);
    Faults faults;
    const auto once = freeflex::compile(scene, structure, spec, faults);
    const auto again = freeflex::compile(scene, structure, spec, faults);
    ASSERT_TRUE(once && again) << rung.name;
    EXPECT_EQ(plan_to_bytes(*once), plan_to_bytes(*again)) << rung.name;
    EXPECT_EQ(once->fidelity, rung.rung);
    EXPECT_TRUE(faults.empty()) << rung.name << ": " << faults.front().message;
  }
}

TEST(Spec, APlanHasTheModesTheRateAndTheFeaturesOfItsSpec) {
  const Scene scene = truss_s1();
  const Structure structure = build(scene);
  PlanSpec spec = full_spec(scene, structure, Fidelity::kSeparated);
  spec.modes = {2, 7, 11};
  spec.numbers_modes = true;
  spec.rate = 250.0;
  spec.has_damping = false;
  Faults faults;
  const auto plan = freeflex::compile(scene, structure, spec, faults);
  ASSERT_TRUE(plan);
  EXPECT_EQ(plan->num_elastic, 3);
  EXPECT_EQ(plan->mode_numbers, (std::vector<std::int32_t>{3, 8, 12}));
  for (std::size_t k = 0; k < 3; ++k) EXPECT_EQ(plan->omega[k], structure.omega[spec.modes[k]]);
  EXPECT_EQ(plan->period, 1.0 / 250.0);
  EXPECT_FALSE(plan->has_damping);
}

TEST(Spec, SettingTheRateLaterGivesThePlanOfThatRateWithItsShadow) {
  Scene scene = truss_s5();
  scene.verdict.horizon = 0.5;
  const Structure structure = build(scene);
  Faults faults;
  auto moved = make_plan(scene, structure, faults);
  scene.rate = 400.0;
  const auto made = make_plan(scene, structure, faults);
  ASSERT_TRUE(moved && made);
  set_rate(*moved, 400.0);
  EXPECT_EQ(plan_to_bytes(*moved), plan_to_bytes(*made));
}

// This scene is compiled four times, namely for the full and the reduced plan, and for shadows.
TEST(MakePlan, ReportsEachFaultOnceForAnyNumberOfPlans) {
  Scene scene = truss_s1();
  scene.verdict.horizon = 0.5;
  scene.leave_out.tolerance = 1e-3;
  scene.initial.angular_velocity = {0.0, 0.0, 50.0};
  scene.initial.points.push_back({0, Eigen::Vector3d(1e-6, 0.0, 0.0), Eigen::Vector3d::Zero()});
  scene.loads.front().history = PulseHistory{0.0, 0.0123456};
  Faults faults;
  ASSERT_TRUE(make_plan(scene, build(scene), faults));
  const auto count = [&](const std::string& words) {
    return std::count_if(faults.begin(), faults.end(),
                         [&](const Fault& fault) { return fault.message.find(words) != std::string::npos; });
  };
  EXPECT_EQ(count("is not slow compared with the lowest frequency"), 1);
  EXPECT_EQ(count("of rigid motion (mass-weighted)"), 1);
  EXPECT_EQ(count("the pulse ends at"), 1);
  std::set<std::string> messages;
  for (const Fault& fault : faults) messages.insert(fault.message);
  EXPECT_EQ(messages.size(), faults.size());
}

TEST(LinkKinds, EachKindHasAUniqueNameAndARangeOfPoints) {
  std::set<std::string> names;
  const auto look = [&](const auto& kind) {
    const LinkTraits traits = traits_of(kind);
    EXPECT_TRUE(names.insert(traits.name).second) << traits.name;
    EXPECT_GE(traits.least, 2U) << traits.name;
    EXPECT_LE(traits.least, traits.most) << traits.name;
    // a kind of link with an axis has exactly two points
    if (traits.is_axial) {
      EXPECT_EQ(traits.most, 2U) << traits.name;
    }
  };
  const auto look_at_all = [&]<std::size_t... I>(std::index_sequence<I...>) {
    (look(std::variant_alternative_t<I, LinkKind>{}), ...);
  };
  look_at_all(std::make_index_sequence<std::variant_size_v<LinkKind>>{});
  EXPECT_EQ(names.size(), std::variant_size_v<LinkKind>);
}

TEST(LinkKinds, OnlySpringsBarsAndDashpotsResistAlongALine) {
  Scene scene;
  add_point(scene, 1.0, {0.0, 0.0, 0.0});
  add_point(scene, 1.0, {0.0, 2.0, 0.0});
  const auto expect = [&](const auto& kind, double stiffness, double damping) {
    const Axial axial = axial_of(scene, scene.links[static_cast<std::size_t>(add_link(scene, 0, 1, kind))]);
    EXPECT_EQ(axial.stiffness, stiffness) << traits_of(kind).name;
    EXPECT_EQ(axial.damping, damping) << traits_of(kind).name;
    EXPECT_EQ(traits_of(kind).is_axial, stiffness + damping > 0.0) << traits_of(kind).name;
  };
  expect(Spring{5.0}, 5.0, 0.0);
  expect(Bar{6.0}, 3.0, 0.0);  // EA / L
  expect(Dashpot{7.0}, 0.0, 7.0);
  expect(Beam{1.0, 1.0, 1.0, 1.0}, 0.0, 0.0);
  expect(BendingSpring{1.0}, 0.0, 0.0);
  expect(TorsionSpring{1.0}, 0.0, 0.0);
  expect(Plate{1.0, 0.3, 1.0}, 0.0, 0.0);
  expect(Rigid{}, 0.0, 0.0);
  expect(MatrixLink{}, 0.0, 0.0);
}

TEST(Rungs, EachRungIncludesTheTermsOfTheRungBelow) {
  for (std::size_t k = 1; k < kRungs.size(); ++k) {
    const RungTraits &less = kRungs[k - 1], &more = kRungs[k];
    EXPECT_GE(more.has_modes, less.has_modes) << more.name;
    // a coupled rung has every term of the spin instead of only the centrifugal load
    EXPECT_GE(more.takes_spin_load || more.couples, less.takes_spin_load) << more.name;
    EXPECT_GE(more.couples, less.couples) << more.name;
    EXPECT_GE(more.has_true_geometry, less.has_true_geometry) << more.name;
    EXPECT_GE(more.divides_tick, less.divides_tick) << more.name;
  }
}

}  // namespace
}  // namespace freeflex::testing
