// Ball joints between rigid bodies on the rung `corotational`: the frequencies of spinning chains in closed
// form, and motions against the Cartesian reference, which holds the joints by multipliers.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>
#include <vector>

#include "core/motion.hpp"
#include "core/plan/make_plan.hpp"
#include "core/step/readout.hpp"
#include "tests/reference/relative_equilibria.hpp"
#include "tests/reference/structures.hpp"
#include "tests/reference/true_geometry.hpp"
#include "tools/verification/reference/integrate.hpp"

namespace freeflex::testing {
namespace {

using Eigen::Vector3d;

Vector3d vector_at(const Vec3& v) { return {v[0], v[1], v[2]}; }

// Equal masses on a line, with a rod between each and the next.
Scene chain(int num_masses) {
  Scene scene;
  for (int i = 0; i < num_masses; ++i) add_point(scene, 1.3, {0.7 * i, 0.0, 0.0});
  for (int i = 1; i < num_masses; ++i) add_link(scene, {i - 1, i}, Rigid{});
  scene.fidelity = Fidelity::kCorotational;
  scene.rate = 1000.0;
  return scene;
}

// A chain of equal masses that spins about an axis across it has the frequencies Omega sqrt(n (n + 1) / 2)
// out of the plane of the spin and Omega sqrt(n (n + 1) / 2 - 1) in the plane, n = 2, 3, ... (THEORY 12.123).
TEST(BallJoints, ASpinningChainHasTheFrequenciesInClosedForm) {
  for (const int num_masses : {3, 4, 6}) {
    const double spin = 2.3;
    const RelativeEquilibrium found = equilibrium_of(chain(num_masses), {0.0, 0.0, spin});
    ASSERT_TRUE(found.error.empty()) << found.error;
    std::vector<double> expected;
    for (int n = 2; n < num_masses; ++n)
      for (const double less : {0.0, 1.0}) expected.push_back(spin * std::sqrt(0.5 * n * (n + 1) - less));
    std::ranges::sort(expected);
    std::vector<double> rates;
    for (const SmallMotion& each : found.motions) {
      rates.push_back(each.rate.imag());
      EXPECT_LT(std::abs(each.rate.real()), 1e-7);
    }
    std::ranges::sort(rates);
    ASSERT_EQ(rates.size(), expected.size());
    for (std::size_t k = 0; k < rates.size(); ++k) {
      std::printf("%d masses: %.9f, expected %.9f\n", num_masses, rates[k], expected[k]);
      EXPECT_NEAR(rates[k], expected[k], 1e-6 * expected[k]);
    }
  }
}

// Returns the positions at the end of a second by the reference.
Eigen::Matrix3Xd reference_positions(const Scene& scene, double end) {
  ReferenceOptions options;
  options.tolerance = 1e-12;
  const double times[] = {end};
  const ReferenceRun run = integrate(true_geometry_of(scene), times, options);
  EXPECT_TRUE(run.error.empty()) << run.error;
  return run.states[0].p_W;
}

// The positions of all points after `end` [s].
Eigen::Matrix3Xd positions_of(const Scene& scene, double end) {
  const Plan plan = compile(scene);
  Motion motion(plan, kMotionAlone);
  const int num_ticks = static_cast<int>(std::lround(end * scene.rate));
  for (int k = 0; k < num_ticks; ++k) {
    const StepStatus status = motion.advance().status;
    EXPECT_EQ(status, StepStatus::kOk) << k;
    if (status != StepStatus::kOk) break;
  }
  Eigen::Matrix3Xd p(3, static_cast<Eigen::Index>(scene.points.size()));
  for (int i = 0; i < static_cast<int>(scene.points.size()); ++i)
    p.col(i) = vector_at(read_point(plan, motion.state(), i).p_W);
  return p;
}
double distance(const Eigen::Matrix3Xd& a, const Eigen::Matrix3Xd& b) {
  return (a - b).colwise().norm().maxCoeff();
}

// A tumbling tree of bodies, a rod and springs, pushed at a joint and beside it, against the reference. The
// order of the step is 4. Measured: 4e-8, 3e-9, 2e-10 and 1e-11 m without loads.
TEST(BallJoints, ATumblingTreeConvergesToTheReference) {
  for (const bool is_pushed : {false, true}) {
    Scene scene = tree(2.0);
    if (is_pushed) {
      push(scene, 3, Axes::kWorld, {20.0, -30.0, 10.0});
      push(scene, 4, Axes::kWorld, {0.0, 5.0, -8.0});
    }
    const Eigen::Matrix3Xd expected = reference_positions(scene, 1.0);
    double before = 0.0;
    for (const double rate : {125.0, 250.0, 500.0, 1000.0}) {
      scene.rate = rate;
      const double off = distance(positions_of(scene, 1.0), expected);
      std::printf("%s %4.0f Hz: off by %.1e m\n", is_pushed ? "pushed" : "free", rate, off);
      if (before > 1e-9) {
        EXPECT_LT(off, 0.1 * before);
      }
      before = off;
    }
    EXPECT_LT(before, 2e-10);
  }
}

// Beams on bodies with a joint. At 250 Hz the filter acts on the axial modes.
TEST(BallJoints, BodiesWithBeamsConvergeToTheReference) {
  Scene scene = tree(2.0);
  scene.links.erase(scene.links.end() - 4, scene.links.end());
  for (const int i : {1, 4}) add_link(scene, i, 7, kBeam);
  scene.initial.angular_velocity = {0.2, 0.3, 0.6};
  push(scene, 7, Axes::kWorld, {2.0, -4.0, 3.0});
  const Eigen::Matrix3Xd expected = reference_positions(scene, 0.5);
  for (const double rate : {250.0, 1000.0, 4000.0}) {
    scene.rate = rate;
    const double off = distance(positions_of(scene, 0.5), expected);
    std::printf("%4.0f Hz: off by %.1e m\n", rate, off);
    EXPECT_LT(off, rate < 1000.0 ? 6e-5 : rate < 4000.0 ? 5e-8 : 2e-10);  // 2e-5, 2e-8 and 6e-11
  }
}

// A massless joint is the limit of a joint of small mass.
TEST(BallJoints, AMasslessJointIsTheLimitOfALightOne) {
  const Eigen::Matrix3Xd limit = positions_of(tree(0.0), 0.5);
  const double small = distance(positions_of(tree(1e-4), 0.5), limit),
               smaller = distance(positions_of(tree(1e-6), 0.5), limit);
  std::printf("off by %.2e m at 1e-4 kg and %.2e m at 1e-6 kg\n", small, smaller);
  EXPECT_NEAR(small / smaller, 100.0, 1.0);
}

// Two bodies with inertia on rigid links move like bodies of six point masses with the same inertia.
TEST(BallJoints, BodiesWithInertiaMoveLikeThoseOfPointMasses) {
  const auto scene_of = [](bool has_inertia) {
    Scene scene;
    add_point(scene, 0.0, {1.0, 0.2, 0.0});
    for (const Vector3d& centre : {Vector3d(0.0, 0.0, 0.0), Vector3d(2.0, 0.0, 0.3)}) {
      const int body = add_point(scene, has_inertia ? 6.0 : 0.0, centre);
      const double arms[] = {0.3, 0.2, 0.4};
      std::vector<int> points{body, 0};
      Vector3d inertia = Vector3d::Zero();
      for (int axis = 0; axis < 3; ++axis) {
        const Vector3d arm = arms[axis] * Vector3d::Unit(axis);
        inertia += 2.0 * (Vector3d::Ones() * arm.squaredNorm() - arm.cwiseProduct(arm));
        for (const double sign : {1.0, -1.0})
          if (!has_inertia) points.push_back(add_point(scene, 1.0, centre + sign * arm));
      }
      if (has_inertia) scene.points[index(body)].inertia = inertia.asDiagonal();
      add_link(scene, points, Rigid{});
    }
    scene.fidelity = Fidelity::kCorotational;
    scene.rate = 1000.0;
    scene.initial.angular_velocity = {1.0, 0.7, 0.4};
    push(scene, 0, Axes::kWorld, {1.0, 8.0, -5.0});
    return scene;
  };
  const Eigen::Matrix3Xd a = positions_of(scene_of(true), 1.0), b = positions_of(scene_of(false), 1.0);
  const double off =
      std::max({(a.col(0) - b.col(0)).norm(), (a.col(1) - b.col(1)).norm(), (a.col(2) - b.col(8)).norm()});
  std::printf("off by %.1e m\n", off);
  EXPECT_LT(off, 1e-12);
}

// Four rods in a closed loop, with springs across it, against the reference.
TEST(BallJoints, AClosedLoopOfRodsConvergesToTheReference) {
  Scene scene;
  for (const Vector3d& p :
       {Vector3d(0.0, 0.0, 0.0), Vector3d(1.0, 0.0, 0.1), Vector3d(1.1, 1.0, 0.0), Vector3d(0.0, 0.9, 0.2)})
    add_point(scene, 1.0 + p.x(), p);
  for (int i = 0; i < 4; ++i) add_link(scene, {i, (i + 1) % 4}, Rigid{});
  add_link(scene, 0, 2, Spring{30.0});
  add_link(scene, 1, 3, Spring{20.0});
  scene.fidelity = Fidelity::kCorotational;
  scene.initial.angular_velocity = {0.5, 0.3, 1.5};
  scene.rate = 1000.0;
  const double off = distance(positions_of(scene, 1.0), reference_positions(scene, 1.0));
  std::printf("off by %.1e m\n", off);
  EXPECT_LT(off, 1e-10);
}

// Over 1e5 ticks of a tumbling tree, the momenta of the points and the lengths of the rigid links stay to
// rounding, and the energy by the order of the step. The published accelerations are the derivatives of the
// velocities.
TEST(BallJoints, MomentaEnergyAndLengthsStay) {
  Scene scene = tree(2.0);
  for (Link& link : scene.links)
    if (Spring* spring = std::get_if<Spring>(&link.kind)) spring->stiffness *= 4.0;
  scene.initial.angular_velocity = {0.15, 0.5, 1.0};
  const Plan plan = compile(scene);
  Motion motion(plan, kMotionAlone);
  const auto energy = [&] {
    const Invariants all = read_invariants(plan, motion.state());
    return all.kinetic_rigid + all.kinetic_elastic + all.potential;
  };
  ASSERT_EQ(motion.advance().status, StepStatus::kOk);
  const double start = energy();
  double drift = 0.0, gap = 0.0, linear = 0.0, angular = 0.0;
  Vector3d first = Vector3d::Zero();
  for (int k = 0; k < 100'000; ++k) {
    ASSERT_EQ(motion.advance().status, StepStatus::kOk) << k;
    if (k % 100 != 0) continue;
    drift = std::max(drift, std::abs(energy() - start));
    Vector3d P = Vector3d::Zero(), H = Vector3d::Zero();
    std::vector<Vector3d> x;
    for (int i = 0; i < 9; ++i) {
      const PointState at = read_point(plan, motion.state(), i);
      x.push_back(vector_at(at.p_W));
      P += scene.points[index(i)].mass * vector_at(at.v_W);
      H += scene.points[index(i)].mass * x.back().cross(vector_at(at.v_W));
    }
    if (k == 0) first = H;
    linear = std::max(linear, P.norm()), angular = std::max(angular, (H - first).norm() / first.norm());
    for (const auto& [i, j] : {std::pair(0, 3), {3, 4}, {3, 5}, {5, 6}})
      gap =
          std::max(gap, std::abs((x[index(i)] - x[index(j)]).norm() -
                                 (scene.points[index(i)].position - scene.points[index(j)].position).norm()));
  }
  std::printf("energy %.1e of %.2f J, momenta %.1e kg m/s and %.1e, lengths %.1e m\n", drift, start, linear,
              angular, gap);
  EXPECT_LT(drift, 1e-6 * start);
  EXPECT_LT(linear, 1e-12);
  EXPECT_LT(angular, 1e-13);
  EXPECT_LT(gap, 1e-14);
}

TEST(BallJoints, PublishedAccelerationsAreTheRatesOfVelocities) {
  Scene scene = tree(2.0);
  push(scene, 3, Axes::kWorld, {20.0, -30.0, 10.0});
  scene.rate = 8000.0;
  const Plan plan = compile(scene);
  Motion motion(plan, kMotionAlone);
  std::array<Eigen::Matrix3Xd, 3> v, a;
  for (int k = 0; k < 2003; ++k) {
    ASSERT_EQ(motion.advance().status, StepStatus::kOk);
    if (k < 2000) continue;
    v[index(k - 2000)].resize(3, 9), a[index(k - 2000)].resize(3, 9);
    for (int i = 0; i < 9; ++i) {
      const PointState at = read_point(plan, motion.state(), i);
      v[index(k - 2000)].col(i) = vector_at(at.v_W);
      a[index(k - 2000)].col(i) = vector_at(at.a_W);
    }
  }
  const double off = ((v[2] - v[0]) * (0.5 * scene.rate) - a[1]).colwise().norm().maxCoeff();
  std::printf("off by %.1e of %.1f m/s^2\n", off, a[1].colwise().norm().maxCoeff());
  EXPECT_LT(off, 1e-5);
}

// What cannot be done is refused by name.
TEST(BallJoints, WhatTheyCannotDoIsRefused) {
  const auto message = [](const Scene& scene) {
    Faults faults;
    EXPECT_FALSE(make_full_plan(scene, build(scene), Fidelity::kCorotational, faults).has_value());
    return faults.empty() ? std::string() : faults.back().message;
  };
  Scene hinge = tree(2.0);
  hinge.links[1].points = {3, 2, 4, 5, 8};
  EXPECT_NE(message(hinge).find("constrains a motion that other ball joints constrain already"),
            std::string::npos)
      << message(hinge);
  Scene beam = tree(2.0);
  add_link(beam, 3, 7, kBeam);
  EXPECT_NE(message(beam).find("point 'p3' is a ball joint of rigid links and turns a beam"),
            std::string::npos)
      << message(beam);
  Scene spread = tree(2.0);
  Beam with_mass = kBeam;
  with_mass.mass_per_length = 1.0;
  add_link(spread, 4, 7, with_mass);
  EXPECT_NE(message(spread).find("a ball joint, which cannot be combined with"), std::string::npos)
      << message(spread);
  for (int kind = 0; kind < 3; ++kind) {  // each was taken before, and wrong by up to 0.8 of the displacement
    Scene damped = tree(2.0);
    if (kind == 0) damped.damping.beta = 0.1;
    if (kind == 1) damped.damping.modal_ratio = 0.01;
    if (kind == 2) add_link(damped, 4, 7, Dashpot{1.0});
    EXPECT_NE(message(damped).find("cannot be combined with dashpots or damping"), std::string::npos)
        << message(damped);
  }
  // two masses, and the massless joint beside their line
  Scene beside;
  add_point(beside, 10.0, {0.0, 0.0, 0.0});
  beside.points[0].inertia.setIdentity();
  add_point(beside, 0.0, {0.5, 0.0, 0.0});
  add_point(beside, 1.0, {1.0, 0.3, 0.0});
  add_point(beside, 1.0, {1.0, -0.3, 0.0});
  add_link(beside, {0, 1}, Rigid{});
  add_link(beside, {1, 2, 3}, Rigid{});
  EXPECT_NE(message(beside).find("has a point beside this line"), std::string::npos) << message(beside);
  Scene light = tree(2.0);
  light.points[5].mass = 0.0;
  EXPECT_NE(message(light).find("give mass to a second point"), std::string::npos) << message(light);
}

// A chain of three masses that folds loses the axes of the frame, which is a fault by name.
TEST(BallJoints, AChainThatFoldsIsAFault) {
  Scene scene = chain(3);
  scene.initial.points = {{0, Vector3d::Zero(), {0.0, 1.0, 0.0}},
                          {1, Vector3d::Zero(), {0.0, -2.0, 0.0}},
                          {2, Vector3d::Zero(), {0.0, 1.0, 0.0}}};
  const Plan plan = compile(scene);
  Motion motion(plan, kMotionAlone);
  StepReport report;
  int tick = 0;
  for (; tick < 3000 && report.status == StepStatus::kOk; ++tick) report = motion.advance();
  std::printf("status %d at tick %d: %s\n", static_cast<int>(report.status), tick,
              lost_shape_text(plan, report, tick).c_str());
  EXPECT_TRUE(report.status == StepStatus::kNoFrame || report.status == StepStatus::kOpenJoint ||
              report.status == StepStatus::kTurnedTooFar);
}

}  // namespace
}  // namespace freeflex::testing
