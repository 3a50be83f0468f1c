// The stiff truss with a reference that proves its own accuracy by halving its step.
#include "tests/reference/separated_cases.hpp"

namespace freeflex::testing {
namespace {

TEST(SeparatedEquationsLong, LeaveTheExpectedElasticErrorOnTheStiffTrussToAKnownAccuracy) {
  ReferenceOptions options;
  options.method = ReferenceMethod::kRungeKutta4;
  options.fixed_step = 2e-6;
  const FullSystem full = full_system(truss_s4(), options, true);
  expect_elastic_error("S4", truss_s4(), full, 2.1e-5);
  options.method = ReferenceMethod::kFehlberg78;
  const FullSystem other = full_system(truss_s4(), options, false);
  // eighth order against fourth: the difference is the fourth-order method's own error
  EXPECT_LT(elastic_error(full.u, other.u), full.accuracy);
}

}  // namespace
}  // namespace freeflex::testing
