// Frequency and damping of coupled modes are those of a free decay in the step itself.
#include "core/plan/damped_modes.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <complex>
#include <cstdio>

#include "core/plan/coupled_roots.hpp"
#include "core/plan/mixing.hpp"
#include "core/step/state.hpp"
#include "core/structure/decompositions.hpp"
#include "tests/motion/coupled_scenes.hpp"
#include "tests/support/simulation.hpp"

namespace freeflex::testing {
namespace {

using Complex = std::complex<double>;

// What one tick of the step itself makes of every coordinate and rate in turn, (size q, q'). Small motions:
// on rungs that are not linear nothing else matters then.
Eigen::MatrixXd tick_of(const Plan& plan) {
  constexpr double kSmall = 1e-9;  // [m]
  const Eigen::Index n = plan.num_elastic;
  Simulation simulation(plan);
  PlanInitial& initial = simulation.plan.initial;
  std::fill(initial.q.begin(), initial.q.end(), 0.0);
  std::fill(initial.q_dot.begin(), initial.q_dot.end(), 0.0);
  const auto size_of = [&](Eigen::Index l) { return std::max(plan.omega[static_cast<std::size_t>(l)], 1.0); };
  Eigen::MatrixXd tick(2 * n, 2 * n);
  for (Eigen::Index column = 0; column < 2 * n; ++column) {
    const Eigen::Index mode = column % n;
    double& start = (column < n ? initial.q : initial.q_dot)[static_cast<std::size_t>(mode)];
    start = column < n ? kSmall : kSmall * size_of(mode);
    reset_state(simulation.plan, simulation.state);
    simulation.run(1);
    start = 0.0;
    for (Eigen::Index l = 0; l < n; ++l) {
      const double scale = 1.0 / (kSmall * size_of(mode));
      tick(l, column) = scale * size_of(l) * simulation.state.q[static_cast<std::size_t>(l)];
      tick(n + l, column) = scale * simulation.state.q_dot[static_cast<std::size_t>(l)];
    }
  }
  return tick;
}

// Every free decay of the step: a motion along an eigenvector of a tick falls and turns by its eigenvalue at
// each.
Eigen::VectorXcd decays_of(const Plan& plan) {
  const Eigen::VectorXcd mu = tick_of(plan).eigenvalues();
  return mu.array().log() / plan.period;
}

Complex printed(const DampedMode& mode) { return {-mode.rate, mode.frequency}; }

struct Largest {
  double off = 0.0, step_error = 0.0, first_order = 0.0;
};

// Every mode in turn: what is printed, and the free decay that is nearest to it. \return the largest
// differences, over the decay rate: of the two, of the step as it is foreseen, of half the diagonal of the
// damping matrix.
Largest compare(const Plan& plan, double rounding) {
  const Eigen::VectorXcd decays = decays_of(plan);
  const std::vector<DampedMode> modes = damped_modes(plan);
  const MixingForces forces = mixing_forces(plan);
  std::vector<bool> is_used(static_cast<std::size_t>(decays.size()), false);
  Largest largest;
  for (std::size_t l = 0; l < modes.size(); ++l) {
    EXPECT_TRUE(modes[l].is_known) << l;
    const Complex s = printed(modes[l]);
    Eigen::Index nearest = 0;
    double off = HUGE_VAL;
    // of equal modes each has a decay of its own
    for (Eigen::Index k = 0; k < decays.size(); ++k)
      if (!is_used[static_cast<std::size_t>(k)] && std::abs(decays[k] - s) < off)
        off = std::abs(decays[k] - s), nearest = k;
    is_used[static_cast<std::size_t>(nearest)] = true;
    const double rate = std::abs(s.real());
    EXPECT_LT(off, 1.3 * modes[l].step_error * rate + rounding * std::abs(s))
        << "mode " << l << ": " << s << " printed, " << decays[nearest] << " shown";
    if (modes[l].frequency > 0.0) {
      EXPECT_NEAR(modes[l].ratio, -s.real() / std::abs(s), 1e-12);
    }
    largest.off = std::max(largest.off, off / rate);
    largest.step_error = std::max(largest.step_error, modes[l].step_error);
    const auto at = static_cast<Eigen::Index>(l);
    const double diagonal = plan.decay[l] - 0.5 * forces.out.col(at).dot(forces.by_q_dot.col(at));
    largest.first_order = std::max(largest.first_order, std::abs(diagonal / rate - 1.0));
  }
  return largest;
}

Scene damped_boxes(std::uint64_t seed, double rate) {
  Scene scene = two_boxes();
  std::mt19937_64 engine(seed);
  std::uniform_real_distribution<double> logarithm(-5.0, -3.0);
  std::uniform_int_distribution<int> any(0, static_cast<int>(scene.links.size()) - 1);
  for (int k = 0; k < 4; ++k)
    scene.links[static_cast<std::size_t>(any(engine))].viscous = std::pow(10.0, logarithm(engine));
  Link dashpot;
  dashpot.name = "dashpot";
  dashpot.points = {3, 30};
  dashpot.kind = Dashpot{std::pow(10.0, 6.0 + logarithm(engine))};
  scene.links.push_back(dashpot);
  scene.damping.modal_ratio = 0.002;
  scene.rate = rate;
  return scene;
}

// 114 modes, more than the exponential takes: dashpots act by splitting, of second order in the step.
TEST(DampedModes, OfRandomScenesAreWhatAFreeDecayShows) {
  for (const std::uint64_t seed : {1U, 2U, 3U}) {
    Largest before;
    for (const double rate : {30000.0, 60000.0}) {
      const Plan plan = plan_of(damped_boxes(seed, rate));
      ASSERT_EQ(plan.mixing.path, PlanMixing::Path::kSplit);
      const Largest now = compare(plan, 1e-9);
      std::printf(
          "seed %d, %5.0f Hz: printed and shown differ by %.1e of the decay rate, foreseen %.1e; half the "
          "diagonal is off by %.2f\n",
          static_cast<int>(seed), rate, now.off, now.step_error, now.first_order);
      EXPECT_GT(now.first_order, 0.1) << "a scene that shows nothing";
      if (before.step_error > 0.0) {
        EXPECT_NEAR(before.step_error / now.step_error, 4.0, 1.0);
      }
      before = now;
    }
  }
}

// A square truss has pairs of equal modes, of which a dashpot damps one combination.
TEST(DampedModes, OfEqualModesAreWhatAFreeDecayShows) {
  Scene scene = square_truss(12);
  Link dashpot;
  dashpot.name = "dashpot";
  dashpot.points = {1, 30};
  dashpot.kind = Dashpot{300.0};
  scene.links.push_back(dashpot);
  scene.damping.modal_ratio = 0.003;
  scene.rate = 20000.0;
  const Plan plan = plan_of(scene);
  ASSERT_EQ(plan.mixing.path, PlanMixing::Path::kSplit);
  const Largest now = compare(plan, 1e-9);
  std::printf("equal modes: printed and shown differ by %.1e of the decay rate\n", now.off);
}

TEST(DampedModes, OnEveryRungAreWhatAFreeDecayShows) {
  for (const Fidelity rung : {Fidelity::kSeparated, Fidelity::kSpinLoaded, Fidelity::kCoupled,
                              Fidelity::kExactBars, Fidelity::kFull}) {
    Scene scene = random_structure(7, 8);
    for (Link& link : scene.links)
      if (const auto* bar = std::get_if<Bar>(&link.kind)) link.kind = Spring{bar->EA};
    Link dashpot;
    dashpot.name = "dashpot";
    dashpot.points = {0, 5};
    dashpot.kind = Dashpot{100.0};
    scene.links.push_back(dashpot);
    scene.damping.modal_ratio = 0.002;
    scene.rate = 64000.0;
    scene.fidelity = rung;
    const Largest now = compare(plan_of(scene), 1e-6);
    std::printf(
        "%-11s printed and shown differ by %.1e of the decay rate; half the diagonal is off by %.2f\n",
        name_of(rung), now.off, now.first_order);
    EXPECT_GT(now.first_order, 0.1) << "a scene that shows nothing";
  }
}

// Feedback from one point on another is no damping matrix, and may let modes grow.
TEST(DampedModes, UnderFeedbackAreWhatAFreeDecayShows) {
  for (const bool is_large : {false, true}) {
    Scene scene = is_large ? damped_boxes(1, 8000.0) : random_structure(11, 8);
    scene.rate = 8000.0;
    scene.damping.modal_ratio = 0.02;
    Feedback feedback;
    feedback.name = "hold";
    feedback.sensor = 2;
    feedback.point = 5;
    feedback.displacement_gain = -2000.0 * Eigen::Matrix3d::Identity();
    feedback.velocity_gain = -2.0 * Eigen::Matrix3d::Identity();
    scene.feedbacks = {feedback};
    const Largest now = compare(plan_of(scene), 1e-9);
    std::printf("feedback: printed and shown differ by %.1e of the decay rate, foreseen %.1e\n", now.off,
                now.step_error);
  }
}

// A mass on three springs with a relaxation time of 0.01 s, inside a truss: 117 modes, ratio 0.005. By itself
// it has the damping 0.005 + 0.01 omega / 2, up to 0.0216, for the truss is stiff and heavy beside it.
TEST(DampedModes, OfASloshingMassAmongManyModesIsItsOwn) {
  Scene scene = square_truss(10);
  const auto mass = static_cast<int>(scene.points.size());
  scene.points.push_back({"slosh", 0.05, Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero()});
  constexpr double kOmega = 3.32, kTime = 0.01;
  for (const auto& [name, corner] : {std::pair{"s1", 16}, {"s2", 21}, {"s3", 23}}) {
    Link link;
    link.name = name;
    link.points = {mass, corner};
    link.kind = Spring{0.75 * 0.05 * kOmega * kOmega};
    link.viscous = kTime;
    scene.links.push_back(link);
  }
  publish_everything(scene);
  scene.damping.modal_ratio = 0.005;
  scene.rate = 1000.0;
  const Plan plan = plan_of(scene);
  ASSERT_GT(plan.num_elastic, kMaxExactModes);
  ASSERT_EQ(plan.num_elastic, 117);
  const std::vector<DampedMode> modes = damped_modes(plan);
  for (std::size_t l = 0; l < 3; ++l) {
    const double expected = 0.005 + 0.5 * kTime * plan.omega[l];
    // a free decay: the logarithm of the amplitude over some ten periods
    Plan decay = plan;
    decay.initial.q[l] = 1e-3;
    Simulation simulation(std::move(decay));
    double first = 0.0, last = 0.0, first_time = 0.0, last_time = 0.0, before = 0.0;
    for (int k = 0; k < 20000; ++k) {
      simulation.run(1);
      const double rate = simulation.state.q_dot[l];
      if (before > 0.0 && rate <= 0.0) {  // a crest
        last = simulation.state.q[l], last_time = static_cast<double>(k);
        if (first == 0.0) first = last, first_time = last_time;
      }
      before = rate;
    }
    const double shown = std::log(first / last) / ((last_time - first_time) * 1e-3) / plan.omega[l];
    std::printf("slosh mode %zu, %.3f rad/s: damping %.5f printed, %.5f shown, %.5f by hand\n", l + 1,
                plan.omega[l], modes[l].ratio, shown, expected);
    EXPECT_NEAR(modes[l].ratio, expected, 1e-3 * expected);
    EXPECT_NEAR(modes[l].ratio, shown, 2e-3 * shown);
    EXPECT_LT(modes[l].step_error, 1e-3);
  }
}

// Three masses in a row, two springs, and a dashpot beside one of them that couples the two modes and is so
// strong that one of them does not oscillate.
TEST(DampedModes, ThatDoNotOscillateHaveTwoRealEigenvalues) {
  Scene scene;
  for (int k = 0; k < 3; ++k)
    scene.points.push_back({"p" + std::to_string(k), 1.0, {1.0 * k, 0.0, 0.0}, Eigen::Vector3d::Zero()});
  for (int k = 0; k < 2; ++k) {
    Link link;
    link.name = "s" + std::to_string(k);
    link.points = {k, k + 1};
    link.kind = Spring{100.0};
    scene.links.push_back(link);
  }
  Link dashpot;
  dashpot.name = "d";
  dashpot.points = {0, 1};
  dashpot.kind = Dashpot{60.0};
  scene.links.push_back(dashpot);
  publish_everything(scene);
  scene.rate = 1000.0;
  const Plan plan = plan_of(scene);
  std::vector<DampedMode> modes = damped_modes(plan);
  std::erase_if(modes, [](const DampedMode& mode) { return mode.rate == 0.0; });  // the hinge
  ASSERT_EQ(modes.size(), 2U);
  // with u, w the two elongations: u'' = -2 (c u' + k u) + k w, w'' = c u' + k u - 2 k w
  Eigen::Matrix4d A;
  A << 0, 0, 1, 0, 0, 0, 0, 1, -200, 100, -120, 0, 100, -200, 60, 0;
  const Eigen::Vector4cd s = A.eigenvalues();
  int real = 0;
  for (const DampedMode& mode : modes) {
    double nearest = HUGE_VAL;
    for (const Complex& each : s) nearest = std::min(nearest, std::abs(each - printed(mode)));
    EXPECT_LT(nearest, 1e-9);
    real += mode.frequency == 0.0;
    EXPECT_EQ(mode.ratio > 1.0, mode.frequency == 0.0);
  }
  EXPECT_EQ(real, 1);
}

// A mode that is left alone prints what it printed.
TEST(DampedModes, ThatNothingCouplesAreTheTextbooks) {
  Scene scene = random_structure(3, 5);
  scene.damping.modal_ratio = 0.1;
  const Plan plan = plan_of(scene);
  for (std::size_t l = 0; const DampedMode& mode : damped_modes(plan)) {
    EXPECT_NEAR(mode.ratio, 0.1, 1e-15);
    EXPECT_NEAR(mode.frequency, plan.omega[l] * std::sqrt(0.99), 1e-15 * plan.omega[l]);
    ++l;
  }
}

// Light damping keeps its digits beside stiff links: 1e-8 of critical at a stiffness ratio of 1e12.
TEST(CoupledRoots, KeepLightDampingBesideStiffModes) {
  constexpr Eigen::Index kModes = 100;
  CoupledModes modes;
  modes.omega =
      Eigen::VectorXd::LinSpaced(kModes, 0.0, 6.0).unaryExpr([](double x) { return std::pow(10.0, x); });
  modes.decay = Eigen::VectorXd::Zero(kModes);
  // each mode is damped by 2e-8 of its frequency, by one dashpot that couples all
  modes.by_q = Eigen::MatrixXd::Zero(1, kModes);
  modes.out = (2.0 * 1e-8 * modes.omega.transpose()).cwiseSqrt();
  modes.by_q_dot = -modes.out;
  int count = 0;
  EXPECT_TRUE(find_coupled_roots(modes, [&](const CoupledRoot& root) {
    // second order in the damping: 1e-16 of the frequency times the number of modes over their spacing
    EXPECT_NEAR(-root.s.real() / std::abs(root.s), 1e-8, 1e-13);
    ++count;
  }));
  EXPECT_EQ(count, kModes);
}

// What would take minutes is not computed, and that is said at once.
TEST(CoupledRoots, ThatAreTooManyAreNotComputed) {
  constexpr Eigen::Index kModes = 700;
  CoupledModes modes;
  modes.omega = Eigen::VectorXd::LinSpaced(kModes, 1.0, 100.0);
  modes.decay = Eigen::VectorXd::Zero(kModes);
  modes.out = Eigen::MatrixXd::Identity(kModes, kModes);
  modes.by_q = Eigen::MatrixXd::Zero(kModes, kModes);
  modes.by_q_dot = -modes.out;
  EXPECT_FALSE(find_coupled_roots(modes, [](const CoupledRoot&) { FAIL(); }));
}

}  // namespace
}  // namespace freeflex::testing
