// These tests compare the centrifugal load and the field of an attractor with the full Cartesian system.
#include "tests/reference/separated_cases.hpp"

namespace freeflex::testing {
namespace {

double error_at(const Scene& scene, const FullSystem& full) {
  return elastic_error(separated(scene, full, 1000.0), full.u);
}

// The expected figures come from an independent prototype of the same equations, compared with an
// extrapolation code of order 16 in extended precision. The centrifugal load is most of the effect of the
// spin, but the rung `spin-loaded` omits Coriolis forces and the reaction on the frame.
TEST(SpinLoad, HasTheExpectedElasticErrorOnTheShortTruss) {
  struct Row {
    double spin, separated, spin_loaded;
  };
  for (const Row& row : {Row{0.0, 4.2e-4, 2.6e-4}, Row{0.01, 2.3e-3, 7.5e-4}, Row{0.1, 6.2e-2, 6.2e-3}}) {
    Scene scene = truss_s5(row.spin);
    ReferenceOptions options;
    options.tolerance = 1e-9;
    const FullSystem full = full_system(scene, options, false);
    const double plain = error_at(scene, full);
    scene.fidelity = Fidelity::kSpinLoaded;
    const double loaded = error_at(scene, full);
    std::printf(
        "spin %.2f rad/s: elastic error separated %.3e (expected %.1e), spin-loaded %.3e (expected %.1e)\n",
        row.spin, plain, row.separated, loaded, row.spin_loaded);
    const auto second_digit = [](double x) { return std::pow(10.0, std::floor(std::log10(x)) - 1.0); };
    EXPECT_NEAR(plain, row.separated, 0.5 * second_digit(row.separated));
    EXPECT_NEAR(loaded, row.spin_loaded, 0.5 * second_digit(row.spin_loaded));
  }
}

// A damped dumb-bell that spins settles to the elongation m w^2 r / k.
TEST(SpinLoad, StretchesADumbBellToItsStaticLength) {
  Scene scene = spring_pair(2.0, 2.0, 1.0, 5e4);
  publish_everything(scene);
  scene.fidelity = Fidelity::kSpinLoaded;
  scene.damping.modal_ratio = 0.2;
  scene.initial.angular_velocity = {0.0, 0.0, 2.0};
  Simulation simulation(scene);
  simulation.run(2000);
  const Eigen::Matrix3Xd V = simulation.displacements_B();
  // after 200 time constants only rounding errors remain
  EXPECT_NEAR(V(0, 1) - V(0, 0), 2.0 * 4.0 * 0.5 / 5e4, 1e-15);
}

// A truss orbits a heavy point. The test checks the orbit, the gravity-gradient torque and the load that
// strains the truss. The equations omit the next term of the field, which is smaller than the gradient by the
// factor size over distance.
TEST(Attractor, MovesRotatesAndStrainsABodyLikeTheFullSystem) {
  std::vector<double> errors;
  for (const double distance : {1.0, 4.0, 16.0}) {
    Scene scene = truss_s1();
    scene.loads.clear();
    // mu is chosen so that the gradient is the same at 40 m and at each multiple of 40 m
    scene.attractor.mu = 400.0 * distance * distance * distance;
    scene.attractor.position = distance * Eigen::Vector3d(1.0, -2.0, 0.5);
    scene.initial.position = distance * Eigen::Vector3d(30.0, 20.0, -15.0);
    scene.initial.velocity = {-1.5, 2.0, 0.7};
    scene.initial.attitude = Eigen::Vector4d(0.8, 0.2, -0.4, 0.3).normalized();
    scene.initial.angular_velocity = {0.002, -0.003, 0.001};
    scene.fidelity = Fidelity::kSpinLoaded;
    ReferenceOptions options;
    options.tolerance = 1e-9;
    std::string error;
    const auto system = make_cartesian_system(scene, error);
    ASSERT_TRUE(system) << error;
    const double times[] = {kCaseEnd};
    const ReferenceRun run = integrate(*system, times, options);
    ASSERT_EQ(run.error, "");
    Simulation simulation(scene);
    simulation.run(2000);
    const Eigen::Matrix3Xd p = simulation.positions_W();
    const double off = (p - run.states[0].p_W).colwise().norm().maxCoeff();
    errors.push_back(elastic_error(elastic_displacements(system->mass, system->r, p),
                                   elastic_displacements(system->mass, system->r, run.states[0].p_W)));
    const Eigen::Vector3d fall = p.rowwise().mean() - system->p_WB - kCaseEnd * system->v_WB;
    std::printf("attractor %.0f m away: positions within %.1e m after a fall of %.2f m, elastic error %.1e\n",
                38.0 * distance, off, fall.norm(), errors.back());
    // the error is (size / distance)^2 of the distance fallen
    EXPECT_LT(off, std::pow(2.2 / (38.0 * distance), 2) * fall.norm());
  }
  EXPECT_LT(errors[0], 0.1);
  for (std::size_t k = 1; k < errors.size(); ++k) EXPECT_NEAR(errors[k - 1] / errors[k], 4.0, 1.0) << k;
}

// The gravity gradient makes a long thin body librate like a pendulum with the frequency sqrt(3 mu / rho^3).
TEST(Attractor, ALongBodyLibratesWithTheKnownFrequency) {
  Scene scene;
  for (const double x : {-1.0, 1.0}) {
    PointMass point;
    point.name = x < 0.0 ? "a" : "b";
    point.mass = 1.0;
    point.position = {x, 0.0, 0.0};
    scene.points.push_back(point);
  }
  Link rigid;
  rigid.name = "rod";
  rigid.points = {0, 1};
  rigid.kind = Rigid{};
  scene.links.push_back(rigid);
  publish_everything(scene);
  const double rho = 1e4, mu = 1e12 * 4.0, rate = std::sqrt(mu / (rho * rho * rho));
  scene.attractor.mu = mu;
  scene.initial.position = {rho, 0.0, 0.0};
  scene.initial.velocity = {0.0, rho * rate, 0.0};  // circular
  const double tilt = 1e-4;
  scene.initial.attitude = {std::cos(tilt / 2), 0.0, 0.0, std::sin(tilt / 2)};
  scene.initial.angular_velocity = {0.0, 0.0, rate};
  scene.rate = 1000.0;
  Simulation simulation(scene);
  const double time = std::llround(1000.0 * M_PI / (std::sqrt(3.0) * rate)) / 1000.0;  // half a libration
  simulation.run(std::llround(time * 1000.0));
  const Eigen::Matrix3Xd p = simulation.positions_W();
  const Eigen::Vector3d line = p.col(1) - p.col(0),
                        up(simulation.state.p_WB[0], simulation.state.p_WB[1], 0.0);
  const double angle = std::atan2(up.cross(line).z(), up.dot(line));
  std::printf("libration: tilt %.6e becomes %.6e in half a period\n", tilt, angle);
  EXPECT_NEAR(angle, -tilt,
              1e-3 * tilt);  // errors: (size / distance)^2, and one tick in half a period of 900 ticks
}

}  // namespace
}  // namespace freeflex::testing
