// Tests rotation near the intermediate axis, and forces and structures from very small to very large sizes.
#include <algorithm>
#include <array>
#include <boost/multiprecision/cpp_bin_float.hpp>
#include <cmath>
#include <limits>
#include <memory>

#include "tools/verification/reference/elastic_error.hpp"
#include "tools/verification/stability/answers.hpp"
#include "tools/verification/stability/ride.hpp"
#include "tools/verification/stability/scenes.hpp"

namespace freeflex::tools {
namespace {

using Wide = boost::multiprecision::cpp_bin_float_50;

constexpr std::array<const char*, 4> kAttitude{"-0.592107085853884653853244", "-0.7083135176948120392994942",
                                               "-0.3833440364697522620363971",
                                               "-0.02735889682532735840419484"};

/// Returns the angle between an attitude and the reference [rad].
double angle_to_answer(const std::array<Wide, 4>& q) {
  const std::array<Wide, 4> p{Wide(kAttitude[0]), Wide(kAttitude[1]), Wide(kAttitude[2]), Wide(kAttitude[3])};
  const std::array<Wide, 3> d = {p[0] * q[1] - p[1] * q[0] - p[2] * q[3] + p[3] * q[2],
                                 p[0] * q[2] - p[2] * q[0] - p[3] * q[1] + p[1] * q[3],
                                 p[0] * q[3] - p[3] * q[0] - p[1] * q[2] + p[2] * q[1]};
  return 2.0 * static_cast<double>(sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2]));
}

Scene near_intermediate_axis(double spin) {
  Scene scene = octahedron(1e6);
  scene.initial.angular_velocity = spin * Eigen::Vector3d(0.01, 1.0, 0.005);
  return scene;
}

Outcome attitude_near_intermediate_axis(double spin, const StabilityOptions& options) {
  const Scene scene = near_intermediate_axis(spin);
  const double end = 20.0 / spin;
  Ride ride(scene);
  if (!ride.has_plan()) return no_answer(ride.faults_text());
  if (!ride.run(std::llround(end * 1000.0))) return no_answer("a state is not finite");
  std::array<Wide, 4> q;
  for (std::size_t a = 0; a < 4; ++a) q[a] = Wide(ride.state().q_WB[a]) + Wide(ride.state().q_WB_low[a]);
  Eigen::VectorXd mass = Eigen::VectorXd::Ones(6);
  Eigen::Matrix3Xd rest(3, 6);
  for (int i = 0; i < 6; ++i) rest.col(i) = scene.points[index(i)].position;
  return {angle_to_answer(q),
          "this is the attitude of the rigid body; in the other methods the body also deforms",
          run_peers(scene, 1e-3, end, options, [&](const CartesianState& state) {
            const Eigen::Quaterniond fit(fit_rotation(mass, rest, state.p_W));
            return angle_to_answer({fit.w(), fit.x(), fit.y(), fit.z()});
          })};
}

Outcome energy_near_intermediate_axis(double spin, const StabilityOptions& options) {
  Ride ride(near_intermediate_axis(spin));
  if (!ride.has_plan()) return no_answer(ride.faults_text());
  const double start = read_invariants(ride.plan, ride.state()).kinetic_rigid;
  const Vec3 H = ride.state().H_W;
  const int blocks = options.is_quick ? 20 : 1000;
  double worst = 0.0;
  for (int k = 0; k < blocks; ++k) {
    if (!ride.run(1000)) return no_answer("a state is not finite");
    worst = std::max(worst, std::abs(read_invariants(ride.plan, ride.state()).kinetic_rigid / start - 1.0));
  }
  if (H != ride.state().H_W) return no_answer("the angular momentum changed");
  return {worst, format_text("%d ticks; the angular momentum is the same to the bit", 1000 * blocks), {}};
}

constexpr Solver kSeparated{Fidelity::kSeparated, IntegrateBy::kModes, "separated"};
constexpr Solver kCoupled{Fidelity::kCoupled, IntegrateBy::kModes, "coupled"};
constexpr double kMaxForce = 1e6;  // [N] force limit of the scene

/// Returns the elastic displacements of a truss that starts at rest, after 200 ticks with a command. The
/// command is a force in body axes on a corner.
std::optional<Eigen::Matrix3Xd> pushed(double force, const Solver& solver, std::string& why) {
  Scene scene = square_truss(3, 1e5);
  use(solver, scene);
  scene.force_limit = kMaxForce;
  Ride ride(scene);
  const auto command = std::make_unique<ForceCommand>();
  command->sender[0] = 'a';
  command->axes = static_cast<std::int32_t>(Axes::kBody);
  command->start_tick = -1;
  command->duration_ticks = 1000;
  command->num_points = 1;
  command->points[0] = {10, 0, {0.6 * force, 0.0, 0.8 * force}};
  if (!ride.has_plan() || !ride.run(200, {command.get(), 1})) {
    why = ride.has_plan() ? "a state is not finite" : ride.faults_text();
    return std::nullopt;
  }
  return ride.displacements_B();
}

constexpr double kSmallForce = 1e-12;  // [N] terms of second order in this force are negligible

/// Compares the displacement per force with the displacement per force of a small force. They must be equal,
/// because the separated equations are linear in forces in body axes.
Outcome small_force(double force, const Solver& solver) {
  std::string why;
  const auto V = pushed(force, solver, why), unit = pushed(kSmallForce, solver, why);
  if (!V || !unit) return no_answer(why);
  // divides by the force first, because the squares in the norm of such small numbers would underflow
  const Eigen::Matrix3Xd per_force = *V / force, expected = *unit / kSmallForce;
  return {(per_force - expected).norm() / expected.norm(), {}, {}};
}

/// Checks that a displacement below the smallest normal number loses only those digits that a denormal number
/// cannot hold.
Outcome denormal_force(const Solver& solver) {
  constexpr double kForce = 1e-310;
  std::string why;
  const auto V = pushed(kForce, solver, why), unit = pushed(kSmallForce, solver, why);
  if (!V || !unit) return no_answer(why);
  const double smallest = std::numeric_limits<double>::denorm_min();
  return {((*V) / smallest - *unit / kSmallForce * kForce / smallest).cwiseAbs().maxCoeff(),
          "in units of 4.9e-324 m",
          {}};
}

/// Returns the difference of the displacements on points from those on modes, in units of the rounding error
/// of a position 3 m from the centre.
Outcome lost_in_rounding(double force) {
  std::string why;
  const auto V = pushed(force, kOnPoints, why), exact = pushed(force, kOnModes, why);
  if (!V || !exact) return no_answer(why);
  constexpr double kUnit = 3.0 * std::numeric_limits<double>::epsilon();
  return {(*V - *exact).cwiseAbs().maxCoeff() / kUnit,
          format_text("in units of %.1e m; displacements of %.1e m", kUnit, exact->cwiseAbs().maxCoeff()),
          {}};
}

/// Compares the motion of a truss of `size` with the motion of the truss of size 1. Lengths and forces are
/// multiplied by the size.
Outcome at_size(double size, const Solver& solver, const StabilityOptions& options) {
  const auto scene_of = [&solver](double times) {
    Scene scene = square_truss(3, 1e5, times);
    use(solver, scene);
    add_force(scene, 10, 50.0 * times * Eigen::Vector3d(0.48, 0.6, 0.64), PulseHistory{0.0, 0.1});
    scene.initial.angular_velocity = {0.1, -0.2, 0.3};
    return scene;
  };
  Ride small(scene_of(1.0)), large(scene_of(size));
  if (!small.has_plan() || !large.has_plan()) return no_answer(large.faults_text());
  if (!small.run(1000) || !large.run(1000)) return no_answer("a state is not finite");
  const Eigen::Matrix3Xd expected = small.displacements_B();
  const auto error = [&](const Eigen::Matrix3Xd& V) {
    return (V / size - expected).norm() / expected.norm();
  };
  Outcome outcome{error(large.displacements_B()), "against the same truss of 1 m", {}};
  if (solver.rung == Fidelity::kSeparated) return outcome;
  const Scene scene = scene_of(size);
  Eigen::VectorXd mass = Eigen::VectorXd::Ones(static_cast<Eigen::Index>(scene.points.size()));
  Eigen::Matrix3Xd rest(3, mass.size());
  for (Eigen::Index i = 0; i < rest.cols(); ++i) rest.col(i) = scene.points[index(i)].position;
  outcome.peers = run_peers(scene, 1e-3, 1.0, options, [&](const CartesianState& state) {
    return error(elastic_displacements(mass, rest, state.p_W));
  });
  return outcome;
}

}  // namespace

const std::array<const char*, 4>& intermediate_axis_attitude() { return kAttitude; }

void add_motion_cases(std::vector<StabilityCase>& cases) {
  const auto add = [&cases](const char* group, std::string name, const char* quantity, double limit,
                            auto run) {
    cases.push_back({group, std::move(name), quantity, limit, false, run});
  };
  constexpr const char* kSpin = "spin near the intermediate axis";
  // the truncation error is below 1e-3 (spin h)^6, but rounding errors grow by a factor of a thousand until
  // the body has flipped
  for (const double spin : {1.0, 5.0, 50.0})
    add(kSpin, format_text("%g rad/s, 20 rad on", spin), "attitude [rad] against fifty digits",
        1e-12 + 1e-3 * std::pow(1e-3 * spin, 6),
        [spin](const StabilityOptions& options) { return attitude_near_intermediate_axis(spin, options); });
  for (const double spin : {1.0, 5.0})
    add(kSpin, format_text("%g rad/s, 1e6 ticks", spin), "largest relative change of the energy", 1e-11,
        [spin](const StabilityOptions& options) { return energy_near_intermediate_axis(spin, options); });
  constexpr const char* kForces = "size of forces";
  constexpr const char* kPerForce = "displacement per force against that at 1e-12 N";
  for (const double force : {1e-300, 1e-200, 1e-30, 1.0, kMaxForce})
    add(kForces, format_text(force == kMaxForce ? "%g N, force_limit, separated" : "%g N, separated", force),
        kPerForce, 1e-12, [force](const StabilityOptions&) { return small_force(force, kSeparated); });
  for (const Solver& solver : {kCoupled, kOnModes})
    for (const double force : {1e-300, 1e-30})
      add(kForces, format_text("%g N, %s", force, solver.name), kPerForce, 1e-12,
          [force, solver](const StabilityOptions&) { return small_force(force, solver); });
  // positions cannot hold displacements below their rounding errors
  for (const double force : {1e-300, 1e-12, 1e-6})
    add(kForces, format_text("%g N, %s", force, kOnPoints.name), "difference from the motion on modes", 300.0,
        [force](const StabilityOptions&) { return lost_in_rounding(force); });
  for (const Solver& solver : {kSeparated, kCoupled, kOnModes})
    add(kForces, format_text("1e-310 N, a denormal, %s", solver.name),
        "displacement error, in units of the smallest double", 1e4,
        [solver](const StabilityOptions&) { return denormal_force(solver); });
  for (const double size : {1e-9, 1e9})
    for (const Solver& solver : {kSeparated, kOnModes, kOnPoints})
      add("size of structures", format_text("%g m across, %s", 2.0 * size, solver.name),
          "elastic difference from a truss of 1 m, after 1 s", 1e-9,
          [size, solver](const StabilityOptions& options) { return at_size(size, solver, options); });
}

}  // namespace freeflex::tools
