// These tests check how a long motion is reduced to samples, which panels a plot has, and that plots are
// written to files.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>

#include "core/step/step.hpp"
#include "service/io/scene/input.hpp"
#include "tests/tools/shell.hpp"
#include "tools/bus/compare.hpp"
#include "tools/plot/chart.hpp"
#include "tools/plot/motion_plot.hpp"
#include "tools/terminal/console.hpp"

namespace freeflex::testing {
namespace {

using tools::Samples;

// a wave of 15.625 Hz has a period of 64 ticks of 1 ms, so samples at every 64th tick would all have the same
// value
TEST(Plot, SamplesKeepThePeaksAndDoNotAlias) {
  Samples samples(2);
  const auto value = [](int tick) { return std::sin(2.0 * std::numbers::pi * 15.625e-3 * tick); };
  for (int tick = 0; tick <= 200'000; ++tick)
    samples.take(1e-3 * tick, {value(tick), tick == 123'457 ? 7.0 : tick == 150'001 ? NAN : 0.0});
  const std::vector<double> time = samples.time(), wave = samples.column(0), kick = samples.column(1);
  ASSERT_EQ(time.size(), wave.size());
  ASSERT_EQ(time.size(), kick.size());
  EXPECT_LE(time.size(), 4000u);
  EXPECT_GE(time.size(), 1000u);
  EXPECT_TRUE(std::is_sorted(time.begin(), time.end()));
  EXPECT_EQ(*std::max_element(kick.begin(), kick.end()), 7.0);
  const auto at = static_cast<std::size_t>(std::max_element(kick.begin(), kick.end()) - kick.begin());
  EXPECT_NEAR(time[at], 123.457, 200.0 / 500.0);
  // each pair of samples is a trough and a crest, except the last pair, which may cover only a part of a
  // period
  for (std::size_t k = 0; k + 2 < wave.size(); k += 2) {
    EXPECT_LT(wave[k], -0.99) << k;
    EXPECT_GT(wave[k + 1], 0.99) << k;
  }
}

TEST(Plot, ShortMotionsAreNotReducedToSamples) {
  Samples samples(1);
  for (int tick = 0; tick < 1500; ++tick) samples.take(tick, {0.5 * tick});
  ASSERT_EQ(samples.time().size(), 1500u);
  EXPECT_EQ(samples.time()[777], 777.0);
  EXPECT_EQ(samples.column(0)[777], 388.5);
}

using tools::MotionPlot;
using tools::Panel;

/// Returns the panels of a scene's motion over `num_ticks` ticks.
std::vector<Panel> panels_of(const std::string& scene, int num_ticks) {
  const TemporaryFolder folder;
  write_text(folder / "scene.yaml", scene);
  const io::PlanResult loaded = io::load_plan(folder / "scene.yaml", 0.0);
  EXPECT_TRUE(loaded.plan);
  if (!loaded.plan) return {};
  State state = make_state(*loaded.plan);
  Workspace workspace = make_workspace(*loaded.plan);
  StepReport report;
  MotionPlot plot(*loaded.plan);
  plot.take(state);
  for (int tick = 0; tick < num_ticks; ++tick) {
    step(*loaded.plan, state, Inputs{}, workspace, report);
    plot.take(state);
  }
  return plot.panels();
}
const Panel& panel(const std::vector<Panel>& panels, const std::string& begin) {
  for (const Panel& each : panels)
    if (each.label.starts_with(begin)) return each;
  throw std::runtime_error("no panel " + begin);
}

// three points of 1 kg joined by springs of 100, 400 and 900 N/m
constexpr const char* kTriangle =
    "points:\n  - {name: a, mass: 1, at: [0, 0, 0]}\n  - {name: b, mass: 1, at: [1, 0, 0]}\n"
    "  - {name: c, mass: 1, at: [0, 1, 0]}\nlinks:\n  - {spring: [a, b], stiffness: 100}\n"
    "  - {spring: [b, c], stiffness: 400}\n  - {spring: [c, a], stiffness: 900}\n";

TEST(Plot, ModesAreRankedByTheirPeakEnergy) {
  // the amplitude of mode 3 is half that of mode 1, but the frequency of mode 3 is more than twice that of
  // mode 1
  const std::vector<Panel> panels =
      panels_of(std::string(kTriangle) + "initial: {modes: {1: {q: 1e-4}, 3: {q: 5e-5}}}\n", 2000);
  const Panel& q = panel(panels, "elastic coordinates [m] of the modes");
  const Panel& energy = panel(panels, "energies of these modes [J]");
  ASSERT_EQ(q.series.size(), 3u);
  EXPECT_TRUE(q.series[0].name.starts_with("mode 3, ")) << q.series[0].name;
  EXPECT_TRUE(q.series[1].name.starts_with("mode 1, ")) << q.series[1].name;
  for (std::size_t k = 0; k < 3; ++k) EXPECT_EQ(q.series[k].name, energy.series[k].name);
  // without damping the energy of a mode stays M/2 omega^2 q^2, where q is the amplitude. The name of a
  // series gives only four digits of the frequency
  for (const auto& [k, amplitude] : {std::pair{0, 5e-5}, {1, 1e-4}}) {
    const auto& series = energy.series[static_cast<std::size_t>(k)];
    const double hertz = std::stod(series.name.substr(series.name.find(", ") + 2));
    const double expected = 0.5 * 3.0 * std::pow(2.0 * std::numbers::pi * hertz * amplitude, 2);
    for (const double value : series.y) ASSERT_NEAR(value, expected, 2e-3 * expected);
  }
}

TEST(Plot, AttitudeAndPointingErrorAreRelativeToTheStart) {
  // the body rotates for 2 s at 0.1 rad/s about its principal axis z, and the initial attitude is a quarter
  // turn about x
  const std::vector<Panel> panels =
      panels_of(std::string(kTriangle) +
                    "initial: {attitude: [0.7071067811865476, 0.7071067811865476, 0, 0], angular_velocity: "
                    "[0, 0, 0.1]}\n",
                2000);
  const double degrees = 0.2 * 180.0 / std::numbers::pi;
  const Panel& attitude = panel(panels, "attitude [deg]: rotation vector from the initial attitude");
  EXPECT_EQ(attitude.series[2].y.front(), 0.0);
  for (const double rest : {attitude.series[0].y.back(), attitude.series[1].y.back()})
    EXPECT_NEAR(rest, 0.0, 1e-9);
  EXPECT_NEAR(attitude.series[2].y.back(), degrees, 1e-9);
  EXPECT_NEAR(panel(panels, "pointing error [deg]").series[0].y.back(), degrees, 1e-9);
  EXPECT_NEAR(panel(panels, "angular velocity [rad/s]").series[2].y.back(), 0.1, 1e-12);
}

TEST(Plot, WheelsArePlottedUnderTheirNames) {
  const std::vector<Panel> panels = panels_of(read_text(kScenes + "satellite.yaml"), 5000);
  const Panel& wheels = panel(panels, "angular momenta of wheels [N m s]");
  ASSERT_EQ(wheels.series.size(), 2u);
  EXPECT_EQ(wheels.series[0].name, "spin_z");
  EXPECT_EQ(wheels.series[1].name, "spin_x");
  // a torque drives the wheel from 1 s on
  EXPECT_NE(wheels.series[0].y.back(), 0.0);
}

TEST(Plot, TheRotationVectorIsAtMost180DegreesForEitherSignOfTheQuaternion) {
  const auto about_z = [](double degrees) {
    const double half = degrees * std::numbers::pi / 360.0;
    return Quat{std::cos(half), 0.0, 0.0, std::sin(half)};
  };
  for (const auto& [to, expected] : {std::pair{50.0, 30.0}, {0.0, -20.0}, {190.0, 170.0}, {210.0, -170.0}}) {
    Quat end = about_z(to);
    for (int sign = 0; sign < 2; ++sign) {
      EXPECT_NEAR(tools::rotation_between(about_z(20.0), end)[2] * 180.0 / std::numbers::pi, expected, 1e-12)
          << to;
      for (double& part : end) part = -part;
    }
  }
  EXPECT_EQ(tools::rotation_between(about_z(20.0), about_z(20.0))[2], 0.0);
}

TEST(Plot, ColumnsOfTwoMotionsAreReadTickByTick) {
  const TemporaryFolder folder;
  write_text(folder / "a.csv", "tick,x,qw,qx,qy,qz\n0,1,0.6,0,0,0.8\n2,3,0.6,0,0,0.8\n3,4,0.6,0,0,0.8\n");
  write_text(folder / "b.csv", "tick,qw,qx,qy,qz,x\n1,1,0,0,0,9\n2,-0.6,0,0,-0.8,5\n3,0.6,0,0,0.8,4\n");
  std::vector<std::string> found;
  tools::trace_columns(
      {.a = folder / "a.csv", .b = folder / "b.csv"}, {"qz", "x"},
      [&](std::int64_t tick, std::size_t column, double a, double b) {
        found.push_back(tools::format_text("%d %zu %g %g", static_cast<int>(tick), column, a, b));
      });
  EXPECT_EQ(found, (std::vector<std::string>{"2 0 0.8 0.8", "2 1 3 5", "3 0 0.8 0.8", "3 1 4 4"}));
}

TEST(Plot, TheCommandComparePlotsBothMotionsAndKeepsItsExitCode) {
  const TemporaryFolder folder;
  write_text(folder / "a.csv", "tick,x\n0,1\n1,2\n");
  write_text(folder / "b.csv", "tick,x\n0,1\n1,2.5\n");
  const std::string compare = "cd " + folder.path() + " && " + kFreeflex + " compare a.csv ";
  for (const auto& [arguments, exit_code] :
       std::vector<std::pair<std::string, int>>{{"b.csv", 1}, {"b.csv --tolerance 0.3", 0}, {"a.csv", 0}}) {
    const Outcome outcome = run(compare + arguments + " --plot d.svg");
    EXPECT_EQ(outcome.exit_code, exit_code) << arguments << outcome.err;
    EXPECT_TRUE(contains(read_text(folder / "d.svg"), "<svg")) << arguments;
    std::filesystem::remove(folder / "d.svg");
  }
  EXPECT_EQ(run(compare + "a.csv --plot no/d.svg").exit_code, 1);
  EXPECT_EQ(run(compare + "a.csv --plot d.gif").exit_code, 2);
}

TEST(Plot, FilesAreWrittenOrTheCauseIsReported) {
  const TemporaryFolder folder;
  const std::string boom = kFreeflex + " run " + kScenes + "boom.yaml --until 1 ";
  for (const char* name : {"a.svg", "b.PNG"}) {
    const Outcome outcome = run(boom + "--plot " + folder / name);
    EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
    EXPECT_TRUE(contains(read_text(folder / name), std::string(name) == "a.svg" ? "<svg" : "PNG"));
  }
  const Outcome modes = run(kFreeflex + " modes " + kScenes + "boom.yaml --plot " + folder / "m.svg");
  EXPECT_EQ(modes.exit_code, 0) << modes.err;
  EXPECT_TRUE(contains(read_text(folder / "m.svg"), "<svg"));
  // the picture shows the scene with the values that the command line sets, as the table does
  std::string heavy = read_text(kScenes + "boom.yaml");
  const std::string mass = "name: tip, mass: 2";
  ASSERT_TRUE(contains(heavy, mass));
  write_text(folder / "heavy.yaml", heavy.replace(heavy.find(mass), mass.size(), "name: tip, mass: 30"));
  EXPECT_EQ(
      run(kFreeflex + " modes " + kScenes + "boom.yaml --set points.tip.mass=30 --plot " + folder / "set.svg")
          .exit_code,
      0);
  EXPECT_EQ(run(kFreeflex + " modes " + folder / "heavy.yaml --plot " + folder / "heavy.svg").exit_code, 0);
  EXPECT_EQ(read_text(folder / "set.svg"), read_text(folder / "heavy.svg"));
  EXPECT_NE(read_text(folder / "set.svg"), read_text(folder / "m.svg"));
  const Outcome nowhere = run(boom + "--plot " + folder / "no/c.svg");
  EXPECT_EQ(nowhere.exit_code, 1);
  EXPECT_TRUE(contains(nowhere.err, "no/c.svg")) << nowhere.err;
  EXPECT_FALSE(contains(nowhere.out, "ticks")) << nowhere.out;
  EXPECT_EQ(run(boom + "--plot " + folder / "c.gif").exit_code, 2);
  EXPECT_EQ(run(boom + "--prefix A --plot " + folder / "c.svg").exit_code, 2);
}

}  // namespace
}  // namespace freeflex::testing
