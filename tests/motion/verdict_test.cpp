// The verdict on a motion is never `good` if the motion is wrong, and not `outside` if it is right.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <stdexcept>

#include "core/plan/loads/quasi_static.hpp"
#include "core/plan/make_plan.hpp"
#include "core/steady/judge_steady.hpp"
#include "tests/motion/rung_cases.hpp"
#include "tests/motion/verdict_truth.hpp"
#include "tests/motion/watched.hpp"

namespace freeflex::testing {
namespace {

using Level = Verdict::Level;

struct Judged {
  Verdict now, worst;
  std::string text;
};
Judged judged(const Scene& scene, double end) {
  Watched watched(scene);
  watched.run_to(end);
  return {watched.motion.verdict(), watched.motion.worst(), watched.text()};
}

// The scene has 11 points of 1 kg and ten equal beams of 1 m along x. The lowest bending mode is at 8.785
// rad/s, and EI / L^2 is 22 N.
constexpr double kLowest = 8.785, kThrust = 22.0;
Scene free_beam(Fidelity rung) {
  Scene scene;
  for (int k = 0; k <= 10; ++k)
    scene.points.push_back({"p" + std::to_string(k), 1.0, {1.0 * k, 0.0, 0.0}, Eigen::Vector3d::Zero()});
  for (int k = 0; k < 10; ++k) {
    Link link;
    link.name = "b" + std::to_string(k);
    link.points = {k, k + 1};
    link.kind =
        Beam{.EA = 1e7, .GJ = 2000.0, .EI_y = 2200.0, .EI_z = 2200.0, .y_axis = Eigen::Vector3d::UnitY()};
    scene.links.push_back(link);
  }
  scene.fidelity = rung;
  scene.rate = 500.0;
  scene.initial.modes = {{1, 1e-3, 0.0}, {2, 1e-3, 0.0}};
  return scene;
}

constexpr Fidelity kLinearLinks[] = {Fidelity::kSeparated, Fidelity::kSpinLoaded, Fidelity::kCoupled};
constexpr Fidelity kBending[] = {Fidelity::kSeparated, Fidelity::kSpinLoaded, Fidelity::kCoupled,
                                 Fidelity::kCorotational, Fidelity::kFull};

// At a spin of 0.34 omega_1 the true frequency of bending out of the plane of spin is 1.17 times the
// frequency at rest, so the computed motion is out of phase with the true motion within a period or two.
TEST(Verdict, ASpinningBeamIsRatedGoodOnNoRungBelowCoupled) {
  for (const Fidelity rung : {Fidelity::kSeparated, Fidelity::kSpinLoaded})
    for (const double spin : {0.06, 0.11, 0.34}) {
      Scene scene = free_beam(rung);
      scene.initial.angular_velocity = {0.0, 0.0, spin * kLowest};
      EXPECT_NE(judged(scene, 4.0).now.level, Level::kGood) << name_of(rung) << " " << spin;
    }
}

// At a spin of 0.02 omega_1 the relative stiffness change is 3.05 * 0.02^2 = 1.2e-3, so after one second the
// phase differs from the true phase by 8.785 * 1.2e-3 / 2 = 0.005 rad.
TEST(Verdict, ASlowlySpinningBeamIsRatedGoodOnRungsWithSmallErrors) {
  for (const Fidelity rung : kBending) {
    Scene scene = free_beam(rung);
    scene.initial.angular_velocity = {0.0, 0.0, 0.02 * kLowest};
    const Judged motion = judged(scene, 1.0);
    std::printf("%-11s %s, %.2f %% of the scale\n", name_of(rung), name_of(motion.now.level),
                100.0 * motion.now.error.deformation / motion.now.scale);
    if (rung == Fidelity::kSeparated)
      continue;  // the rung `separated` also omits centrifugal stretch and Coriolis forces
    EXPECT_EQ(motion.now.level, Level::kGood) << name_of(rung) << " " << motion.text;
    const double expected =
        rung == Fidelity::kSpinLoaded ? 0.005 : 0.0;  // `coupled` has the stiffness by the spin
    EXPECT_NEAR(motion.now.error.deformation / motion.now.scale, expected, 0.003) << name_of(rung);
  }
}

// The rung `coupled` has the stiffness by the load, and is good under a thrust that follows the beam.
TEST(Verdict, NoRungWithoutTheStiffnessByLoadsRatesABeamUnderThrustGood) {
  for (const Axes axes : {Axes::kBody, Axes::kLocal}) {
    Scene scene = free_beam(Fidelity::kCorotational);
    publish_everything(scene);
    Load thrust;
    thrust.axes = axes;
    thrust.forces = {{0, {20.0 * kThrust, 0.0, 0.0}}};
    scene.loads = {thrust};
    Scene fine = scene;
    fine.rate = 2000.0;
    Watched truth(fine);
    truth.run_to(4.0);
    for (const Fidelity rung : kLinearLinks) {
      scene.fidelity = rung;
      Watched watched(scene);
      const Verdict& verdict = watched.run_to(4.0);
      const double error = distance_between(scene, truth, watched) / verdict.scale,
                   estimate = verdict.error.deformation / verdict.scale;
      std::printf("thrust on %-11s error %.2e of the scale, estimate %.2e, %s\n", name_of(rung), error,
                  estimate, name_of(verdict.level));
      EXPECT_NEAR(estimate, error, verdict.own_error / verdict.scale);
      EXPECT_TRUE(verdict.level != Level::kGood || error < kGoodElastic);
      if (rung != Fidelity::kCoupled) {
        EXPECT_NE(verdict.level, Level::kGood);
      }
    }
  }
}

// Returns the frequency of the first mode from the times between its zeros.
double frequency(const Scene& scene, double end) {
  Simulation simulation(scene);
  double before = simulation.state.q[0], first = -1.0, last = 0.0;
  int count = 0;
  for (std::int64_t k = 1; k <= std::llround(end / simulation.plan.period); ++k) {
    simulation.run(1);
    const double now = simulation.state.q[0];
    if (before * now < 0.0) {
      last = (static_cast<double>(k) - now / (now - before)) * simulation.plan.period;
      if (first < 0.0) first = last;
      ++count;
    }
    before = now;
  }
  return M_PI * (count - 1) / (last - first);
}

// The expected frequencies, 7.4122 and 4.6101 rad/s, come from the determinant of the condensed matrix of ten
// elements with consistent geometric stiffness, point masses and a thrust along the rotated end (an
// independent program in Python). Without thrust the frequency is 8.7853 rad/s. If the stiffness of the
// internal forces were omitted, the frequency would rise.
TEST(Followers, InternalForcesUnderFollowerForcesChangeTheStiffnessOfABeam) {
  for (const Fidelity rung : {Fidelity::kSeparated, Fidelity::kCoupled, Fidelity::kFull})
    for (const auto& [thrust, expected] : {std::pair{0.0, 8.7853}, {440.0, 7.4122}, {1320.0, 4.6101}}) {
      Scene scene = free_beam(rung);
      scene.initial.modes = {{1, 1e-5, 0.0}};
      scene.rate = 2000.0;
      Load load;
      load.axes = Axes::kLocal;
      load.forces = {{0, {thrust, 0.0, 0.0}}};
      if (thrust > 0.0) scene.loads = {load};
      const double omega = frequency(scene, 10.0);
      std::printf("%-11s %6.0f N: %.4f rad/s, expected %.4f\n", name_of(rung), thrust, omega, expected);
      // other modes change the frequency by 1e-3
      EXPECT_NEAR(omega, expected, 1.5e-3 * expected);
    }
}

// A pair of end loads of pi^2 EI / L^2 in fixed directions buckles the beam. The beam then bends from a
// deflection of a millionth of its length, but on a linear rung this deflection stays as small.
TEST(Verdict, ABucklingBeamIsRatedOutsideBeforeItBends) {
  for (const auto& [share, is_good] : {std::pair{0.001, true}, {0.6, false}, {1.1, false}}) {
    Scene scene = free_beam(Fidelity::kSpinLoaded);
    scene.initial.modes = {{1, 1e-5, 0.0}};
    const double load = share * M_PI * M_PI * kThrust;
    Load ends;
    ends.axes = Axes::kBody;
    ends.forces = {{0, {load, 0.0, 0.0}}, {10, {-load, 0.0, 0.0}}};
    scene.loads = {ends};
    scene.damping.modal_ratio = 0.01;
    const Judged found = judged(scene, 2.0);
    std::printf("%.3f of the buckling load: %s\n", share, found.text.c_str());
    if (share > 1.0) {
      EXPECT_EQ(found.now.level, Level::kOutside) << share;
    }
    EXPECT_EQ(found.worst.level == Level::kGood, is_good) << share;
  }
}

TEST(Verdict, ABodyWithANegligibleSpinIsRatedGood) {
  Scene scene = boxed_truss(1e-9, 0.0);
  scene.loads.clear();
  EXPECT_EQ(judged(scene, 0.2).worst.level, Level::kGood);
}

// The same motion has the same verdict, whatever the scene publishes.
TEST(Verdict, DoesNotDependOnWhatTheScenePublishes) {
  Scene all = boxed_truss(0.0, 10000.0), unpublished = all;
  unpublished.publication.points.clear();
  const Judged of_all = judged(all, 0.5), of_none = judged(unpublished, 0.5);
  EXPECT_EQ(of_all.now.level, Level::kOutside);
  EXPECT_EQ(of_none.text, of_all.text);
  EXPECT_EQ(of_none.worst.tick, of_all.worst.tick);
}

// Errors of past horizons are included in the verdict.
TEST(Verdict, TheVerdictOnALongRunIncludesPastHorizons) {
  Scene scene = watched_truss(Fidelity::kSeparated, 0.5, 0.2);
  const Judged brief = judged(scene, 0.45), late = judged(scene, 4.05);
  std::printf("error %.1e m within one horizon, %.1e m after eight\n", brief.now.error.deformation,
              late.now.error.deformation);
  EXPECT_GT(late.now.error.deformation, 2.0 * brief.now.error.deformation);
  EXPECT_NE(late.now.level, Level::kGood);
}

// Errors are measured relative to the displacement that remains, not to the large displacement of a past
// deployment.
TEST(Verdict, ASettledBodyIsRatedByItsRemainingDisplacement) {
  Scene scene = free_beam(Fidelity::kSeparated);
  scene.damping.modal_ratio = 0.05;
  EXPECT_EQ(judged(scene, 20.0).now.level, Level::kGood);
  scene.initial.angular_velocity = {0.0, 0.0, 0.3 * kLowest};
  const Judged spinning = judged(scene, 120.0);
  EXPECT_NE(spinning.now.level, Level::kGood) << spinning.text;
}

TEST(Verdict, IsAtBestWatchIfTheShadowSharesAnError) {
  Scene rigid = free_beam(Fidelity::kRigid);
  rigid.initial.modes.clear();
  rigid.initial.angular_velocity = {0.0, 0.0, 0.1};
  EXPECT_EQ(judged(rigid, 0.1).now.cause, Verdict::Cause::kRigid);

  Scene fast = free_beam(Fidelity::kCoupled);
  Load load;
  load.forces = {{0, {0.0, 1e-6, 0.0}}};
  load.history = SineHistory{2.5 * fast.rate, 0.0};
  fast.loads = {load};
  EXPECT_EQ(judged(fast, 0.1).now.cause, Verdict::Cause::kFastLoad);

  Scene near = free_beam(Fidelity::kCoupled);
  near.points[0].inertia = Eigen::Matrix3d::Identity();  // on bodies the field is linear
  near.attractor.mu = 1.0;
  near.attractor.position = {0.0, 0.0, -150.0};  // a distance of 30 times the size
  EXPECT_EQ(judged(near, 0.1).now.cause, Verdict::Cause::kAttractor);

  // the beam is given as a matrix, so its internal forces are unknown
  Scene matrix = as_matrix(free_beam(Fidelity::kCoupled));
  EXPECT_EQ(judged(matrix, 4.0).now.level, Level::kGood) << "the body is at rest and deforms little";
  matrix.initial.angular_velocity = {0.0, 0.0, 0.34 * kLowest};
  const Judged spinning = judged(matrix, 4.0);
  EXPECT_EQ(spinning.now.level, Level::kWatch) << spinning.text;
  EXPECT_EQ(spinning.now.cause, Verdict::Cause::kShared);
}

// The state does not show the amplitudes that commands excite in omitted modes. The shadow has these modes.
TEST(Verdict, ContainsTheErrorOfModesThatAreOmittedAndPushed) {
  for (const double tolerance : {0.01, 0.2}) {
    Scene scene = free_beam(Fidelity::kSeparated);
    scene.publication.points = {10};
    scene.pushable = {10};
    scene.leave_out.tolerance = tolerance;
    Watched watched(scene);
    ASSERT_LT(watched.plan.num_elastic, 27) << "modes must be omitted";
    const auto after = [&](std::span<const ForceCommand> first) {
      const Verdict& verdict = watched.run(501, first);
      std::printf("%s\n", describe(watched.plan, verdict).c_str());
      return verdict;
    };
    EXPECT_EQ(after({}).level, Level::kGood);
    ForceCommand command = make_command(1, 1, Axes::kBody, 50);
    add_force(command, 10, {0.0, 0.1, 0.0});
    const Verdict pushed = after({&command, 1});
    EXPECT_LT(pushed.error.deformation, tolerance * pushed.scale);
    EXPECT_GT(pushed.error.deformation, 1e-4 * pushed.scale);
  }
}

// Two opposite pushes hardly move the kept modes. The deformation is in the omitted modes.
TEST(Verdict, PushesThatCancelInTheKeptModesAreNotRatedGood) {
  Scene scene;
  for (int k = 0; k < 6; ++k)
    add_point(scene, 10.0,
              {2.0 * std::cos(k * M_PI / 3.0), 2.0 * std::sin(k * M_PI / 3.0), k % 2 == 1 ? 0.8 : -0.8});
  const int a = add_point(scene, 1.0, {-0.3, 0.05, 0.0}), b = add_point(scene, 1.0, {0.3, 0.0, 0.05});
  for (int i = 0; i < 6; ++i) {
    add_link(scene, {a, i}, Spring{300.0 + 10.0 * i});
    add_link(scene, {b, i}, Spring{320.0 + 8.0 * i});
    for (int j = i + 1; j < 6; ++j) add_link(scene, {i, j}, Spring{200.0 + 11.0 * i + j});
  }
  add_link(scene, {a, b}, Spring{2e4});
  publish_everything(scene);
  scene.pushable = {a, b};
  scene.rate = 1000.0;
  scene.damping.modal_ratio = 0.02;
  scene.leave_out.tolerance = 0.02;
  scene.leave_out.on_need = OnNeed::kRefuse;
  Watched watched(scene);
  ASSERT_LT(watched.plan.num_elastic, 18) << "modes must be omitted";
  const Eigen::Vector3d apart = (scene.points[static_cast<std::size_t>(b)].position -
                                 scene.points[static_cast<std::size_t>(a)].position)
                                    .normalized();
  ForceCommand command = make_command(0, 1, Axes::kWorld);
  add_force(command, a, -5.0 * apart);
  add_force(command, b, 5.0 * apart);
  const Verdict& verdict = watched.run(1000, std::span(&command, 1));
  std::printf("%d of 18 modes: %s\n", watched.plan.num_elastic, describe(watched.plan, verdict).c_str());
  EXPECT_NE(verdict.level, Level::kGood);
}

// A small load acts across the beam and an end thrust along it. The thrust reduces the lowest bending
// stiffness by 29 % (7.41 instead of 8.79 rad/s).
TEST(Verdict, TheQuasiStaticVerdictDependsOnTheStiffnessChangeDueToTheLoad) {
  Scene scene = free_beam(Fidelity::kSpinLoaded);
  scene.initial.modes.clear();
  publish_everything(scene);
  const Plan plan = judged_plan_of(scene);
  const auto judge = [&](double thrust, double spin) {
    const PointForce forces[] = {
        {0, 0, {thrust, 1e-3, 0.0}}, {5, 0, {0.0, -2e-3, 0.0}}, {10, 0, {0.0, 1e-3, 0.0}}};
    std::string error;
    const SteadyLoad load{forces, {}, {0.0, 0.0, spin}};
    const auto state = quasi_static(plan, load, error);
    if (!state) throw std::runtime_error(error);
    const SteadyVerdict verdict = judge_steady(plan, *state, load);
    std::printf("thrust %6.1f N, spin %.2f rad/s: %.2e of the scale, %s %s%s\n", thrust, spin,
                verdict.error / verdict.scale, name_of(verdict.level), verdict.cause.c_str(),
                verdict.why_not.c_str());
    return verdict;
  };
  EXPECT_EQ(judge(0.0, 0.0).level, Level::kGood);
  EXPECT_LT(judge(0.0, 0.0).error / judge(0.0, 0.0).scale, 1e-5);
  // the thrust has a moment about the centre of mass of the bent beam, so there is no steady motion
  EXPECT_NE(judge(20.0 * kThrust, 0.0).why_not, "");
  EXPECT_NE(judge(-20.0 * kThrust, 0.0).level, Level::kGood);
  EXPECT_NE(judge(0.0, 0.34 * kLowest).level, Level::kGood);
}

// A straight beam stays straight in the equations under any load along it, but above Euler's load
// pi^2 EI / L^2 = 217 N of a beam with supported ends the shape is unstable.
TEST(Verdict, AShapeAboveTheBucklingLoadIsOutside) {
  Scene scene = free_beam(Fidelity::kSpinLoaded);
  scene.initial.modes.clear();
  publish_everything(scene);
  const Plan plan = judged_plan_of(scene);
  const double euler = M_PI * M_PI * 2200.0 / 100.0;
  for (const double share : {-2.0, 0.5, 0.95, 1.05, 2.0, 10.0}) {
    const PointForce forces[] = {{0, 0, {share * euler, 0.0, 0.0}}, {10, 0, {-share * euler, 0.0, 0.0}}};
    std::string error;
    const SteadyLoad load{forces, {}, {}};
    const auto state = quasi_static(plan, load, error);
    ASSERT_TRUE(state) << error;
    const SteadyVerdict verdict = judge_steady(plan, *state, load);
    ASSERT_EQ(verdict.why_not, "");
    EXPECT_EQ(verdict.level, share > 1.0 ? Level::kOutside : Level::kGood) << share << " " << verdict.cause;
    EXPECT_EQ(verdict.cause.find("unstable") != std::string::npos, share > 1.0) << share;
  }
}

// The structures have links of every kind. tests/motion/verdict_long_test has three hundred such structures,
// and three hundred more of a seed on which no constant was tuned.
TEST(Verdict, IsCorrectForRandomStructures) {
  VerdictCounts counts;
  // a cloud, a matrix, a chain, a mixture, plates, and a cloud whose modes resonate
  for (const long long seed : {24LL, 31LL, 80LL, 100LL, 119LL, 20261122156LL})
    judge_scene(static_cast<std::uint64_t>(seed), counts);
  expect_true_verdicts(counts);
}

TEST(Automatic, AutoChoosesTrueGeometryIfNoOtherRungMeetsTheTolerance) {
  Scene scene = free_beam(Fidelity::kSeparated);
  scene.initial.angular_velocity = {0.0, 0.0, 0.34 * kLowest};
  scene.automatic = AutomaticRung{{}, {}, 1e-3, 2.0, {}};
  const Plan plan = reduced_plan_of(scene);
  for (const PlanRung& each : plan.tried_rungs)
    std::printf("%-12s %.1e m, %.1e rad, elastic %.1e\n", name_of(each.rung), each.position, each.attitude,
                each.elastic);
  EXPECT_EQ(plan.fidelity, Fidelity::kCorotational);
}

// The tolerance of the scene is for the elastic error. The verdict judges the attitude too.
TEST(Automatic, AutoWarnsIfItChoosesARungWhoseVerdictIsOutside) {
  Scene scene = free_beam(Fidelity::kSeparated);
  scene.initial.angular_velocity = {0.0, 0.0, 0.34 * kLowest};
  scene.automatic = AutomaticRung{{}, {}, 10.0, 2.0, {}};
  Faults faults;
  const auto plan = make_plan(scene, build(scene), faults);
  ASSERT_TRUE(plan);
  const auto found = std::ranges::find_if(faults, [](const Fault& fault) {
    return fault.message.find("whose estimated error meets the tolerance but whose verdict is ") !=
           std::string::npos;
  });
  ASSERT_NE(found, faults.end());
  std::printf("%s\n", found->message.c_str());
}

// How a matrix carries its forces is unknown, so the verdict is not better than `watch`. The cheapest rung
// that meets the tolerance is chosen, with a warning.
TEST(Automatic, AutoWarnsIfItChoosesARungWhoseVerdictIsWatch) {
  Scene scene = as_matrix(free_beam(Fidelity::kSeparated));
  scene.initial.angular_velocity = {0.0, 0.0, 0.05 * kLowest};
  scene.automatic = AutomaticRung{{}, {}, 0.1, 2.0, {}};
  Faults faults;
  const auto structure = build_structure(scene, faults);
  EXPECT_TRUE(make_plan(scene, *structure, faults));
  ASSERT_FALSE(faults.empty());
  EXPECT_NE(faults.back().message.find("whose verdict is watch (the inside of link 'K' is not known"),
            std::string::npos)
      << faults.back().message;
}

}  // namespace
}  // namespace freeflex::testing
