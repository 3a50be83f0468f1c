// These tests check damping, loads, and rigid bodies on a line at true geometry.
#include <Eigen/Geometry>
#include <random>

#include "tests/reference/true_geometry.hpp"
#include "tests/support/mixed_structures.hpp"
#include "tests/support/simulation.hpp"
#include "tools/verification/reference/elastic_error.hpp"
#include "tools/verification/reference/integrate.hpp"

namespace freeflex::testing {
namespace {

using Eigen::Matrix3Xd;
using Eigen::Vector3d;
using Eigen::VectorXd;

TEST(TrueDamping, SmallMotionsDecayLikeTheModes) {
  for (std::uint64_t seed = 1; seed <= 4; ++seed) {
    Scene scene = random_mixture(seed, 7);
    scene.damping.modal_ratio = 0.01;
    scene.damping.mode_ratios = {{2, 0.03}};
    scene.damping.alpha = 0.4;
    scene.damping.beta = 2e-5;
    for (std::size_t k = 0; k < scene.links.size(); k += 2)
      if (!std::holds_alternative<Rigid>(scene.links[k].kind)) scene.links[k].loss_factor = 0.02;
    const Structure structure = build(scene);
    const SteadyMotion motion = steady_motion_of(scene);
    // the rates are sorted, so those of the rigid motions come first; every other motion has a pair of rates
    const auto rigid = motion.rates.size() - 2 * structure.omega.size();
    double worst = 0.0;
    for (Eigen::Index k = 0; k < structure.omega.size(); ++k) {
      const double omega = structure.omega[k];
      const double ratio = (k == 1 ? 0.03 : 0.01) + structure.structural_ratio[k];
      const double decay =
          ratio * omega + 0.5 * scene.damping.alpha + 0.5 * scene.damping.beta * omega * omega;
      worst = std::max(worst, std::abs(motion.rates[rigid + 2 * k].real() + decay) / decay);
    }
    std::printf("seed %d: decay off by %.1e\n", static_cast<int>(seed), worst);
    EXPECT_LT(worst, 1e-5);
  }
}

TEST(TrueDamping, ForcesHaveNoResultantAndNoMoment) {
  Scene scene = random_mixture(3, 8);
  scene.damping.modal_ratio = 0.05;
  const CartesianSystem system = true_geometry_of(scene);
  std::mt19937_64 engine(5);
  std::uniform_real_distribution<double> uniform(-1.0, 1.0);
  const auto any = [&](double size) {
    return Matrix3Xd::NullaryExpr(3, 8, [&]() { return size * uniform(engine); }).eval();
  };
  const Matrix3Xd e = any(0.3), e_dot = any(1.0);
  Matrix3Xd force = Matrix3Xd::Zero(3, 8);
  system.true_geometry->add_damping(e, e_dot, force);
  Vector3d moment = Vector3d::Zero();
  for (int i = 0; i < 8; ++i) moment += Vector3d(system.r.col(i) + e.col(i)).cross(Vector3d(force.col(i)));
  EXPECT_LT(force.rowwise().sum().norm(), 1e-12 * force.norm());
  EXPECT_LT(moment.norm(), 1e-12 * force.norm());
  EXPECT_LT(force.cwiseProduct(e_dot).sum(), 0.0);
}

// The loads in each kind of axes are so weak that the motion is nearly linear. The difference from the linear
// modes relative to the motion is proportional to the load.
TEST(TrueLoads, WeakLoadsMoveThePointsAsLinearModesDo) {
  for (const Axes axes : {Axes::kWorld, Axes::kBody, Axes::kLocal}) {
    std::array<double, 2> error{};
    for (std::size_t k = 0; k < 2; ++k) {
      Scene scene = random_mixture(11, 7);
      const double size = k == 0 ? 1.0 : 0.1;  // [N]
      Load load;
      load.axes = axes;
      load.forces = {{2, size * Vector3d(1.0, -0.5, 0.7)}, {5, size * Vector3d(-0.3, 0.8, 0.4)}};
      load.history = PulseHistory{0.0, 0.05};
      scene.loads.push_back(load);
      scene.rate = 4000.0;
      scene.fidelity = Fidelity::kCoupled;
      for (int i = 0; i < 7; ++i) scene.publication.points.push_back(i);
      Simulation simulation(scene);
      simulation.run(480);
      const double times[] = {0.12};
      const CartesianSystem system = true_geometry_of(scene);
      const ReferenceRun run = integrate(system, times);
      ASSERT_EQ(run.error, "");
      const Matrix3Xd truth = elastic_displacements(system.mass, system.r, run.states[0].p_W);
      error[k] = elastic_error(elastic_displacements(system.mass, system.r, simulation.positions_W()), truth);
    }
    std::printf("axes %d: elastic error %.1e at 1 N, %.1e at 0.1 N\n", static_cast<int>(axes), error[0],
                error[1]);
    EXPECT_LT(error[0], 1e-2);
    EXPECT_LT(error[1], 0.15 * error[0] + 1e-5);
  }
}

// A rigid body rotates the beams at its points, even if the points lie on one line.
TEST(TrueRigid, ARigidBodyOnALineRotatesTheBeamsAtItsPoints) {
  for (const bool is_line : {true, false}) {
    Scene scene;
    for (int i = 0; i < 4; ++i) add_point(scene, i == 0 ? 2.0 : 1.0, {static_cast<double>(i), 0.0, 0.0});
    for (int i = 0; i < 3; ++i) add_link(scene, i, i + 1, Beam{1e6, 1e3, 100.0, 100.0});
    add_point(scene, 3.0, {0.0, 0.0, 1.0});
    add_point(scene, 3.0, {0.0, 0.0, -1.0});
    Link body;
    body.points = {0, 4, 5};
    body.kind = Rigid{};
    if (!is_line) body.points.push_back(add_point(scene, 1e-9, {0.0, 1.0, 0.0}));
    scene.links.push_back(body);
    const VectorXd omega = rest_modes(true_geometry_of(scene)).omega / (2.0 * M_PI);
    std::printf("%s: %.4f %.4f %.4f Hz\n", is_line ? "on a line" : "beside it", omega[0], omega[1], omega[2]);
    EXPECT_NEAR(omega[0], 0.84, 0.005);
    EXPECT_NEAR(omega[1], 2.16, 0.005);
    EXPECT_NEAR(omega[2], 3.25, 0.005);
    // core/structure condenses the same body by equations of its own
    const VectorXd linear = build(scene).omega / (2.0 * M_PI);
    for (Eigen::Index k = 0; k < 3; ++k) EXPECT_NEAR(omega[k], linear[k], 1e-7 * linear[k]);
  }
}

// The distances between the points of rigid links stay constant.
TEST(TrueRigid, RigidLinksKeepTheirLengthDuringALongMotion) {
  Scene scene = random_mixture(7, 8);
  scene.initial.angular_velocity = {0.5, 1.5, -1.0};
  const CartesianSystem system = true_geometry_of(scene);
  const double times[] = {0.1, 0.5};
  const ReferenceRun run = integrate(system, times);
  ASSERT_EQ(run.error, "");
  for (const Link& link : scene.links) {
    if (!std::holds_alternative<Rigid>(link.kind)) continue;
    for (const int i : link.points)
      for (const int j : link.points) {
        const double before = (system.r.col(i) - system.r.col(j)).norm();
        const double after = (run.states[1].p_W.col(i) - run.states[1].p_W.col(j)).norm();
        EXPECT_NEAR(after, before, 1e-9);
      }
  }
}

}  // namespace
}  // namespace freeflex::testing
