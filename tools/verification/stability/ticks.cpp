// Tests ticks in which bodies, wheels and orbits rotate by large angles.
#include <Eigen/Geometry>
#include <boost/multiprecision/cpp_bin_float.hpp>
#include <cmath>

#include "core/step/rigid/tick_rotation.hpp"
#include "tools/verification/stability/ride.hpp"
#include "tools/verification/stability/scenes.hpp"

namespace freeflex::tools {
namespace {

using Eigen::Quaterniond, Eigen::Vector3d;
using Wide = boost::multiprecision::cpp_bin_float_50;

Scene one_body(const Vector3d& moments, const Vector3d& spin, double rate) {
  Scene scene;
  add_point(scene, 1.0, Vector3d::Zero());
  scene.points[0].inertia = moments.asDiagonal();
  scene.publication.points = scene.pushable = {0};
  scene.rate = rate;
  scene.initial.angular_velocity = spin;
  return scene;
}

std::int64_t ticks_of(const StabilityOptions& options) { return options.is_quick ? 200 : 2000; }

/// Compares the attitude with the closed form for a body with the moments (I, I, I_3) and a wheel of momentum
/// h on its axis of symmetry. The body precesses about H at |H| / I, and it rotates about its own axis at
/// w_3 - (I_3 w_3 + h) / I (Hughes 1986, 7.1).
Outcome symmetric(double I, double I_3, const Vector3d& spin, double wheel, double rate,
                  const StabilityOptions& options) {
  Scene scene = one_body({I, I, I_3}, spin, rate);
  if (wheel != 0.0) scene.wheels.push_back({"w", 0, Vector3d::UnitZ(), wheel, {}});
  Ride ride(scene);
  if (!ride.has_plan()) return no_answer(ride.faults_text());
  const std::int64_t ticks = ticks_of(options);
  if (!ride.run(ticks)) return no_answer("a state is not finite");
  const double t = static_cast<double>(ticks) * ride.plan.period;
  const Vector3d H(I * spin[0], I * spin[1], I_3 * spin[2] + wheel);
  const double own = spin[2] - H[2] / I;
  const Quaterniond right = Quaterniond(Eigen::AngleAxisd(H.norm() / I * t, H.normalized())) *
                            Quaterniond(Eigen::AngleAxisd(own * t, Vector3d::UnitZ()));
  const Quat& q = ride.state().q_WB;
  return {right.angularDistance(Quaterniond(q[0], q[1], q[2], q[3])),
          ride.verdict().level == Verdict::Level::kGood ? "good" : "not good",
          {}};
}

/// Measures the largest relative change of the rotational energy of a body with three different moments and a
/// wheel on a skew axis.
Outcome energy(const Vector3d& moments, double wheel, double rate, const StabilityOptions& options) {
  const Vector3d spin(0.5, 1.0, 0.3);
  Scene scene = one_body(moments, spin, rate);
  const double own = (moments.asDiagonal() * spin).norm();
  scene.wheels.push_back({"w", 0, Vector3d(0.6, 0.0, 0.8), wheel * own, {}});
  Ride ride(scene);
  if (!ride.has_plan()) return no_answer(ride.faults_text());
  const double start = read_invariants(ride.plan, ride.state()).kinetic_rigid;
  double worst = 0.0;
  for (std::int64_t k = ticks_of(options) / 20; k > 0; --k) {
    if (!ride.run(1)) return no_answer("a state is not finite");
    worst = std::max(worst, std::abs(read_invariants(ride.plan, ride.state()).kinetic_rigid / start - 1.0));
  }
  return {worst, ride.verdict().level == Verdict::Level::kGood ? "good" : "not good", {}};
}

/// Measures the position error after ten revolutions, divided by the semi-major axis. The exact position
/// comes from Kepler's equation in fifty digits.
Outcome orbit(double e, int ticks, const StabilityOptions&) {
  const double perigee = 1.0 - e;
  Scene scene;
  add_point(scene, 1.0, Vector3d::Zero());
  scene.publication.points = scene.pushable = {0};
  scene.rate = ticks / (2.0 * M_PI);
  scene.attractor.mu = 1.0;
  scene.initial.position = {perigee, 0.0, 0.0};
  scene.initial.velocity = {0.0, std::sqrt((1.0 + e) / perigee), 0.0};
  Ride ride(scene);
  if (!ride.has_plan()) return no_answer(ride.faults_text());
  const std::int64_t count = 10 * ticks + std::max(1, ticks / 7);
  if (!ride.run(count)) return no_answer("a state is not finite");
  // the exact orbit that starts at the rounded initial values
  const Wide r = scene.initial.position[0], v = scene.initial.velocity[1], a = 1 / (2 / r - v * v);
  const Wide ecc = 1 - r / a, mean = Wide(ride.plan.period) * count / (a * sqrt(a));
  Wide E = mean;
  for (int k = 0; k < 200; ++k) E -= (E - ecc * sin(E) - mean) / (1 - ecc * cos(E));
  const Wide x = a * (cos(E) - ecc), y = a * sqrt(1 - ecc * ecc) * sin(E);
  const Wide dx = x - ride.state().p_WB[0], dy = y - ride.state().p_WB[1];
  return {static_cast<double>(sqrt(dx * dx + dy * dy)), {}, {}};
}

}  // namespace

void add_tick_cases(std::vector<StabilityCase>& cases) {
  const auto add = [&cases](const char* group, std::string name, const char* quantity, double limit,
                            auto run) {
    cases.push_back({group, std::move(name), quantity, limit, false, run});
  };
  constexpr const char* kAttitude = "attitude [rad] against closed form";
  constexpr const char* kEnergy = "largest relative change of the energy";
  // the rounding error of the angle is the same at each tick, so the total error is eps times the total
  // rotation
  for (const double rotation : {0.1, 2.0, 100.0})
    add("slow ticks", format_text("%g rad per tick about an axis", rotation), kAttitude,
        1e-11 + 1e-12 * rotation, [rotation](const StabilityOptions& options) {
          return symmetric(2.0, 3.0, {0.0, 0.0, rotation}, 0.0, 1.0, options);
        });
  for (const double rotation : {0.1, 1.0, 30.0})
    add("fast wheels", format_text("nutation of %g rad per tick", rotation), kAttitude,
        1e-10 + 1e-12 * rotation, [rotation](const StabilityOptions& options) {
          return symmetric(0.002, 0.002, {0.01, 0.0, 0.01}, 0.02, 10.0 / rotation, options);
        });
  for (const double wheel : {1.0, 1000.0})
    add("fast wheels", format_text("skew, %g times the momentum of the body", wheel), kEnergy, 1e-9,
        [wheel](const StabilityOptions& options) {
          return energy({1.0, 2.0, 2.5}, wheel, 1.0, options);
        });
  // A tick rounds the angular momentum H in body axes by up to 2 eps |H|, which changes the spin about the
  // thin axis by 4e-16 |H| / I_3. The limit allows for 2000 such ticks of 1 s with |H| / I_3 = ratio
  for (const double ratio : {1e3, 1e6}) {
    add("needles and discs", format_text("a needle of ratio %g, 1 rad per tick", ratio), kAttitude,
        1e-9 + 9e-13 * ratio, [ratio](const StabilityOptions& options) {
          return symmetric(1.0, 1.0 / ratio, {0.6, 0.8, 3.0}, 0.0, 1.0, options);
        });
    add("needles and discs", format_text("one of ratio %g with a skew wheel of its momentum", ratio), kEnergy,
        1e-9, [ratio](const StabilityOptions& options) {
          return energy({1.0 / ratio, 1.0, 1.0 + 0.5 / ratio}, 1.0, 1.0, options);
        });
  }
  add("needles and discs", "a disc, 1 rad per tick", kAttitude, 1e-10, [](const StabilityOptions& options) {
    return symmetric(1.0, 2.0, {0.3, 0.2, 0.9}, 0.0, 1.0, options);
  });
  for (const double e : {0.0, 0.5, 0.9, 0.99})
    for (const int ticks : {1, 10, 1000})
      add("eccentric orbits", format_text("eccentricity %g, %d ticks per revolution", e, ticks),
          "position error after ten revolutions over the semi-major axis", 5e-11 / ((1.0 - e) * (1.0 - e)),
          [e, ticks](const StabilityOptions& options) { return orbit(e, ticks, options); });
}

}  // namespace freeflex::tools
