// The Cartesian reference, compared with closed forms. A pair of masses on a spring moves along its line as a
// linear oscillator at any amplitude, because l - L is the relative displacement.
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <functional>
#include <numbers>

#include "tests/reference/system_of.hpp"
#include "tests/support/structures.hpp"
#include "tools/verification/reference/integrate.hpp"

namespace freeflex {
namespace {

using Eigen::Vector3d;

constexpr double kM0 = 2.0, kM1 = 3.0;  // [kg]
constexpr double kLength = 1.5;         // [m]
constexpr double kStiffness = 4e4;      // [N/m]
const double kReduced = kM0 * kM1 / (kM0 + kM1);
const double kOmega = std::sqrt(kStiffness / kReduced);  // [rad/s]

CartesianState state_at(const CartesianSystem& system, double t, const ReferenceOptions& options = {}) {
  const double times[] = {t};
  const ReferenceRun run = integrate(system, times, options);
  EXPECT_EQ(run.error, "");
  return run.states.at(0);
}

double separation(const CartesianState& state) { return (state.p_W.col(1) - state.p_W.col(0)).norm(); }

// Returns the pair at rest, stretched by `stretch` [m]. The rigid part of the initial displacement is
// removed.
Scene stretched_pair(double stretch) {
  Scene scene = testing::spring_pair(kM0, kM1, kLength, kStiffness);
  scene.initial.points.push_back({1, {stretch, 0.0, 0.0}, Vector3d::Zero()});
  return scene;
}

// Local errors of 1e-9 of the amplitude in some ten steps per cycle add up to less than 1e-7 over 20 cycles.
constexpr double kAmplitudeAccuracy = 1e-7;

TEST(CartesianReference, AFallingPairVibratesAsInClosedForm) {
  constexpr double kStretch = 1e-3, kT = 0.7;
  Scene scene = stretched_pair(kStretch);
  scene.gravity = {0.0, 1.0, -9.81};
  scene.initial.position = {10.0, -20.0, 5.0};
  scene.initial.velocity = {3.0, 0.5, 12.0};
  scene.initial.attitude = Eigen::Vector4d(0.5, -0.5, 0.5, 0.5);
  const CartesianState state = state_at(system_of(scene), kT);
  const double l = kLength + kStretch * std::cos(kOmega * kT);
  EXPECT_NEAR(separation(state), l, kAmplitudeAccuracy * kStretch);
  const Vector3d centre =
      scene.initial.position + kT * scene.initial.velocity + 0.5 * kT * kT * scene.gravity;
  const Vector3d x_W = Eigen::Quaterniond(0.5, -0.5, 0.5, 0.5) * Vector3d::UnitX();
  // the centre of mass is exact up to the rounding error of coordinates of 100 m, and the oscillation is
  // exact up to kAmplitudeAccuracy
  EXPECT_LT((state.p_W.col(0) - (centre - kM1 / (kM0 + kM1) * l * x_W)).norm(),
            1e-13 + kAmplitudeAccuracy * kStretch);
  EXPECT_LT((state.p_W.col(1) - (centre + kM0 / (kM0 + kM1) * l * x_W)).norm(),
            1e-13 + kAmplitudeAccuracy * kStretch);
  const double rate = -kStretch * kOmega * std::sin(kOmega * kT);
  EXPECT_NEAR((state.v_W.col(1) - state.v_W.col(0)).dot(x_W), rate, kAmplitudeAccuracy * kStretch * kOmega);
}

TEST(CartesianReference, APairVibratesWithOneFrequencyAtEveryAmplitude) {
  constexpr double kT = 0.3;
  for (const double stretch : {1e-9, 1e-5, 0.5}) {
    const double l = separation(state_at(system_of(stretched_pair(stretch)), kT));
    // the length is a difference of world positions of 1 m, whose rounding error is 4e-16 m
    EXPECT_NEAR(l, kLength + stretch * std::cos(kOmega * kT), kAmplitudeAccuracy * stretch + 4e-16)
        << stretch;
  }
}

TEST(CartesianReference, APairWithStiffnessProportionalDampingDecaysAsInClosedForm) {
  constexpr double kStretch = 1e-3, kT = 0.2, kBeta = 2e-4;
  Scene scene = stretched_pair(kStretch);
  scene.damping.beta = kBeta;
  const double decay = 0.5 * kBeta * kOmega * kOmega;
  const double damped = std::sqrt(kOmega * kOmega - decay * decay);
  const double expected =
      kStretch * std::exp(-decay * kT) * (std::cos(damped * kT) + decay / damped * std::sin(damped * kT));
  EXPECT_NEAR(separation(state_at(system_of(scene), kT)) - kLength, expected, kAmplitudeAccuracy * kStretch);
}

// Elongation of a pair that is initially at rest, under the force F amplitude(t) on point 1 along the line,
// divided by F / m1.
struct HistoryCase {
  const char* name;
  History history;
  std::function<double(double)> stretch;
};

std::vector<HistoryCase> history_cases() {
  const double w2 = kOmega * kOmega;
  const auto step_response = [w2](double t) { return t > 0.0 ? (1.0 - std::cos(kOmega * t)) / w2 : 0.0; };
  const auto ramp_response = [w2](double t) {
    return t > 0.0 ? (t - std::sin(kOmega * t) / kOmega) / w2 : 0.0;
  };
  constexpr double kFrequency = 7.0, kPhase = 0.4;
  const auto sine_response = [w2](double t) {
    const double W = 2.0 * M_PI * kFrequency;
    return (std::sin(W * t + kPhase) - std::sin(kPhase) * std::cos(kOmega * t) -
            W / kOmega * std::cos(kPhase) * std::sin(kOmega * t)) /
           (w2 - W * W);
  };
  return {
      {"constant", ConstantHistory{}, step_response},
      {"pulse", PulseHistory{0.05, 0.12},
       [step_response](double t) { return step_response(t - 0.05) - step_response(t - 0.17); }},
      {"sine", SineHistory{kFrequency, kPhase}, sine_response},
      {"table", TableHistory{{0.02, 0.06, 0.11}, {0.0, 2.0, -1.0}},
       [ramp_response](double t) {
         return 50.0 * ramp_response(t - 0.02) - 110.0 * ramp_response(t - 0.06) +
                60.0 * ramp_response(t - 0.11);
       }},
  };
}

TEST(CartesianReference, UnderEveryLoadHistoryThePairMovesAsInClosedForm) {
  constexpr double kForce = 8.0, kT = 0.3;
  for (const HistoryCase& item : history_cases()) {
    Scene scene = testing::spring_pair(kM0, kM1, kLength, kStiffness);
    Load load;
    load.forces.push_back({1, {kForce, 0.0, 0.0}});
    load.history = item.history;
    scene.loads.push_back(load);
    const double got = separation(state_at(system_of(scene), kT)) - kLength;
    const double amplitude = kForce / kM1 / (kOmega * kOmega);
    EXPECT_NEAR(got, kForce / kM1 * item.stretch(kT), 10.0 * kAmplitudeAccuracy * amplitude) << item.name;
  }
}

TEST(CartesianReference, PulsesBeginAndEndBetweenTicks) {
  constexpr double kForce = 8.0;
  Scene scene = testing::spring_pair(kM0, kM1, kLength, kStiffness);
  scene.rate = 100.0;  // neither 0.012 s nor 0.048 s is a tick
  Load load;
  load.forces.push_back({1, {kForce, 0.0, 0.0}});
  load.history = PulseHistory{0.012, 0.036};
  scene.loads.push_back(load);
  const CartesianState state = state_at(system_of(scene), 0.2);
  const Vector3d momentum = kM0 * state.v_W.col(0) + kM1 * state.v_W.col(1);
  EXPECT_NEAR(momentum[0], kForce * 0.036, 1e-12);
  // the momentum acts from the mean time of the pulse on
  const Vector3d centre = (kM0 * state.p_W.col(0) + kM1 * state.p_W.col(1)) / (kM0 + kM1);
  EXPECT_NEAR(centre[0], kForce * 0.036 * (0.2 - 0.03) / (kM0 + kM1), 1e-12);
}

// In circular motion the reduced mass times l spin^2 equals the tension k (l - L) of the spring.
TEST(CartesianReference, ASpinningPairKeepsTheLengthOfSteadySpin) {
  constexpr double kSpin = 20.0, kT = 1.0;
  const double l = kStiffness * kLength / (kStiffness - kReduced * kSpin * kSpin);
  Scene scene = stretched_pair(l - kLength);
  scene.initial.angular_velocity = {0.0, 0.0, kSpin};
  CartesianSystem rotating = system_of(scene);
  // the same motion in a frame at rest, in which displacements are as large as the pair
  CartesianSystem resting = rotating;
  resting.spin.setZero();
  for (int i = 0; i < 2; ++i) {
    const Vector3d x = rotating.r.col(i) + rotating.initial.segment<3>(3 * i);
    resting.initial.segment<3>(6 + 3 * i) += rotating.spin.cross(x);
  }
  ReferenceOptions options;
  options.tolerance = 1e-11;
  options.scale = ElasticScale{l - kLength, (l - kLength) * kOmega};
  const Vector3d direction(std::cos(kSpin * kT), std::sin(kSpin * kT), 0.0);
  for (const CartesianSystem* system : {&rotating, &resting}) {
    const CartesianState state = state_at(*system, kT, options);
    const Vector3d span = state.p_W.col(1) - state.p_W.col(0);
    // the bound is for three revolutions of a pair of 1.5 m, with local errors of 1e-11 of the elongation of
    // 18 mm in some thousand steps
    EXPECT_LT((span - l * direction).norm(), 1e-9);
    EXPECT_LT((state.v_W.col(1) - state.v_W.col(0) - l * kSpin * Vector3d::UnitZ().cross(direction)).norm(),
              1e-7);
  }
}

TEST(CartesianReference, EstimateCoversTheTrueError) {
  constexpr double kStretch = 1e-3, kT = 0.5;
  const CartesianSystem system = system_of(stretched_pair(kStretch));
  const double times[] = {kT};
  for (const double tolerance : {1e-6, 1e-8}) {
    ReferenceOptions options;
    options.tolerance = tolerance;
    const ReferenceRun run = integrate_with_estimate(system, times, options);
    ASSERT_EQ(run.error, "");
    const double exact = kStretch * std::cos(kOmega * kT);
    const double error = std::abs(separation(run.states[0]) - kLength - exact) / std::abs(exact);
    EXPECT_LE(error, run.accuracy) << tolerance;
    EXPECT_LE(run.accuracy, 1e4 * tolerance) << "the estimate must not be far too large";
  }
}

TEST(CartesianReference, ATorqueOnTheWholeBodyGivesTheExpectedAngularMomentum) {
  constexpr double kTorque = 0.01, kT = 1.0;
  for (const Axes axes : {Axes::kWorld, Axes::kBody}) {
    Scene scene = testing::octahedron();
    Group all{"all", {0, 1, 2, 3, 4, 5}, {}};
    scene.groups.push_back(all);
    Load load;
    load.axes = axes;
    load.wrenches.push_back({0, {0.0, 0.0, 0.2}, {0.0, 0.0, kTorque}});
    scene.loads.push_back(load);
    const CartesianSystem system = system_of(scene);
    const CartesianInvariants sum = invariants(system, state_at(system, kT));
    // the torque is spread over the rest shape, so displacements of 1e-8 m change it by a relative amount of
    // 1e-8 or so
    EXPECT_NEAR(sum.angular_momentum[2], kTorque * kT, 1e-6 * kTorque);
    EXPECT_LT((sum.linear_momentum - Vector3d(0.0, 0.0, 0.2)).norm(), 1e-12);
  }
}

TEST(CartesianReference, RefusesScenesThatItsEquationsCannotRepresent) {
  const auto refusal = [](const Scene& scene) {
    std::string error;
    EXPECT_FALSE(make_cartesian_system(scene, error).has_value());
    return error;
  };
  Scene beam = stretched_pair(0.0);
  beam.links[0].kind = Beam{1e6, 1e3, 1e3, 1e3, Vector3d::Zero()};
  EXPECT_NE(refusal(beam).find(
                "is not a spring, bar or dashpot, and the Cartesian reference supports no other links"),
            std::string::npos);
  Scene matrix = stretched_pair(0.0);
  matrix.links[0].kind = MatrixLink{};
  EXPECT_NE(refusal(matrix).find(
                "is not a spring, bar or dashpot, and the Cartesian reference supports no other links"),
            std::string::npos);
  Scene damped = stretched_pair(0.0);
  damped.damping.modal_ratio = 0.01;
  EXPECT_NE(refusal(damped).find("damping"), std::string::npos);
  Scene modal = stretched_pair(0.0);
  modal.initial.modes.push_back({1, 1e-3, 0.0});
  EXPECT_NE(refusal(modal).find("by points"), std::string::npos);
  Scene body = stretched_pair(0.0);
  Load load;
  load.axes = Axes::kBody;
  load.forces.push_back({0, {0.0, 1.0, 0.0}});
  body.loads.push_back(load);
  EXPECT_NE(refusal(body).find("collinear"), std::string::npos);
}

TEST(CartesianReference, AFailureOfTheSolverIsReturnedWithItsMessage) {
  const CartesianSystem system = system_of(stretched_pair(1e-3));
  const double times[] = {10.0};
  ReferenceOptions options;
  options.method = ReferenceMethod::kRungeKutta4;
  options.fixed_step = 0.1;  // omega h = 18 is far outside the region of stability
  const ReferenceRun run = integrate(system, times, options);
  EXPECT_NE(run.error.find("ERKStepEvolve"), std::string::npos) << run.error;
  EXPECT_TRUE(run.states.empty());
  options.fixed_step = 0.0;
  EXPECT_NE(integrate(system, times, options).error.find("fixed step"), std::string::npos);
}

// Two cycles take some twenty steps, more than the limit of 5 and fewer than the limit of 100.
TEST(CartesianReference, ARunWithTooManyStepsIsReported) {
  const CartesianSystem system = system_of(stretched_pair(1e-3));
  const double times[] = {2.0 * 2.0 * std::numbers::pi / kOmega};
  ReferenceOptions options;
  options.scale = ElasticScale{1e-3, 1e-3 * kOmega};
  options.max_steps = 5;
  EXPECT_NE(integrate(system, times, options).error.find("mxstep"), std::string::npos);
  options.max_steps = 100;
  EXPECT_EQ(integrate(system, times, options).error, "");
}

}  // namespace
}  // namespace freeflex
