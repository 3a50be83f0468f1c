// The rung `corotational` on random structures of every kind of link, body and load, in large rotations and
// with displacements of 1 to 6 % of the size, against the Cartesian reference integrated by CVODE to 1e-12.
// The reference has no bodies with inertia, massless points, distributed mass of bars, wheels, feedback and
// damping of true strains, so a copy with point masses or forces that the test adds stand for them. Beams
// with distributed mass and superelements are compared with ticks of 1/32 ms, which shows the integration
// alone; their models are held by `spread_mass_test` and `matrix_link_test`.
//
// Each test prints a row: displacement over size, rotation [rad], phase of the fastest mode in 1 ms [rad],
// errors at ticks of 4, 2, 1 and 0.5 ms, order between the last two, error of the attitude at 1 ms [rad].
// `true_kinds_long_test` prints the table over five structures of each kind.
#include <gtest/gtest.h>

#include <algorithm>
#include <cctype>

#include "core/motion.hpp"
#include "core/plan/make_plan.hpp"
#include "core/step/readout.hpp"
#include "tests/reference/kinds.hpp"
#include "tests/setup/make_scene.hpp"

namespace freeflex::testing {

void PrintTo(const Kind& kind, std::ostream* out) { *out << kind.name; }

namespace {

class TrueKinds : public ::testing::TestWithParam<Kind> {};

TEST_P(TrueKinds, ConvergeToTheReference) {
  const KindErrors errors = errors_of(GetParam(), 1);
  print_row(GetParam(), {errors});
  check(GetParam(), errors);
}

std::string name_of(const ::testing::TestParamInfo<Kind>& instance) {
  std::string name;
  for (const char c : std::string(instance.param.name))
    if (std::isalnum(static_cast<unsigned char>(c)) != 0) name += c;
  return name;
}

INSTANTIATE_TEST_SUITE_P(All, TrueKinds, ::testing::ValuesIn(all_kinds()), name_of);

Scene scene_of(const char* name) {
  Random random(1);
  const auto& kinds = all_kinds();
  return std::find_if(kinds.begin(), kinds.end(),
                      [&](const Kind& kind) { return kind.name == std::string(name); })
      ->make(random)
      .scene;
}

// The published acceleration of each point is the rate of its published velocity. Differences over two ticks
// of 1/8000 s have an error of order h^2.
TEST(TrueFeedback, AccelerationsAreTheRatesOfVelocities) {
  Scene scene = scene_of("feedback");
  scene.fidelity = Fidelity::kCorotational;
  scene.rate = 8000.0;
  scene.feedbacks[0].displacement_gain *= 20.0;
  const Plan plan = compile(scene);
  Motion motion(plan, kMotionAlone);
  std::vector<PointState> states[3];
  for (long k = 0; k < 2402; ++k) {
    ASSERT_EQ(motion.advance().status, StepStatus::kOk);
    for (std::size_t i = 0; i < plan.points.size() && k >= 2399; ++i)
      states[k - 2399].push_back(read_point(plan, motion.state(), static_cast<int>(i)));
  }
  const auto at = [](const Vec3& x) { return Eigen::Map<const Eigen::Vector3d>(x.data()); };
  double off = 0.0, largest = 0.0;
  for (std::size_t i = 0; i < plan.points.size(); ++i) {
    const Eigen::Vector3d gain = 0.5 * scene.rate * (at(states[2][i].v_W) - at(states[0][i].v_W));
    off = std::max(off, (gain - at(states[1][i].a_W)).norm());
    largest = std::max(largest, gain.norm());
  }
  std::printf("off by %.1e of %.1f m/s^2\n", off, largest);
  EXPECT_LT(off, 1e-3 * largest);
}

TEST(TrueFeedback, OnABodyIsAWarning) {
  for (const char* name : {"feedback", "feedback between bodies"}) {
    Scene scene = scene_of(name);
    scene.fidelity = Fidelity::kCorotational;
    scene.rate = 1000.0;
    Faults faults;
    ASSERT_TRUE(make_plan(scene, build(scene), faults));
    const bool warns = std::any_of(faults.begin(), faults.end(), [](const Fault& fault) {
      return fault.message.find("of a rigid body, and uses the rotation of the body to first order only") !=
             std::string::npos;
    });
    EXPECT_EQ(warns, name == std::string("feedback between bodies"));
  }
}

}  // namespace
}  // namespace freeflex::testing
