// These tests check the effect of linear feedback on the modes and the body, and the messages on gains that
// are too large.
#include <gtest/gtest.h>

#include <complex>
#include <cstdio>

#include "core/plan/make_plan.hpp"
#include "core/structure/structure.hpp"
#include "tests/motion/coupled_scenes.hpp"
#include "tests/motion/linear_system.hpp"
#include "tests/support/simulation.hpp"
#include "tests/support/structures.hpp"

namespace freeflex::testing {
namespace {

void add_feedback(Scene& scene, int point, int sensor, const Eigen::Matrix3d& displacement,
                  const Eigen::Matrix3d& velocity) {
  Feedback feedback;
  feedback.name = "f" + std::to_string(scene.feedbacks.size());
  feedback.point = point;
  feedback.sensor = sensor;
  feedback.displacement_gain = displacement;
  feedback.velocity_gain = velocity;
  scene.feedbacks.push_back(feedback);
}

/// Returns all faults that are found up to the full plan of the scene.
Faults faults_on_its_rung(const Scene& scene) {
  Faults faults;
  if (const auto structure = build_structure(scene, faults))
    make_full_plan(scene, *structure, scene.fidelity, faults);
  return faults;
}

bool has_words(const Faults& faults, Fault::Severity severity, const std::string& words) {
  for (const Fault& fault : faults)
    if (fault.severity == severity && fault.message.find(words) != std::string::npos) return true;
  return false;
}

// Two points lie on a line with a spring between them. The force on the second point is proportional to the
// displacement, velocity and acceleration of that point, so the motion has a closed form. Here x = V_2 - V_1,
// so V_2 = x m_1 / M, and mu is the reduced mass.
struct FeedbackRig {
  double m1 = 3.0, m2 = 2.0, k = 500.0, g = -200.0, c = -0.8, a = -0.5;
  Scene scene() const {
    Scene scene = spring_pair(m1, m2, 1.0, k);
    publish_everything(scene);
    Feedback feedback;
    feedback.name = "actuator";
    feedback.point = feedback.sensor = 1;
    feedback.displacement_gain(0, 0) = g;
    feedback.velocity_gain(0, 0) = c;
    feedback.acceleration_gain(0, 0) = a;
    scene.feedbacks.push_back(feedback);
    const double x = 1e-4, M = m1 + m2;
    scene.initial.points = {{0, {-x * m2 / M, 0.0, 0.0}, Eigen::Vector3d::Zero()},
                            {1, {x * m1 / M, 0.0, 0.0}, Eigen::Vector3d::Zero()}};
    return scene;
  }
};

TEST(Feedback, TheElasticCoordinateAndTheBodyMoveExactly) {
  const FeedbackRig rig;
  // mu x'' + k x = (m1 / M) f, f = (m1 / M) (g x + c x' + a x''), because only the fraction m1 / M of the
  // force strains the spring
  const double M = rig.m1 + rig.m2, mu = rig.m1 * rig.m2 / M, s = rig.m1 / M;
  const double mass = mu - s * s * rig.a, damping = -s * s * rig.c, stiffness = rig.k - s * s * rig.g;
  const double decay = damping / (2.0 * mass), wd = std::sqrt(stiffness / mass - decay * decay);
  const auto x_at = [&](double t) {
    return 1e-4 * std::exp(-decay * t) * (std::cos(wd * t) + decay / wd * std::sin(wd * t));
  };
  for (const double rate : {1000.0, 2000.0, 4000.0}) {
    Scene scene = rig.scene();
    scene.rate = rate;
    Simulation simulation(scene);
    simulation.run(static_cast<std::int64_t>(rate));
    const Eigen::Matrix3Xd V = simulation.displacements_B();
    EXPECT_NEAR(V(0, 1) - V(0, 0), x_at(1.0), 1e-12 * 1e-4);
    // the momentum of the body, M v, is the integral of f = (mu x'' + k x) / s, here by Simpson's rule
    double impulse = 0.0;
    const int n = 20000;
    const auto force = [&](double t) {
      const double x = x_at(t);
      const double x_dot = -1e-4 * std::exp(-decay * t) * (wd + decay * decay / wd) * std::sin(wd * t);
      return (mu * (-damping * x_dot - stiffness * x) / mass + rig.k * x) / s;
    };
    for (int i = 0; i <= n; ++i)
      impulse += (i == 0 || i == n ? 1.0 : i % 2 == 1 ? 4.0 : 2.0) * force(1.0 * i / n);
    impulse /= 3.0 * n;
    const double error = std::abs(simulation.state.v_WB[0] - impulse / M);
    std::printf("feedback, h = %g s: velocity of the centre of mass off by %.2e of %.2e m/s\n", 1.0 / rate,
                error, std::abs(impulse / M));
    // each of thousands of ticks has one rounding error
    EXPECT_LT(error, 1e-12 * std::abs(impulse / M));
  }
}

// A spring joins two masses, and a force c V_1' acts on the first mass. The force decays within a tick if |c|
// is 1e3 N s/m or more. With x = V_2 - V_1 and V_1 = -m2 x / M, the motion is x'' = m2 / (M m1) c x' - k x /
// mu, and M v = -c m2 x / M from x(0) = 0.
TEST(Feedback, FeedbackThatDecaysWithinATickGivesTheBodyItsExactMomentum) {
  using Complex = std::complex<long double>;
  const long double m1 = 1.5L, m2 = 2.5L, k = 400.0L, M = m1 + m2, rate0 = 1e-3L, t = 0.1L;
  for (const double gain : {-1e1, -1e2, -1e3, -1e4, -1e6, -1e8}) {
    Scene scene = spring_pair(static_cast<double>(m1), static_cast<double>(m2), 1.0, static_cast<double>(k));
    publish_everything(scene);
    Eigen::Matrix3d velocity = Eigen::Matrix3d::Zero();
    velocity(0, 0) = gain;
    add_feedback(scene, 0, 0, Eigen::Matrix3d::Zero(), velocity);
    scene.initial.points = {{0, Eigen::Vector3d::Zero(), {static_cast<double>(-m2 / M * rate0), 0.0, 0.0}},
                            {1, Eigen::Vector3d::Zero(), {static_cast<double>(m1 / M * rate0), 0.0, 0.0}}};
    Simulation simulation(scene);
    simulation.run(100);
    // these are the roots of s^2 + b s + w2, and the smaller root is computed from the product of the roots,
    // because it then keeps its digits
    const long double b = -static_cast<long double>(gain) * m2 / (M * m1), w2 = k * M / (m1 * m2);
    const Complex fast = -0.5L * (b + std::sqrt(Complex(b * b - 4.0L * w2))), slow = w2 / fast;
    const Complex e_slow = std::exp(slow * t), e_fast = std::exp(fast * t);
    const long double x = (rate0 * (e_slow - e_fast) / (slow - fast)).real();
    const long double integral =
        (rate0 * ((e_slow - 1.0L) / slow - (e_fast - 1.0L) / fast) / (slow - fast)).real();
    const long double share = -static_cast<long double>(gain) * m2 / (M * M);
    const auto v = static_cast<double>(share * x), p = static_cast<double>(share * integral);
    std::printf("gain %g N s/m: v %.10e m/s off by %.1e, p off by %.1e of it\n", gain, v,
                std::abs(simulation.state.v_WB[0] / v - 1.0), std::abs(simulation.state.p_WB[0] / p - 1.0));
    // the bound allows for rounding errors of 100 ticks and of the exponential of 4e4, which needs 17
    // squarings
    EXPECT_NEAR(simulation.state.v_WB[0], v, 1e-12 * std::abs(v)) << gain;
    EXPECT_NEAR(simulation.state.p_WB[0], p, 1e-12 * std::abs(p)) << gain;
  }
}

/// Holds the position and velocity of the centre of mass and the angular momentum of small motions, from the
/// linear system of the total displacements u of the points. V is u minus the rigid motion of u. This rigid
/// motion is the motion of the body.
struct LinearBody {
  Eigen::Vector3d p, v, H;
  Eigen::VectorXd V;  // elastic displacements
};

LinearBody linear_body(const Scene& scene, long double seconds) {
  const LinearSystem system(scene);
  const Eigen::Index n = system.mass.size();
  Eigen::Matrix<long double, 3, Eigen::Dynamic> r(3, n / 3);
  for (Eigen::Index i = 0; i < n / 3; ++i)
    r.col(i) = scene.points[static_cast<std::size_t>(i)].position.cast<long double>();
  const long double mass = system.mass.sum() / 3.0L;
  WideMatrix translation(n, 3), rotation(n, 3);
  for (Eigen::Index i = 0; i < n / 3; ++i) translation.middleRows<3>(3 * i).setIdentity();
  const WideMatrix weight = system.mass.asDiagonal();
  r.colwise() -= Eigen::Matrix<long double, 3, 1>(translation.transpose() * weight * r.reshaped() / mass);
  for (Eigen::Index i = 0; i < n / 3; ++i)
    rotation.middleRows<3>(3 * i) << 0.0L, r(2, i), -r(1, i), -r(2, i), 0.0L, r(0, i), r(1, i), -r(0, i),
        0.0L;
  const WideMatrix inertia = rotation.transpose() * weight * rotation;
  const WideMatrix elastic = WideMatrix::Identity(n, n) -
                             translation * translation.transpose() * weight / mass -
                             rotation * inertia.inverse() * rotation.transpose() * weight;
  WideMatrix A = system.generator();
  for (const Feedback& feedback : scene.feedbacks) {
    const Eigen::Index to = n + 3 * feedback.point;
    const long double m = system.mass[3 * feedback.point];
    const WideMatrix sensed = elastic.middleRows<3>(3 * feedback.sensor);
    A.block(to, 0, 3, n) += feedback.displacement_gain.cast<long double>() * sensed / m;
    A.block(to, n, 3, n) += feedback.velocity_gain.cast<long double>() * sensed / m;
  }
  const WideVector y = system.advance(A, seconds, start_of(scene), WideVector::Zero(n));
  const WideMatrix momentum = weight * y.tail(n);
  return {(translation.transpose() * weight * y.head(n) / mass).cast<double>(),
          (translation.transpose() * momentum / mass).cast<double>(),
          (rotation.transpose() * momentum).cast<double>(), (elastic * y.head(n)).cast<double>()};
}

// Forces on two points depend on the motion of other points. The velocity, the angular momentum and the path
// of the body agree with the linear system.
TEST(Feedback, GivesTheBodyTheMomentaOfTheLinearSystem) {
  for (const double size : {1.0, 1e3, 1e6}) {
    Scene scene = octahedron(1e4);
    publish_everything(scene);
    stretch(scene, 1e-13, 11);  // the motion is so small that the rotation of the body is negligible
    add_feedback(scene, 1, 1, Eigen::Matrix3d::Zero(), Eigen::Vector3d(-1.0, -2.0, -0.5).asDiagonal() * size);
    Eigen::Matrix3d stiffness, damping;
    stiffness << -20.0, 3.0, 0.0, 3.0, -10.0, 1.0, 0.0, 1.0, -30.0;
    damping << -1.0, 0.2, 0.1, 0.0, -2.0, 0.3, 0.2, 0.0, -1.0;
    add_feedback(scene, 3, 3, stiffness, size * damping);
    const LinearBody exact = linear_body(scene, 0.2L);
    Simulation simulation(scene);
    const Vec3 p_start = simulation.state.p_WB;
    simulation.run(200);
    const auto difference = [](const Vec3& found, const Eigen::Vector3d& wanted) {
      return (Eigen::Vector3d(found[0], found[1], found[2]) - wanted).norm() / wanted.norm();
    };
    const double v = difference(simulation.state.v_WB, exact.v),
                 H = difference(simulation.state.H_W, exact.H);
    const double p = difference({simulation.state.p_WB[0] - p_start[0], simulation.state.p_WB[1] - p_start[1],
                                 simulation.state.p_WB[2] - p_start[2]},
                                exact.p);
    std::printf("gains times %g: v off by %.1e, p by %.1e, H by %.1e\n", size, v, p, H);
    // terms of second order in the motion remain, because the body rotates by some 1e-11 rad
    EXPECT_LT(std::max({v, p, H}), 1e-10) << size;
  }
}

// There are too many modes for the exact exponential, so they are advanced by splitting. The velocity of the
// centre of mass has an error of second order, and it stays bounded for a gain of 1e6 N s/m.
TEST(Feedback, TheVelocityOfTheCentreOfMassHasSecondOrderErrorIfFeedbackIsSplit) {
  const auto error_of = [](double gain, double rate) {
    Scene scene = two_boxes();
    publish_everything(scene);
    stretch(scene, 1e-10, 9);
    scene.rate = rate;
    add_feedback(scene, 2, 2, Eigen::Matrix3d::Zero(), -gain * Eigen::Matrix3d::Identity());
    Simulation simulation(scene);
    EXPECT_EQ(simulation.plan.modal_coupling.path, PlanModalCoupling::Path::kSplit);
    simulation.run(std::llround(0.05 * rate));
    const Eigen::Vector3d exact = linear_body(scene, 0.05L).v;
    const Vec3& v = simulation.state.v_WB;
    const double error = (Eigen::Vector3d(v[0], v[1], v[2]) - exact).norm() / exact.norm();
    std::printf("split, gain %g N s/m, h = %g s: velocity of the centre of mass off by %.2e of it\n", gain,
                1.0 / rate, error);
    return error;
  };
  const double coarse = error_of(100.0, 4000.0), fine = error_of(100.0, 8000.0);
  EXPECT_NEAR(std::log2(coarse / fine), 2.0, 0.3);
  // the force decays within a thousandth of a tick
  EXPECT_LT(error_of(1e6, 4000.0), 1.0);
}

// 33 points have 99 impulses, fewer than the 114 modes. 40 points have 120 impulses, more than the modes, so
// the weights of the impulses are computed by a function of an (n x n) matrix for n modes.
TEST(Feedback, SplittingOfFeedbackOnEveryPointHasSecondOrder) {
  for (const int num_points : {33, 40}) {
    std::vector<double> errors;
    for (const double rate : {4000.0, 8000.0}) {
      Scene scene = two_boxes();
      publish_everything(scene);
      stretch(scene, 1e-10, 9);
      scene.rate = rate;
      for (int i = 0; i < num_points; ++i)
        add_feedback(scene, i, i, -50.0 * Eigen::Matrix3d::Identity(),
                     Eigen::Vector3d(-10.0 - i, -1.0, 0.0).asDiagonal());
      Simulation simulation(scene);
      EXPECT_EQ(simulation.plan.modal_coupling.num_impulses, 3 * num_points);
      simulation.run(std::llround(0.02 * rate));
      const Eigen::VectorXd exact = linear_body(scene, 0.02L).V;
      errors.push_back((simulation.displacements_B().reshaped() - exact).norm() / exact.norm());
      std::printf("feedback on %d points, h = %g s: displacements off by %.2e of them\n", num_points,
                  1.0 / rate, errors.back());
    }
    EXPECT_NEAR(std::log2(errors[0] / errors[1]), 2.0, 0.3) << num_points;
  }
}

TEST(Feedback, FeedbackThatMakesAMotionGrowIsReported) {
  FeedbackRig rig;
  rig.c = 5.0;
  const Faults faults = faults_on_its_rung(rig.scene());
  ASSERT_EQ(faults.size(), 1u);
  EXPECT_NE(faults[0].message.find("the feedback drives a motion that grows by a factor of"),
            std::string::npos);
}

// A split step holds the elastic coordinates q fixed during each splitting impulse, so the force of a
// displacement gain is constant over half a tick. If gain h^2 / m is above 4, the split step therefore makes
// a motion grow that would be stable without splitting.
TEST(Feedback, FeedbackUnstableUnderSplittingIsRefusedWithASufficientRate) {
  Scene scene = two_boxes();
  publish_everything(scene);
  stretch(scene, 1e-7, 9);
  const double stiff = 10.0 * scene.points[2].mass * scene.rate * scene.rate;
  add_feedback(scene, 2, 2, -stiff * Eigen::Matrix3d::Identity(), Eigen::Matrix3d::Zero());
  const Faults faults = faults_on_its_rung(scene);
  ASSERT_TRUE(has_words(faults, Fault::Severity::kError, "feedback 'f0' has a displacement gain of "));
  ASSERT_TRUE(has_words(faults, Fault::Severity::kError, "gain tick^2 / mass is 10."));
  const std::string& message = faults.back().message;
  const std::size_t position = message.find("raise the rate to ");
  ASSERT_NE(position, std::string::npos) << message;
  scene.rate = std::stod(message.substr(position + 18));
  EXPECT_GT(scene.rate, 1000.0);
  EXPECT_FALSE(has_error(faults_on_its_rung(scene)));
  Simulation simulation(scene);
  simulation.run(20000);
  // the motion is stable and the displacements stay bounded, because the feedback acts like a spring to the
  // mean frame
  EXPECT_LT(simulation.displacements_B().norm(), 100.0 * start_of(scene).cast<double>().norm());
}

TEST(Feedback, FeedbackThatMakesManyModesGrowIsReportedAtEveryRate) {
  Scene scene = two_boxes();
  add_feedback(scene, 2, 2, Eigen::Matrix3d::Zero(), 5.0 * Eigen::Matrix3d::Identity());
  for (const double rate : {1000.0, 8000.0}) {
    scene.rate = rate;
    const Faults faults = faults_on_its_rung(scene);
    EXPECT_FALSE(has_error(faults));
    EXPECT_TRUE(has_words(faults, Fault::Severity::kWarning, "the feedback drives a motion that grows by"));
  }
  scene.feedbacks[0].velocity_gain *= -1.0;
  EXPECT_FALSE(has_words(faults_on_its_rung(scene), Fault::Severity::kWarning, "feedback"));
}

TEST(Feedback, FeedbackWithALargeSplittingErrorIsReported) {
  Scene scene = two_boxes();
  add_feedback(scene, 2, 2, Eigen::Matrix3d::Zero(), -1e4 * Eigen::Matrix3d::Identity());
  EXPECT_TRUE(has_words(faults_on_its_rung(scene), Fault::Severity::kWarning,
                        "coupled modes are advanced by splitting, whose error grows with the square"));
}

// A plan without modes has no elastic motion that feedback could act on.
TEST(Feedback, AWarningSaysThatFeedbackHasNoEffectWithoutModes) {
  Scene scene = spring_pair(1.0, 2.0, 1.0, 100.0);
  add_feedback(scene, 1, 0, Eigen::Matrix3d::Zero(), -Eigen::Matrix3d::Identity());
  const std::string words = "feedback 'f0' has no effect, because it acts on elastic motion";
  scene.fidelity = Fidelity::kSeparated;
  EXPECT_FALSE(has_words(faults_on_its_rung(scene), Fault::Severity::kWarning, words));
  scene.fidelity = Fidelity::kRigid;
  EXPECT_TRUE(has_words(faults_on_its_rung(scene), Fault::Severity::kWarning, words));
}

}  // namespace
}  // namespace freeflex::testing
