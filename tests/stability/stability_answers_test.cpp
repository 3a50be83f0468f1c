// Recomputes the reference values of the stability table.
#include <gtest/gtest.h>

#include "tests/support/exact_frequencies.hpp"
#include "tests/support/wide_rotation.hpp"
#include "tools/verification/stability/answers.hpp"

namespace freeflex::tools {
namespace {

TEST(StabilityAnswers, FrequenciesMatchASixtyDigitSolution) {
  for (const FrequencyAnswer& answer : frequency_answers()) {
    const auto values =
        testing::exact_eigenvalues(testing::exact_dynamic_matrix(answer.make(answer.first, answer.second)));
    const testing::Exact exact = sqrt(values[6]), given(answer.lowest);
    EXPECT_LT(abs((given - exact) / exact), testing::Exact("1e-23")) << answer.name;
    // the first six eigenvalues belong to rigid motions, and no other mode has the frequency zero
    EXPECT_LT(abs(values[5]), values[6] * testing::Exact("1e-20")) << answer.name;
  }
}

TEST(StabilityAnswers, AttitudeNearTheIntermediateAxisMatchesAFiftyDigitSolution) {
  for (const double spin : {1.0, 5.0, 50.0}) {
    const testing::WideRotation body =
        testing::rotate_freely({2.0, 3.0, 4.0}, {spin * 0.01, spin * 1.0, spin * 0.005}, 20.0 / spin);
    const auto& answer = intermediate_axis_attitude();
    // the table holds for any spin, but 0.01 and 0.005 times the spin are rounded here, and this rounding
    // error grows by a factor of a thousand
    for (std::size_t a = 0; a < 4; ++a)
      EXPECT_LT(abs(testing::Wide(answer[a]) - body.q[a]), testing::Wide("1e-14")) << spin;
  }
}

}  // namespace
}  // namespace freeflex::tools
