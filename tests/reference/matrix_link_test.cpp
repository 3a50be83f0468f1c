// Superelements with rotations on the rung `corotational`: a beam given as a stiffness matrix against the
// beam itself, and the conservation of energy.
#include <gtest/gtest.h>

#include <cmath>

#include "core/motion.hpp"
#include "core/plan/make_plan.hpp"
#include "core/step/links/beam.hpp"
#include "core/step/readout.hpp"
#include "tests/reference/energy_drift.hpp"
#include "tests/reference/structures.hpp"

namespace freeflex::testing {
namespace {

using Eigen::MatrixXd;
using Eigen::Vector3d;

const Beam kBoomBeam{1e5, 300.0, 200.0, 400.0, {0.0, 1.0, 0.0}};

// A chain of six beams, of which two may be superelements.
Scene boom(bool has_matrices) {
  Scene scene;
  for (int i = 0; i < 7; ++i) add_point(scene, 1.0, {0.9 * i, 0.0, 0.05 * i * i});
  for (int i = 0; i < 6; ++i) {
    const Vector3d span = scene.points[index(i + 1)].position - scene.points[index(i)].position;
    Eigen::Matrix3d axes;
    axes << span.normalized(), kBoomBeam.y_axis, span.normalized().cross(kBoomBeam.y_axis);
    MatrixLink matrix;
    matrix.has_rotations = true;
    matrix.matrix = beam_stiffness(kBoomBeam, axes, span.norm()).sparseView();
    if (has_matrices && (i == 1 || i == 4))
      add_link(scene, i, i + 1, matrix);
    else
      add_link(scene, i, i + 1, kBoomBeam);
  }
  scene.fidelity = Fidelity::kCorotational;
  return scene;
}

Eigen::Matrix3Xd positions(const Plan& plan, const MotionState& state) {
  Eigen::Matrix3Xd p(3, static_cast<Eigen::Index>(plan.points.size()));
  for (Eigen::Index i = 0; i < p.cols(); ++i)
    p.col(i) = Eigen::Map<const Vector3d>(read_point(plan, state, static_cast<int>(i)).p_W.data());
  return p;
}

// The matrix has no bow, and no stiffness from the tension within it, so the difference is of second order in
// the motion: it falls at least fourfold when the motion is halved. The boom turns by up to 1.6 rad.
TEST(MatrixLinks, ABeamAsASuperelementMovesLikeTheBeam) {
  double before = HUGE_VAL;
  for (const double size : {0.4, 0.2, 0.1}) {
    Eigen::Matrix3Xd at[2];
    double motion_size = 0.0;
    for (const bool has_matrices : {false, true}) {
      Scene scene = boom(has_matrices);
      scene.rate = 2000.0;
      scene.initial.angular_velocity = size / 0.4 * Vector3d(1.0, -0.5, 3.0);
      Random random(5);
      for (int i = 0; i < 7; ++i)
        scene.initial.points.push_back({i, Vector3d::Zero(), size * random.vector()});
      const Plan plan = compile(scene);
      ASSERT_EQ(plan.coupled.links.matrices.size(), has_matrices ? 2U : 0U);
      Motion motion(plan, kMotionAlone);
      for (int k = 0; k < 1000; ++k) ASSERT_EQ(motion.advance().status, StepStatus::kOk);
      at[has_matrices ? 1 : 0] = positions(plan, motion.state());
      for (std::size_t i = 0; i < 7; ++i)
        motion_size =
            std::max(motion_size, length(read_point(plan, motion.state(), static_cast<int>(i)).V_B));
    }
    const double difference = (at[0] - at[1]).colwise().norm().maxCoeff();
    std::printf("size %.1f: elastic displacement %.3f m, difference %.1e m\n", size, motion_size, difference);
    EXPECT_LT(difference, 0.1 * motion_size);
    EXPECT_LT(difference, 0.3 * before);
    before = difference;
  }
}

// Of order 4: half the step has at most a tenth of the error.
TEST(MatrixLinks, SuperelementsConserveEnergy) {
  double before = HUGE_VAL;
  for (const double rate : {2000.0, 4000.0}) {
    Scene scene = boom(true);
    scene.rate = rate;
    scene.fidelity = Fidelity::kFull;
    scene.initial.angular_velocity = {1.0, -0.5, 3.0};
    const Plan plan = compile(scene);
    const auto [start, most, strain] = energy_drift(plan, static_cast<int>(rate));
    std::printf("%4.0f Hz, %d substeps: energy changes by %.1e of the largest strain energy %.3f J\n", rate,
                plan.coupled.num_substeps, most / strain, strain);
    EXPECT_LT(most, 1e-5 * strain);
    EXPECT_LT(most, 0.1 * before);
    before = most;
  }
}

// Points nearly on a line do not tell how a matrix without rotations turns about it. A roll of 0.1 rad from a
// displacement of 0.15 mm moved a boom by 16 % of its displacement.
TEST(MatrixLinks, ANarrowMatrixWithoutRotationsIsRefused) {
  for (const double camber : {1e-3, 0.2}) {
    Scene scene;
    Eigen::Matrix3Xd p(3, 4);
    for (int i = 0; i < 4; ++i) {
      p.col(i) << i, camber * i * (3 - i), 0.3 * camber * (i % 2);
      add_point(scene, 1.0, p.col(i));
    }
    MatrixXd K = MatrixXd::Zero(12, 12);
    for (int i = 0; i < 4; ++i)
      for (int j = 0; j < i; ++j) {
        Eigen::VectorXd row = Eigen::VectorXd::Zero(12);
        row.segment<3>(3 * i) = (p.col(i) - p.col(j)).normalized();
        row.segment<3>(3 * j) = -row.segment<3>(3 * i);
        K += 1e4 * row * row.transpose();
      }
    MatrixLink matrix;
    matrix.matrix = K.sparseView();
    add_link(scene, {0, 1, 2, 3}, matrix);
    Faults faults;
    const auto plan = make_full_plan(scene, build(scene), Fidelity::kCorotational, faults);
    EXPECT_EQ(plan.has_value(), camber > 0.1);
    if (!plan) {
      EXPECT_NE(faults.back().message.find("on a line or nearly so"), std::string::npos);
    }
  }
}

}  // namespace
}  // namespace freeflex::testing
