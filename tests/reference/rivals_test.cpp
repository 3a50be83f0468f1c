// Checks the methods with which freeflex is compared: each method must converge at its order, and the
// linearised methods must solve the linear system.
#include "tools/verification/reference/rivals.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "tests/support/simulation.hpp"
#include "tests/support/structures.hpp"
#include "tools/verification/reference/elastic_error.hpp"
#include "tools/verification/reference/lanczos.hpp"

namespace freeflex::testing {
namespace {

constexpr double kEnd = 0.25;  // [s] end of the runs, when the phase of the slowest mode is 17 rad

/// A truss of two sections and eight points under the corner pulse, with the motion that the reference
/// computes.
struct Small {
  Scene scene = square_truss(2);
  std::optional<CartesianSystem> system;
  ElasticScale scale;
  Eigen::Matrix3Xd u;  // [m] displacements of the full system at kEnd

  explicit Small(double spin = 0.0) {
    add_corner_pulse(scene);
    scene.initial.angular_velocity = {0.0, 0.0, spin};
    std::string error;
    system = make_cartesian_system(scene, error);
    ReferenceOptions options;
    options.tolerance = 1e-12;
    const double times[] = {kEnd};
    const ReferenceRun run = integrate(*system, times, options);
    EXPECT_EQ(run.error, "");
    scale = run.scale;
    u = displacements(run.states.at(0).p_W);
  }

  Eigen::Matrix3Xd displacements(const Eigen::Matrix3Xd& p_W) const {
    return elastic_displacements(system->mass, system->r, p_W);
  }

  /// Returns the elastic displacements at kEnd that a rival computes.
  Eigen::Matrix3Xd run(Rival rival, double step, double tolerance) const {
    std::string error;
    const auto method = make_rival(rival, *system, error);
    EXPECT_NE(method, nullptr) << error;
    const double times[] = {kEnd};
    Eigen::Matrix3Xd end;
    const RivalRun run = method->run(times, {step, tolerance, scale, {}},
                                     [&](std::size_t, const CartesianState& state) { end = state.p_W; });
    EXPECT_EQ(run.error, "");
    EXPECT_GT(run.num_steps, 0);
    EXPECT_GT(run.num_evaluations, 0);
    EXPECT_GT(run.memory, 0u);
    return displacements(end);
  }

  double error(Rival rival, double step, double tolerance) const {
    return elastic_error(run(rival, step, tolerance), u);
  }

  /// Returns the displacements that the rung `spin-loaded` computes with steps of 0.1 ms, which are the exact
  /// motion of the linearised system.
  Eigen::Matrix3Xd linear() const {
    Scene rung = scene;
    rung.fidelity = Fidelity::kSpinLoaded;
    rung.rate = 1e4;
    Simulation simulation(rung);
    simulation.run(std::llround(kEnd * rung.rate));
    return displacements(simulation.positions_W());
  }
};

// Halving the step divides the error by 2^order. The coarsest step is 0.15 rad of the fastest mode.
TEST(Rivals, FixedStepMethodsHaveTheirOrderOnTheFullSystem) {
  const Small small;
  for (const auto& [rival, order] : {std::pair{Rival::kVerlet, 2.0}, {Rival::kRungeKutta4, 4.0}}) {
    double before = 0.0;
    for (double step = 2e-4; step > 2e-5; step *= 0.5) {
      const double error = small.error(rival, step, 0.0);
      if (before > 0.0) {
        EXPECT_NEAR(std::log2(before / error), order, 0.15) << "step " << step;
      }
      before = error;
    }
  }
}

// The factor of 1e5 between tolerance and error allows for the errors that accumulate over 28 periods of the
// fastest mode.
TEST(Rivals, ErrorOfPackagedMethodsFallsWithTheirToleranceOnTheFullSystem) {
  const Small small;
  for (const Rival rival : {Rival::kErk4, Rival::kErk8, Rival::kDirk5, Rival::kAdams, Rival::kBdf}) {
    const double loose = small.error(rival, 0.0, 1e-5), tight = small.error(rival, 0.0, 1e-9);
    EXPECT_LT(tight, 1e-4) << static_cast<int>(rival);
    EXPECT_LT(tight, 0.02 * loose) << static_cast<int>(rival);
  }
}

TEST(Rivals, LeapfrogIsOfSecondOrderOnTheLinearSystem) {
  const Small small;
  const Eigen::Matrix3Xd exact = small.linear();
  double before = 0.0;
  for (double step = 2e-4; step > 2e-5; step *= 0.5) {
    const double error = elastic_error(small.run(Rival::kLeapfrog, step, 0.0), exact);
    if (before > 0.0) {
      EXPECT_NEAR(std::log2(before / error), 2.0, 0.1) << "step " << step;
    }
    before = error;
  }
}

// The method takes the load as linear in time over a step. During the 0.1 s of the pulse the body rotates by
// some 1e-3 rad, proportional to t^2. So a step of 0.1 s gives an error of some 1e-5, and the error is
// proportional to the square of the step.
TEST(Rivals, KrylovSolvesTheLinearSystemAtAnyStep) {
  const Small small;
  const Eigen::Matrix3Xd exact = small.linear();
  for (const auto& [step, allowed] : {std::pair{kEnd, 3e-5}, {0.05, 8e-6}, {0.01, 1e-6}, {0.001, 1e-6}})
    EXPECT_LT(elastic_error(small.run(Rival::kKrylov, step, 1e-10), exact), allowed) << step;
}

// At a spin of 0.2 rad/s the exact motion of the linear system includes the centrifugal load.
TEST(Rivals, LinearisedMethodsIncludeTheCentrifugalLoad) {
  const Small small(0.2);
  const Eigen::Matrix3Xd exact = small.linear();
  EXPECT_LT(elastic_error(small.run(Rival::kKrylov, 0.01, 1e-10), exact), 1e-5);
  EXPECT_LT(elastic_error(small.run(Rival::kLeapfrog, 2e-5, 0.0), exact), 2e-3);
}

// If the step exceeds 2 / omega_max, the motion grows without bound. The run must then end with an error.
TEST(Rivals, AStepBeyondTheStabilityLimitIsReported) {
  const Small small;
  std::string error;
  const auto method = make_rival(Rival::kVerlet, *small.system, error);
  const double times[] = {100.0};
  const RivalRun run = method->run(times, {5e-3, 0.0, {}, {}}, [](std::size_t, const CartesianState&) {});
  EXPECT_NE(run.error.find("stability"), std::string::npos) << run.error;
}

TEST(Rivals, ARunStopsOnRequest) {
  const Small small;
  for (const Rival rival : {Rival::kVerlet, Rival::kStoermer12, Rival::kKahanLi8, Rival::kErk8, Rival::kBdf,
                            Rival::kLeapfrog, Rival::kKrylov}) {
    std::string error;
    const auto method = make_rival(rival, *small.system, error);
    const double times[] = {10.0};
    const RivalRun run = method->run(times, {1e-4, 1e-9, small.scale, [] { return true; }},
                                     [](std::size_t, const CartesianState&) {});
    EXPECT_NE(run.error.find("stopped"), std::string::npos) << static_cast<int>(rival) << ": " << run.error;
  }
}

// A state read between steps agrees with a run that ends at that time.
TEST(Rivals, AStateReadDuringARunAgreesWithARunThatEndsAtThatTime) {
  const Small small;
  for (const auto& [rival, step, tolerance, allowed] : {std::tuple{Rival::kVerlet, 1e-4, 0.0, 2e-3},
                                                        {Rival::kRungeKutta4, 1e-4, 0.0, 1e-4},
                                                        {Rival::kStoermer8, 2e-4, 0.0, 1e-4},
                                                        {Rival::kStoermer16, 2e-4, 0.0, 1e-4},
                                                        {Rival::kKahanLi8, 2e-4, 0.0, 1e-4},
                                                        {Rival::kErk8, 0.0, 1e-9, 1e-4},
                                                        {Rival::kAdams, 0.0, 1e-9, 1e-4},
                                                        {Rival::kDirk5, 0.0, 1e-9, 1e-4},
                                                        {Rival::kLeapfrog, 1e-4, 0.0, 2e-3},
                                                        {Rival::kKrylov, 0.2, 1e-10, 1e-6}}) {
    std::string error;
    const auto method = make_rival(rival, *small.system, error);
    const double times[] = {0.0503, 0.1337, kEnd};
    std::vector<Eigen::Matrix3Xd> p_W;
    const RivalRun run =
        method->run(times, {step, tolerance, small.scale, {}},
                    [&](std::size_t, const CartesianState& state) { p_W.push_back(state.p_W); });
    ASSERT_EQ(run.error, "");
    ASSERT_EQ(p_W.size(), 3u);
    const double until[] = {0.1337};
    Eigen::Matrix3Xd end;
    method->run(until, {step, tolerance, small.scale, {}},
                [&](std::size_t, const CartesianState& state) { end = state.p_W; });
    EXPECT_LT(elastic_error(small.displacements(p_W[1]), small.displacements(end)), allowed)
        << static_cast<int>(rival);
  }
}

TEST(Rivals, MethodsRefuseAttractorsAndDissipation) {
  Small small;
  std::string error;
  small.system->attractor_mu = 1.0;
  EXPECT_EQ(make_rival(Rival::kVerlet, *small.system, error), nullptr);
  EXPECT_NE(error.find("attractor"), std::string::npos);
  small.system->attractor_mu = 0.0;
  small.system->links[3].damping = 1.0;
  for (const Rival rival : {Rival::kRungeKutta4, Rival::kBdf, Rival::kKrylov}) {
    error.clear();
    EXPECT_EQ(make_rival(rival, *small.system, error), nullptr);
    EXPECT_NE(error.find("dissipation"), std::string::npos);
  }
}

// The matrix is the Laplacian of the path graph, whose eigenvectors are cosines (Strang 1999).
TEST(Lanczos, FunctionsOfAMatrixEqualTheirSumsOverKnownEigenvectors) {
  constexpr int kSize = 40;
  constexpr double kStep = 1.7;
  const auto apply = [](const double* from, double* to) {
    for (int i = 0; i < kSize; ++i) {
      to[i] = 0.0;
      if (i > 0) to[i] += from[i] - from[i - 1];
      if (i + 1 < kSize) to[i] += from[i] - from[i + 1];
    }
  };
  Eigen::VectorXd b(kSize);
  for (int i = 0; i < kSize; ++i) b[i] = std::sin(1.0 + i * i);
  using Term = LanczosSpace::Term;
  const Term terms[] = {{WaveFunction::kCos, 1.0, 1e-13}, {WaveFunction::kRising, 1.0, 1e-13}};
  const auto exact = [&](auto f) {
    Eigen::VectorXd sum = Eigen::VectorXd::Zero(kSize);
    for (int k = 0; k < kSize; ++k) {
      Eigen::VectorXd v(kSize);
      for (int i = 0; i < kSize; ++i) v[i] = std::cos(std::numbers::pi * k * (i + 0.5) / kSize);
      const double x = kStep * 2.0 * std::sin(0.5 * std::numbers::pi * k / kSize);
      sum += f(x) * v.dot(b) / v.squaredNorm() * v;
    }
    return sum;
  };
  for (const bool is_reorthogonalised : {false, true}) {
    LanczosSpace space;
    ASSERT_TRUE(space.build(apply, b, kStep, terms, kSize, is_reorthogonalised));
    EXPECT_LT(space.size(), kSize);
    const auto check = [&](WaveFunction function, auto f) {
      Eigen::VectorXd sum = Eigen::VectorXd::Zero(kSize);
      space.add(function, kStep, 1.0, sum);
      EXPECT_LT((sum - exact(f)).norm(), 1e-12 * b.norm());
    };
    check(WaveFunction::kCos, [](double x) { return std::cos(x); });
    check(WaveFunction::kSinc, [](double x) { return x > 0.0 ? std::sin(x) / x : 1.0; });
    check(WaveFunction::kConstant, [](double x) { return x > 0.0 ? (1.0 - std::cos(x)) / (x * x) : 0.5; });
    check(WaveFunction::kRising,
          [](double x) { return x > 0.1 ? (1.0 - std::sin(x) / x) / (x * x) : 1.0 / 6 - x * x / 120; });
  }
}

}  // namespace
}  // namespace freeflex::testing
