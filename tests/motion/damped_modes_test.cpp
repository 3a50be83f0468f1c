// The reported frequency and damping of coupled modes agree with a free decay that the step computes.
#include "core/plan/modes/damped_modes.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <complex>
#include <cstdio>

#include "core/plan/make_plan.hpp"
#include "core/plan/modes/coupled_roots.hpp"
#include "core/plan/modes/free_forces.hpp"
#include "core/plan/modes/modal_coupling.hpp"
#include "core/step/state.hpp"
#include "core/structure/modes/dense/decompositions.hpp"
#include "core/structure/structure.hpp"
#include "tests/motion/coupled_scenes.hpp"
#include "tests/setup/make_scene.hpp"
#include "tests/support/simulation.hpp"

namespace freeflex::testing {
namespace {

using Complex = std::complex<double>;

// Returns the matrix that one tick of the step applies to (size q, q'), where size is the frequency of each
// mode, but at least 1 rad/s. The motions are so small that nonlinear rungs act linearly.
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

// Returns the complex rates of the free motions that the step computes [1/s]. A motion along an eigenvector
// of the matrix of a tick is multiplied by the eigenvalue at each tick.
Eigen::VectorXcd decays_of(const Plan& plan) {
  const Eigen::VectorXcd mu = tick_of(plan).eigenvalues();
  return mu.array().log() / plan.period;
}

Complex printed(const DampedMode& mode) { return {-mode.rate, mode.frequency}; }

struct Largest {
  double off = 0.0, step_error = 0.0, first_order = 0.0;
};

// Compares every reported mode with the nearest free decay. \return the largest of each of three errors
// relative to the decay rate: the difference between the reported and the computed rate, the predicted error
// of the step, and the error of half the diagonal of the damping matrix
Largest compare(const Plan& plan, double rounding) {
  const Eigen::VectorXcd decays = decays_of(plan);
  const std::vector<DampedMode> modes = free_motion(plan).modes;
  const CouplingForces forces = coupling_forces(plan);
  std::vector<bool> is_used(static_cast<std::size_t>(decays.size()), false);
  Largest largest;
  for (std::size_t l = 0; l < modes.size(); ++l) {
    EXPECT_TRUE(modes[l].is_known) << l;
    const Complex s = printed(modes[l]);
    Eigen::Index nearest = 0;
    double off = HUGE_VAL;
    // each decay is compared with one mode only, because each of several equal modes has its own decay
    for (Eigen::Index k = 0; k < decays.size(); ++k)
      if (!is_used[static_cast<std::size_t>(k)] && std::abs(decays[k] - s) < off)
        off = std::abs(decays[k] - s), nearest = k;
    is_used[static_cast<std::size_t>(nearest)] = true;
    const double rate = std::abs(s.real());
    EXPECT_LT(off, 1.3 * modes[l].step_error * rate + rounding * std::abs(s))
        << "mode " << l << ": " << s << " printed, " << decays[nearest] << " measured";
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
  add_link(scene, 3, 30, Dashpot{std::pow(10.0, 6.0 + logarithm(engine))});
  scene.damping.modal_ratio = 0.002;
  scene.rate = rate;
  return scene;
}

// The scenes have up to 114 modes. That is too many for the exact exponential, so dashpots act by splitting,
// which has second order in the step.
TEST(DampedModes, ModesOfRandomScenesMatchAFreeDecay) {
  for (const std::uint64_t seed : {1U, 2U, 3U}) {
    Largest before;
    for (const double rate : {30000.0, 60000.0}) {
      const Plan plan = plan_of(damped_boxes(seed, rate));
      ASSERT_EQ(plan.modal_coupling.path, PlanModalCoupling::Path::kSplit);
      const Largest now = compare(plan, 1e-9);
      std::printf(
          "seed %d, %5.0f Hz: printed and measured differ by %.1e of the decay rate, predicted %.1e; half "
          "the "
          "diagonal is off by %.2f\n",
          static_cast<int>(seed), rate, now.off, now.step_error, now.first_order);
      EXPECT_GT(now.first_order, 0.1) << "the coupling is too weak to test anything";
      if (before.step_error > 0.0) {
        EXPECT_NEAR(before.step_error / now.step_error, 4.0, 1.0);
      }
      before = now;
    }
  }
}

// A square truss has pairs of modes of equal frequency. A dashpot damps one combination of each pair.
TEST(DampedModes, ModesOfEqualFrequencyMatchAFreeDecay) {
  Scene scene = square_truss(12);
  add_link(scene, 1, 30, Dashpot{300.0});
  scene.damping.modal_ratio = 0.003;
  scene.rate = 20000.0;
  const Plan plan = plan_of(scene);
  ASSERT_EQ(plan.modal_coupling.path, PlanModalCoupling::Path::kSplit);
  const Largest now = compare(plan, 1e-9);
  std::printf("equal modes: printed and measured differ by %.1e of the decay rate\n", now.off);
}

TEST(DampedModes, PrintedModesMatchAFreeDecayOnEveryRung) {
  for (const Fidelity rung : {Fidelity::kSeparated, Fidelity::kSpinLoaded, Fidelity::kCoupled,
                              Fidelity::kCorotational, Fidelity::kFull}) {
    Scene scene = random_structure(7, 8);
    for (Link& link : scene.links)
      if (const auto* bar = std::get_if<Bar>(&link.kind)) link.kind = Spring{bar->EA};
    add_link(scene, 0, 5, Dashpot{100.0});
    scene.damping.modal_ratio = 0.002;
    scene.rate = 64000.0;
    scene.fidelity = rung;
    const Largest now = compare(plan_of(scene), 1e-6);
    std::printf(
        "%-11s printed and measured differ by %.1e of the decay rate; half the diagonal is off by %.2f\n",
        name_of(rung), now.off, now.first_order);
    EXPECT_GT(now.first_order, 0.1) << "the coupling is too weak to test anything";
  }
}

// If feedback from the motion of one point acts on another, the damping matrix is not symmetric, and modes
// may grow.
TEST(DampedModes, ModesUnderFeedbackMatchAFreeDecay) {
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
    std::printf("feedback: printed and measured differ by %.1e of the decay rate, predicted %.1e\n", now.off,
                now.step_error);
  }
}

// A mass hangs inside a truss on three springs with a relaxation time of 0.01 s. The scene has 117 modes and
// a damping ratio of 0.005. The truss is stiff and heavy compared with the mass, so the modes of the mass
// have the damping ratio 0.005 + 0.01 omega / 2, up to 0.0216.
TEST(DampedModes, ASloshingMassAmongManyModesHasItsOwnDamping) {
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
  const std::vector<DampedMode> modes = free_motion(plan).modes;
  for (std::size_t l = 0; l < 3; ++l) {
    const double expected = 0.005 + 0.5 * kTime * plan.omega[l];
    // the decay rate is measured from the logarithm of the amplitude over about ten periods
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
    const double measured = std::log(first / last) / ((last_time - first_time) * 1e-3) / plan.omega[l];
    std::printf("slosh mode %zu, %.3f rad/s: damping %.5f printed, %.5f measured, %.5f by hand\n", l + 1,
                plan.omega[l], modes[l].ratio, measured, expected);
    EXPECT_NEAR(modes[l].ratio, expected, 1e-3 * expected);
    EXPECT_NEAR(modes[l].ratio, measured, 2e-3 * measured);
    EXPECT_LT(modes[l].step_error, 1e-3);
  }
}

// Two springs join three masses in a row. A dashpot in parallel with one spring couples the two modes and is
// so strong that one mode does not oscillate.
TEST(DampedModes, AModeThatDoesNotOscillateHasTwoRealEigenvalues) {
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
  std::vector<DampedMode> modes = free_motion(plan).modes;
  std::erase_if(modes, [](const DampedMode& mode) { return mode.rate == 0.0; });  // the hinge
  ASSERT_EQ(modes.size(), 2U);
  // with the two elongations u and w, the equations are u'' = -2 (c u' + k u) + k w, w'' = c u' + k u - 2 k w
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

// Returns the matrix that one tick applies to (size q, q', w), where w is the angular velocity of the body.
// The response to constant loads is subtracted.
Eigen::MatrixXd tick_with_body(const Plan& plan) {
  constexpr double kSmall = 1e-7;  // initial value of each coordinate of (size q, q', w)
  const Eigen::Index n = plan.num_elastic, all = 2 * n + 3;
  Simulation simulation(plan);
  PlanInitial& initial = simulation.plan.initial;
  const auto size_of = [&](Eigen::Index l) { return std::max(plan.omega[static_cast<std::size_t>(l)], 1.0); };
  const auto next = [&] {
    reset_state(simulation.plan, simulation.state);
    simulation.run(1);
    Eigen::VectorXd y(all);
    for (Eigen::Index l = 0; l < n; ++l) {
      y[l] = size_of(l) * simulation.state.q[static_cast<std::size_t>(l)];
      y[n + l] = simulation.state.q_dot[static_cast<std::size_t>(l)];
    }
    for (Eigen::Index k = 0; k < 3; ++k)
      y[2 * n + k] = simulation.state.coupled.w_B[static_cast<std::size_t>(k)];
    return y;
  };
  std::fill(initial.q.begin(), initial.q.end(), 0.0);
  std::fill(initial.q_dot.begin(), initial.q_dot.end(), 0.0);
  const Eigen::VectorXd at_rest = next();
  Eigen::MatrixXd tick(all, all);
  for (Eigen::Index column = 0; column < all; ++column) {
    const Eigen::Index l = column % n;
    double& start = column < n       ? initial.q[static_cast<std::size_t>(l)]
                    : column < 2 * n ? initial.q_dot[static_cast<std::size_t>(l)]
                                     : initial.w_B[static_cast<std::size_t>(column - 2 * n)];
    start = column < n ? kSmall / size_of(l) : kSmall;
    tick.col(column) = (next() - at_rest) / kSmall;
    start = 0.0;
  }
  return tick;
}

// Returns the largest distance between a mode and the nearest eigenvalue of a tick, relative to the magnitude
// of the eigenvalue.
double farthest(const std::vector<DampedMode>& modes, const Eigen::MatrixXd& tick, double period) {
  Eigen::ArrayXcd measured = tick.eigenvalues().array().log() / period;
  double most = 0.0;
  for (const DampedMode& mode : modes) {
    EXPECT_TRUE(mode.is_known);
    Eigen::Index nearest = 0;
    const double off = (measured - printed(mode)).abs().minCoeff(&nearest);
    most = std::max(most, off / std::abs(printed(mode)));
    measured[nearest] = HUGE_VAL;  // each eigenvalue belongs to one mode
  }
  return most;
}

Scene boom_with_wheel(double momentum) {
  Scene scene;
  scene.points = {{"hub", 10.0, {0.0, 0.0, 0.0}, Eigen::Vector3d::Zero()},
                  {"mid", 1.0, {1.0, 0.0, 0.0}, Eigen::Vector3d::Zero()},
                  {"tip", 1.0, {2.0, 0.0, 0.0}, Eigen::Vector3d::Zero()}};
  scene.points[0].inertia = Eigen::Vector3d(1.0, 1.2, 1.5).asDiagonal();
  scene.points[1].inertia = Eigen::Vector3d(0.01, 0.01, 0.01).asDiagonal();
  for (int k = 0; k < 2; ++k) {
    add_link(scene, k, k + 1, Beam{1e5, 100.0, 100.0, 100.0, {0.0, 1.0, 0.0}});
  }
  scene.wheels.push_back({"wheel", 0, Eigen::Vector3d::UnitZ(), momentum, {}});
  scene.fidelity = Fidelity::kCoupled;
  scene.rate = 4000.0;
  publish_everything(scene);
  return scene;
}

// On the rung `coupled` wheels couple the modes with the rotation of the body, so the matrix of a tick
// includes the angular velocity. Below that rung wheels do not affect free modes, so the reported modes are
// those of the structure.
TEST(DampedModes, ModesOfABodyWithWheelsIncludeTheRotationOfTheBody) {
  for (const double momentum : {0.5, 5.0, 50.0}) {
    Scene scene = boom_with_wheel(momentum);
    scene.damping.modal_ratio = 0.01;
    const Plan plan = plan_of(scene);
    FreeMotion motion = free_motion(plan);
    EXPECT_TRUE(motion.unknown.empty()) << motion.unknown;
    ASSERT_GT(motion.nutation, 0.0);
    double shift = 0.0;
    for (std::size_t l = 0; l < motion.modes.size(); ++l)
      shift = std::max(shift, std::abs(motion.modes[l].frequency / plan.omega[l] - 1.0));
    const double off = farthest(motion.modes, tick_with_body(plan), plan.period);
    std::printf("wheel of %4.1f N m s: nutation %.4f Hz, modes shift by up to %.2g, off the tick by %.1e\n",
                momentum, motion.nutation / (2.0 * M_PI), shift, off);
    EXPECT_GT(shift, 1e-4) << "the coupling is too weak to test anything";
    EXPECT_LT(off, 1e-6);  // the bound is the error of order four at 0.13 rad per tick
    scene.fidelity = Fidelity::kSeparated;
    const Plan separated = plan_of(scene);
    EXPECT_FALSE(couples_modes(separated));
  }
}

Scene rocket_of_beams(double thrust, Fidelity rung) {
  Scene scene;
  for (int k = 0; k < 11; ++k)
    scene.points.push_back({"p" + std::to_string(k), 1.0, {1.0 * k, 0.0, 0.0}, Eigen::Vector3d::Zero()});
  for (int k = 0; k < 10; ++k) {
    add_link(scene, k, k + 1, Beam{1e5, 1e3, 1000.0, 1500.0, {0.0, 1.0, 0.0}});
  }
  Load load;
  load.name = "thrust";
  load.axes = Axes::kLocal;
  load.forces = {{0, {thrust, 0.0, 0.0}}};
  scene.loads = {load};
  scene.damping.modal_ratio = 0.005;
  scene.fidelity = rung;
  scene.rate = 2000.0;
  publish_everything(scene);
  return scene;
}

// A constant follower thrust lowers the frequencies. Above a critical thrust, the frequencies of two modes
// merge and the modes grow.
TEST(DampedModes, ModesUnderConstantFollowerForcesMatchAFreeDecay) {
  for (const Fidelity rung : {Fidelity::kSeparated, Fidelity::kCoupled})
    for (const double thrust : {60.0, 1000.0}) {
      const Plan plan = plan_of(rocket_of_beams(thrust, rung));
      const std::vector<DampedMode> modes = free_motion(plan).modes;
      const Eigen::MatrixXd tick = tick_with_body(plan);
      const Eigen::Index n = 2 * Eigen::Index{plan.num_elastic};
      const double off = farthest(modes, tick.topLeftCorner(n, n), plan.period);
      double grows = 0.0;
      for (const DampedMode& mode : modes) grows = std::max(grows, -mode.rate);
      std::printf(
          "%-9s thrust of %4.0f N: first mode %.4f Hz of %.4f, growth %.3f 1/s, off the tick by %.1e\n",
          name_of(rung), thrust, modes[0].frequency / (2.0 * M_PI), plan.omega[0] / (2.0 * M_PI), grows, off);
      EXPECT_LT(off, 1e-4);  // followers act with second order in the step
      EXPECT_EQ(grows > 0.0, thrust > 500.0);
      EXPECT_LT(modes[0].frequency, 0.98 * plan.omega[0]);
    }
}

// A torque acts on a body in local axes. On the rung `coupled`, half of the follower stiffness of this torque
// comes from the load on the rotated body.
TEST(DampedModes, ModesUnderAFollowerTorqueMatchAFreeDecay) {
  for (const Fidelity rung : {Fidelity::kSeparated, Fidelity::kCoupled}) {
    Scene scene = boom_with_wheel(0.0);
    scene.wheels.clear();
    Load load;
    load.name = "motor";
    load.axes = Axes::kLocal;
    load.torques = {{1, {0.0, 0.0, 20.0}}};
    scene.loads = {load};
    scene.damping.modal_ratio = 0.01;
    scene.fidelity = rung;
    const Plan plan = plan_of(scene);
    const std::vector<DampedMode> modes = free_motion(plan).modes;
    const Eigen::Index n = 2 * Eigen::Index{plan.num_elastic};
    const double off = farthest(modes, tick_with_body(plan).topLeftCorner(n, n), plan.period);
    double shift = 0.0;
    for (std::size_t l = 0; l < modes.size(); ++l)
      shift = std::max(shift, std::abs(modes[l].frequency / plan.omega[l] - 1.0));
    std::printf("%-9s follower torque: modes shift by up to %.2g, off the tick by %.1e\n", name_of(rung),
                shift, off);
    EXPECT_GT(shift, 5e-4) << "the coupling is too weak to test anything";
    EXPECT_LT(shift, 0.01);  // modes on which no force acts keep their eigenvalues and their order
    EXPECT_LT(off, 1e-5);    // the method has second order in the step
  }
}

TEST(DampedModes, AFollowerForceThatMakesAModeGrowGivesAWarning) {
  for (const Fidelity rung : {Fidelity::kSeparated, Fidelity::kCoupled})
    for (const double thrust : {60.0, 1000.0}) {
      const Scene scene = rocket_of_beams(thrust, rung);
      Faults faults;
      const auto structure = build_structure(scene, faults);
      ASSERT_TRUE(structure && make_full_plan(scene, *structure, scene.fidelity, faults));
      const bool warns = std::any_of(faults.begin(), faults.end(), [](const Fault& fault) {
        return fault.message.find("load 'thrust', which rotates with the structure, makes a mode grow by") !=
               std::string::npos;
      });
      EXPECT_EQ(warns, thrust > 500.0) << name_of(rung) << ", " << thrust;
    }
}

// The linear equations do not contain the geometric stiffness that bars at true geometry have from their
// internal forces.
TEST(DampedModes, ModesAreUnknownIfFollowerForcesStrainExactBars) {
  Scene scene = square_truss(3);
  Load load;
  load.name = "thrust";
  load.axes = Axes::kLocal;
  load.forces = {{0, {0.0, 0.0, 10.0}}};
  scene.loads = {load};
  scene.fidelity = Fidelity::kCorotational;
  publish_everything(scene);
  const FreeMotion motion = free_motion(plan_of(scene));
  for (const DampedMode& mode : motion.modes) EXPECT_FALSE(mode.is_known);
  EXPECT_EQ(motion.unknown,
            "load 'thrust' follows the structure, and it strains bars at their true geometry");
}

// The scene has masses in a row on springs, and some springs are viscous. Two real eigenvalues may have most
// of their energy in different modes, but every mode must still get an eigenvalue.
TEST(DampedModes, EachModeOfASmallSceneHasAnEigenvalue) {
  Scene scene;
  for (int k = 0; k < 4; ++k)
    scene.points.push_back({"p" + std::to_string(k), 1.0, {1.0 * k, 0.0, 0.0}, Eigen::Vector3d::Zero()});
  const double viscous[] = {0.3, 0.0, 0.05};
  for (int k = 0; k < 3; ++k) {
    Link link;
    link.name = "s" + std::to_string(k);
    link.points = {k, k + 1};
    link.kind = Spring{100.0 * (k + 1)};
    link.viscous = viscous[k];
    scene.links.push_back(link);
  }
  publish_everything(scene);
  scene.rate = 2000.0;
  const Plan plan = plan_of(scene);
  std::vector<DampedMode> modes = free_motion(plan).modes;
  modes.erase(modes.begin(), modes.begin() + 4);  // mechanisms
  ASSERT_EQ(modes.size(), 3U);
  EXPECT_LT(farthest(modes, tick_of(plan), plan.period), 1e-6);
  // the expected eigenvalues are the pairs -1.4917 +- 13.040 i and -14.32 +- 22.15 i, and the slower of the
  // real eigenvalues -3.66 and -54.7
  std::vector<double> frequencies;
  for (const DampedMode& mode : modes) frequencies.push_back(mode.frequency);
  std::sort(frequencies.begin(), frequencies.end());
  EXPECT_EQ(frequencies[0], 0.0);
  EXPECT_NEAR(frequencies[1], 13.040, 1e-3);
  EXPECT_NEAR(frequencies[2], 22.15, 5e-3);
}

// A feedback that increases a displacement gives real eigenvalues of both signs.
TEST(DampedModes, AModeThatDivergesIsReportedAsGrowing) {
  for (const double damping : {0.0, 20.0}) {
    Scene scene;
    for (int k = 0; k < 2; ++k)
      scene.points.push_back({"p" + std::to_string(k), 1.0, {1.0 * k, 0.0, 0.0}, Eigen::Vector3d::Zero()});
    Link link;
    link.name = "s";
    link.points = {0, 1};
    link.kind = Spring{100.0};
    scene.links = {link};
    if (damping > 0.0) {
      link.name = "d";
      link.kind = Dashpot{damping};
      scene.links.push_back(link);
    }
    Feedback feedback;
    feedback.name = "away";
    feedback.sensor = feedback.point = 1;
    feedback.displacement_gain = 500.0 * Eigen::Vector3d::UnitX() * Eigen::RowVector3d::UnitX();
    scene.feedbacks = {feedback};
    publish_everything(scene);
    scene.rate = 1000.0;
    const std::vector<DampedMode> modes = free_motion(plan_of(scene)).modes;
    ASSERT_EQ(modes.size(), 1U);
    // u is the elongation, and each point moves by u / 2, so u'' = (-200 + 250) u - 2 damping u'
    EXPECT_EQ(modes[0].frequency, 0.0);
    EXPECT_NEAR(modes[0].rate, damping - std::sqrt(damping * damping + 50.0), 1e-9);
    EXPECT_EQ(modes[0].ratio, -1.0);
  }
}

// A mode without coupling has its given damping ratio and the damped frequency of a single oscillator.
TEST(DampedModes, UncoupledModesHaveTheFrequencyAndDampingOfSingleOscillators) {
  Scene scene = random_structure(3, 5);
  scene.damping.modal_ratio = 0.1;
  const Plan plan = plan_of(scene);
  for (std::size_t l = 0; const DampedMode& mode : free_motion(plan).modes) {
    EXPECT_NEAR(mode.ratio, 0.1, 1e-15);
    EXPECT_NEAR(mode.frequency, plan.omega[l] * std::sqrt(0.99), 1e-15 * plan.omega[l]);
    ++l;
  }
}

// A damping ratio of 1e-8 keeps its digits although stiffnesses differ by a factor of 1e12.
TEST(CoupledRoots, LightDampingKeepsItsDigitsDespiteStiffModes) {
  constexpr Eigen::Index kModes = 100;
  CoupledModes modes;
  modes.omega =
      Eigen::VectorXd::LinSpaced(kModes, 0.0, 6.0).unaryExpr([](double x) { return std::pow(10.0, x); });
  modes.decay = Eigen::VectorXd::Zero(kModes);
  // a single dashpot couples all modes and gives each a damping ratio of 1e-8
  modes.by_q = Eigen::MatrixXd::Zero(1, kModes);
  modes.out = (2.0 * 1e-8 * modes.omega.transpose()).cwiseSqrt();
  modes.by_q_dot = -modes.out;
  int count = 0;
  EXPECT_TRUE(find_coupled_roots(modes, [&](const CoupledRoot& root) {
    // terms of second order in the damping are 1e-16 of the frequency, times the number of modes over their
    // spacing
    EXPECT_NEAR(-root.s.real() / std::abs(root.s), 1e-8, 1e-13);
    ++count;
  }));
  EXPECT_EQ(count, kModes);
}

// A computation that would take minutes is refused before it starts.
TEST(CoupledRoots, TooManyRootsAreNotComputed) {
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
