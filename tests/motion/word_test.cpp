// The word on a motion: never good where it is wrong, and not outside where nothing is.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <stdexcept>

#include "core/plan/make_plan.hpp"
#include "core/plan/quasi_static.hpp"
#include "core/validity/judgement.hpp"
#include "tests/motion/rung_cases.hpp"
#include "tests/motion/watched.hpp"
#include "tests/motion/word_truth.hpp"

namespace freeflex::testing {
namespace {

using Word = Verdict::Word;

struct Judged {
  Verdict now, worst;
  std::string text;
};
Judged judged(const Scene& scene, double end) {
  Watched watched(scene);
  Judgement judgement(watched.plan);
  judgement.take(watched.state, watched.budget);
  for (std::int64_t k = 0; k < std::llround(end / watched.plan.period); ++k) {
    watched.run(1);
    judgement.take(watched.state, watched.budget);
  }
  return {judgement.now(), judgement.worst(), text_of(watched.plan, judgement.now())};
}

// 11 points of 1 kg and ten equal beams of 1 m along x: the lowest bending is at 8.785 rad/s, EI / L^2 is 22
// N
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

constexpr Fidelity kBending[] = {Fidelity::kSeparated, Fidelity::kSpinLoaded, Fidelity::kCoupled,
                                 Fidelity::kExactBars, Fidelity::kFull};

// Out of the plane of spin the frequency rises by 1.17 at 0.34 of omega_1: out of phase within a period or
// two.
TEST(Word, OnASpinningBeamIsNoneOfGoodOnAnyRung) {
  for (const Fidelity rung : kBending)
    for (const double spin : {0.06, 0.11, 0.34}) {
      Scene scene = free_beam(rung);
      scene.initial.angular_velocity = {0.0, 0.0, spin * kLowest};
      EXPECT_NE(judged(scene, 4.0).now.word, Word::kGood) << name_of(rung) << " " << spin;
    }
}

// At 0.02 the share is 3.05 * 0.02^2 = 1.2e-3: after a second 8.785 * 1.2e-3 / 2 = 0.5 % out of phase.
TEST(Word, OnASlowlySpinningBeamIsGoodWhereTheErrorIsSmall) {
  for (const Fidelity rung : kBending) {
    Scene scene = free_beam(rung);
    scene.initial.angular_velocity = {0.0, 0.0, 0.02 * kLowest};
    const Judged motion = judged(scene, 1.0);
    std::printf("%-11s %s, %.2f %% of the scale\n", name_of(rung), name_of(motion.now.word),
                100.0 * motion.now.error / motion.now.scale);
    if (rung == Fidelity::kSeparated)
      continue;  // its centrifugal stretch and Coriolis forces are missing too
    EXPECT_EQ(motion.now.word, Word::kGood) << name_of(rung) << " " << motion.text;
    EXPECT_NEAR(motion.now.error / motion.now.scale, 0.005, 0.003) << name_of(rung);
  }
}

TEST(Word, OnAThrustingBeamIsNoneOfGoodOnAnyRung) {
  for (const Fidelity rung : kBending)
    for (const Axes axes : {Axes::kBody, Axes::kLocal}) {
      Scene scene = free_beam(rung);
      Load thrust;
      thrust.axes = axes;
      thrust.forces = {{0, {20.0 * kThrust, 0.0, 0.0}}};
      scene.loads = {thrust};
      EXPECT_NE(judged(scene, 4.0).now.word, Word::kGood) << name_of(rung);
    }
}

// Frequency of the first mode by the times between its zeros.
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

// Ten elements with consistent geometric stiffness, point masses, thrust along the turned end: 7.4122 and
// 4.6101 rad/s by the determinant of the condensed matrix (a program of its own, in Python); 8.7853 at rest.
// Without the stiffness of its internal forces the frequency would rise.
TEST(Followers, CarryTheStiffnessOfTheirInternalForces) {
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
      // other modes ring along by 1e-3 of it
      EXPECT_NEAR(omega, expected, 1.5e-3 * expected);
    }
}

// A pair of dead end loads of pi^2 EI / L^2 buckles the beam: it bends from nothing, and nothing of it is
// seen on a linear rung.
TEST(Word, OnABeamThatBucklesIsOutsideAlthoughNothingBendsYet) {
  for (const auto& [share, is_good] : {std::pair{0.001, true}, {0.6, false}, {1.1, false}}) {
    Scene scene = free_beam(Fidelity::kSpinLoaded);
    scene.initial.modes.clear();
    const double load = share * M_PI * M_PI * kThrust;
    Load ends;
    ends.axes = Axes::kBody;
    ends.forces = {{0, {load, 0.0, 0.0}}, {10, {-load, 0.0, 0.0}}};
    scene.loads = {ends};
    scene.damping.modal_ratio = 0.01;
    const Verdict verdict = judged(scene, 1.0).now;
    if (share > 1.0) {
      EXPECT_EQ(verdict.word, Word::kOutside) << share;
      EXPECT_EQ(verdict.cause, Verdict::Cause::kBuckling) << share;
    }
    EXPECT_EQ(verdict.word == Word::kGood, is_good) << share;
  }
}

TEST(Word, OnAQuietBodyIsGoodAtASpinOfNothing) {
  Scene scene = boxed_truss(1e-9, 0.0);
  scene.loads.clear();
  EXPECT_EQ(judged(scene, 0.2).worst.word, Word::kGood);
}

// Whatever is published: the same motion, the same word.
TEST(Word, DoesNotDependOnWhatIsPublished) {
  Scene all = boxed_truss(0.0, 10000.0), none = all;
  none.publication.points.clear();
  const Judged of_all = judged(all, 0.5), of_none = judged(none, 0.5);
  EXPECT_EQ(of_all.now.word, Word::kOutside);
  EXPECT_EQ(of_none.text, of_all.text);
  EXPECT_EQ(of_none.worst.tick, of_all.worst.tick);
}

// Errors of horizons that are over count.
TEST(Word, OfALongRunIsNotForgivenAtEachHorizon) {
  Scene scene = watched_truss(Fidelity::kSeparated, 0.5, 0.2);
  const Judged brief = judged(scene, 0.45), late = judged(scene, 4.05);
  std::printf("error %.1e m within one horizon, %.1e m after eight\n", brief.now.error, late.now.error);
  EXPECT_GT(late.now.error, 2.0 * brief.now.error);
  EXPECT_NE(late.now.word, Word::kGood);
}

// A body that was deployed and came to rest is not excused: what comes after is judged by what is left.
TEST(Word, OfACalmBodyIsGoodAndADeploymentDoesNotExcuseWhatFollows) {
  Scene scene = free_beam(Fidelity::kSeparated);
  scene.damping.modal_ratio = 0.05;
  EXPECT_EQ(judged(scene, 20.0).now.word, Word::kGood);
  scene.initial.angular_velocity = {0.0, 0.0, 0.3 * kLowest};
  const Judged spinning = judged(scene, 120.0);
  EXPECT_NE(spinning.now.word, Word::kGood) << spinning.text;
}

TEST(Word, IsAtBestWatchWhereSomethingIsNotKnown) {
  Scene rigid = free_beam(Fidelity::kRigid);
  rigid.initial.modes.clear();
  rigid.initial.angular_velocity = {0.0, 0.0, 0.1};
  EXPECT_EQ(judged(rigid, 0.1).now.cause, Verdict::Cause::kRigid);

  Scene fast = free_beam(Fidelity::kCoupled);
  Load load;
  load.forces = {{0, {0.0, 1e-6, 0.0}}};
  load.history = SineHistory{fast.rate / 5.0, 0.0};
  fast.loads = {load};
  EXPECT_EQ(judged(fast, 0.1).now.cause, Verdict::Cause::kFastLoad);

  Scene near = free_beam(Fidelity::kCoupled);
  near.attractor.mu = 1.0;
  near.attractor.position = {0.0, 0.0, -150.0};  // 30 sizes
  EXPECT_EQ(judged(near, 0.1).now.cause, Verdict::Cause::kAttractor);

  // the beam as a matrix: nobody knows what is inside
  Scene matrix = as_matrix(free_beam(Fidelity::kCoupled));
  EXPECT_EQ(judged(matrix, 4.0).now.word, Word::kGood) << "at rest, and small";
  matrix.initial.angular_velocity = {0.0, 0.0, 0.34 * kLowest};
  const Judged spinning = judged(matrix, 4.0);
  EXPECT_EQ(spinning.now.word, Word::kWatch) << spinning.text;
  EXPECT_EQ(spinning.now.cause, Verdict::Cause::kUnseen);
}

// what commands ring in modes that are left out shows in no state
TEST(Word, OnPushedModesThatAreLeftOutIsAtBestWatch) {
  for (const double tolerance : {0.01, 0.2}) {
    Scene scene = free_beam(Fidelity::kSeparated);
    scene.publication.points = {10};
    scene.pushable = {10};
    scene.leave_out.tolerance = tolerance;
    Watched watched(scene);
    ASSERT_LT(watched.plan.num_elastic, 27) << "modes are left out";
    Judgement judgement(watched.plan);
    Budget none;
    const auto after = [&](const Inputs& first) {
      watched.run(1, first);
      judgement.take(watched.state, none);
      for (int k = 0; k < 500; ++k) {
        watched.run(1);
        judgement.take(watched.state, none);
      }
      std::printf("%s\n", describe(watched.plan, judgement.now()).c_str());
      return judgement.now();
    };
    judgement.take(watched.state, none);
    EXPECT_EQ(after({}).word, Word::kGood);
    ForceCommand command = make_command(1, 1, Axes::kBody, 50);
    add_force(command, 10, {0.0, 0.1, 0.0});
    const Verdict pushed = after({std::span(&command, 1)});
    EXPECT_EQ(pushed.word == Word::kGood, tolerance < kGoodElastic);
    if (tolerance > kGoodElastic) {
      EXPECT_EQ(pushed.cause, Verdict::Cause::kTruncation);
    }
  }
}

// two pushes against each other hardly move what is kept: all of it is in what is left out
TEST(Word, OnPushesThatCancelInWhatIsKeptIsNotGood) {
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
  ASSERT_LT(watched.plan.num_elastic, 18) << "modes are left out";
  Judgement judgement(watched.plan);
  Budget none;
  judgement.take(watched.state, none);
  const Eigen::Vector3d apart = (scene.points[static_cast<std::size_t>(b)].position -
                                 scene.points[static_cast<std::size_t>(a)].position)
                                    .normalized();
  ForceCommand command = make_command(0, 1, Axes::kWorld);
  add_force(command, a, -5.0 * apart);
  add_force(command, b, 5.0 * apart);
  for (int k = 0; k < 1000; ++k) {
    watched.run(1, k == 0 ? Inputs{std::span(&command, 1)} : Inputs{});
    judgement.take(watched.state, none);
  }
  EXPECT_NE(judgement.now().word, Word::kGood);
  EXPECT_EQ(judgement.now().cause, Verdict::Cause::kTruncation);
}

// A small load across the beam and an end thrust along it, which takes 0.29 of the lowest bending's stiffness
// (7.41 of 8.79 rad/s below).
TEST(Word, OfASteadyAnswerGoesByWhatTheLoadChangesOfTheStiffness) {
  Scene scene = free_beam(Fidelity::kSpinLoaded);
  scene.initial.modes.clear();
  publish_everything(scene);
  Faults faults;
  const auto structure = build_structure(scene, faults);
  const auto plan = make_whole_plan(scene, *structure, Fidelity::kSpinLoaded, faults);
  ASSERT_TRUE(plan);
  const auto judge = [&](double thrust, double spin) {
    const PointForce forces[] = {
        {0, 0, {thrust, 1e-3, 0.0}}, {5, 0, {0.0, -2e-3, 0.0}}, {10, 0, {0.0, 1e-3, 0.0}}};
    std::string error;
    const auto state = quasi_static(*plan, {forces, {}, {0.0, 0.0, spin}}, error);
    if (!state) throw std::runtime_error(error);
    const Verdict verdict = judge_steady(*plan, *state);
    std::printf("thrust %6.1f N, spin %.2f rad/s: %.2e of the scale, %s\n", thrust, spin,
                verdict.error / verdict.scale, describe(*plan, verdict).c_str());
    return verdict;
  };
  EXPECT_EQ(judge(0.0, 0.0).word, Word::kGood);
  EXPECT_LT(judge(0.0, 0.0).error / judge(0.0, 0.0).scale, 1e-5);
  EXPECT_NE(judge(20.0 * kThrust, 0.0).word, Word::kGood);
  EXPECT_NE(judge(-20.0 * kThrust, 0.0).word, Word::kGood);
  EXPECT_NE(judge(0.0, 0.34 * kLowest).word, Word::kGood);
}

// Every kind of link. Three hundred of them, and as many of a seed that nothing was set on, in
// tests/motion/word_long_test.
TEST(Word, IsTrueOfRandomStructures) {
  WordCounts counts;
  // cloud, matrix, chain, mixture, plates; and a cloud whose modes resonate
  for (const long long seed : {24LL, 31LL, 80LL, 100LL, 119LL, 20261122156LL})
    judge_scene(static_cast<std::uint64_t>(seed), counts);
  expect_true_words(counts);
}

TEST(Automatic, TakesNoRungThatItsOwnWordCallsOutside) {
  Scene scene = free_beam(Fidelity::kSeparated);
  scene.initial.angular_velocity = {0.0, 0.0, 0.34 * kLowest};
  scene.automatic = AutomaticRung{{}, {}, 0.1, 2.0, {}};
  Faults faults;
  const auto structure = build_structure(scene, faults);
  EXPECT_FALSE(make_plan(scene, *structure, faults));
  ASSERT_TRUE(has_error(faults));
  EXPECT_NE(faults.back().message.find("outside by model"), std::string::npos) << faults.back().message;
}

// Nothing tells how a matrix carries its forces: the cheapest rung that meets the tolerance otherwise is
// taken, and that it is watched at best is said.
TEST(Automatic, TakesARungThatIsWatchedAndSaysSo) {
  Scene scene = as_matrix(free_beam(Fidelity::kSeparated));
  scene.initial.angular_velocity = {0.0, 0.0, 0.05 * kLowest};
  scene.automatic = AutomaticRung{{}, {}, 0.1, 2.0, {}};
  Faults faults;
  const auto structure = build_structure(scene, faults);
  EXPECT_TRUE(make_plan(scene, *structure, faults));
  ASSERT_FALSE(faults.empty());
  EXPECT_NE(faults.back().message.find(
                "the word on its motion is watch: not modelled: how forces run inside matrix"),
            std::string::npos)
      << faults.back().message;
}

}  // namespace
}  // namespace freeflex::testing
