// Linear models against the step and against closed forms.
#include "tools/control/state_space.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <unsupported/Eigen/MatrixFunctions>

#include "core/motion.hpp"
#include "core/plan/make_plan.hpp"
#include "core/step/readout.hpp"
#include "service/io/scene/input.hpp"
#include "tools/control/held_modes.hpp"

namespace freeflex::control {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

Plan plan_from(const std::string& text) {
  const io::SceneResult read = io::read_scene_text({text});
  for (const Fault& fault : read.faults)
    if (fault.severity == Fault::Severity::kError) ADD_FAILURE() << fault.message;
  Faults faults;
  const std::optional<Structure> structure = build_structure(read.scene.value(), faults);
  std::optional<Plan> plan = make_full_plan(*read.scene, structure.value(), read.scene->fidelity, faults);
  for (const Fault& fault : faults)
    if (fault.severity == Fault::Severity::kError) ADD_FAILURE() << fault.message;
  return plan.value();
}

StateSpace model_of(const Plan& plan, const Ports& ports) {
  StateSpaceResult made = make_state_space(plan, ports);
  EXPECT_EQ(made.error, "");
  return made.model.value_or(StateSpace{});
}

/// Keeps a number of modes.
Reduction keep(int count) {
  Reduction reduction;
  reduction.count = count;
  return reduction;
}

const std::string kPair =
    "points: [{name: a, mass: 2, at: [0, 0, 0]}, {name: b, mass: 2, at: [1, 0, 0]}]\n"
    "links: {name: s, spring: [a, b], stiffness: 50, viscous: 0.002}\n";

TEST(StateSpaceModel, OfASpringIsItsTransferFunction) {
  const Plan plan = plan_from(kPair);
  const StateSpace model = model_of(
      plan, {{"point.b.fx"}, {"point.b.x", "point.a.x", "point.b.vx", "point.b.ax", "link.s.axial"}});
  const Response response(model);
  for (const double omega : {0.1, 3.0, 7.0, 40.0}) {
    const std::complex<double> s(0.0, omega), k = 50.0 * (1.0 + 0.002 * s);
    // m s^2 xb = F - k (xb - xa), m s^2 xa = k (xb - xa)
    const std::complex<double> ms = 2.0 * s * s, xb = (ms + k) / (ms * (ms + 2.0 * k)),
                               xa = k / (ms * (ms + 2.0 * k));
    const Eigen::MatrixXcd g = response.at(omega);
    EXPECT_LT(std::abs(g(0, 0) / xb - 1.0), 1e-12) << omega;
    EXPECT_LT(std::abs(g(1, 0) / xa - 1.0), 1e-12) << omega;
    EXPECT_LT(std::abs(g(2, 0) / (s * xb) - 1.0), 1e-12) << omega;
    EXPECT_LT(std::abs(g(3, 0) / (s * s * xb) - 1.0), 1e-12) << omega;
    EXPECT_LT(std::abs(g(4, 0) / (k * (xb - xa)) - 1.0), 1e-11) << omega;
  }
}

// a body with beams, a wheel with momentum, a dashpot and a feedback
const std::string kRich =
    "rate: 2000\nfidelity: coupled\n"
    "points:\n"
    "  - {name: hub, mass: 40, at: [0, 0, 0], inertia: [4, 5, 6], offset: [0, 0.02, 0]}\n"
    "  - {name: mid, mass: 1, at: [1.5, 0, 0]}\n"
    "  - {name: elbow, mass: 1, at: [3, 0, 0.2]}\n"
    "  - {name: tip, mass: 2, at: [3, 1, 0]}\n"
    "links:\n"
    "  - {name: tube, beam: [hub..tip], EA: 6.4e5, GJ: 5.6e3, EIy: 7.5e3, EIz: 7.5e3}\n"
    "  - {name: damper, dashpot: [hub, tip], damping: 3}\n"
    "damping: {ratio: 0.01}\n"
    "wheels: [{name: w, at: hub, axis: [0, 0.6, 0.8], momentum: 2}]\n"
    "feedback: [{at: tip, displacement: [-200, -100, -50], velocity: -2}]\n"
    "groups: {outer: [mid..tip]}\n";

/// Returns the largest difference between the model and the step under a constant input of this size,
/// relative to the largest output.
double difference_from_step(const std::string& scene, const std::string& input, double size) {
  const Plan plan = plan_from(scene);
  const Ports ports{{input},
                    {"point.tip.p", "point.tip.v", "point.hub.r", "point.hub.w", "point.mid.d", "wz"}};
  const StateSpace model = model_of(plan, ports);
  // exact step of x' = A x + B u with constant u
  const Eigen::Index n = model.A.rows();
  MatrixXd both = MatrixXd::Zero(n + 1, n + 1);
  both.topLeftCorner(n, n) = model.A * plan.period;
  both.topRightCorner(n, 1) = model.B * plan.period;
  const MatrixXd advance = both.exp();
  ForceCommand push{};
  push.sender[0] = 't';
  push.axes = 1;
  push.start_tick = -1;
  push.duration_ticks = 1'000'000;
  const char part = input[input.size() - 2];
  const auto axis = static_cast<std::size_t>(input.back() - 'x');
  const auto unit = [&] {
    return std::array<double, 3>{axis == 0 ? size : 0, axis == 1 ? size : 0, axis == 2 ? size : 0};
  };
  if (input.starts_with("wheel")) {
    push.num_wheels = 1;
    push.wheels[0] = {0, 0, size};
  } else if (input.starts_with("group")) {
    push.num_wrenches = 1;
    push.wrenches[0] = {0, 0, part == 'f' ? unit() : std::array<double, 3>{},
                        part == 't' ? unit() : std::array<double, 3>{}};
  } else if (part == 'f') {
    push.num_points = 1;
    push.points[0] = {3, 0, unit()};
  } else {
    push.num_torques = 1;
    push.torques[0] = {0, 0, unit()};
  }
  Motion motion(plan, kMotionAlone);
  VectorXd x = VectorXd::Zero(n + 1);
  x[n] = size;
  const PointState tip_at_start = read_point(plan, motion.state(), 3);
  VectorXd scale =
      VectorXd::Zero(model.outputs.size() > 0 ? static_cast<Eigen::Index>(model.outputs.size()) : 0);
  VectorXd worst = scale;
  for (int tick = 0; tick < 1000; ++tick) {
    const std::array<ForceCommand, 1> commands{push};
    EXPECT_EQ(
        motion.advance(tick == 0 ? std::span<const ForceCommand>(commands) : std::span<const ForceCommand>())
            .status,
        StepStatus::kOk);
    x = advance * x;
    const PointState tip = read_point(plan, motion.state(), 3), mid = read_point(plan, motion.state(), 1);
    const BodyState hub = read_body(plan, motion.state(), 0);
    VectorXd found(scale.size());
    for (int k = 0; k < 3; ++k) {
      const auto i = static_cast<std::size_t>(k);
      found[k] = tip.p_W[i] - tip_at_start.p_W[i];
      found[3 + k] = tip.v_W[i];
      found[6 + k] = 2.0 * hub.q_WP[i + 1];
      found[9 + k] = hub.w_P[i];
      found[12 + k] = mid.V_B[i];
    }
    found[15] = angular_velocity(plan, motion.state())[2];
    const VectorXd expected = model.C * x.head(n) + model.D * size;
    scale = scale.cwiseMax(expected.cwiseAbs());
    worst = worst.cwiseMax((found - expected).cwiseAbs());
  }
  double largest = 0.0;
  // each quantity is compared with the largest of its three components
  for (int k = 0; k < 15; ++k) largest = std::max(largest, worst[k] / scale.segment<3>(k / 3 * 3).maxCoeff());
  return std::max(largest, worst[15] / std::max(scale[15], 1e-12 * scale.maxCoeff()));
}

// The model is the limit of small motions: what remains is of first order in the size of the input.
TEST(StateSpaceModel, IsTheLimitOfTheStepForSmallInputs) {
  for (const char* input : {"point.tip.fz", "point.tip.fx", "point.hub.tx", "group.outer.fy",
                            "group.outer.tz", "wheel.w.torque"}) {
    const double large = difference_from_step(kRich, input, 1e-2),
                 small = difference_from_step(kRich, input, 1e-5);
    EXPECT_LT(small, 2e-5) << input;
    // A thousandth of the input leaves less than a hundredth of the difference; the step at 2 kHz adds 2e-6.
    EXPECT_LT(small, 0.01 * large + 2e-6) << input;
  }
}

TEST(StateSpaceModel, BelowTheCoupledRungsIsTheLimitOfTheStepToo) {
  std::string separated = kRich;
  separated.replace(separated.find("coupled"), 7, "separated");
  for (const char* input : {"point.tip.fz", "point.hub.tx", "wheel.w.torque"})
    EXPECT_LT(difference_from_step(separated, input, 1e-5), 2e-5) << input;
}

TEST(StateSpaceModel, OfKeptModesDiffersByNoMoreThanItsBound) {
  std::string scene = kRich;
  for (const char* coupling : {"  - {name: damper, dashpot: [hub, tip], damping: 3}\n",
                               "feedback: [{at: tip, displacement: [-200, -100, -50], velocity: -2}]\n",
                               "wheels: [{name: w, at: hub, axis: [0, 0.6, 0.8], momentum: 2}]\n"})
    scene.erase(scene.find(coupling), std::string(coupling).size());
  const StateSpace model = model_of(plan_from(scene), {{"point.tip.f"}, {"point.tip.p", "point.mid.d"}});
  for (const int count : {0, 1, 3, 8}) {
    const Reduced reduced = reduce(model, keep(count));
    EXPECT_EQ(reduced.model.modes.size(), static_cast<std::size_t>(count));
    ASSERT_TRUE(std::isfinite(reduced.bound));
    const Response of_all(model), of_kept(reduced.model);
    double largest = 0.0;
    for (double omega = 1.0; omega < 5000.0; omega *= 1.01) {
      const Eigen::MatrixXcd rest = of_all.at(omega) - of_kept.at(omega);
      largest = std::max(largest, rest.cwiseAbs().maxCoeff());
    }
    EXPECT_LE(largest, reduced.bound) << count;
    EXPECT_GT(largest, 0.02 * reduced.bound) << count;
  }
  const Reduced all = reduce(model, {});
  EXPECT_EQ(all.model.A, model.A);
  EXPECT_EQ(all.bound, 0.0);
}

TEST(StateSpaceModel, OfFewerModesIsConsistent) {
  // without its mode, the pair moves as a rigid body under the force
  const StateSpace model = model_of(plan_from(kPair), {{"point.b.fx"}, {"point.b.vx", "point.b.ax"}});
  const Reduced rigid = reduce(model, keep(0));
  for (const double omega : {0.3, 30.0}) {
    const Eigen::MatrixXcd g = Response(rigid.model).at(omega);
    EXPECT_LT(std::abs(g(0, 0) * std::complex<double>(0.0, omega) * 4.0 - 1.0), 1e-12) << omega;
    EXPECT_LT(std::abs(g(1, 0) * 4.0 - 1.0), 1e-12) << omega;
  }
}

TEST(StateSpaceModel, WithoutDampingKeepsTheModesOfLargestGain) {
  std::string scene = kRich;
  scene.erase(scene.find("  - {name: damper"),
              scene.find("damping: {ratio") - scene.find("  - {name: damper"));
  scene.replace(scene.find("damping: {ratio: 0.01}"), 22, "");
  scene.erase(scene.find("wheels:"), scene.find("groups:") - scene.find("wheels:"));
  const StateSpace model = model_of(plan_from(scene), {{"point.tip.fz"}, {"point.tip.z"}});
  const Reduced two = reduce(model, keep(2));
  ASSERT_EQ(two.model.modes.size(), 2u);
  double least = 1e300, largest_other = 0.0;
  for (const ModeGain& gain : mode_gains(model)) {
    const bool is_kept = gain.mode == two.model.modes[0] || gain.mode == two.model.modes[1];
    (is_kept ? least : largest_other) =
        is_kept ? std::min(least, gain.gain) : std::max(largest_other, gain.gain);
  }
  EXPECT_GE(least, largest_other);
  EXPECT_TRUE(std::isinf(two.bound));
  Reduction share;
  share.share = 0.0;
  EXPECT_EQ(reduce(model, share).model.modes.size(), model.modes.size());
  EXPECT_EQ(reduce(model, keep(1000)).model.modes.size(), model.modes.size());
}

// For more than the critical damping, the largest gain of a displacement is that under a constant force.
TEST(StateSpaceModel, OfAnOverdampedModeHasTheGainOfAConstantForce) {
  std::string scene = kPair;
  scene.replace(scene.find("0.002"), 5, "0.5");  // [s]; omega = 7.1 rad/s, so zeta = 0.25 s omega = 1.8
  const StateSpace model = model_of(plan_from(scene), {{"point.b.fx"}, {"link.s.axial"}});
  const ModeGain gain = mode_gains(model).back();
  ASSERT_GT(gain.damping, 1.0);
  double largest = 0.0;
  const Response response(model);
  for (double omega = 1e-3; omega < 1e3; omega *= 1.1)
    largest = std::max(largest, std::abs(response.at(omega)(0, 0)));
  EXPECT_LE(largest, gain.peak);
}

TEST(StateSpaceModel, NamesWhatIsWrong) {
  const Plan plan = plan_from(kPair);
  const auto error = [&](const Ports& ports) { return make_state_space(plan, ports).error; };
  EXPECT_EQ(error({{"point.nothing.fx"}, {"x"}}),
            "input 'point.nothing.fx': the scene has no point 'nothing'");
  EXPECT_EQ(error({{"point.a.tx"}, {"x"}}),
            "input 'point.a.tx': the point has no inertia and no offset, so it takes no torque");
  EXPECT_EQ(
      error({{"point.a.fx"}, {"point.a.q"}}),
      "output 'point.a.q': a point has the outputs x y z, vx .., ax .., dx .., and a body rx .., wx ..");
  EXPECT_EQ(error({{"wheel"}, {"x"}}),
            "input 'wheel': it must be point.NAME.fx, point.NAME.tx, group.NAME.fx, group.NAME.tx or "
            "wheel.NAME.torque");
}

/// Returns a cantilever of 2 m with 24 beams, 3 kg/m and EI = 800 N m^2, whose root is a body.
std::string cantilever() {
  std::string points = "points:\n  - {name: root, mass: 5, at: [0, 0, 0], inertia: [1, 1, 1]}\n";
  for (int k = 1; k <= 24; ++k)
    points +=
        "  - {name: p" + std::to_string(k) + ", mass: 0, at: [" + std::to_string(k / 12.0) + ", 0, 0]}\n";
  return points +
         "links: {beam: [root, p1..p24], EA: 1e7, GJ: 1e3, EIy: 800, EIz: 800, mass_per_length: 3}\nmodes: "
         "{count: 60}\n";
}

TEST(StateSpaceModel, RefusesATorqueAboutTheLineOfAGroup) {
  const Plan plan = plan_from(
      "points: [{name: a, mass: 1, at: [0, 0, 0]}, {name: b, mass: 1, at: [1, 0, 0]}, {name: c, mass: 1, at: "
      "[0, 1, 0]}]\n"
      "links: [{spring: [a, b], stiffness: 50}, {spring: [b, c], stiffness: 50}, {spring: [a, c], stiffness: "
      "50}]\n"
      "groups: {pair: [a, b]}\npublish: {points: {of: all}, groups: [pair]}\n");
  EXPECT_EQ(make_state_space(plan, {{"group.pair.tx"}, {"x"}}).error,
            "input 'group.pair.tx': the points of the group are on a line, about which they take no torque");
  const StateSpace model = model_of(plan, {{"group.pair.tz"}, {"wz"}});
  // a torque of 1 N m gives the whole body the rate 1 / Izz
  EXPECT_NEAR(model.B(11, 0), 1.0 / plan.inertia[8], 1e-12);
}

TEST(HeldModes, OfAClampedBeamHaveItsClosedForm) {
  std::string scene = cantilever();
  scene.erase(scene.find("modes:"));
  const HeldModes held = hold(plan_from(scene), "root");
  ASSERT_EQ(held.error, "");
  EXPECT_TRUE(held.holds_rotation);
  // roots of cos(b) cosh(b) = -1 and effective masses of a uniform cantilever, Blevins (1979), and 4 (sigma /
  // b)^2
  const double betas[] = {1.875104068711961, 4.694091132974175, 7.854757438237613};
  std::vector<const HeldMode*> along_y;
  for (const HeldMode& mode : held.modes)
    if (mode.effective_mass[1] > 1e-3 * mode.effective_mass.head<3>().sum() &&
        mode.effective_mass[1] >= mode.effective_mass[0])
      along_y.push_back(&mode);
  const double unit = std::sqrt(800.0 / 3.0) / 4.0 / (2.0 * std::numbers::pi);
  for (int k = 0; k < 3; ++k) {
    const double b = betas[k], sigma = (std::sinh(b) - std::sin(b)) / (std::cosh(b) + std::cos(b));
    double mass = 0.0, frequency = 0.0;
    for (const HeldMode* mode : along_y)
      if (std::abs(mode->frequency / (b * b * unit) - 1.0) < 0.02)
        mass += mode->effective_mass[1], frequency = mode->frequency;
    EXPECT_NEAR(frequency / (b * b * unit), 1.0, 2e-4 * (k + 1)) << k;
    EXPECT_NEAR(mass / 6.0, 4.0 * sigma * sigma / (b * b), 1e-3) << k;
  }
  // of the beam's 6 kg, the root carries a part of the first element's 0.25 kg
  double sum = 0.0;
  for (const HeldMode& mode : held.modes) sum += mode.effective_mass[1];
  EXPECT_NEAR(sum, 6.0, 0.1);
}

TEST(HeldModes, OfAGroupOfAllPointsDoNotExist) {
  const Plan plan = plan_from(kPair + "groups: {both: [a, b]}\n");
  EXPECT_EQ(hold(plan, "both").error, "'both' is all that can move, so nothing is left to vibrate");
  EXPECT_EQ(hold(plan, "nothing").error, "there is no point or group 'nothing'");
}

TEST(HeldModes, OfASpringAreThoseOfAMassOnIt) {
  const HeldModes held = hold(plan_from(kPair), "a");
  ASSERT_EQ(held.error, "");
  EXPECT_FALSE(held.holds_rotation);
  // b swings on the spring; a pair of point masses that turns about a has no stiffness
  const HeldMode& last = held.modes.back();
  EXPECT_NEAR(last.frequency, std::sqrt(50.0 / 2.0) / (2.0 * std::numbers::pi), 1e-12);
  EXPECT_NEAR(last.effective_mass[0], 2.0, 1e-12);
  EXPECT_NEAR(held.moving[0], 2.0, 1e-12);
}

}  // namespace
}  // namespace freeflex::control
