// The rung `corotational` against the Cartesian reference at true geometry, which shares neither frame,
// coordinates, integrator nor code with it.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "core/motion.hpp"
#include "core/step/readout.hpp"
#include "tests/reference/energy_drift.hpp"
#include "tests/reference/structures.hpp"
#include "tests/reference/true_geometry.hpp"
#include "tests/support/simulation.hpp"
#include "tools/verification/reference/integrate.hpp"

namespace freeflex::testing {
namespace {

using Eigen::Matrix3Xd;
using Eigen::Vector3d;

// Pushes points along axes of all kinds, so that the loads alone would displace them by about `size` times
// the length of a link at the lowest frequency [rad/s].
void push_points(Scene& scene, Random& random, double lowest, double size) {
  const double force = 0.3 * size * lowest * lowest;
  push(scene, 0, Axes::kLocal, force * random.vector());
  // The body axes of rigid bodies meet sum m r x V + sum J theta = 0, those of the reference fit the points
  // best. They differ by third order in the rotation, which was 2e-4 of the displacement here.
  push(scene, 2, scene.links[0].points.size() > 3 ? Axes::kWorld : Axes::kBody, force * random.vector());
  scene.loads.back().history = SineHistory{0.7 * lowest / (2.0 * M_PI), 0.4};
  push(scene, 4, Axes::kWorld, force * random.vector());
  scene.loads.back().history = PulseHistory{0.1, 0.2};
}

// Returns the error of the positions relative to the elastic displacement. Sets `estimate` to that of the
// steps.
double error_at(Scene scene, double rate, double end, const Matrix3Xd& truth, double scale,
                double& estimate) {
  scene.rate = rate;
  const Plan plan = compile(scene);
  Motion motion(plan, kMotionAlone);
  for (long k = 0; k < std::lround(end * rate); ++k)
    if (motion.advance().status != StepStatus::kOk) return HUGE_VAL;
  const CoupledState& steps = motion.state().coupled;
  estimate = (steps.integration_error + steps.filter_error) / scale;
  double sum = 0.0;
  for (std::size_t i = 0; i < scene.points.size(); ++i) {
    const PointState point = read_point(plan, motion.state(), static_cast<int>(i));
    const auto p = Eigen::Map<const Vector3d>(point.p_W.data());
    sum += (p - truth.col(static_cast<Eigen::Index>(i))).squaredNorm();
  }
  return std::sqrt(sum / static_cast<double>(scene.points.size())) / scale;
}

struct Case {
  const char* name;
  Scene (*make)(Random&);
  double size;  // [-] of the initial rates and loads
  // [-] errors at 250, 1000 and 4000 Hz, twice those that were measured
  std::array<double, 3> bounds;
};

void PrintTo(const Case& c, std::ostream* out) { *out << c.name; }

class Corotational : public ::testing::TestWithParam<Case> {};

// The motion begins with a large rotation rate and vibration, and is pushed by loads along axes of all kinds.
// At 250 Hz the filter acts on beams and hinges.
TEST_P(Corotational, ConvergesToTheReference) {
  const Case& c = GetParam();
  Random random(7);
  Scene scene = c.make(random);
  scene.fidelity = Fidelity::kCorotational;
  scene.initial.angular_velocity = c.size * Vector3d(0.8, -1.1, 1.7);
  const Structure structure = build(scene);
  const double lowest =
      *std::find_if(structure.omega.begin(), structure.omega.end(), [](double w) { return w > 0.0; });
  Eigen::VectorXd V = Eigen::VectorXd::Zero(structure.shapes.rows());
  for (Eigen::Index l = 0; l < std::min<Eigen::Index>(6, structure.omega.size()); ++l)
    V +=
        0.1 * c.size * random.one() * lowest / std::max(lowest, structure.omega[l]) * structure.shapes.col(l);
  for (int i = 0; i < static_cast<int>(scene.points.size()); ++i)
    scene.initial.points.push_back({i, Vector3d::Zero(), lowest * V.segment<3>(3 * Eigen::Index{i})});
  push_points(scene, random, lowest, 0.1 * c.size);
  std::string error;
  const auto system = make_true_geometry(scene, error);
  ASSERT_TRUE(system) << error;
  ReferenceOptions options;
  options.tolerance = 1e-10;
  const double end = 0.5;
  const double times[] = {end};
  const ReferenceRun run = integrate(*system, times, options);
  ASSERT_TRUE(run.error.empty()) << run.error;
  std::printf("%-7s omega %.1f to %.0f rad/s:", c.name, lowest, structure.omega.maxCoeff());
  for (std::size_t k = 0; k < 3; ++k) {
    const double rate = 250.0 * std::pow(4.0, static_cast<double>(k));
    double estimate = 0.0;
    const double found = error_at(scene, rate, end, run.states[0].p_W, run.scale.displacement, estimate);
    std::printf("  %.1e (estimate %.0e) at %g Hz", found, estimate, rate);
    EXPECT_LT(found, c.bounds[k]);
    // the verdict takes three times the estimate (THEORY 12.95). Below 1e-6 the reference and the rounding
    // count
    EXPECT_LT(found, 3.0 * estimate + 1e-6);
  }
  std::printf("\n");
}

// The body axes of rigid bodies meet sum m r x V + sum J theta = 0, those of the reference fit the points
// best. They differ by third order in the rotation, so the error of the bodies ends near 1e-6.
INSTANTIATE_TEST_SUITE_P(EveryKindOfLink, Corotational,
                         ::testing::Values(Case{"beams", chain, 1.0, {5e-4, 9e-7, 4e-9}},
                                           Case{"hinge", hinged, 1.0, {2e-2, 5e-5, 3e-7}},
                                           Case{"plates", sheet, 0.1, {8e-7, 2e-9, 4e-10}},
                                           Case{"angles", angles, 1.0, {3e-6, 2e-8, 1e-10}},
                                           Case{"bodies", bodies, 1.0, {4e-4, 4e-8, 2e-10}},
                                           Case{"matrices", matrices, 1.0, {4e-7, 2e-9, 1e-10}},
                                           Case{"sprung", sprung, 1.0, {1e-8, 5e-11, 5e-11}},
                                           Case{"massless", massless, 1.0, {2e-4, 5e-6, 3e-8}},
                                           Case{"rods", rods, 1.0, {2e-4, 5e-7, 3e-9}}),
                         [](const auto& instance) { return instance.param.name; });

struct Momenta {
  Vector3d linear = Vector3d::Zero(), angular = Vector3d::Zero();  // [kg m/s], [kg m^2/s] of the points
  double size = 0.0;                                               // [kg m^2/s] sum m |x| |v|
};
Momenta momenta_of_points(const Scene& scene, const Plan& plan, const Motion& motion) {
  Momenta sum;
  for (std::size_t i = 0; i < scene.points.size(); ++i) {
    const PointState point = read_point(plan, motion.state(), static_cast<int>(i));
    const Vector3d x = Eigen::Map<const Vector3d>(point.p_W.data());
    const Vector3d mv = scene.points[i].mass * Eigen::Map<const Vector3d>(point.v_W.data());
    sum.linear += mv;
    sum.angular += x.cross(mv);
    sum.size += x.norm() * mv.norm();
  }
  return sum;
}

// The momenta of the published points are constant without loads, also where a tick does not resolve the
// stiff modes.
TEST(Momenta, OfThePublishedPointsAreConstant) {
  for (const auto make : {chain, hinged, sheet, angles, sprung}) {
    Random random(7);
    Scene scene = make(random);
    scene.fidelity = Fidelity::kCorotational;
    scene.rate = 250.0;
    scene.initial.angular_velocity = Vector3d(0.8, -1.1, 1.7);
    scene.initial.velocity = Vector3d(0.3, 0.1, -0.2);
    for (int i = 0; i < static_cast<int>(scene.points.size()); ++i)
      scene.initial.points.push_back({i, Vector3d::Zero(), 0.05 * random.vector()});
    const Plan plan = compile(scene);
    Motion motion(plan, kMotionAlone);
    const Momenta start = momenta_of_points(scene, plan, motion);
    double worst = 0.0;
    for (int k = 0; k < 1000; ++k) {
      ASSERT_EQ(motion.advance().status, StepStatus::kOk);
      const Momenta now = momenta_of_points(scene, plan, motion);
      worst = std::max({worst, (now.angular - start.angular).norm() / start.size,
                        (now.linear - start.linear).norm() / start.linear.norm()});
    }
    std::printf("momenta change by %.1e\n", worst);
    EXPECT_LT(worst, 1e-13);
  }
}

// Velocities and accelerations of points are those of their published positions. The differences over two
// ticks of 1/8000 s have an error of order h^2.
TEST_P(Corotational, ReadsTheRatesOfThePublishedPositions) {
  const Case& c = GetParam();
  Random random(7);
  Scene scene = c.make(random);
  scene.fidelity = Fidelity::kFull;
  scene.rate = 8000.0;
  scene.initial.angular_velocity = c.size * Vector3d(0.8, -1.1, 1.7);
  push(scene, 2, Axes::kBody, c.size * random.vector());
  push(scene, 4, Axes::kWorld, c.size * random.vector());
  const Plan plan = compile(scene);
  Motion motion(plan, kMotionAlone);
  std::vector<PointState> states[3];
  for (long k = 0; k < 2402; ++k) {
    ASSERT_EQ(motion.advance().status, StepStatus::kOk);
    if (k < 2399) continue;
    for (std::size_t i = 0; i < scene.points.size(); ++i)
      states[k - 2399].push_back(read_point(plan, motion.state(), static_cast<int>(i)));
  }
  double of_v = 0.0, of_a = 0.0, v = 0.0, a = 0.0;
  const auto at = [](const Vec3& x) { return Eigen::Map<const Vector3d>(x.data()); };
  for (std::size_t i = 0; i < scene.points.size(); ++i) {
    const PointState &before = states[0][i], &now = states[1][i], &after = states[2][i];
    const Vector3d mean = 0.5 * scene.rate * (at(after.p_W) - at(before.p_W));
    const Vector3d gain = 0.5 * scene.rate * (at(after.v_W) - at(before.v_W));
    of_v = std::max(of_v, (mean - at(now.v_W)).norm());
    of_a = std::max(of_a, (gain - at(now.a_W)).norm());
    v = std::max(v, at(now.v_W).norm());
    a = std::max(a, at(now.a_W).norm());
  }
  std::printf("%-7s velocity off by %.1e of %.2g m/s, acceleration by %.1e of %.2g m/s^2\n", c.name, of_v, v,
              of_a, a);
  EXPECT_LT(of_v, 1e-5 * v);
  EXPECT_LT(of_a, 5e-4 * a);
}

// A hub with inertia, an offset and a wheel carries a boom. The reference has no wheels, so the test checks
// the conservation of energy.
TEST(TurningBodies, ABodyWithAWheelAndABoomConservesEnergy) {
  Scene scene;
  for (int i = 0; i < 4; ++i) add_point(scene, i == 0 ? 6.0 : 0.8, {1.2 * i, 0.1 * i, 0.0});
  scene.points[0].inertia << 3.0, 0.2, 0.1, 0.2, 2.0, 0.0, 0.1, 0.0, 4.0;
  scene.points[0].offset = {0.05, -0.1, 0.02};
  for (int i = 0; i < 3; ++i) add_link(scene, i, i + 1, Beam{2e5, 300.0, 60.0, 90.0, {0.0, 1.0, 0.2}});
  Wheel wheel;
  wheel.name = "wheel";
  wheel.point = 0;
  wheel.axis = Vector3d(0.3, -0.5, 0.8).normalized();
  wheel.momentum = 1.5;
  scene.wheels = {wheel};
  scene.fidelity = Fidelity::kFull;
  scene.initial.angular_velocity = {0.7, -0.4, 1.1};
  scene.initial.points = {{3, {0.0, 0.0, 0.0}, {0.0, 0.1, 0.3}}};
  double before = 0.0;
  for (const double rate : {500.0, 1000.0}) {
    scene.rate = rate;
    const Plan plan = compile(scene);
    ASSERT_EQ(plan.coupled.turning.bodies.size(), 1U);
    const auto [start, most, strain] = energy_drift(plan, 4 * static_cast<int>(rate));
    std::printf("%4.0f Hz, %d substeps: energy %.9f J, changes by %.1e of the largest strain energy %.3f J\n",
                rate, plan.coupled.num_substeps, start, most / strain, strain);
    if (before > 0.0 && plan.coupled.num_substeps == 1) {
      EXPECT_LT(most, 0.2 * before);
    }
    EXPECT_LT(most, 1e-6 * strain);
    before = most;
  }
}

// Couples at both ends bend a beam with bodies at its ends to half a circle and further. There the bodies
// have turned by 90 degrees, and no other mass defines the rotation of the frame about the line of the beam.
// Without the fault, the velocity across the plane rose from 3e-7 to 1.7 m/s in 0.1 s. A body in the middle
// defines the frame.
TEST(TurningBodies, AFrameThatBodiesDoNotDefineIsAFault) {
  for (const bool has_middle : {false, true}) {
    constexpr int kElements = 8;
    constexpr double kArm = 0.1;
    Scene scene;
    for (int i = 0; i <= kElements; ++i) add_point(scene, 0.1, {i / 8.0, 0.0, 0.0});
    for (const int at : {0, kElements, kElements / 2}) {
      if (at == kElements / 2 && !has_middle) continue;
      std::vector<int> body{at};
      for (const Vector3d& arm : {Vector3d(0.0, kArm, 0.0), Vector3d(0.0, -kArm, 0.0),
                                  Vector3d(0.0, 0.0, kArm), Vector3d(0.0, 0.0, -kArm)})
        body.push_back(add_point(scene, 0.05, scene.points[static_cast<std::size_t>(at)].position + arm));
      add_link(scene, body, Rigid{});
      if (at == kElements / 2) continue;
      for (const int side : {1, -1}) {
        const double force = side * (at == 0 ? 1.0 : -1.0) * M_PI / kArm;
        push(scene, body[side > 0 ? 1 : 2], Axes::kLocal, {force, 0.0, 0.0});
        scene.loads.back().history = TableHistory{{0.0, 2.0, 20.0}, {0.0, 1.0, 1.0}};
      }
    }
    for (int i = 0; i < kElements; ++i)
      add_link(scene, i, i + 1, Beam{2e3, 20.0, 20.0, 1.0, {0.0, 1.0, 0.0}});
    scene.initial.points = {{3, {0.0, 0.0, 0.0}, {0.0, 0.0, 1e-6}}};
    scene.rate = 4000.0;
    scene.fidelity = Fidelity::kFull;
    const Plan plan = compile(scene);
    Motion motion(plan, kMotionAlone);
    StepReport report;
    double across = 0.0;
    long tick = 0;
    for (; tick < 4400 && report.status == StepStatus::kOk; ++tick) {
      report = motion.advance();
      across = std::max(across, std::abs(read_point(plan, motion.state(), 2).v_W[2]));
    }
    std::printf("%s middle body: tick %ld, %.1e m/s across\n", has_middle ? "with" : "without", tick, across);
    EXPECT_LT(across, 1e-5);
    EXPECT_EQ(report.status, has_middle ? StepStatus::kOk : StepStatus::kNoFrame);
    if (has_middle) continue;
    EXPECT_GT(tick, 3000);
    EXPECT_NE(lost_shape_text(plan, report, tick).find("the axes of the body are lost"), std::string::npos);
  }
}

// Gives a scene its rate, a slow rotation, and elastic velocities of its lowest six modes.
void set_in_motion(Scene& scene, Random& random, double phase, double kick, double& lowest) {
  scene.fidelity = Fidelity::kCorotational;
  const Structure structure = build(scene);
  Eigen::Index first = 0;
  while (structure.omega[first] == 0.0) ++first;
  lowest = structure.omega[first];
  scene.rate = structure.omega.maxCoeff() / phase;
  scene.initial.angular_velocity = 0.3 * std::min(lowest, 20.0) * random.vector();
  const auto count = static_cast<Eigen::Index>(scene.points.size());
  Eigen::VectorXd V = Eigen::VectorXd::Zero(3 * count);
  for (Eigen::Index l = first; l < std::min(first + 6, structure.omega.size()); ++l)
    V += random.one() * lowest / structure.omega[l] * structure.shapes.col(l).head(3 * count);
  const double size = structure.mass_properties.r.colwise().norm().maxCoeff();
  V *= kick * size * std::sqrt(static_cast<double>(count)) / V.norm();
  for (Eigen::Index i = 0; i < count; ++i)
    scene.initial.points.push_back({static_cast<int>(i), Vector3d::Zero(), lowest * V.segment<3>(3 * i)});
}

// A random frame of 5 to 9 points with beams, and a plate or a body with inertia. The fastest mode advances
// by `phase` [rad] in a tick, and the lowest six are kicked by `kick` times the size of the frame.
Scene frame(unsigned seed, double phase, double kick, double& lowest) {
  Random random(seed);
  const auto between = [&](double a, double b) { return a * std::pow(b / a, 0.5 * (random.one() + 1.0)); };
  Scene scene;
  const int count = 5 + static_cast<int>(seed % 5);
  for (int i = 0; i < count; ++i)
    add_point(scene, between(0.5, 5.0), Vector3d(i % 3, i / 3 % 3, i / 9.0) + 0.3 * random.vector());
  const double EA = between(1e4, 1e8);
  const auto beam = [&] {
    const double EI = between(50.0, 2000.0);
    return Beam{EA * between(0.5, 2.0), EI * between(0.3, 1.5), EI, EI * between(0.4, 2.5), {0.3, 0.2, 0.9}};
  };
  for (int i = 0; i + 1 < count; ++i) add_link(scene, i, i + 1, beam());
  for (int k = 0; k < static_cast<int>(seed % 4); ++k) add_link(scene, k, count - 1 - k % 2, beam());
  if (seed % 3 == 1) add_link(scene, {0, 1, 3}, Plate{between(1e6, 1e9), 0.3, 0.02});
  if (seed % 3 == 2) {
    scene.points[0].inertia = between(0.01, 3.0) * Vector3d(1.0, 1.2, 1.5).asDiagonal();
    scene.points[0].offset = {0.05, 0.02, -0.03};
  }
  set_in_motion(scene, random, phase, kick, lowest);
  return scene;
}

// Bodies with little inertia in a chain of beams: their rotations have the highest frequencies.
Scene light_bodies(double phase, double kick, double& lowest) {
  Random random(1);
  Scene scene;
  for (int i = 0; i < 6; ++i) add_point(scene, 1.0 + 0.2 * (i % 3), {1.0 * i, 0.3 * (i % 2), 0.2 * (i % 3)});
  for (const std::size_t body : {2, 4})
    scene.points[body].inertia = 1e-3 * Vector3d(1.0, 1.2, 1.5).asDiagonal();
  for (int i = 0; i < 5; ++i) add_link(scene, i, i + 1, Beam{2e4, 300.0, 500.0, 400.0, {0.3, 0.2, 0.9}});
  set_in_motion(scene, random, phase, kick, lowest);
  return scene;
}

// A hub with inertia carries a jet and the foot of a boom on a rigid link. Jet and foot have the mass `mass`.
Scene craft(double mass) {
  Scene scene;
  add_point(scene, 6.0, Vector3d::Zero());
  scene.points[0].inertia << 3.0, 0.2, 0.1, 0.2, 2.0, 0.0, 0.1, 0.0, 4.0;
  scene.points[0].offset = {0.05, -0.1, 0.15};
  add_point(scene, mass, {-0.4, 0.3, 0.2});
  add_point(scene, mass, {0.5, 0.0, 0.1});
  add_link(scene, {0, 1, 2}, Rigid{});
  for (int i = 3; i < 6; ++i) {
    add_point(scene, 0.8, {1.2 * i - 2.4, 0.1 * i, 0.0});
    add_link(scene, i - 1, i, kBeam);
  }
  scene.fidelity = Fidelity::kCorotational;
  scene.rate = 1000.0;
  scene.initial.angular_velocity = {0.7, -0.3, 0.5};
  return scene;
}

Vector3d tip_after(const Scene& scene, double time) {
  const Plan plan = compile(scene);
  Motion motion(plan, kMotionAlone);
  for (long k = 0; k < std::lround(time * scene.rate); ++k)
    EXPECT_EQ(motion.advance().status, StepStatus::kOk);
  const PointState tip = read_point(plan, motion.state(), static_cast<int>(scene.points.size()) - 1);
  return {tip.p_W[0], tip.p_W[1], tip.p_W[2]};
}

TEST(TurningBodies, AMasslessPointOfABodyMovesAndIsPushedWithIt) {
  const Vector3d force(3.0, -8.0, 5.0);
  Scene scene = craft(0.0);
  push(scene, 1, Axes::kLocal, force);
  const Vector3d tip = tip_after(scene, 1.0);
  // the same wrench on the hub
  Scene wrench = craft(0.0);
  push(wrench, 0, Axes::kLocal, force);
  wrench.loads[0].torques.push_back({0, (scene.points[1].position - scene.points[0].position).cross(force)});
  EXPECT_LT((tip_after(wrench, 1.0) - tip).norm(), 1e-12);
  // the limit of light points: the difference is of the order of their mass
  const auto of_mass = [&](double mass) {
    Scene light = craft(mass);
    push(light, 1, Axes::kLocal, force);
    return (tip_after(light, 1.0) - tip).norm();
  };
  const double coarse = of_mass(1e-5), fine = of_mass(1e-6);
  std::printf("points of 1e-5 and 1e-6 kg change the motion by %.2e and %.2e m\n", coarse, fine);
  EXPECT_LT(coarse, 1e-4);
  EXPECT_NEAR(coarse / fine, 10.0, 0.1);
}

struct Growth {
  double rise = 0.0;  // [-] largest rise of the energy over the largest elastic energy
  StepStatus status = StepStatus::kOk;
};
Growth growth(const Plan& plan, long ticks) {
  Motion motion(plan, kMotionAlone);
  const auto energy = [&](double& elastic) {
    const Invariants all = read_invariants(plan, motion.state());
    elastic = all.kinetic_elastic + all.potential;
    return all.kinetic_rigid + elastic;
  };
  Growth result;
  double elastic = 0.0, rise = 0.0;
  motion.advance();
  const double start = energy(elastic);
  double most = elastic;
  for (long k = 0; k < ticks && result.status == StepStatus::kOk; ++k) {
    result.status = motion.advance().status;
    if (k % 20 != 0 || result.status != StepStatus::kOk) continue;
    rise = std::max(rise, energy(elastic) - start);
    most = std::max(most, elastic);
  }
  result.rise = rise / most;
  return result;
}

// The energy of undamped motion must not grow, however coarse the tick is for the stiff modes.
TEST(Filter, UndampedVibrationsOfRandomFramesDoNotGrow) {
  double worst = 0.0;
  for (const double phase : {3.1, 6.0, 20.0, 60.0})
    for (unsigned seed = 0; seed < 10; ++seed) {
      double lowest = 0.0;
      const Scene scene = frame(seed, phase, 0.01, lowest);
      const Plan plan = compile(scene);
      ASSERT_TRUE(plan.coupled.curve.is_filtered);
      const double period = 2.0 * M_PI / lowest;
      const Growth found = growth(plan, std::lround(std::min(10.0 * period * scene.rate, 5000.0)));
      worst = std::max(worst, found.rise);
      EXPECT_EQ(found.status, StepStatus::kOk) << "seed " << seed << ", " << phase << " rad a tick";
      EXPECT_LT(found.rise, 5e-3) << "seed " << seed << ", " << phase << " rad a tick";
    }
  std::printf("largest rise of the energy %.1e of the elastic energy\n", worst);
}

// A frame like those above.
TEST(Filter, WithoutItVibrationsOfAFrameGrow) {
  double lowest = 0.0;
  Plan plan = compile(frame(12, 6.0, 0.01, lowest));
  EXPECT_LT(growth(plan, 5000).rise, 5e-3);
  plan.coupled.curve.is_filtered = false;
  const double without = growth(plan, 5000).rise;
  std::printf("without the filter the energy rises by %.2f\n", without);
  EXPECT_GT(without, 0.1);
}

// With two evaluations at each stage this motion fails at tick 757, after its energy has doubled.
TEST(Filter, TheSlowMotionIsFoundAtEachStage) {
  double lowest = 0.0;
  const Growth found = growth(compile(frame(4, 60.0, 0.03, lowest)), 1000);
  EXPECT_EQ(found.status, StepStatus::kOk);
  EXPECT_LT(found.rise, 1e-3);
}

// The moments of the joints of these stiff booms are rounded to some 4e-10 m/s^2, which is more than the miss
// that ends the iteration where the slow motion hardly moves. All 12 trials would be made at each stage. In
// the short boom the miss is less than that of a vibration by 1e-9 of the size. The long one vibrates so
// slowly that this bound is below the rounding, and the trials end because they no longer improve.
TEST(Filter, TrialsEndWhereOnlyRoundingIsLeft) {
  for (const int count : {20, 80}) {
    Scene scene;
    for (int i = 0; i < count; ++i)
      add_point(scene, 1.0, {0.5 * i, 0.2 * std::sin(i), 0.2 * std::cos(1.3 * i)});
    for (int i = 0; i + 1 < count; ++i)
      add_link(scene, i, i + 1, Beam{1.8e9, 2.5e5, 3.6e5, 3.6e5, {0.0, 0.0, 1.0}});
    scene.damping.modal_ratio = 0.01;
    scene.fidelity = Fidelity::kCorotational;
    scene.rate = 1000.0;
    Simulation boom(scene);
    int most = 0;
    for (int k = 0; k < 100; ++k) {
      boom.run(1);
      most = std::max(most, boom.workspace.coupled.curve.num_tried);
    }
    std::printf("%d points: at most %d trials a stage\n", count, most);
    EXPECT_LE(most, 8);
  }
}

// Rotations of bodies are not axial, but as stiff. Unfiltered they resonate. The energy rises by 3e-5 a
// period, here by 1.4e-2 in 460 periods.
TEST(Filter, FastRotationsOfLightBodiesAreFiltered) {
  double lowest = 0.0;
  Plan plan = compile(light_bodies(20.0, 0.01, lowest));
  const Growth found = growth(plan, 20000);
  EXPECT_EQ(found.status, StepStatus::kOk);
  EXPECT_LT(found.rise, 0.03);
  PlanCurve& curve = plan.coupled.curve;
  for (std::size_t k = curve.stiff.size(); k-- > 0;) {
    if (curve.is_axial[static_cast<std::size_t>(curve.stiff[k])] != 0) continue;
    curve.stiff.erase(curve.stiff.begin() + static_cast<std::ptrdiff_t>(k));
    curve.filter.erase(curve.filter.begin() + static_cast<std::ptrdiff_t>(k));
  }
  const Growth without = growth(plan, 20000);
  std::printf("rise %.1e, without the rotations %.1e\n", found.rise, without.rise);
  EXPECT_GT(without.rise, 0.15);
}

// Without the shorter steps, a joint of this motion has no equilibrium after tick 92.
TEST(Joints, StepsThatGoTooFarAreShortened) {
  double lowest = 0.0;
  EXPECT_EQ(growth(compile(frame(31, 3.1, 0.03, lowest)), 500).status, StepStatus::kOk);
}

// Points on a line do not say how far they turned about it.
TEST(LocalLoads, WithoutARotationAboutALineAreAWarning) {
  const auto num_warnings = [](bool has_beam, const Vector3d& third, const Vector3d& force) {
    Scene scene;
    for (const Vector3d& at : {Vector3d(0.0, 0.0, 0.0), Vector3d(1.0, 0.0, 0.0), third})
      add_point(scene, 1.0, at);
    add_link(scene, 0, 1, Bar{1e4});
    if (has_beam)
      add_link(scene, 1, 2, kBeam);
    else
      add_link(scene, 1, 2, Bar{1e4});
    scene.fidelity = Fidelity::kCorotational;
    push(scene, 1, Axes::kLocal, force);
    Faults faults;
    const auto structure = build_structure(scene, faults);
    EXPECT_TRUE(structure && make_plan(scene, *structure, faults));
    return std::count_if(faults.begin(), faults.end(), [](const Fault& fault) {
      return fault.message.find("acts in local axes at point 'p1'") != std::string::npos;
    });
  };
  const Vector3d on_line(2.0, 0.0, 0.0), beside(1.0, 1.0, 0.0), x(1.0, 0.0, 0.0), y(0.0, 1.0, 0.0);
  EXPECT_EQ(num_warnings(false, on_line, y), 1);
  EXPECT_EQ(num_warnings(false, on_line, x), 0);
  EXPECT_EQ(num_warnings(false, beside, y), 0);
  EXPECT_EQ(num_warnings(true, on_line, y), 0);
}

// A reset begins the estimates of the error anew.
TEST(Filter, AResetForgetsTheEstimates) {
  double lowest = 0.0;
  const Plan plan = compile(frame(0, 6.0, 0.01, lowest));
  Motion motion(plan, kMotionAlone);
  for (int k = 0; k < 100; ++k) motion.advance();
  EXPECT_GT(motion.state().coupled.filter_error, 0.0);
  EXPECT_GT(motion.state().coupled.integration_error, 0.0);
  motion.reset();
  EXPECT_EQ(motion.state().coupled.filter_error, 0.0);
  EXPECT_EQ(motion.state().coupled.integration_error, 0.0);
}

}  // namespace
}  // namespace freeflex::testing
