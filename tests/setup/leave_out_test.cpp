// The omission of a feature changes the motion. These tests compare this change with the error that the plan
// states for the omission. For each feature, random scenes are run with two plans: one omits the feature, and
// the other keeps it (setting leave_out.keep).
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "tests/support/omissions.hpp"
#include "tests/support/structures.hpp"

namespace freeflex {
namespace {

using testing::Change;
using testing::change_by;
using testing::feature_of;
using testing::reduced_plan_of;
using testing::TimedCommand;

constexpr std::int64_t kTicks = 2000;  // 2 s at 1 kHz

Eigen::Vector3d random_vector(std::mt19937_64& engine) {
  std::uniform_real_distribution<double> uniform(-1.0, 1.0);
  const double x = uniform(engine), y = uniform(engine), z = uniform(engine);
  return {x, y, z};
}

double log_uniform(std::mt19937_64& engine, double low, double high) {
  return std::exp(std::uniform_real_distribution<double>(std::log(low), std::log(high))(engine));
}

Load pulse_on(int point, const Eigen::Vector3d& force, double duration, Axes axes) {
  Load load;
  load.name = "pulse";
  load.axes = axes;
  load.forces = {{point, force}};
  load.history = PulseHistory{0.05, duration};
  return load;
}

/// Returns a structure of 12 to 78 modes with one load. Commands may push no point.
Scene loaded_scene(std::uint64_t seed) {
  std::mt19937_64 engine(seed);
  Scene scene = seed % 2 == 0 ? testing::random_structure(seed, 6 + static_cast<int>(seed % 9))
                              : testing::square_truss(3 + static_cast<int>(seed % 5));
  scene.pushable.clear();
  const int point = static_cast<int>(engine() % scene.points.size());
  const double duration = log_uniform(engine, 0.002, 0.5);
  scene.loads = {pulse_on(point, 10.0 * random_vector(engine), duration,
                          engine() % 2 == 0 ? Axes::kWorld : Axes::kBody)};
  if (seed % 3 == 0) scene.initial.angular_velocity = 0.3 * random_vector(engine);
  if (seed % 4 == 0) scene.loads.front().history = SineHistory{log_uniform(engine, 1.0, 20.0), 0.0};
  if (seed % 5 == 0) scene.damping.modal_ratio = 0.002;
  scene.leave_out.tolerance = log_uniform(engine, 1e-3, 0.2);
  scene.leave_out.horizon = 2.0;
  return scene;
}

/// Returns the fraction of `values` that are at most `bound`.
double share_within(const std::vector<double>& values, double bound) {
  const auto count =
      std::count_if(values.begin(), values.end(), [&](double value) { return value <= bound; });
  return static_cast<double>(count) / static_cast<double>(values.size());
}

void print(const char* what, std::vector<double> ratios) {
  std::sort(ratios.begin(), ratios.end());
  std::printf(
      "%s: %zu scenes, allowance over change: least %.3g, median %.3g, largest %.3g; %.0f %% within 10\n",
      what, ratios.size(), ratios.front(), ratios[ratios.size() / 2], ratios.back(),
      100.0 * share_within(ratios, 10.0));
}

TEST(LeaveOut, TheErrorOfOmittingSmallModesIsMostlyATenthToAllOfTheStatedError) {
  std::vector<double> ratios, link_ratios;
  for (std::uint64_t seed = 1; seed <= 60; ++seed) {
    const Scene scene = loaded_scene(seed);
    const PlanFeature feature = feature_of(reduced_plan_of(scene), Feature::kSmallModes);
    if (!feature.is_left_out) continue;
    const Change change = change_by(scene, Feature::kSmallModes, kTicks);
    EXPECT_LE(change.displacement, feature.error) << "seed " << seed;
    EXPECT_LE(change.displacement, scene.leave_out.tolerance * change.largest * 1.02)
        << "seed " << seed << ": 500 samples may underestimate the largest displacement by two per cent";
    EXPECT_LE(change.link_force, feature.link_error) << "seed " << seed;
    ratios.push_back(feature.error / change.displacement);
    link_ratios.push_back(feature.link_error / change.link_force);
  }
  ASSERT_GE(ratios.size(), 40U);
  print("small modes, displacements", ratios);
  print("small modes, link forces", link_ratios);
  EXPECT_GE(share_within(ratios, 10.0), 0.8);
  EXPECT_GE(share_within(link_ratios, 10.0), 0.8);
}

TEST(LeaveOut, TheStatedErrorOfOmittingSmallModesHoldsUnderCommands) {
  std::vector<double> ratios, link_ratios;
  for (std::uint64_t seed = 1; seed <= 40; ++seed) {
    std::mt19937_64 engine(seed);
    Scene scene = seed % 2 == 0 ? testing::random_structure(seed, 8) : testing::square_truss(4);
    const int point = static_cast<int>(engine() % scene.points.size());
    scene.pushable = {point};
    scene.leave_out.tolerance = log_uniform(engine, 0.01, 0.3);
    const PlanFeature feature = feature_of(reduced_plan_of(scene), Feature::kSmallModes);
    if (!feature.is_left_out) continue;
    // the command is switched on and off, and both changes excite the omitted modes
    ForceCommand command =
        testing::make_command(0, 1, Axes::kBody, 1 + static_cast<std::int64_t>(engine() % 300));
    const Eigen::Vector3d force = 5.0 * random_vector(engine);
    testing::add_force(command, point, force);
    const Change change = change_by(scene, Feature::kSmallModes, 600, {{10, command}});
    const double allowed = 2.0 * feature.error_per_force * force.norm();
    EXPECT_LE(change.displacement, allowed) << "seed " << seed;
    const double link_allowed = 2.0 * feature.link_error_per_force * force.norm();
    EXPECT_LE(change.link_force, link_allowed) << "seed " << seed;
    ratios.push_back(allowed / change.displacement);
    link_ratios.push_back(link_allowed / change.link_force);
  }
  ASSERT_GE(ratios.size(), 25U);
  print("small modes under commands, displacements", ratios);
  print("small modes under commands, link forces", link_ratios);
  EXPECT_GE(share_within(ratios, 10.0), 0.8);
  EXPECT_GE(share_within(link_ratios, 10.0), 0.8);
}

TEST(LeaveOut, LinkForcesUnderASteadyLoadAreExactWithoutTheSmallModes) {
  Scene scene = testing::square_truss(5);
  scene.pushable.clear();
  scene.loads = {pulse_on(18, {3.0, 4.0, 5.0}, 1e3, Axes::kBody)};
  scene.loads.front().history = ConstantHistory{};
  scene.damping.modal_ratio = 0.5;
  scene.leave_out.tolerance = 0.1;
  scene.leave_out.horizon = 0.5;
  const Plan plan = reduced_plan_of(scene);
  ASSERT_GE(feature_of(plan, Feature::kSmallModes).count, 10);
  testing::Simulation without(plan);
  scene.leave_out.keeps.fill(true);
  testing::Simulation with(reduced_plan_of(scene));
  // the slowest decay rate is 30 1/s, so e^-60 remains after 2 s
  without.run(2000);
  with.run(2000);
  const Eigen::VectorXd exact = with.link_forces();
  // a load in body axes is constant, so only the rounding errors of sums over 54 modes remain
  EXPECT_LE((without.link_forces() - exact).norm(), 1e-12 * exact.norm());
}

/// Returns a random frame of beams in the xy plane.
Scene planar_scene(std::uint64_t seed) {
  std::mt19937_64 engine(seed);
  std::uniform_real_distribution<double> coordinate(-2.0, 2.0);
  Scene scene;
  scene.name = "planar";
  const int num_points = 5 + static_cast<int>(seed % 8);
  for (int i = 0; i < num_points; ++i) {
    PointMass point;
    point.name = std::to_string(i);
    point.mass = log_uniform(engine, 0.3, 3.0);
    point.position = {coordinate(engine), coordinate(engine), 0.0};
    scene.points.push_back(point);
    if (i == 0) continue;
    Link link;
    link.name = std::to_string(i);
    link.points = {i - 1, i};
    link.kind = Beam{.EA = 1e6, .GJ = 1e3, .EI_y = 2e3, .EI_z = 1e3, .y_axis = Eigen::Vector3d::UnitZ()};
    scene.links.push_back(link);
  }
  scene.loads = {pulse_on(num_points - 1, {3.0, -4.0, 0.0}, 0.1, seed % 2 == 0 ? Axes::kWorld : Axes::kBody)};
  scene.initial.angular_velocity = {0.0, 0.0, seed % 3 == 0 ? 0.5 : 0.0};
  testing::publish_everything(scene);
  scene.leave_out.on_need = OnNeed::kRefuse;
  return scene;
}

/// Returns the largest change, relative to the largest displacement, over all seeds whose plan omits the
/// feature.
template <typename MakeScene>
double exact_change(const char* what, Feature feature, int least, const MakeScene& make_scene,
                    const std::vector<TimedCommand>& commands = {}) {
  double largest = 0.0;
  int num_left_out = 0;
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    const Scene scene = make_scene(seed);
    if (!feature_of(reduced_plan_of(scene), feature).is_left_out) continue;
    ++num_left_out;
    const Change change = change_by(scene, feature, kTicks, commands);
    largest = std::max({largest, change.displacement / change.largest, change.position / change.largest});
    if (change.largest_force > 0.0) largest = std::max(largest, change.link_force / change.largest_force);
  }
  std::printf("%s: %d scenes, largest change %.1e of the largest displacement or force\n", what, num_left_out,
              largest);
  EXPECT_GE(num_left_out, least);
  return largest;
}

// [-] ten times the drift of phases due to rounding errors of the frequencies, eps omega t = 2e-16 *
// 1e4 rad/s * 2 s. Frequencies have different rounding errors if modes of equal frequency were combined
// differently, or if the plan has fewer such modes.
constexpr double kRounding = 5e-11;

TEST(LeaveOut, OmittingOutOfPlaneModesChangesOnlyRoundingErrors) {
  EXPECT_LE(exact_change("out of plane", Feature::kOutOfPlane, 20, planar_scene), kRounding);
}

TEST(LeaveOut, OmittingUnexcitableModesChangesOnlyRoundingErrors) {
  // a load at the middle of a symmetric beam does not excite its antisymmetric modes, which are half of the
  // modes. Of each pair of bending modes of equal frequency the load excites only one, because the directions
  // of the two modes can be chosen along and across the load
  const auto make = [](std::uint64_t seed) {
    Scene scene;
    scene.name = "symmetric";
    const int num_points = 5 + 2 * static_cast<int>(seed % 5);
    for (int i = 0; i < num_points; ++i) {
      PointMass point;
      point.name = std::to_string(i);
      point.mass = 1.0 + 0.1 * static_cast<double>(seed) * std::abs(i - num_points / 2);
      point.position = {static_cast<double>(i - num_points / 2), 0.0, 0.0};
      scene.points.push_back(point);
      if (i == 0) continue;
      Link link;
      link.name = std::to_string(i);
      link.points = {i - 1, i};
      link.kind = Beam{.EA = 1e6, .GJ = 1e3, .EI_y = 1e3, .EI_z = 1e3};
      scene.links.push_back(link);
    }
    scene.loads = {pulse_on(num_points / 2, {0.0, 3.0, 4.0}, 0.1, Axes::kBody)};
    testing::publish_everything(scene);
    scene.pushable.clear();
    return scene;
  };
  EXPECT_GE(reduced_plan_of(make(1)).features[static_cast<std::size_t>(Feature::kUnreachedModes)].count +
                reduced_plan_of(make(1)).features[static_cast<std::size_t>(Feature::kOutOfPlane)].count,
            10);
  EXPECT_LE(exact_change("unreached", Feature::kUnreachedModes, 20, make), kRounding);
}

TEST(LeaveOut, WithoutMomentsOmittingRotationChangesOnlyRoundingErrors) {
  const auto make = [](std::uint64_t seed) {
    Scene scene = testing::random_structure(seed, 8);
    scene.pushable.clear();
    // opposite forces on two points along their line have no moment
    const Eigen::Vector3d along = (scene.points[1].position - scene.points[0].position).normalized();
    Load load = pulse_on(0, 7.0 * along, 0.1, seed % 2 == 0 ? Axes::kWorld : Axes::kBody);
    load.forces.push_back({1, -7.0 * along});
    scene.loads = {load};
    return scene;
  };
  EXPECT_LE(exact_change("rotation", Feature::kRotation, 20, make), kRounding);
}

TEST(LeaveOut, OmittingAbsentDampingAndGravityChangesNoBit) {
  for (const Feature feature : {Feature::kDamping, Feature::kGravity}) {
    const auto make = [](std::uint64_t seed) {
      Scene scene = loaded_scene(seed);
      scene.damping.modal_ratio = 0.0;
      scene.leave_out.tolerance = 0.0;
      return scene;
    };
    EXPECT_EQ(exact_change(name_of(feature), feature, 20, make), 0.0);
  }
}

TEST(LeaveOut, OmittingModeShapeRowsOfUnusedPointsChangesNoBit) {
  const auto make = [](std::uint64_t seed) {
    Scene scene = loaded_scene(seed);
    scene.leave_out.tolerance = 0.0;
    scene.publication.points = {0, 1};
    return scene;
  };
  EXPECT_EQ(exact_change("rows of points", Feature::kPointRows, 20, make), 0.0);
}

TEST(LeaveOut, FeaturesForCommandsAreKeptUnlessTheSceneAllowsOmission) {
  Scene scene = planar_scene(1);
  scene.loads.clear();
  scene.leave_out.on_need = OnNeed::kKeep;
  const Plan kept = reduced_plan_of(scene);
  EXPECT_FALSE(feature_of(kept, Feature::kOutOfPlane).is_left_out);
  EXPECT_FALSE(feature_of(kept, Feature::kRotation).is_left_out);
  EXPECT_EQ(kept.num_elastic, 3 * static_cast<int>(scene.points.size()) - 6);
  scene.leave_out.on_need = OnNeed::kRefuse;
  const Plan reduced = reduced_plan_of(scene);
  EXPECT_TRUE(feature_of(reduced, Feature::kOutOfPlane).is_left_out);
  EXPECT_TRUE(feature_of(reduced, Feature::kRotation).is_left_out);
  // a planar structure of N points has N - 3 elastic freedoms out of its plane
  EXPECT_EQ(feature_of(reduced, Feature::kOutOfPlane).count, static_cast<int>(scene.points.size()) - 3);
}

TEST(LeaveOut, SmallModesAreKeptIfCommandsMayRotateTheBodyUnderALoad) {
  Scene scene = loaded_scene(1);
  scene.loads.front().axes = Axes::kWorld;
  scene.leave_out.tolerance = 0.2;
  EXPECT_TRUE(feature_of(reduced_plan_of(scene), Feature::kSmallModes).is_left_out);
  scene.pushable = {0};
  const PlanFeature feature = feature_of(reduced_plan_of(scene), Feature::kSmallModes);
  EXPECT_FALSE(feature.is_left_out);
  EXPECT_NE(feature.why.find("commands may turn the body"), std::string::npos) << feature.why;
}

TEST(LeaveOut, TheCoupledRungOmitsOnlySmallModes) {
  Scene scene = loaded_scene(2);
  scene.fidelity = Fidelity::kCoupled;
  const Plan plan = reduced_plan_of(scene);
  EXPECT_LT(plan.num_elastic, testing::plan_of(scene).num_elastic);
  for (const PlanFeature& feature : plan.features)
    EXPECT_EQ(feature.is_left_out, feature.feature == Feature::kSmallModes);
}

TEST(LeaveOut, TheRungExactBarsKeepsEveryMode) {
  Scene scene = loaded_scene(2);
  scene.fidelity = Fidelity::kCorotational;
  const Plan plan = reduced_plan_of(scene);
  EXPECT_EQ(plan.num_elastic, testing::plan_of(scene).num_elastic);
  for (const PlanFeature& feature : plan.features) EXPECT_FALSE(feature.is_left_out);
}

TEST(LeaveOut, ModeNumbersOfAReducedPlanAreThoseOfTheFullPlan) {
  Scene scene = planar_scene(2);
  scene.damping.mode_ratios = {{1, 0.1}, {5, 0.2}, {9, 0.05}};
  const Plan full = testing::plan_of(scene);
  const Plan reduced = reduced_plan_of(scene);
  ASSERT_LT(reduced.num_elastic, full.num_elastic);
  ASSERT_EQ(reduced.mode_numbers.size(), static_cast<std::size_t>(reduced.num_elastic));
  for (std::size_t l = 0; l < reduced.mode_numbers.size(); ++l) {
    const auto number = static_cast<std::size_t>(reduced.mode_numbers[l]) - 1;
    EXPECT_DOUBLE_EQ(reduced.omega[l], full.omega[number]);
    EXPECT_DOUBLE_EQ(reduced.decay[l], full.decay[number]);
  }
}

}  // namespace
}  // namespace freeflex
