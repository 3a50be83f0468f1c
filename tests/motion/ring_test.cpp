// The ring of NASTRAN-95, demonstration problem 2-1-1 (NASA SP-223): inertia relief under a radial force, and
// a steady spin. The published figures, taken as SI units, are: radial displacement of point 13 relative to
// point 1, 1.733905; bending moments -80.47 at point 1 and -236.00 at point 13; axial force 4.99923e4 next to
// point 1.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>

#include "core/plan/loads/quasi_static.hpp"
#include "core/plan/make_plan.hpp"
#include "core/step/readout.hpp"
#include "core/structure/structure.hpp"
#include "service/io/scene/input.hpp"
#include "tests/support/simulation.hpp"
#include "tests/support/structures.hpp"

namespace freeflex::testing {
namespace {

Scene ring() {
  const io::SceneResult result = io::read_scene(FREEFLEX_SOURCE_DIR "/service/scenes/ring.yaml");
  for (const Fault& fault : result.faults) ADD_FAILURE() << fault.message;
  return result.scene.value_or(Scene{});
}

TEST(Ring, TheStaticResponseMatchesThePublishedFigures) {
  const Plan plan = plan_of(ring());
  const PointForce force{12, 0, {-100.0, 0.0, 0.0}};
  std::string error;
  const std::optional<State> state = quasi_static(plan, {std::span(&force, 1), {}, {0.0, 0.0, 1.0}}, error);
  ASSERT_TRUE(state) << error;
  // both points lie on the x axis, and outward is +x at point 1 and -x at point 13
  const double shift = read_point(plan, *state, 0).V_B[0] - read_point(plan, *state, 12).V_B[0];
  std::array<double, 12> first{}, twelfth{};
  read_link(plan, *state, 0, first);
  read_link(plan, *state, 11, twelfth);
  std::printf("ring: %.6f m, moments %.3f and %.3f N m, axial force %.1f N\n", shift, std::abs(first[4]),
              std::abs(twelfth[10]), first[6]);
  EXPECT_NEAR(shift, 1.733905, 2e-4 * 1.733905);
  EXPECT_NEAR(std::abs(first[4]), 80.47, 2e-4 * 80.47);
  EXPECT_NEAR(std::abs(twelfth[10]), 236.00, 2e-4 * 236.00);
  EXPECT_NEAR(first[6], 4.99923e4, 2e-4 * 4.99923e4);
  // the expected values come from an independent solution in the mean-axis frame, to all printed digits
  EXPECT_NEAR(shift, 1.733880, 5e-7);
  EXPECT_NEAR(std::abs(first[4]), 80.478, 5.1e-4);
  EXPECT_NEAR(std::abs(twelfth[10]), 236.012, 5e-4);
  EXPECT_NEAR(first[6], 49992.3, 0.05);
}

// The damped motion settles to the quasi-static response.
TEST(Ring, TheDampedMotionSettlesToTheQuasiStaticResponse) {
  Scene scene = ring();
  scene.rate = 1.0;
  scene.damping.modal_ratio = 0.5;
  Load load;
  load.name = "pull";
  load.axes = Axes::kBody;
  load.forces = {{12, {-1e-3, 0.0, 0.0}}, {0, {1e-3, 0.0, 0.0}}};
  scene.loads.push_back(load);
  Simulation simulation(scene);
  simulation.run(2000);  // 100 time constants of the slowest mode
  std::string error;
  const std::vector<PointForce> forces{{12, 0, {-1e-3, 0.0, 0.0}}, {0, 0, {1e-3, 0.0, 0.0}}};
  const std::optional<State> state = quasi_static(simulation.plan, {forces, {}, {}}, error);
  ASSERT_TRUE(state) << error;
  double largest = 0.0;
  for (const double q : state->q) largest = std::max(largest, std::abs(q));
  for (std::size_t mode = 0; mode < state->q.size(); ++mode)
    EXPECT_NEAR(simulation.state.q[mode], state->q[mode], 1e-13 * largest) << mode;
}

TEST(Ring, ASpinThatTheMethodDoesNotCoverGivesAWarning) {
  Scene scene = ring();
  scene.initial.angular_velocity = {0.0, 0.0, 1.0};
  Faults faults;
  const auto structure = build_structure(scene, faults);
  ASSERT_TRUE(structure);
  ASSERT_TRUE(make_full_plan(scene, *structure, scene.fidelity, faults));
  ASSERT_EQ(faults.size(), 1u);
  EXPECT_NE(faults[0].message.find("(spin / omega_1)^2 is 69"), std::string::npos) << faults[0].message;
  EXPECT_NE(faults[0].message.find("so they do not cover this motion; do not use the result"),
            std::string::npos)
      << faults[0].message;
}

// On the coupled rungs, loads act on points that move with the deformation, so the response is not linear in
// the load.
TEST(QuasiStatic, RefusesRungsWhoseLoadsDependOnTheDeformation) {
  for (const RungTraits& rung : kRungs) {
    Scene scene = square_truss(2);
    scene.fidelity = rung.rung;
    const Plan plan = plan_of(scene);
    const PointForce force{3, 0, {1.0, 0.0, 0.0}};
    std::string error;
    const auto state = quasi_static(plan, {std::span(&force, 1), {}, {}}, error);
    EXPECT_EQ(state.has_value(), !rung.couples) << rung.name;
    if (rung.couples) {
      EXPECT_NE(error.find(rung.name), std::string::npos) << error;
    } else {
      EXPECT_GT(state->force_W[0], 0.5) << rung.name;
    }
  }
}

TEST(QuasiStatic, RefusesLoadsWithoutASteadyState) {
  Scene scene;
  for (const auto& [x, y] : {std::pair{0.0, 0.0}, {1.0, 0.0}, {1.0, 1.0}, {0.0, 1.0}}) {
    PointMass point;
    point.name = "p" + std::to_string(scene.points.size());
    point.mass = 1.0;
    point.position = {x, y, 0.0};
    scene.points.push_back(point);
    scene.pushable.push_back(static_cast<int>(scene.pushable.size()));
  }
  for (int i = 0; i < 4; ++i) {
    Link link;
    link.name = "l" + std::to_string(i);
    link.points = {i, (i + 1) % 4};
    link.kind = Spring{1e4};
    scene.links.push_back(link);
  }
  const Plan plan = plan_of(scene);
  std::string error;
  const PointForce shear[] = {{2, 0, {1.0, 0.0, 0.0}}, {3, 0, {1.0, 0.0, 0.0}}, {0, 0, {-2.0, 0.0, 0.0}}};
  EXPECT_FALSE(quasi_static(plan, {shear, {}, {}}, error));
  EXPECT_NE(error.find("the load drives an unresisted motion, mechanism"), std::string::npos) << error;
  // a pull along a side does not shear the square
  const PointForce stretch[] = {{0, 0, {-1.0, 0.0, 0.0}}, {1, 0, {1.0, 0.0, 0.0}}};
  const std::optional<State> state = quasi_static(plan, {stretch, {}, {}}, error);
  ASSERT_TRUE(state) << error;
  EXPECT_FALSE(quasi_static(plan, {stretch, {}, {0.0, 0.0, 1.0}}, error));
  EXPECT_NE(error.find("fidelity: spin-loaded"), std::string::npos) << error;
}

}  // namespace
}  // namespace freeflex::testing
