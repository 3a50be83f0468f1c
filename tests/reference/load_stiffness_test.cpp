// The geometric stiffness of reference loads on the rung `coupled` (THEORY 8.49 to 8.52),
// with few modes of a beam and with all of a structure: against the continuous beam, against the rung
// `corotational`, and against invariance under rigid motions.
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <span>

#include "core/motion.hpp"
#include "core/plan/check_motion.hpp"
#include "core/plan/file/plan_bytes.hpp"
#include "core/plan/make_plan.hpp"
#include "core/plan/rungs/shadow.hpp"
#include "core/steady/relative_equilibrium.hpp"
#include "core/step/readout.hpp"
#include "core/structure/links/link_factor.hpp"
#include "core/structure/structure.hpp"
#include "tests/reference/structures.hpp"
#include "tests/reference/true_geometry.hpp"
#include "tests/support/simulation.hpp"
#include "tools/verification/reference/elastic_error.hpp"

namespace freeflex::testing {
namespace {

using Eigen::MatrixXd;
using Eigen::Vector3d;

constexpr double kFirst = 22.3733;  // [rad/s] lowest frequency of beam_of(), with EI / (m L^4) = 1

Plan plan_on(Scene scene, Fidelity rung, int num_modes = 0) {
  scene.fidelity = rung;
  scene.modes.count = num_modes;
  Faults faults;
  const auto structure = build_structure(scene, faults);
  EXPECT_TRUE(structure.has_value());
  auto plan = make_full_plan(scene, *structure, rung, faults);
  EXPECT_TRUE(plan.has_value());
  return *plan;
}

// Returns the frequencies [rad/s] of the small motions about a steady motion, ascending.
std::vector<double> frequencies(const Plan& plan, const Vector3d& spin) {
  RelativeEquilibria equilibria(plan, plan.histories.empty() ? std::nullopt : std::optional(0.0));
  const RelativeEquilibrium found = equilibria.find(spin);
  EXPECT_EQ(found.error, "");
  std::vector<double> all;
  for (const SmallMotion& small : found.motions) all.push_back(small.rate.imag());
  return all;
}

// Free beams of 1000 elements on the sparse path, with 2, 6 and 10 modes in each plane.
TEST(LoadStiffness, FewModesOfASpinningBeamHaveTheFrequenciesOfTheContinuousBeam) {
  constexpr double expected[][3] = {
      {0.1, 1.015134, 2.768118}, {0.5, 1.327300, 3.032316}, {1.0, 2.010022, 3.735482}};
  for (const int num_modes : {4, 12, 20}) {
    const Plan plan = plan_on(beam_of(1000, 1e8), Fidelity::kCoupled, num_modes);
    for (const auto& [share, first, second] : expected) {
      const double spin = share * kFirst;
      const std::vector<double> found = frequencies(plan, {0.0, 0.0, spin});
      const auto off = [&](double omega) {
        double nearest = HUGE_VAL;
        for (const double each : found) nearest = std::min(nearest, std::abs(each / omega - 1.0));
        return nearest;
      };
      const double out = off(first * kFirst), in = off(kFirst * std::sqrt(first * first - share * share)),
                   out_second = off(second * kFirst);
      std::printf("%2d modes, Omega %.1f: out of the plane %.1e, in it %.1e; second %.1e\n", num_modes, share,
                  out, in, out_second);
      const double allowed = num_modes == 4 ? 2e-3 : 5e-5;
      EXPECT_LT(out, allowed);
      EXPECT_LT(in, allowed);
    }
  }
}

TEST(LoadStiffness, FewModesOfARocketHaveTheFrequenciesOfTheContinuousBeam) {
  constexpr double expected[][3] = {{20.0, 19.5294, 57.7753}, {100.0, 13.9483, 34.0619}};
  for (const int num_modes : {16, 40, 80}) {
    for (const auto& [thrust, first, second] : expected) {
      Scene scene = beam_of(1000, 1e8);
      push(scene, 0, Axes::kLocal, {thrust, 0.0, 0.0});
      const std::vector<double> found =
          frequencies(plan_on(scene, Fidelity::kCoupled, num_modes), Vector3d::Zero());
      const double first_off = std::abs(found[0] / first - 1.0),
                   second_off = std::abs(found[2] / second - 1.0);
      std::printf("%2d modes, thrust %3.0f: %.1e, %.1e\n", num_modes, thrust, first_off, second_off);
      EXPECT_LT(first_off, num_modes == 16 ? 1e-3 : 3e-4);
      EXPECT_LT(second_off, num_modes == 16 ? 2e-3 : 3e-4);
    }
  }
  for (const double thrust : {109.0, 110.5}) {
    Scene scene = beam_of(1000, 1e8);
    push(scene, 0, Axes::kLocal, {thrust, 0.0, 0.0});
    const Plan plan = plan_on(scene, Fidelity::kCoupled, 40);
    double growth = 0.0;
    for (const SmallMotion& small : RelativeEquilibria(plan, 0.0).find(Vector3d::Zero()).motions)
      growth = std::max(growth, small.rate.real());
    std::printf("thrust %.1f: grows by %.3f\n", thrust, growth);
    EXPECT_EQ(growth > 1e-2, thrust == 110.5);
  }
}

// Loads in body axes and in world axes press a column together as they do at true geometry.
TEST(LoadStiffness, DeadEndLoadsSoftenAColumn) {
  for (const Axes axes : {Axes::kBody, Axes::kWorld})
    for (const int num_modes : {12, 24}) {
      Scene scene = beam_of(20, 1e6);
      push(scene, 0, axes, {8.0, 0.0, 0.0});
      push(scene, 20, axes, {-8.0, 0.0, 0.0});
      const Plan coupled = plan_on(scene, Fidelity::kCoupled, num_modes),
                 whole = plan_on(scene, Fidelity::kCorotational);
      const std::vector<double> few = frequencies(coupled, Vector3d::Zero()),
                                all = frequencies(whole, Vector3d::Zero());
      // in world axes the whole column tips too, at less than 5 rad/s
      const double lowest = *std::ranges::lower_bound(all, 5.0), found = *std::ranges::lower_bound(few, 5.0);
      std::printf("%s axes: %.6f rad/s with %d modes, %.6f at true geometry, %.4f without load\n",
                  axes == Axes::kBody ? "body" : "world", found, num_modes, lowest, coupled.omega[0]);
      EXPECT_NEAR(found, lowest, (num_modes == 12 ? 3e-3 : 1e-3) * lowest);
      EXPECT_LT(lowest, 0.7 * coupled.omega[0]);
    }
}

// Returns the largest distance of the elastic displacements of two motions, over the largest elastic
// displacements of the second one (THEORY 10.9). The commands act from the first tick on.
double distance_of(const Scene& scene, const Plan& plan, std::span<const ForceCommand> commands,
                   const Plan& other_plan, std::span<const ForceCommand> other_commands, double end) {
  Motion motion(plan, kMotionAlone), other(other_plan, kMotionAlone);
  const auto count = static_cast<Eigen::Index>(scene.points.size());
  Eigen::VectorXd mass(count);
  Eigen::Matrix3Xd rest(3, count), p_W(3, count);
  for (Eigen::Index i = 0; i < count; ++i) {
    mass[i] = scene.points[static_cast<std::size_t>(i)].mass;
    rest.col(i) = scene.points[static_cast<std::size_t>(i)].position;
  }
  const auto displacements = [&](const Plan& of, const Motion& moving) {
    for (Eigen::Index i = 0; i < count; ++i)
      p_W.col(i) = Eigen::Map<const Vector3d>(read_point(of, moving.state(), static_cast<int>(i)).p_W.data());
    return elastic_displacements(mass, rest, p_W);
  };
  double off = 0.0, most = 0.0;
  for (long tick = 1; tick <= std::lround(end * scene.rate); ++tick) {
    const bool is_first = tick == 1;
    EXPECT_EQ(motion.advance(is_first ? commands : std::span<const ForceCommand>{}).status, StepStatus::kOk);
    EXPECT_EQ(other.advance(is_first ? other_commands : std::span<const ForceCommand>{}).status,
              StepStatus::kOk);
    const Eigen::Matrix3Xd V = displacements(other_plan, other);
    off = std::max(off, (displacements(plan, motion) - V).norm());
    most = std::max(most, V.norm());
  }
  return off / most;
}

// Returns the distance of the motion on the rung `coupled` from that on the rung `corotational`.
double off_by(const Scene& scene, double end) {
  return distance_of(scene, plan_on(scene, Fidelity::kCoupled), {}, plan_on(scene, Fidelity::kCorotational),
                     {}, end);
}

// A load that bends a structure and presses it: if the stiffness by the load contained the bending, it would
// act on the same bending again. With soft modes in the static response the arch is
// off by 22 % and the boom by 3.7 %.
TEST(LoadStiffness, ALoadThatBendsIsNotCountedTwice) {
  Scene arch, boom;
  for (int i = 0; i < 8; ++i) {
    const double x = 0.5 * i;
    add_point(arch, i == 0 ? 8.4 : i == 7 ? 2.5 : 0.84, {x, x * x / 12.25, 0.0});
    if (i > 0) add_link(arch, i - 1, i, Beam{7.27e4, 90.0, 134.7, 134.7, {0.0, 0.0, 1.0}});
  }
  for (int i = 0; i < 11; ++i) {
    add_point(boom, i == 0 || i == 10 ? 0.56 : 1.12, {0.4 * i, 0.0, 0.0});
    if (i > 0) add_link(boom, i - 1, i, Beam{6.5e5, 27.5, 65.9, 65.9, {0.0, 0.0, 1.0}});
  }
  push(arch, 0, Axes::kBody, {5.568, 0.0, 0.0});
  arch.loads[0].forces.push_back({7, {-5.568, 0.0, 0.0}});
  arch.loads[0].history = SineHistory{0.144, 0.0};
  push(boom, 0, Axes::kBody, {6.0, 0.05, 0.0});
  boom.loads[0].forces.push_back({10, {-6.0, -0.05, 0.0}});
  for (Scene* scene : {&arch, &boom}) scene->rate = 1000.0, scene->damping.modal_ratio = 0.02;
  const double of_arch = off_by(arch, 1.68), of_boom = off_by(boom, 1.0);
  std::printf("arch off by %.1e, boom by %.1e\n", of_arch, of_boom);
  EXPECT_LT(of_arch, 0.04);  // 1.4e-2
  EXPECT_LT(of_boom, 0.01);  // 9e-4
}

// Returns a straight boom of 11 points with a small bending load, and two forces that press it together.
Scene pressed_boom(Axes axes, bool is_built_in) {
  Scene scene;
  for (int i = 0; i < 11; ++i) {
    add_point(scene, i == 0 || i == 10 ? 0.56 : 1.12, {0.4 * i, 0.0, 0.0});
    if (i > 0) add_link(scene, i - 1, i, Beam{6.5e5, 27.5, 65.9, 65.9, {0.0, 0.0, 1.0}});
  }
  push(scene, 5, Axes::kBody, {0.0, 0.01, 0.02});
  if (is_built_in) {
    push(scene, 0, axes, {12.0, 0.0, 0.0});
    scene.loads.back().forces.push_back({10, {-12.0, 0.0, 0.0}});
  }
  scene.rate = 1000.0, scene.damping.modal_ratio = 0.02;
  scene.pushable = {0, 10};
  return scene;
}

ForceCommand press(Axes axes) {
  ForceCommand command = make_command(0, 1, axes);
  add_force(command, 0, {12.0, 0.0, 0.0});
  add_force(command, 10, {-12.0, 0.0, 0.0});
  return command;
}

// A command has the stiffness of the same built-in load, and the motion of the rung with true geometry. The
// stiffness is what makes the difference.
TEST(LoadStiffness, ACommandHasTheStiffnessOfTheSameBuiltInLoad) {
  for (const Axes axes : {Axes::kBody, Axes::kWorld}) {
    const Scene scene = pressed_boom(axes, false), same = pressed_boom(axes, true);
    const ForceCommand command = press(axes);
    const std::span<const ForceCommand> commands(&command, 1);
    const Plan plan = plan_on(scene, Fidelity::kCoupled);
    const double from_built_in =
                     distance_of(scene, plan, commands, plan_on(same, Fidelity::kCoupled), {}, 1.0),
                 from_truth = distance_of(scene, plan, commands, plan_on(scene, Fidelity::kCorotational),
                                          commands, 1.0),
                 of_built_in = off_by(same, 1.0),
                 without = distance_of(scene, without_load_stiffness(plan), commands,
                                       plan_on(scene, Fidelity::kCorotational), commands, 1.0);
    std::printf("%s axes: from the built-in load %.1e; from truth %.1e, the built-in load %.1e, none %.1e\n",
                axes == Axes::kBody ? "body" : "world", from_built_in, from_truth, of_built_in, without);
    EXPECT_LT(from_built_in, 1e-11);
    EXPECT_LT(from_truth, 1.01 * of_built_in);
    EXPECT_LT(from_truth, 1e-3);  // 2.1e-4
    EXPECT_GT(without, 0.1);
  }
}

// The shadow of a plan with the stiffness by commands is no nearer than that of the built-in load.
TEST(LoadStiffness, TheVerdictKnowsTheStiffnessByCommands) {
  const Scene scene = pressed_boom(Axes::kBody, false), same = pressed_boom(Axes::kBody, true);
  const ForceCommand command = press(Axes::kBody);
  const auto worst = [](const Scene& given, Plan plan, std::span<const ForceCommand> commands) {
    const Structure structure = build(given);
    compile_verdict(given, structure, structure, plan);
    Motion motion(plan);
    for (int tick = 0; tick < 1000; ++tick)
      motion.advance(tick == 0 ? commands : std::span<const ForceCommand>());
    return motion.worst().level;
  };
  const Plan plan = plan_on(scene, Fidelity::kCoupled);
  EXPECT_EQ(worst(scene, plan, {&command, 1}), Verdict::Level::kGood);
  EXPECT_EQ(worst(same, plan_on(same, Fidelity::kCoupled), {}), Verdict::Level::kGood);
  EXPECT_EQ(worst(scene, without_load_stiffness(plan), {&command, 1}), Verdict::Level::kOutside);
}

// Returns a boom whose ends are bodies with inertia, with a small bending load. It buckles under torques of
// 2 pi EI / L = 104 N m if its ends are supported.
Scene boom_of_bodies() {
  Scene scene;
  for (int i = 0; i < 11; ++i) {
    add_point(scene, 1.12, {0.4 * i, 0.0, 0.0});
    if (i > 0) add_link(scene, i - 1, i, Beam{6.5e5, 2e3, 65.9, 65.9, {0.0, 0.0, 1.0}});
  }
  for (const int end : {0, 10}) scene.points[index(end)].inertia = 0.2 * Eigen::Matrix3d::Identity();
  push(scene, 5, Axes::kBody, {0.0, 0.01, 0.02});
  scene.rate = 1000.0, scene.damping.modal_ratio = 0.02;
  scene.pushable = {0, 10};
  return scene;
}

// Expects that a commanded motion on `coupled` is nearer to that on `corotational` than `with`, and without
// the stiffness further than `without`.
void expect_distances(const char* what, const Scene& scene, const ForceCommand& command, double with,
                      double without) {
  const std::span<const ForceCommand> commands(&command, 1);
  const Plan plan = plan_on(scene, Fidelity::kCoupled), truth = plan_on(scene, Fidelity::kCorotational);
  const double found = distance_of(scene, plan, commands, truth, commands, 0.3),
               bare = distance_of(scene, without_load_stiffness(plan), commands, truth, commands, 0.3);
  std::printf("%s: off by %.1e, without the stiffness by %.1e\n", what, found, bare);
  EXPECT_LT(found, with);
  EXPECT_GT(bare, without);
}

TEST(LoadStiffness, TorquesAndMotorsHaveAStiffness) {
  Scene scene = boom_of_bodies();
  ForceCommand twist = make_command(0, 1, Axes::kBody);
  twist.num_torques = 2;
  twist.torques[0] = {0, 0, {30.0, 0.0, 0.0}};
  twist.torques[1] = {10, 0, {-30.0, 0.0, 0.0}};
  expect_distances("torques on bodies", scene, twist, 1e-2, 0.05);  // 4.8e-3, 0.11
  scene.wheels.push_back({"first", 0, Vector3d::UnitX(), 0.0, {}});
  scene.wheels.push_back({"last", 10, Vector3d::UnitX(), 0.0, {}});
  ForceCommand motors = make_command(0, 1, Axes::kBody);
  motors.num_wheels = 2;
  motors.wheels[0] = {0, 0, 30.0};
  motors.wheels[1] = {1, 0, -30.0};
  expect_distances("motors", scene, motors, 1e-2, 0.05);  // 5.2e-3, 0.10
}

TEST(LoadStiffness, WrenchesOnGroupsHaveAStiffness) {
  Scene scene = pressed_boom(Axes::kWorld, false);
  scene.groups = {{"first", {0, 1, 2}, {}}, {"last", {8, 9, 10}, {}}};
  ForceCommand press_groups = make_command(0, 1, Axes::kWorld);
  press_groups.num_wrenches = 2;
  press_groups.wrenches[0] = {0, 0, {12.0, 0.0, 0.0}, {0.0, 0.0, 0.0}};
  press_groups.wrenches[1] = {1, 0, {-12.0, 0.0, 0.0}, {0.0, 0.0, 0.0}};
  expect_distances("forces on groups", scene, press_groups, 1e-3, 0.03);  // 1.1e-4, 0.06
}

// Torques of 3 N m bend the boom by 2 % of its length. The stiffness must not make such a motion worse: with
// the displaced geometry of the response in E it is off by 93 %, because the modes have no terms of the
// third order that would cancel the stretching.
TEST(LoadStiffness, CommandsThatBendDoNotSoftenABoom) {
  Scene scene = pressed_boom(Axes::kBody, false);
  scene.loads.clear();
  scene.groups = {{"first", {0, 1, 2}, {}}, {"last", {8, 9, 10}, {}}};
  ForceCommand bend = make_command(0, 1, Axes::kBody);
  bend.num_wrenches = 2;
  bend.wrenches[0] = {0, 0, {0.0, 0.0, 0.0}, {0.0, 3.0, 0.0}};
  bend.wrenches[1] = {1, 0, {0.0, 0.0, 0.0}, {0.0, -3.0, 0.0}};
  expect_distances("torques on groups", scene, bend, 0.07, 0.0);  // 0.053
}

// The stiffness by torsional torques on a straight boom couples its modes, but stiffens none of them alone.
TEST(LoadStiffness, ALoadThatOnlyCouplesModesIsKept) {
  Scene scene = boom_of_bodies();
  scene.loads.front().torques = {{0, {30.0, 0.0, 0.0}}, {10, {-30.0, 0.0, 0.0}}};
  const Plan plan = plan_on(scene, Fidelity::kCoupled);
  const PlanStiffening& stiffening = plan.histories.front().stiffening;
  ASSERT_FALSE(stiffening.modes.empty());
  const std::size_t n = stiffening.modes.size(), padded = pad(n);
  double diagonal = 0.0, largest = 0.0;
  for (std::size_t l = 0; l < n; ++l)
    for (std::size_t u = 0; u < n; ++u) {
      const double entry = std::abs(stiffening.rows[l * padded + u]);
      largest = std::max(largest, entry);
      if (u == l) diagonal = std::max(diagonal, entry);
    }
  std::printf("largest entry %.1e N/m, on the diagonal %.1e; share %.1e\n", largest, diagonal,
              stiffening.shares.front());
  EXPECT_GT(stiffening.shares.front(), 0.1);
}

// The bits of a commanded motion on a read plan are those on the saved one, and those of a copied motion.
TEST(LoadStiffness, ACommandedMotionRepeatsItsBits) {
  for (const Axes axes : {Axes::kBody, Axes::kWorld}) {
    Scene scene = pressed_boom(axes, false);
    scene.initial.angular_velocity = {0.0, 0.3, 0.2};
    const Plan plan = plan_on(scene, Fidelity::kCoupled);
    std::string error;
    const auto read = plan_from_bytes(plan_to_bytes(plan), error);
    ASSERT_TRUE(read.has_value()) << error;
    EXPECT_EQ(read->command_stiffening.rows, plan.command_stiffening.rows);
    ForceCommand command = press(axes);
    command.duration_ticks = 200;
    Motion first(plan), second(*read);
    for (int tick = 0; tick < 150; ++tick) {
      const std::span<const ForceCommand> commands(&command, tick == 10 ? 1 : 0);
      ASSERT_EQ(first.advance(commands).status, StepStatus::kOk);
      ASSERT_EQ(second.advance(commands).status, StepStatus::kOk);
    }
    Motion third(first);
    for (int tick = 150; tick < 400; ++tick) first.advance(), second.advance(), third.advance();
    for (const Motion* other : {&second, &third}) {
      EXPECT_EQ(first.state().q, other->state().q);
      EXPECT_EQ(first.state().q_dot, other->state().q_dot);
      EXPECT_EQ(first.state().H_W, other->state().H_W);
      EXPECT_EQ(first.state().q_WB, other->state().q_WB);
      EXPECT_EQ(first.verdict().level, other->verdict().level);
    }
  }
}

// 64 pushable points have 192 components. With more, commands have no stiffness, and a warning says so.
TEST(LoadStiffness, AWarningSaysThatTooManyPointsMayBePushed) {
  for (const int num_points : {64, 65}) {
    Scene scene = beam_of(70, 1e6);
    scene.fidelity = Fidelity::kCoupled;
    scene.modes.count = 8;
    for (int i = 0; i < num_points; ++i) scene.pushable.push_back(i);
    Faults faults;
    const Structure structure = build(scene);
    const auto plan = make_full_plan(scene, structure, scene.fidelity, faults);
    ASSERT_TRUE(plan.has_value());
    check_motion(scene, structure, *plan, faults);
    const bool warns = std::ranges::any_of(faults, [](const Fault& fault) {
      return fault.severity == Fault::Severity::kWarning &&
             fault.message.starts_with(
                 "commands may have 195 components of force and torque, but the rung "
                 "coupled computes the change of the stiffness by commands for at most "
                 "192") &&
             fault.message.find("name the points to push in commands: points") != std::string::npos;
    });
    EXPECT_EQ(warns, num_points == 65);
    EXPECT_EQ(plan->command_stiffening.components.size(), num_points == 65 ? 0U : 192U);
  }
}

}  // namespace
}  // namespace freeflex::testing
