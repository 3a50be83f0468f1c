// The separated equations, compared with the full system. The separated equations omit nonlinear geometry and
// the reaction of the deformation on the frame. The expected errors come from an independent prototype of the
// separated equations, which was compared with an extrapolation code of order 16 in extended precision.
#include "tests/reference/separated_cases.hpp"

namespace freeflex::testing {
namespace {

TEST(SeparatedEquations, HaveTheExpectedElasticErrorOnTheShortTruss) {
  ReferenceOptions options;
  options.tolerance = 1e-10;
  expect_elastic_error("S1", truss_s1(), full_system(truss_s1(), options, true), 4.2e-4);
}

TEST(SeparatedEquations, HaveTheExpectedElasticErrorOnTheLongTruss) {
  expect_elastic_error("S2", truss_s2(), full_system(truss_s2(), ReferenceOptions{}, true), 9.5e-5);
}

// The fastest mode is at 673,000 rad/s. The classical Runge-Kutta method is stable up to omega h = 2.8, and
// at this step it damps the fastest modes. They carry only 1e-6 of the motion, as the long test of this
// structure shows.
TEST(SeparatedEquations, HaveTheExpectedElasticErrorOnTheStiffTruss) {
  ReferenceOptions options;
  options.method = ReferenceMethod::kRungeKutta4;
  options.fixed_step = 4e-6;
  expect_elastic_error("S4", truss_s4(), full_system(truss_s4(), options, false), 2.1e-5);
}

/// Returns the elastic error at kCaseEnd. Prints the error with two ratios of the run, max|V| / max|r| and
/// (|w| / omega_1)^2 max|r| / max|V|.
double error_beside_ratios(const char* what, const Scene& scene) {
  ReferenceOptions options;
  options.tolerance = 1e-8;
  const FullSystem full = full_system(scene, options, false);
  Simulation simulation(scene);
  double largest = 0.0;
  for (int tick = 0; tick < 2000; ++tick) {
    simulation.run(1);
    largest = std::max(largest, simulation.displacements_B().colwise().norm().maxCoeff());
  }
  const double error =
      elastic_error(elastic_displacements(full.mass, full.rest, simulation.positions_W()), full.u);
  const Vec3 w = angular_velocity(simulation.plan, simulation.state);
  const double spin = std::sqrt(w[0] * w[0] + w[1] * w[1] + w[2] * w[2]) / simulation.plan.omega[0];
  const double size = full.rest.colwise().norm().maxCoeff();
  std::printf(
      "%-16s elastic error %.2e, displacement ratio %.1e, spin ratio %.1e, lowest frequency %.3f Hz\n", what,
      error, largest / size, spin * spin * size / largest, simulation.plan.omega[0] / (2.0 * M_PI));
  return error;
}

// The omitted terms are of second order in the displacements and in the spin. The expected error of the
// spinning truss comes from the same prototype as the errors above.
TEST(SeparatedEquations, HaveAnErrorThatGrowsWithDisplacementAndSpin) {
  const auto pushed = [](double force) {
    Scene scene = truss_s1();
    for (Load& load : scene.loads)
      for (PointLoad& each : load.forces) each.force *= force;
    return scene;
  };
  const double once = error_beside_ratios("S1, 1 N", pushed(1.0));
  const double tenfold = error_beside_ratios("S1, 10 N", pushed(10.0));
  EXPECT_NEAR(tenfold / once, 10.0, 1.0);
  EXPECT_NEAR(error_beside_ratios("S5, 0.1 rad/s", truss_s5()), 6.2e-2, 0.05e-2);
}

}  // namespace
}  // namespace freeflex::testing
