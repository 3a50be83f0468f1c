// These tests check the conserved quantities and the order of convergence of the Cartesian reference. They
// also check the fit of a rigid motion, from which the elastic error is measured.
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <random>

#include "tests/reference/system_of.hpp"
#include "tests/support/structures.hpp"
#include "tools/verification/reference/elastic_error.hpp"
#include "tools/verification/reference/integrate.hpp"

namespace freeflex {
namespace {

using Eigen::Matrix3Xd;
using Eigen::Vector3d;

// Returns a truss that does not spin about a principal axis and deforms by centimetres, so that its motion is
// strongly nonlinear.
Scene wild_truss() {
  Scene scene = testing::square_truss(5);
  scene.initial.angular_velocity = {0.7, -1.1, 2.0};
  scene.initial.velocity = {0.3, 0.0, -0.2};
  scene.initial.points.push_back({18, {0.0, 0.02, -0.03}, {0.0, 0.0, 1.0}});
  scene.initial.points.push_back({2, {-0.02, 0.0, 0.01}, {0.5, 0.0, 0.0}});
  return scene;
}

TEST(CartesianReference, AFreeSystemConservesEnergyAndLinearAndAngularMomentum) {
  const CartesianSystem system = system_of(wild_truss());
  const std::vector<double> times = {1e-9, 0.5, 1.0};
  ReferenceOptions options;
  options.tolerance = 1e-11;
  const ReferenceRun run = integrate(system, times, options);
  ASSERT_EQ(run.error, "");
  const CartesianInvariants first = invariants(system, run.states[0]);
  for (std::size_t k = 1; k < times.size(); ++k) {
    const CartesianInvariants sum = invariants(system, run.states[k]);
    const double energy = first.kinetic + run.strain_energy[0];
    // the bound allows for local errors of 1e-11 of the elastic scale in some thousand steps
    EXPECT_NEAR(sum.kinetic + run.strain_energy[k], energy, 1e-9 * energy);
    EXPECT_LT((sum.linear_momentum - first.linear_momentum).norm(), 1e-11 * first.linear_momentum.norm());
    EXPECT_LT((sum.angular_momentum - first.angular_momentum).norm(), 1e-9 * first.angular_momentum.norm());
  }
}

TEST(CartesianReference, TheGainInEnergyEqualsTheWorkOfTheLoad) {
  // the work of a constant force in world axes is F times the displacement of its point
  Scene scene = testing::square_truss(5);
  Load load;
  const Vector3d force(3.0, -4.0, 12.0);
  load.forces.push_back({18, force});
  scene.loads.push_back(load);
  const CartesianSystem system = system_of(scene);
  const double times[] = {0.8};
  const ReferenceRun run = integrate(system, times);
  ASSERT_EQ(run.error, "");
  const Vector3d start = scene.points[18].position;
  const double work = force.dot(Vector3d(run.states[0].p_W.col(18)) - start);
  const double gained = invariants(system, run.states[0]).kinetic + run.strain_energy[0];
  EXPECT_NEAR(gained, work, 1e-8 * work);
}

double order_at(const CartesianSystem& system, ReferenceMethod method, double step, const Matrix3Xd& truth) {
  const double times[] = {0.25};
  double errors[4];
  for (int k = 0; k < 4; ++k) {
    ReferenceOptions options;
    options.method = method;
    options.fixed_step = step / (1 << k);
    const ReferenceRun run = integrate(system, times, options);
    EXPECT_EQ(run.error, "");
    errors[k] = (run.states[0].p_W - truth).norm();
  }
  double lowest = 1e9;
  for (int k = 0; k < 3; ++k) {
    const double order = std::log2(errors[k] / errors[k + 1]);
    std::printf("step %.3g s: position error %.3e m, order %.2f\n", step / (1 << k), errors[k], order);
    lowest = std::min(lowest, order);
  }
  return lowest;
}

// If a solver reuses the last stage of a step as the first slope of the next step, both orders fall, so each
// step must evaluate its own first slope.
TEST(CartesianReference, FixedStepMethodsConvergeAtTheirOrder) {
  const CartesianSystem system = system_of(wild_truss());
  const double times[] = {0.25};
  ReferenceOptions options;
  options.fixed_step = 1.0 / 8192;
  const ReferenceRun truth = integrate(system, times, options);
  ASSERT_EQ(truth.error, "");
  EXPECT_GT(order_at(system, ReferenceMethod::kRungeKutta4, 1.0 / 1024, truth.states[0].p_W), 3.7);
  EXPECT_GT(order_at(system, ReferenceMethod::kFehlberg78, 1.0 / 512, truth.states[0].p_W), 7.0);
}

TEST(CartesianReference, RungeKuttaAndAdamsAgreeWithinTheirEstimates) {
  for (const Scene& scene : {testing::truss_s1(), wild_truss()}) {
    const CartesianSystem system = system_of(scene);
    const double times[] = {0.5, 1.0};
    ReferenceOptions options;
    options.tolerance = 1e-9;
    const ReferenceRun runge_kutta = integrate_with_estimate(system, times, options);
    options.method = ReferenceMethod::kAdams;
    options.tolerance = 1e-10;
    const ReferenceRun adams = integrate_with_estimate(system, times, options);
    ASSERT_EQ(runge_kutta.error + adams.error, "");
    const double bound = runge_kutta.accuracy + adams.accuracy;
    std::printf("%s: estimates %.2e (Fehlberg 8), %.2e (Adams)\n", scene.name.c_str(), runge_kutta.accuracy,
                adams.accuracy);
    EXPECT_LT(bound, 1e-2);
    for (std::size_t k = 0; k < 2; ++k) {
      const Matrix3Xd u = elastic_displacements(system.mass, system.r, runge_kutta.states[k].p_W);
      const Matrix3Xd v = elastic_displacements(system.mass, system.r, adams.states[k].p_W);
      EXPECT_LT(elastic_error(v, u), bound);
    }
  }
}

TEST(CartesianReference, AForceInBodyAxesRotatesWithTheFittedAxes) {
  // a force in body axes acts through the centre of a stiff body that spins about z, so it rotates in world
  // axes
  Scene scene = testing::octahedron();
  constexpr double kSpin = 3.0, kForce = 2.0, kT = 0.9;
  scene.initial.angular_velocity = {0.0, 0.0, kSpin};
  Load load;
  load.axes = Axes::kBody;
  // half of the force acts on each of the two points on the x axis, so it has no moment about the centre
  for (const int point : {0, 1}) load.forces.push_back({point, {0.5 * kForce, 0.0, 0.0}});
  scene.loads.push_back(load);
  const CartesianSystem system = system_of(scene);
  const double times[] = {kT};
  const ReferenceRun run = integrate(system, times);
  ASSERT_EQ(run.error, "");
  const Vector3d expected = kForce / kSpin * Vector3d(std::sin(kSpin * kT), 1.0 - std::cos(kSpin * kT), 0.0);
  // the centrifugal stretch of 1e-5 m changes the inertia, and so the spin, by a fraction of 1e-5
  EXPECT_LT((invariants(system, run.states[0]).linear_momentum - expected).norm(), 1e-4 * expected.norm());
}

TEST(ElasticError, TheDisplacementsMeetEckartsConditionsAndExcludeRigidMotion) {
  std::mt19937_64 engine(11);
  std::uniform_real_distribution<double> uniform(-1.0, 1.0);
  for (const double angle : {0.0, 1e-8, 0.7, 3.14159}) {
    for (const double amplitude : {0.0, 1e-7, 1e-2}) {
      Matrix3Xd rest(3, 9), V(3, 9);
      Eigen::VectorXd mass(9);
      for (int i = 0; i < 9; ++i) {
        mass[i] = std::pow(10.0, uniform(engine));
        for (int a = 0; a < 3; ++a) rest(a, i) = uniform(engine);
        for (int a = 0; a < 3; ++a) V(a, i) = amplitude * uniform(engine);
      }
      const Eigen::AngleAxisd rotation(angle, Vector3d(1.0, -2.0, 0.5).normalized());
      const Matrix3Xd p_W = (rotation.toRotationMatrix() * (rest + V)).colwise() + Vector3d(3.0, -7.0, 2.0);
      const Matrix3Xd u = elastic_displacements(mass, rest, p_W);
      // rounding errors of coordinates of up to 10 m
      constexpr double kRounding = 1e-14;
      const Vector3d centre = rest * mass / mass.sum();
      Vector3d moment = Vector3d::Zero();
      for (int i = 0; i < 9; ++i)
        moment += mass[i] * Vector3d(rest.col(i) - centre).cross(Vector3d(u.col(i)));
      EXPECT_LT((u * mass).norm(), kRounding * mass.sum());
      EXPECT_LT(moment.norm(), kRounding * mass.sum());
      // the fitted displacement is at least a tenth and at most ten times the given displacement
      EXPECT_LE(u.norm(), 10.0 * V.norm() + kRounding);
      EXPECT_GE(u.norm(), 0.1 * V.norm() - kRounding);
      EXPECT_LT((elastic_displacements(mass, rest, rest + V) - u).norm(), 10.0 * kRounding);
    }
  }
}

TEST(ElasticError, ACollinearShapeIsFittedByTheSmallestRotation) {
  const Eigen::VectorXd mass = Eigen::Vector3d(1.0, 2.0, 1.0);
  Matrix3Xd rest(3, 3), bent(3, 3);
  rest << -1.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0;
  bent << -1.0, 0.0, 1.0, 1e-6, -1e-6, 1e-6, 0.0, 0.0, 0.0;
  EXPECT_LT((elastic_displacements(mass, rest, bent) - (bent - rest)).norm(), 1e-16);
  const Eigen::Matrix3d rotation = Eigen::AngleAxisd(0.4, Vector3d::UnitZ()).toRotationMatrix();
  EXPECT_LT((elastic_displacements(mass, rest, rotation * bent) - (bent - rest)).norm(), 1e-15);
}

}  // namespace
}  // namespace freeflex
