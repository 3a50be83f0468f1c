// The separated equations against the full system. What is left is what they leave out: nonlinear geometry
// and the reaction of the deformation on the frame. Expected figures: an independent prototype of the same
// equations, compared with an extrapolation code of order 16 in extended precision.
#include "tests/reference/separated_cases.hpp"

namespace freeflex::testing {
namespace {

TEST(SeparatedEquations, LeaveTheExpectedElasticErrorOnTheShortTruss) {
  ReferenceOptions options;
  options.tolerance = 1e-10;
  expect_elastic_error("S1", truss_s1(), full_system(truss_s1(), options, true), 4.2e-4);
}

TEST(SeparatedEquations, LeaveTheExpectedElasticErrorOnTheLongTruss) {
  expect_elastic_error("S2", truss_s2(), full_system(truss_s2(), ReferenceOptions{}, true), 9.5e-5);
}

// 673,000 rad/s: the classical method is stable to omega h = 2.8 and damps the fastest modes, which carry
// 1e-6 of the motion: the long test of the same structure shows it.
TEST(SeparatedEquations, LeaveTheExpectedElasticErrorOnTheStiffTruss) {
  ReferenceOptions options;
  options.method = ReferenceMethod::kRungeKutta4;
  options.fixed_step = 4e-6;
  expect_elastic_error("S4", truss_s4(), full_system(truss_s4(), options, false), 2.1e-5);
}

}  // namespace
}  // namespace freeflex::testing
