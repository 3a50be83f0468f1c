// These tests compare the rung `coupled`, with any set of modes and with rigid links, with Lagrange's
// equations in accelerations.
#include <gtest/gtest.h>

#include <cstdio>
#include <numeric>

#include "core/plan/compile.hpp"
#include "core/plan/make_plan.hpp"
#include "core/plan/rungs/kinetics.hpp"
#include "tests/motion/lagrange_equations.hpp"
#include "tests/motion/rung_cases.hpp"
#include "tests/motion/watched.hpp"
#include "tests/setup/make_scene.hpp"

namespace freeflex::testing {
namespace {

using Form = PlanKinetics::Form;

// Returns a plan in the given form, which the set-up might not choose.
Plan in_form(const Scene& scene, const Structure& structure, const PlanSpec& spec, Form form) {
  Faults faults;
  std::optional<Plan> plan = compile(scene, structure, spec, faults);
  for (const Fault& fault : faults) EXPECT_NE(fault.severity, Fault::Severity::kError) << fault.message;
  if (!plan) return {};
  std::vector<int> modes = spec.modes;
  Eigen::MatrixXd shapes(structure.shapes.rows(),
                         static_cast<Eigen::Index>(modes.size()) + structure.constraint_shapes.cols());
  shapes << structure.shapes(Eigen::all, modes), structure.constraint_shapes;
  Structure few = structure;
  few.shapes = structure.shapes(Eigen::all, modes);
  plan->coupled.kinetics = {};
  compile_kinetics(scene, few, shapes, form, *plan);
  return without_load_stiffness(*plan);
}

// Returns five points with nine elastic modes of some 20 to 110 rad/s.
Scene five_points() {
  Scene scene;
  const std::vector<Eigen::Vector3d> positions{
      {0.0, 0.0, 0.0}, {1.1, 0.1, 0.0}, {0.2, 0.9, 0.1}, {0.3, 0.2, 1.2}, {1.0, 1.1, 0.8}};
  for (std::size_t i = 0; i < positions.size(); ++i)
    add_point(scene, 1.0 + 0.3 * static_cast<double>(i), positions[i]);
  join_all(scene, 900.0);
  for (int i = 0; i < 5; ++i) scene.publication.points.push_back(i);
  scene.pushable = scene.publication.points;
  scene.initial.angular_velocity = {0.7, -1.1, 2.3};
  scene.rate = 1000.0;
  return scene;
}

PlanSpec spec_of(const Scene& scene, const Structure& structure, const std::vector<int>& modes) {
  PlanSpec spec = full_spec(scene, structure, Fidelity::kCoupled);
  spec.modes = modes;
  for (Eigen::Index l = 0; l < spec.initial.q.size(); ++l) {
    spec.initial.q[l] = 0.02 * std::cos(1.0 + static_cast<double>(l));
    spec.initial.q_dot[l] = 0.5 * std::sin(2.0 + static_cast<double>(l));
  }
  return spec;
}

// Returns the largest difference of coordinates and attitude from the solution of the equations in
// accelerations.
double error_of(const Simulation& simulation, const Eigen::VectorXd& y, Eigen::Index n) {
  const Eigen::Map<const Eigen::VectorXd> q(simulation.state.q.data(), n);
  const Quat& a = simulation.state.q_WB;
  Eigen::Vector4d attitude(a[1], a[2], a[3], a[0]);
  if (attitude.dot(y.tail<4>()) < 0.0) attitude = -attitude;
  return std::max((q - y.head(n)).cwiseAbs().maxCoeff(), (attitude - y.tail<4>()).cwiseAbs().maxCoeff());
}

// Returns the accelerations of all points [m/s^2] (3 x N) in body axes, for loads without a resultant.
Eigen::Matrix3Xd accelerations_B(const AssumedShapes& equations, const Eigen::VectorXd& y) {
  const Eigen::VectorXd z = equations.accelerations(y), q = y.head(equations.n()),
                        q_dot = y.segment(equations.n(), equations.n());
  const Eigen::Vector3d w = equations.spin(y), w_dot = z.head<3>();
  Eigen::Matrix3Xd a(3, equations.mass.size());
  for (Eigen::Index i = 0; i < a.cols(); ++i) {
    const auto b = equations.b.middleRows<3>(3 * i);
    const Eigen::Vector3d x = equations.r.col(i) + b * q, V_dot = b * q_dot;
    a.col(i) = w_dot.cross(x) + w.cross(w.cross(x)) + 2.0 * w.cross(V_dot) + b * z.tail(equations.n());
  }
  return a;
}

// Adds two forces in world axes that stretch and rotate the body.
void pull(Scene& scene, AssumedShapes& equations) {
  const Eigen::Vector3d force(3.0, -2.0, 4.0);
  scene.loads.clear();
  Load load;
  load.name = "pull";
  load.forces = {{0, force}, {3, -force}};
  load.history = ConstantHistory{};
  scene.loads.push_back(load);
  equations.force.col(0) = force;
  equations.force.col(3) = -force;
}

// Adds c (u . (b_j - b_i))^2 to the damping matrix for each dashpot.
void damp(const Scene& scene, AssumedShapes& equations) {
  equations.damping = Eigen::MatrixXd::Zero(equations.n(), equations.n());
  for (const Link& link : scene.links) {
    const auto* dashpot = std::get_if<Dashpot>(&link.kind);
    if (dashpot == nullptr) continue;
    const Eigen::Index i = 3 * link.points[0], j = 3 * link.points[1];
    const Eigen::RowVector3d u = (equations.r.col(j / 3) - equations.r.col(i / 3)).normalized().transpose();
    const Eigen::RowVectorXd rate = u * (equations.b.middleRows<3>(j) - equations.b.middleRows<3>(i));
    equations.damping += dashpot->damping * rate.transpose() * rate;
  }
}

void expect_order_four(Scene scene, const std::vector<int>& modes, Form form, const char* what) {
  const Structure structure = build(scene);
  AssumedShapes equations = assumed_shapes(structure, modes);
  pull(scene, equations);
  damp(scene, equations);
  PlanSpec spec = spec_of(scene, structure, modes);
  constexpr double kEnd = 0.5;
  const Eigen::VectorXd y = equations.run(
      equations.start(spec.initial.q(modes), spec.initial.q_dot(modes), scene.initial.angular_velocity), kEnd,
      400);
  std::vector<double> errors;
  for (const double rate : {500.0, 1000.0, 2000.0, 4000.0, 16000.0}) {
    spec.rate = rate;
    Simulation simulation(in_form(scene, structure, spec, form));
    simulation.run(std::llround(kEnd * rate));
    errors.push_back(error_of(simulation, y, equations.n()));
    if (rate < 16000.0) continue;
    const Eigen::Matrix3Xd a = AssumedShapes::attitude(y).toRotationMatrix() * accelerations_B(equations, y);
    for (int i = 0; i < a.cols(); ++i) {
      const Vec3 read = read_point(simulation.plan, simulation.state, i).a_W;
      EXPECT_LT((Eigen::Map<const Eigen::Vector3d>(read.data()) - a.col(i)).norm(), 1e-10 * a.norm()) << i;
    }
  }
  std::printf("%s, %d of %d modes: error %.1e %.1e %.1e %.1e at 500 to 4000 Hz, %.1e at 16 kHz\n", what,
              static_cast<int>(modes.size()), static_cast<int>(structure.omega.size()), errors[0], errors[1],
              errors[2], errors[3], errors[4]);
  for (std::size_t k = 1; k < 4; ++k) EXPECT_NEAR(std::log2(errors[k - 1] / errors[k]), 4.0, 0.35) << what;
  EXPECT_LT(errors[4], 2e-12);
}

TEST(KeptModes, ObeyLagrangesEquations) {
  const Scene scene = five_points();
  for (const Form form : {Form::kPoints, Form::kTables}) {
    expect_order_four(scene, {0, 2, 5}, form, form == Form::kPoints ? "points" : "tables");
    expect_order_four(scene, {1, 3, 4, 6, 7, 8}, form, form == Form::kPoints ? "points" : "tables");
  }
}

TEST(KeptModes, KeptModesWithDashpotsObeyLagrangesEquations) {
  Scene scene = five_points();
  add_link(scene, 0, 2, Dashpot{8.0});
  add_link(scene, 1, 4, Dashpot{15.0});
  expect_order_four(scene, {0, 2, 5, 7}, Form::kPoints, "dashpots by points");
  expect_order_four(scene, {0, 2, 5, 7}, Form::kTables, "dashpots by tables");
}

TEST(KeptModes, KeptModesMoveLikeTheSameModesOfTheFullStructure) {
  Scene scene = five_points();
  scene.fidelity = Fidelity::kCoupled;
  scene.initial.velocity = {0.1, 0.2, -0.3};
  Load load;
  load.axes = Axes::kWorld;
  load.forces.push_back({3, {4.0, -9.0, 5.0}});
  load.history = PulseHistory{0.0, 0.2};
  scene.loads.push_back(load);
  const Structure whole = build(scene);
  PlanSpec spec = full_spec(scene, whole, Fidelity::kCoupled);
  spec.modes = {0, 1, 2, 3};
  Simulation few(in_form(scene, whole, spec, Form::kPoints));
  few.run(400);
  scene.modes.count = 4;
  Faults faults;
  const std::optional<Plan> plan = make_plan(scene, build(scene), faults);
  ASSERT_TRUE(plan) << faults.front().message;
  ASSERT_EQ(plan->num_elastic, 4);
  // the structure is small, so its shadow has all modes and true geometry
  ASSERT_EQ(plan->verdict.shadows.size(), 1U);
  EXPECT_EQ(plan->verdict.shadows[0].plan.num_elastic, whole.omega.size());
  EXPECT_EQ(plan->verdict.shadows[0].plan.fidelity, Fidelity::kCorotational);
  EXPECT_EQ(plan->verdict.shared, SharedError::kNone);
  Simulation kept(without_load_stiffness(*plan));
  kept.run(400);
  EXPECT_LT((kept.positions_W() - few.positions_W()).cwiseAbs().maxCoeff(), 1e-12);
  EXPECT_GT(few.displacements_B().cwiseAbs().maxCoeff(), 1e-3)
      << "the structure must bend for the test to have a meaning";
}

TEST(KeptModes, AllKeptModesTogetherMoveLikeTheCompleteSet) {
  Scene scene = boxed_truss(5.0, 100.0);
  scene.rate = 1000.0;
  const Structure structure = build(scene);
  PlanSpec spec = full_spec(scene, structure, Fidelity::kCoupled);
  Simulation complete(in_form(scene, structure, spec, Form::kComplete));
  complete.run(500);
  const Eigen::Matrix3Xd p = complete.positions_W(), V = complete.displacements_B();
  for (const Form form : {Form::kPoints, Form::kTables}) {
    Simulation some(in_form(scene, structure, spec, form));
    some.run(500);
    const double position = (some.positions_W() - p).cwiseAbs().maxCoeff(),
                 elastic = elastic_error(some.displacements_B(), V);
    const double velocity = (some.velocities_W() - complete.velocities_W()).cwiseAbs().maxCoeff();
    std::printf("all modes by %s: %.1e m, elastic %.1e\n", form == Form::kPoints ? "points" : "tables",
                position, elastic);
    // the bound allows for the rounding errors of 500 ticks at w h = 0.8
    EXPECT_LT(position, 1e-12);
    EXPECT_LT(elastic, 1e-10);
    EXPECT_LT(velocity, 1e-10);
  }
}

// Returns a rigid bar and a rigid triangle among springs. The structure has twelve elastic freedoms minus
// four constraints.
Scene with_rigid_links() {
  Scene scene = five_points();
  add_point(scene, 0.7, {1.6, -0.8, 0.5});
  scene.publication.points.push_back(5);
  scene.pushable = scene.publication.points;
  scene.links.clear();
  scene.publication.links = {add_link(scene, {0, 3}, Rigid{})};
  add_link(scene, {1, 2, 4}, Rigid{});
  for (int i = 0; i < 6; ++i)
    for (int j = 0; j < i; ++j)
      if (!(j == 0 && i == 3) && !(i != 5 && i != 3 && j != 0 && j != 3))
        add_link(scene, j, i, Spring{900.0 + 40.0 * (i + j)});
  return scene;
}

std::vector<int> first_modes(Eigen::Index count) {
  std::vector<int> modes(static_cast<std::size_t>(count));
  std::iota(modes.begin(), modes.end(), 0);
  return modes;
}

TEST(RigidLinks, RigidLinksOnTheCoupledRungObeyLagrangesEquations) {
  const Scene scene = with_rigid_links();
  const Structure structure = build(scene);
  ASSERT_EQ(structure.num_constraints, 4);
  ASSERT_EQ(structure.omega.size(), 3 * 6 - 6 - 4);
  for (const Form form : {Form::kPoints, Form::kTables})
    expect_order_four(scene, first_modes(structure.omega.size()), form,
                      form == Form::kPoints ? "rigid links by points" : "rigid links by tables");
}

// Returns the tension of the rigid bar from the balance of forces on the points: m a - F - elastic forces =
// forces of rigid bar and triangle + m alpha x r. Here alpha is the second-order effect of linear links on a
// deformed shape (THEORY 12.37).
double tension_of_bar(const Scene& scene, const AssumedShapes& equations, const Eigen::VectorXd& y) {
  const Eigen::Matrix3d R = AssumedShapes::attitude(y).toRotationMatrix();
  const Eigen::VectorXd q = y.head(equations.n());
  Eigen::Matrix3Xd held = accelerations_B(equations, y) * equations.mass.asDiagonal();
  held -= R.transpose() * equations.force;
  const auto direction = [&](int i, int j) {
    return Eigen::Vector3d((equations.r.col(j) - equations.r.col(i)).normalized());
  };
  for (const Link& link : scene.links) {
    const auto* spring = std::get_if<Spring>(&link.kind);
    if (spring == nullptr) continue;
    const int i = link.points[0], j = link.points[1];
    const Eigen::Vector3d u = direction(i, j);
    const double tension =
        spring->stiffness * u.dot((equations.b.middleRows<3>(3 * j) - equations.b.middleRows<3>(3 * i)) * q);
    held.col(i) -= tension * u;
    held.col(j) += tension * u;
  }
  Eigen::MatrixXd columns = Eigen::MatrixXd::Zero(held.size(), 7);
  const std::array<std::array<int, 2>, 4> bars{{{0, 3}, {1, 2}, {1, 4}, {2, 4}}};
  for (std::size_t k = 0; k < bars.size(); ++k) {
    const Eigen::Vector3d u = direction(bars[k][0], bars[k][1]);
    columns.block<3, 1>(3 * bars[k][0], static_cast<Eigen::Index>(k)) = u;
    columns.block<3, 1>(3 * bars[k][1], static_cast<Eigen::Index>(k)) = -u;
  }
  for (Eigen::Index i = 0; i < held.cols(); ++i)
    for (int axis = 0; axis < 3; ++axis)
      columns.block<3, 1>(3 * i, 4 + axis) =
          equations.mass[i] *
          Eigen::Vector3d(Eigen::Vector3d::Unit(axis).cross(Eigen::Vector3d(equations.r.col(i))));
  const Eigen::Map<const Eigen::VectorXd> all(held.data(), held.size());
  const Eigen::VectorXd solved = columns.colPivHouseholderQr().solve(all);
  EXPECT_LT((columns * solved - all).norm(), 1e-10 * all.norm());
  return solved[0];
}

TEST(RigidLinks, RigidLinksPublishTheForcesFromSpinAndLoads) {
  Scene scene = with_rigid_links();
  const Structure structure = build(scene);
  AssumedShapes equations = assumed_shapes(structure, first_modes(structure.omega.size()));
  pull(scene, equations);
  scene.fidelity = Fidelity::kCoupled;
  scene.rate = 4000.0;
  const auto n = equations.n();
  const Eigen::VectorXd y = equations.run(
      equations.start(Eigen::VectorXd::Zero(n), Eigen::VectorXd::Zero(n), scene.initial.angular_velocity),
      0.5, 400);
  const double expected = tension_of_bar(scene, equations, y);
  for (const Form form : {Form::kPoints, Form::kTables}) {
    Simulation simulation(in_form(scene, structure, full_spec(scene, structure, Fidelity::kCoupled), form));
    simulation.run(2000);
    EXPECT_NEAR(simulation.link_forces()[0], expected, 1e-9 * std::abs(expected));
  }
  std::printf("tension of the rigid bar %.6f N\n", expected);
}

TEST(KeptModes, ModesChosenByAToleranceMeetThatTolerance) {
  Scene scene = boxed_truss(0.5, 100.0);
  scene.pushable.clear();
  scene.fidelity = Fidelity::kCoupled;
  scene.rate = 1000.0;
  scene.leave_out.horizon = 2.0;
  Simulation full(plan_of(scene));
  for (const double tolerance : {0.3, 0.03}) {
    scene.leave_out.tolerance = tolerance;
    Faults faults;
    const auto plan = make_plan(scene, build(scene), faults);
    ASSERT_TRUE(plan.has_value());
    EXPECT_LT(plan->num_elastic, full.plan.num_elastic);
    EXPECT_NE(plan->coupled.kinetics.form, Form::kComplete);
    Simulation reduced(*plan);
    full = Simulation(plan_of(scene));
    double largest = 0.0, off = 0.0;
    for (int k = 0; k < 200; ++k) {
      full.run(10);
      reduced.run(10);
      const Eigen::Matrix3Xd V = full.displacements_B();
      largest = std::max(largest, V.colwise().norm().maxCoeff());
      off = std::max(off, (reduced.displacements_B() - V).colwise().norm().maxCoeff());
    }
    const PlanFeature& feature = plan->features[static_cast<std::size_t>(Feature::kSmallModes)];
    std::printf("tolerance %g: %d of %d modes, displacements off by %.1e of the largest, estimated %.1e\n",
                tolerance, plan->num_elastic, full.plan.num_elastic, off / largest, feature.relative_error);
    EXPECT_LE(off, tolerance * largest);
    EXPECT_LE(off, feature.error);
  }
}

TEST(KeptModes, AWarningSaysThatNoModeIsBelowTheGivenFrequency) {
  Scene scene = five_points();
  scene.modes.below = 1e-3;
  Faults faults;
  const std::optional<Plan> plan = make_plan(scene, build(scene), faults);
  ASSERT_TRUE(plan);
  EXPECT_EQ(plan->num_elastic, 0);
  ASSERT_EQ(faults.size(), 1U);
  EXPECT_NE(faults[0].message.find("no elastic mode is below 0.001 Hz"), std::string::npos)
      << faults[0].message;
}

// A scene cannot refer by number to modes that are not kept.
TEST(KeptModes, InitialStateAndDampingMayReferOnlyToKeptModes) {
  for (const bool is_damping : {false, true}) {
    Scene scene = five_points();
    scene.modes.count = 2;
    if (is_damping)
      scene.damping.mode_ratios = {{5, 0.1}};
    else
      scene.initial.modes = {{5, 0.1, 0.0}};
    Faults faults;
    EXPECT_FALSE(build_structure(scene, faults));
    ASSERT_EQ(faults.size(), 1U);
    EXPECT_NE(faults[0].message.find("names elastic mode 5, but there are only 2"), std::string::npos);
  }
}

// The rung `corotational` supports rigid links, with another structure than the rungs below.
TEST(BestRung, TheShadowOfAPlanWithRigidLinksHasTrueGeometry) {
  Scene scene = with_rigid_links();
  for (const Fidelity rung : {Fidelity::kSpinLoaded, Fidelity::kCoupled, Fidelity::kCorotational}) {
    scene.fidelity = rung;
    Watched watched(scene);
    ASSERT_EQ(watched.plan.verdict.shadows.size(), 1U);
    EXPECT_EQ(watched.plan.verdict.shadows.front().plan.fidelity, Fidelity::kCorotational);
    EXPECT_EQ(watched.plan.verdict.shared, SharedError::kNone) << watched.plan.verdict.shared_text;
    const Verdict& verdict = watched.run(400);
    const double error = verdict.error.deformation / verdict.scale;
    std::printf("rigid links on %s: %.1e of the scale\n", name_of(rung), error);
    if (rung == Fidelity::kCorotational)
      EXPECT_LT(error, 1e-6);
    else
      EXPECT_GT(error, 1e-3);
  }
}

}  // namespace
}  // namespace freeflex::testing
