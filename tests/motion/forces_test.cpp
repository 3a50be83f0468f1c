// The forces of links of every kind balance loads and inertia, rigid links stay rigid, and mechanisms keep
// their rates.
#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <cstdio>
#include <random>

#include "core/plan/loads/quasi_static.hpp"
#include "core/scene/link_kinds.hpp"
#include "core/structure/links/link_factor.hpp"
#include "tests/setup/make_scene.hpp"
#include "tests/support/simulation.hpp"
#include "tests/support/structures.hpp"

namespace freeflex::testing {
namespace {

// Returns a scene with every kind of link except plates, whose resultants are not forces on points.
Scene every_kind() {
  Scene scene;
  std::mt19937_64 engine(17);
  std::uniform_real_distribution<double> jitter(-0.2, 0.2), mass(0.5, 4.0);
  for (int i = 0; i < 12; ++i)
    add_point(
        scene, mass(engine),
        {1.5 * (i % 3) + jitter(engine), 1.5 * (i / 3 % 2) + jitter(engine), 1.5 * (i / 6) + jitter(engine)});
  for (int i = 0; i < 12; ++i)
    for (int j = 0; j < i; ++j)
      if ((i + 2 * j) % 3 != 0 && !(i == 1 && j == 0)) add_link(scene, {i, j}, Spring{2e4});
  add_link(scene, {2, 8}, Bar{3e4});
  add_link(scene, {3, 4}, Beam{2e5, 400.0, 300.0, 500.0, Eigen::Vector3d::Zero()});
  add_link(scene, {4, 10}, Beam{2e5, 400.0, 300.0, 500.0, Eigen::Vector3d::Zero(), 4e3, 5e3});
  add_link(scene, {0, 5, 9}, BendingSpring{120.0});
  add_link(scene, {1, 2, 6, 7}, TorsionSpring{90.0});
  add_link(scene, {0, 1}, Rigid{});
  add_link(scene, {6, 9, 11}, Rigid{});
  const int viscous = add_link(scene, {5, 11}, Spring{4e4});
  scene.links[static_cast<std::size_t>(viscous)].viscous = 3e-3;
  add_link(scene, {0, 7}, Dashpot{40.0});
  Eigen::MatrixXd K(6, 6);
  const Eigen::Vector3d u = (scene.points[10].position - scene.points[2].position).normalized();
  K << u * u.transpose(), -u * u.transpose(), -u * u.transpose(), u * u.transpose();
  add_link(scene, {2, 10}, MatrixLink{(7e3 * K).sparseView()});
  for (std::size_t i = 0; i < scene.links.size(); ++i) scene.publication.links.push_back(static_cast<int>(i));
  publish_everything(scene);
  scene.publication.links.clear();
  for (std::size_t i = 0; i < scene.links.size(); ++i) scene.publication.links.push_back(static_cast<int>(i));
  return scene;
}

/// Returns the forces of all links on the points, in body axes, from the published values.
Eigen::Matrix3Xd forces_on_points(const Scene& scene, const Simulation& simulation) {
  Eigen::Matrix3Xd force = Eigen::Matrix3Xd::Zero(3, static_cast<Eigen::Index>(scene.points.size()));
  const auto at = [&](int i) { return Eigen::Vector3d(scene.points[static_cast<std::size_t>(i)].position); };
  for (std::size_t k = 0; k < simulation.plan.link_outputs.size(); ++k) {
    const PlanLinkOutput& output = simulation.plan.link_outputs[k];
    const Link& link = scene.links[static_cast<std::size_t>(output.link)];
    std::vector<double> values(static_cast<std::size_t>(output.num_rows));
    read_link(simulation.plan, simulation.state, static_cast<int>(k), values);
    const Eigen::Map<const Eigen::VectorXd> v(values.data(), output.num_rows);
    const auto apply = [&](const DeformationRow& row, double s) {
      for (const auto& [freedom, coefficient] : row.coefficients)
        force(freedom % 3, freedom / 3) -= coefficient * s;
    };
    if (std::holds_alternative<Beam>(link.kind)) {
      const Eigen::Matrix3d axes = axes_of(scene, link);
      force.col(link.points[0]) -= axes * v.segment<3>(0);
      force.col(link.points[1]) -= axes * v.segment<3>(6);
    } else if (std::holds_alternative<BendingSpring>(link.kind)) {
      const DeformationRows rows = bending_rows(scene, link);
      for (std::size_t r = 0; r < rows.size(); ++r) apply(rows[r], values[r]);
    } else if (std::holds_alternative<TorsionSpring>(link.kind)) {
      const DeformationRows rows = torsion_rows(scene, link);
      apply(rows[0], values[0]);
    } else if (v.size() == 1) {
      const Eigen::Vector3d pull = v[0] * (at(link.points[1]) - at(link.points[0])).normalized();
      force.col(link.points[0]) += pull;
      force.col(link.points[1]) -= pull;
    } else {
      for (std::size_t p = 0; p < link.points.size(); ++p)
        force.col(link.points[p]) += v.segment<3>(3 * static_cast<Eigen::Index>(p));
    }
  }
  return force;
}

/// Returns the part of a load that strains the structure: F - S at each point, where S is the part that
/// accelerates the structure as a rigid body (THEORY 11.1 to 11.3).
Eigen::Matrix3Xd straining_part(const Scene& scene, const Plan& plan, const std::vector<PointLoad>& loads) {
  const auto num_points = static_cast<Eigen::Index>(scene.points.size());
  Eigen::Matrix3Xd F = Eigen::Matrix3Xd::Zero(3, num_points), r(3, num_points);
  for (Eigen::Index i = 0; i < num_points; ++i)
    r.col(i) = Eigen::Map<const Eigen::Vector3d>(plan.points[static_cast<std::size_t>(i)].r.data());
  for (const PointLoad& each : loads) F.col(each.point) += each.force;
  const Eigen::Vector3d R = F.rowwise().sum();
  Eigen::Vector3d L = Eigen::Vector3d::Zero();
  for (Eigen::Index i = 0; i < num_points; ++i) L += r.col(i).cross(F.col(i));
  const Eigen::Matrix3d inertia =
      Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(plan.inertia.data());
  const Eigen::Vector3d alpha = inertia.ldlt().solve(L);
  for (Eigen::Index i = 0; i < num_points; ++i)
    F.col(i) -= plan.points[static_cast<std::size_t>(i)].mass * (R / plan.mass + alpha.cross(r.col(i)));
  return F;
}

/// Returns m V'' of every point from the equations of motion of the elastic coordinates.
Eigen::Matrix3Xd elastic_inertia(const Simulation& simulation) {
  const Plan& plan = simulation.plan;
  const State& state = simulation.state;
  const auto n = static_cast<std::size_t>(plan.num_padded);
  Eigen::Matrix3Xd force = Eigen::Matrix3Xd::Zero(3, static_cast<Eigen::Index>(plan.points.size()));
  for (std::size_t mode = 0; mode < static_cast<std::size_t>(plan.num_elastic); ++mode) {
    const double q_ddot = state.Q[mode] / plan.mass - 2.0 * plan.decay[mode] * state.q_dot[mode] -
                          std::pow(plan.omega[mode], 2) * state.q[mode];
    for (std::size_t i = 0; i < plan.points.size(); ++i)
      for (std::size_t a = 0; a < 3; ++a)
        force(static_cast<Eigen::Index>(a), static_cast<Eigen::Index>(i)) +=
            plan.points[i].mass *
            plan.rows[(3 * static_cast<std::size_t>(plan.points[i].row) + a) * n + mode] * q_ddot;
  }
  return force;
}

// The bound is 1e-10 F_max, which is larger than 10 eps k_max |V|_max.
void expect_balance(const char* when, const Eigen::Matrix3Xd& left, double largest) {
  const double worst = left.colwise().norm().maxCoeff();
  std::printf("%s: link forces balance to %.1e N of %.1e N\n", when, worst, largest);
  EXPECT_LT(worst, 1e-10 * largest) << when;
}

// Expects m V'' = F - S + link forces at every point, where F - S is the straining part of the load.
// Meanwhile every kind of link moves under a body-fixed load.
void expect_balance_in_motion(const char* when, Scene scene, const std::vector<int>& ticks) {
  scene.initial.points.push_back({3, {1e-5, -2e-5, 1e-5}, {1e-3, 0.0, -1e-3}});
  Load load;
  load.name = "push";
  load.axes = Axes::kBody;
  load.forces = {{8, {3.0, -2.0, 5.0}}, {0, {-1.0, 4.0, 2.0}}};
  scene.loads.push_back(load);
  Simulation simulation(scene);
  const Eigen::Matrix3Xd strain = straining_part(scene, simulation.plan, load.forces);
  for (const int more : ticks) {
    simulation.run(more);
    const Eigen::Matrix3Xd links = forces_on_points(scene, simulation);
    expect_balance(when, strain + links - elastic_inertia(simulation), links.colwise().norm().maxCoeff());
  }
}

TEST(LinkForces, LinkForcesBalanceTheLoadsAndTheAccelerationsOfEveryPoint) {
  expect_balance_in_motion("moving", every_kind(), {1, 50, 500});
}

// The links, including beams and the supports of rigid links, carry the stiffness-proportional part of
// Rayleigh damping.
TEST(LinkForces, LinkForcesAlsoBalanceWithRayleighDamping) {
  Scene scene = every_kind();
  scene.damping.beta = 2e-3;
  expect_balance_in_motion("damped", scene, {1, 5, 50});
}

// The force of a spring is k (d + beta d'). At the start d = 0 and d' = 2e-3 m/s, so the force is 100 N/m x
// 0.05 s x 2e-3 m/s.
TEST(LinkForces, TheForceOfADampedSpringAtRestLengthDependsOnItsRate) {
  Scene scene;
  add_point(scene, 1.0, {0.0, 0.0, 0.0});
  add_point(scene, 1.0, {1.0, 0.0, 0.0});
  add_link(scene, {0, 1}, Spring{100.0});
  publish_everything(scene);
  scene.initial.points = {{0, Eigen::Vector3d::Zero(), {-1e-3, 0.0, 0.0}},
                          {1, Eigen::Vector3d::Zero(), {1e-3, 0.0, 0.0}}};
  scene.damping.beta = 0.05;
  EXPECT_NEAR(Simulation(scene).link_forces()[0], 0.01, 1e-17);
  scene.damping.beta = 0.02;
  scene.links[0].viscous = 0.03;
  EXPECT_NEAR(Simulation(scene).link_forces()[0], 0.01, 1e-17);
}

TEST(LinkForces, LinkForcesBalanceASteadyLoad) {
  const Scene scene = every_kind();
  Simulation simulation(scene);
  const std::vector<PointLoad> loads{{8, {3.0, -2.0, 5.0}}, {0, {-1.0, 4.0, 2.0}}};
  const std::vector<PointForce> forces{{8, 0, {3.0, -2.0, 5.0}}, {0, 0, {-1.0, 4.0, 2.0}}};
  std::string error;
  const std::optional<State> state = quasi_static(simulation.plan, {forces, {}, {}}, error);
  ASSERT_TRUE(state) << error;
  simulation.state = *state;
  const Eigen::Matrix3Xd links = forces_on_points(scene, simulation);
  expect_balance("steady", straining_part(scene, simulation.plan, loads) + links,
                 links.colwise().norm().maxCoeff());
}

// Plates publish resultants. The forces on points that follow from the natural forces of the plates balance
// the loads too.
TEST(LinkForces, ForcesOfPlatesBalanceTheLoads) {
  Scene scene;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) add_point(scene, 1.0 + 0.1 * i, {0.5 * i, 0.4 * j, 0.1 * i * j});
  for (int i = 0; i < 2; ++i)
    for (int j = 0; j < 2; ++j) {
      const int a = 3 * i + j;
      add_link(scene, {a, a + 3, a + 4}, Plate{7e7, 0.3, 0.01});
      add_link(scene, {a, a + 4, a + 1}, Plate{7e7, 0.3, 0.01});
    }
  publish_everything(scene);
  Simulation simulation(scene);
  const std::vector<PointForce> forces{{8, 0, {1.0, -2.0, 3.0}}};
  std::string error;
  const std::optional<State> state = quasi_static(simulation.plan, {forces, {}, {}}, error);
  ASSERT_TRUE(state) << error;
  simulation.state = *state;
  const Eigen::Matrix3Xd V = simulation.displacements_B();
  const Eigen::VectorXd stacked = Eigen::Map<const Eigen::VectorXd>(V.data(), V.size());
  Faults faults;
  const LinkFactor factor = factor_links(scene, true, faults);
  Eigen::Matrix3Xd links = Eigen::Matrix3Xd::Zero(3, V.cols());
  for (std::size_t k = 0; k < scene.links.size(); ++k) {
    const Eigen::VectorXd natural = natural_forces(factor, static_cast<int>(k)) * stacked;
    for (int row = 0; row < factor.natural_of[k].count; ++row)
      for (const auto& [freedom, coefficient] :
           factor.natural[static_cast<std::size_t>(factor.natural_of[k].first + row)].coefficients)
        if (freedom < stacked.size()) links(freedom % 3, freedom / 3) -= coefficient * natural[row];
  }
  expect_balance("plates", straining_part(scene, simulation.plan, {{8, {1.0, -2.0, 3.0}}}) + links,
                 links.colwise().norm().maxCoeff());
}

TEST(RigidLinks, RigidLinksKeepTheirLengthInMotion) {
  Scene scene = every_kind();
  Load load;
  load.name = "push";
  load.forces = {{8, {30.0, -20.0, 50.0}}};
  scene.loads.push_back(load);
  Simulation simulation(scene);
  double worst = 0.0, moved = 0.0;
  for (int k = 0; k < 20; ++k) {
    simulation.run(100);
    const Eigen::Matrix3Xd V = simulation.displacements_B();
    for (const auto& [i, j] : {std::pair{0, 1}, {6, 9}, {9, 11}, {6, 11}}) {
      const Eigen::Vector3d span = scene.points[static_cast<std::size_t>(j)].position -
                                   scene.points[static_cast<std::size_t>(i)].position;
      worst = std::max(worst, std::abs(span.normalized().dot(V.col(j) - V.col(i))) / span.norm());
      moved = std::max(moved, (V.col(j) - V.col(i)).norm() / span.norm());
    }
  }
  std::printf("rigid pairs: elongation %.1e of their length while they move by %.1e of it\n", worst, moved);
  EXPECT_GT(moved, 1e-6);
  EXPECT_LT(worst, 1e-14);
}

TEST(RigidLinks, AFullyRigidStructureMovesAsARigidBody) {
  Scene scene;
  for (const Eigen::Vector3d& at : {Eigen::Vector3d(0, 0, 0), Eigen::Vector3d(1, 0, 0),
                                    Eigen::Vector3d(0, 2, 0), Eigen::Vector3d(0, 0, 3)})
    add_point(scene, 1.0 + at.sum(), at);
  add_link(scene, {0, 1, 2, 3}, Rigid{});
  publish_everything(scene);
  scene.publication.links = {0};
  scene.initial.angular_velocity = {0.3, -0.2, 0.4};
  Simulation simulation(scene);
  ASSERT_EQ(simulation.plan.num_elastic, 0);
  ASSERT_EQ(simulation.plan.link_outputs.size(), 1u);
  simulation.run(1000);
  const Eigen::Matrix3Xd p = simulation.positions_W();
  EXPECT_NEAR((p.col(3) - p.col(2)).norm(), std::sqrt(13.0), 1e-14);
  EXPECT_EQ(simulation.link_forces().size(), 12);
}

// A force of 7 N pulls one end of a rigid pair. Half of the force accelerates each end, so the link carries
// half of the force.
TEST(RigidLinks, RigidLinksCarryTheForceThatAcceleratesTheirPoints) {
  Scene scene;
  add_point(scene, 2.0, {0.0, 0.0, 0.0});
  add_point(scene, 2.0, {1.0, 0.0, 0.0});
  add_link(scene, {0, 1}, Rigid{});
  publish_everything(scene);
  scene.publication.links = {0};
  Load load;
  load.name = "pull";
  load.axes = Axes::kBody;
  load.forces = {{1, {7.0, 0.0, 0.0}}};
  scene.loads.push_back(load);
  Simulation simulation(scene);
  simulation.run(10);
  EXPECT_NEAR(simulation.link_forces()[0], 3.5, 1e-14);
}

// Three bars on a line bend freely, and a square without diagonals shears freely. The mechanisms of both
// structures keep their initial rates.
TEST(Mechanisms, MechanismsKeepTheirInitialRatesExactly) {
  Scene chain;
  for (int i = 0; i < 4; ++i) add_point(chain, 1.0 + i, {1.0 * i, 0.0, 0.0});
  for (int i = 0; i < 3; ++i) add_link(chain, {i, i + 1}, Bar{1e5});
  Scene square;
  for (const auto& [x, y] : {std::pair{0.0, 0.0}, {1.0, 0.0}, {1.0, 1.0}, {0.0, 1.0}})
    add_point(square, 1.0, {x, y, 0.0});
  for (int i = 0; i < 4; ++i) add_link(square, {i, (i + 1) % 4}, Bar{1e5});
  for (auto& [scene, count] : {std::pair<Scene&, int>{chain, 4}, {square, 2}}) {
    publish_everything(scene);
    scene.initial.modes.push_back({1, 1e-3, 2e-4});
    scene.initial.modes.push_back({2, -3e-3, 1e-4});
    Simulation simulation(scene);
    EXPECT_EQ(simulation.plan.mechanisms.size(), static_cast<std::size_t>(count));
    for (const auto& moved : simulation.plan.mechanisms) EXPECT_FALSE(moved.empty());
    simulation.run(100000);
    const double t = 100000 * simulation.plan.period;
    EXPECT_EQ(simulation.state.q_dot[0], 2e-4);
    EXPECT_EQ(simulation.state.q_dot[1], 1e-4);
    // the value after 100,000 ticks has one rounding error
    EXPECT_NEAR(simulation.state.q[0], 1e-3 + 2e-4 * t, 2.3e-16 * 0.03);
    EXPECT_NEAR(simulation.state.q[1], -3e-3 + 1e-4 * t, 2.3e-16 * 0.03);
  }
}

}  // namespace
}  // namespace freeflex::testing
