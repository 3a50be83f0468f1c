// These tests check hand-written methods with fixed steps. Each method must converge at its order to a closed
// form and to a nonlinear motion, and under loads all methods must converge to one limit.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <utility>

#include "tests/reference/system_of.hpp"
#include "tests/support/structures.hpp"
#include "tools/verification/reference/elastic_error.hpp"
#include "tools/verification/reference/rivals.hpp"

namespace freeflex::testing {
namespace {

using Eigen::Matrix3Xd;

/// A method, its order, and the number of steps of the coarsest run in which the order is visible, for two
/// points and for the truss.
struct Case {
  Rival rival;
  int order;
  double pair_steps, truss_steps;
};
constexpr std::array kCases{Case{Rival::kVerlet, 2, 2000, 10000},  Case{Rival::kRungeKutta4, 4, 1000, 3000},
                            Case{Rival::kStoermer8, 8, 200, 800},  Case{Rival::kStoermer12, 12, 85, 300},
                            Case{Rival::kStoermer16, 16, 80, 250}, Case{Rival::kKahanLi8, 8, 200, 800}};

/// Returns the state at the end of a run of `steps` equal steps.
CartesianState end_of(Rival rival, const CartesianSystem& system, double end, double steps) {
  std::string error;
  const auto method = make_rival(rival, system, error);
  EXPECT_NE(method, nullptr) << error;
  const double times[] = {end};
  CartesianState state;
  const RivalRun run = method->run(times, {end / steps, 0.0, {}, {}},
                                   [&](std::size_t, const CartesianState& now) { state = now; });
  EXPECT_EQ(run.error, "");
  return state;
}

/// Returns the measured order, from a run and from a second run whose error should be 512 times smaller.
template <typename Error>
double order_of(const Case& method, double first, const Error& error_at) {
  const double last = std::round(first * std::exp2(9.0 / method.order));
  return std::log(error_at(first) / error_at(last)) / std::log(last / first);
}

// Two points on a line, stretched by a tenth of a metre, move for 37 periods, and their elongation is a
// cosine. The error includes the error of the rate, so that the total error cannot vanish where the
// elongation passes through zero.
TEST(HandWritten, EachMethodHasItsOrderAgainstTheClosedFormOfTwoPoints) {
  constexpr double kLength = 2.0, kStretch = 0.1, kStiffness = 1e4, kReduced = 0.75, kEnd = 2.0;
  Scene scene = spring_pair(1.0, 3.0, kLength, kStiffness);
  scene.initial.points.push_back({1, {kStretch, 0.0, 0.0}, {0.0, 0.0, 0.0}});
  const CartesianSystem system = system_of(scene);
  const double omega = std::sqrt(kStiffness / kReduced), phase = omega * kEnd;
  for (const Case& method : kCases) {
    const double order = order_of(method, method.pair_steps, [&](double steps) {
      const CartesianState end = end_of(method.rival, system, kEnd, steps);
      const double distance = (end.p_W.col(1) - end.p_W.col(0)).norm() - kLength,
                   rate = (end.v_W.col(1) - end.v_W.col(0)).x();
      return std::hypot(distance / kStretch - std::cos(phase), rate / (omega * kStretch) + std::sin(phase));
    });
    EXPECT_NEAR(order, method.order, 0.05 * method.order);
  }
}

/// Returns a truss that does not spin about a principal axis and deforms by centimetres.
Scene wild_truss() {
  Scene scene = square_truss(2);
  scene.initial.angular_velocity = {0.7, -1.1, 2.0};
  scene.initial.points.push_back({6, {0.0, 0.02, -0.03}, {0.0, 0.0, 1.0}});
  scene.initial.points.push_back({2, {-0.02, 0.0, 0.01}, {0.5, 0.0, 0.0}});
  return scene;
}

// The methods of the two highest orders take steps of three radians or more of the fastest mode. At such
// steps the error falls faster than the order predicts, and it soon reaches rounding errors. So the test
// fails only if the order is too low.
TEST(HandWritten, EachMethodHasItsOrderOnATrussThatDeformsByCentimetres) {
  constexpr double kEnd = 1.0;
  const CartesianSystem system = system_of(wild_truss());
  ReferenceOptions options;
  options.tolerance = 1e-13;
  const double times[] = {kEnd};
  const ReferenceRun reference = integrate(system, times, options);
  ASSERT_EQ(reference.error, "");
  const Matrix3Xd u = elastic_displacements(system.mass, system.r, reference.states[0].p_W);
  for (const Case& method : kCases) {
    const double order = order_of(method, method.truss_steps, [&](double steps) {
      const Matrix3Xd p_W = end_of(method.rival, system, kEnd, steps).p_W;
      return elastic_error(elastic_displacements(system.mass, system.r, p_W), u);
    });
    EXPECT_GT(order, 0.9 * method.order);
    if (method.order <= 8) {
      EXPECT_LT(order, 1.1 * method.order);
    }
  }
}

// The loads are a pulse in world axes and a sine of two forces that rotate with the body. The pulse divides
// the time into smooth pieces, and the sine varies within the pieces.
TEST(HandWritten, AllMethodsConvergeToOneLimitUnderLoads) {
  constexpr double kEnd = 0.25;
  Scene scene = wild_truss();
  add_corner_pulse(scene);
  scene.loads[0].forces[0].force *= 300.0;
  Load sine;
  sine.axes = Axes::kBody;
  sine.forces = {{1, {200.0, 0.0, 100.0}}, {5, {-200.0, 50.0, 0.0}}};
  sine.history = SineHistory{30.0, 0.4};
  scene.loads.push_back(sine);
  const CartesianSystem system = system_of(scene);
  const auto displacements = [&](Rival rival, double steps) {
    return elastic_displacements(system.mass, system.r, end_of(rival, system, kEnd, steps).p_W);
  };
  const Matrix3Xd u = displacements(Rival::kRungeKutta4, 40000);
  for (const Rival rival : {Rival::kStoermer8, Rival::kStoermer12, Rival::kStoermer16, Rival::kKahanLi8}) {
    const double error = elastic_error(displacements(rival, 1000), u);
    EXPECT_LT(error, 1e-8) << static_cast<int>(rival);
  }
}

// The interpolation uses x, v and a at both ends of a step, so its error is proportional to the sixth power
// of the step. The test requires that half the step gives at most a thirtieth of the error.
TEST(HandWritten, HalvingTheStepReducesTheInterpolationErrorThirtyfold) {
  const CartesianSystem system = system_of(wild_truss());
  const double times[] = {0.0503, 0.1};
  const CartesianState exact = end_of(Rival::kStoermer16, system, times[0], 200);
  for (const Rival rival : {Rival::kStoermer8, Rival::kStoermer12, Rival::kStoermer16, Rival::kKahanLi8}) {
    std::string error;
    const auto method = make_rival(rival, system, error);
    double before = 0.0;
    for (const double step : {1e-3, 5e-4}) {
      CartesianState read;
      method->run(times, {step, 0.0, {}, {}}, [&](std::size_t k, const CartesianState& now) {
        if (k == 0) read = now;
      });
      const double position = (read.p_W - exact.p_W).norm();
      if (before > 0.0) {
        EXPECT_LT(position, before / 30.0) << static_cast<int>(rival);
      }
      before = position;
    }
  }
}

TEST(HandWritten, EachMethodRefusesASystemWithADampedLink) {
  Scene scene = spring_pair(1.0, 3.0, 2.0, 1e4);
  CartesianSystem system = system_of(scene);
  system.links[0].damping = 1.0;
  for (const Case& method : kCases) {
    std::string error;
    EXPECT_EQ(make_rival(method.rival, system, error), nullptr);
    EXPECT_EQ(error, "these methods support springs and bars only, without dissipation");
  }
}

TEST(HandWritten, EachEvaluationOfTheForcesIsCounted) {
  const CartesianSystem system = system_of(wild_truss());
  for (const auto& [rival, evaluations] : {std::pair{Rival::kVerlet, 1L},
                                           {Rival::kRungeKutta4, 4L},
                                           {Rival::kStoermer8, 11L},
                                           {Rival::kStoermer12, 22L},
                                           {Rival::kStoermer16, 37L},
                                           {Rival::kKahanLi8, 17L}}) {
    std::string error;
    const double times[] = {0.01};
    const RivalRun run = make_rival(rival, system, error)->run(times, {1e-3, 0.0, {}, {}}, [](auto...) {});
    EXPECT_EQ(run.num_steps, 10);
    EXPECT_EQ(run.num_evaluations / run.num_steps, evaluations) << static_cast<int>(rival);
  }
}

}  // namespace
}  // namespace freeflex::testing
