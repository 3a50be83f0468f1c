// The rung `coupled` with rigid links is compared with points at true geometry. Other tests use shapes on a
// line and one body alone.
#include <gtest/gtest.h>

#include <cstdio>

#include "core/plan/compile.hpp"
#include "core/plan/rungs/kinetics.hpp"
#include "tests/motion/rung_cases.hpp"
#include "tests/motion/verdict_truth.hpp"
#include "tests/setup/make_scene.hpp"
#include "tests/support/wide_rotation.hpp"

namespace freeflex::testing {
namespace {

// Returns a rigid bar and a rigid triangle among springs. If `stiffness` is not 0, springs of this stiffness
// [N/m] take the place of the bar and the triangle.
Scene held_points(double stiffness, double force) {
  Scene scene;
  const std::vector<Eigen::Vector3d> positions{{0.0, 0.0, 0.0}, {1.1, 0.1, 0.0}, {0.2, 0.9, 0.1},
                                               {0.3, 0.2, 1.2}, {1.0, 1.1, 0.8}, {1.6, -0.8, 0.5}};
  for (std::size_t i = 0; i < positions.size(); ++i) {
    add_point(scene, 1.0 + 0.3 * static_cast<double>(i), positions[i]);
    scene.publication.points.push_back(static_cast<int>(i));
  }
  const auto is_held = [](int i, int j) {
    return (i == 0 && j == 3) || (i == 1 && j == 2) || (i == 1 && j == 4) || (i == 2 && j == 4);
  };
  for (int j = 0; j < 6; ++j)
    for (int i = 0; i < j; ++i)
      if (!is_held(i, j) || stiffness > 0.0)
        add_link(scene, i, j, Spring{is_held(i, j) ? stiffness : 900.0 + 40.0 * (i + j)});
  if (stiffness == 0.0) {
    add_link(scene, {0, 3}, Rigid{});
    add_link(scene, {1, 2, 4}, Rigid{});
  }
  Load load;
  load.name = "push";
  load.forces = {{5, {0.3 * force, -force, 0.5 * force}}};
  load.history = PulseHistory{0.0, 0.2};
  scene.loads.push_back(load);
  // centrifugal loads grow with the square of the spin, so they are proportional to the force too
  scene.initial.angular_velocity = std::sqrt(force) * Eigen::Vector3d(0.3, -0.2, 0.4);
  return scene;
}

// The remaining error is the second order of the geometry, so relative to the motion it is proportional to
// the amplitude.
TEST(RigidLinks, RigidLinksOnTheCoupledRungMatchStiffSpringsToFirstOrder) {
  constexpr double kEnd = 0.5, kStiff = 3e7;
  std::vector<double> errors;
  for (const double force : {4.0, 2.0, 1.0, 0.5}) {
    const Truth truth = truth_of(held_points(kStiff, force), kEnd);
    errors.push_back(
        errors_of(run_rung(held_points(0.0, force), Fidelity::kCoupled, 5e-4, kEnd), truth).elastic);
  }
  const double spin_loaded = errors_of(run_rung(held_points(0.0, 0.5), Fidelity::kSpinLoaded, 5e-4, kEnd),
                                       truth_of(held_points(kStiff, 0.5), kEnd))
                                 .elastic;
  std::printf("rigid links, elastic error %.1e %.1e %.1e %.1e at 4 to 0.5 N, spin-loaded %.1e there\n",
              errors[0], errors[1], errors[2], errors[3], spin_loaded);
  for (std::size_t k = 1; k < errors.size(); ++k) EXPECT_NEAR(errors[k - 1] / errors[k], 2.0, 0.4);
  EXPECT_LT(errors[3], 0.5 * spin_loaded);
}

Scene points_on_a_line(bool is_rigid) {
  Scene scene;
  for (int i = 0; i < 5; ++i) {
    add_point(scene, 1.0 + 0.5 * i, Eigen::Vector3d(0.6, 0.8, 0.0) * i);
    scene.publication.points.push_back(i);
  }
  for (int i = 1; i < 5; ++i) add_link(scene, i - 1, i, Spring{1e4});
  for (int i = 2; i < 5; ++i) add_link(scene, {i - 2, i - 1, i}, BendingSpring{300.0});
  if (is_rigid) add_link(scene, {1, 2, 3}, Rigid{});
  Load load;
  load.name = "push";
  load.forces.push_back({0, {0.3, -0.4, 1.0}});
  load.history = PulseHistory{0.0, 0.05};
  scene.loads.push_back(load);
  scene.initial.angular_velocity = {-0.8, 0.6, 0.5};
  scene.fidelity = Fidelity::kCoupled;
  scene.rate = 1000.0;
  return scene;
}

TEST(RigidLinks, RigidLinksOnALineKeepEnergyAndMomentum) {
  const Scene scene = points_on_a_line(true);
  const Structure structure = build(scene);
  ASSERT_EQ(structure.mass_properties.rigid_freedoms, 5);
  for (const auto form : {PlanKinetics::Form::kPoints, PlanKinetics::Form::kTables}) {
    Plan plan = without_load_stiffness(compile(scene));
    plan.coupled.kinetics = {};
    compile_kinetics(scene, structure, structure.shapes, form, plan);
    Simulation simulation(std::move(plan));
    simulation.run(50);
    const double energy = energy_of(simulation);
    const Vec3 H = simulation.state.H_W;
    simulation.run(2000);
    EXPECT_NEAR(energy_of(simulation), energy, 1e-9 * energy);
    EXPECT_EQ(simulation.state.H_W, H);
    const Vec3& w = simulation.state.coupled.w_B;
    EXPECT_LT(std::abs(0.6 * w[0] + 0.8 * w[1]), 1e-14) << "points on a line have no spin about it";
    // the momentum is computed from positions and velocities
    const Eigen::Matrix3Xd p = simulation.positions_W(), v = simulation.velocities_W();
    const Eigen::VectorXd mass = masses_of(scene);
    const Eigen::Vector3d centre = p * mass / mass.sum();
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    for (Eigen::Index i = 0; i < p.cols(); ++i)
      sum += mass[i] * (p.col(i) - centre).cross(Eigen::Vector3d(v.col(i)));
    EXPECT_LT((sum - Eigen::Vector3d(H.data())).norm(), 1e-12 * sum.norm());
  }
}

// If only one mode of a pair of bending modes were kept, its bending would push against the frame.
TEST(KeptModesOfALine, ABendingModeWithoutTheOtherModeOfItsPairIsRefused) {
  const Scene scene = points_on_a_line(false);
  const Structure structure = build(scene);
  PlanSpec spec = full_spec(scene, structure, Fidelity::kCoupled);
  spec.modes = {0, 1};  // the lowest bending mode in each of two planes
  Faults faults;
  EXPECT_TRUE(compile(scene, structure, spec, faults).has_value());
  spec.modes = {0};
  EXPECT_FALSE(compile(scene, structure, spec, faults).has_value());
  EXPECT_NE(faults.back().message.find("keep both modes of each transverse pair"), std::string::npos);
}

// The free rotation of a single body agrees with a solution in fifty digits.
TEST(CoupledBody, ABodyAloneRotatesFreelyUpToRoundingErrors) {
  const std::array<double, 3> moment{0.7, 1.1, 1.5}, spin{0.2, 0.9, -0.3};
  Scene scene;
  add_point(scene, 3.0, {0.1, 0.2, 0.3});
  scene.points.back().inertia = Eigen::Vector3d(moment[0], moment[1], moment[2]).asDiagonal();
  scene.publication.points = {0};
  scene.initial.angular_velocity = {spin[0], spin[1], spin[2]};
  const double end = 2.0;
  const WideRotation truth = rotate_freely(moment, spin, end);
  std::vector<double> errors;
  for (const double h : {0.04, 0.02, 0.01, 1e-3}) {
    const Simulation simulation = run_rung(scene, Fidelity::kCoupled, h, end);
    double error = 0.0;
    for (std::size_t k = 0; k < 4; ++k)
      error = std::max(error, std::abs(simulation.state.q_WB[k] - static_cast<double>(truth.q[k])));
    errors.push_back(2.0 * error);
  }
  std::printf("a body alone, 2 s at 1 rad/s: off by %.1e %.1e %.1e rad at 40, 20, 10 ms, %.1e at 1 ms\n",
              errors[0], errors[1], errors[2], errors[3]);
  // the body has no modes, so at any tick length it moves as on the rungs below the coupled rungs
  for (const double error : errors) EXPECT_LT(error, 2e-14);
}

// Random structures with rigid links are compared with a reference at true geometry. A motion with an error
// above 5 % of the scale never gets the verdict `good`.
TEST(Verdict, IsCorrectForRigidLinksOnTheCoupledRung) {
  int num_judged = 0, num_good = 0;
  for (std::uint64_t seed = 1; num_judged < 5; ++seed) {
    const RandomScene random(seed);
    if (!random.has_rigid_links()) continue;
    const auto truth = true_displacements(random.truth(), random.end());
    const JudgedError judged = compare_verdict(random.judged(), Fidelity::kCoupled, random.end(), truth);
    ++num_judged;
    num_good += judged.level == Verdict::Level::kGood;
    EXPECT_TRUE(judged.level != Verdict::Level::kGood || judged.error < 0.05) << seed;
    EXPECT_TRUE(judged.level != Verdict::Level::kOutside || judged.error > 0.01) << seed;
  }
  std::printf("rigid links on coupled: %d of %d verdicts good\n", num_good, num_judged);
}

}  // namespace
}  // namespace freeflex::testing
