// These tests check which files `freeflex run` writes, which files it never overwrites, and the verdict on
// the motion.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <iomanip>
#include <nlohmann/json.hpp>
#include <set>
#include <sstream>

#include "freeflex_msgs/status_t.hpp"
#include "service/io/wire/decode.hpp"
#include "service/io/wire/log.hpp"
#include "tests/tools/shell.hpp"

namespace freeflex::testing {
namespace {

using Json = nlohmann::json;

/// Returns a scene of two points of 1 kg, 1 m apart, on a spring of 100 N/m: omega_1^2 = 200 rad^2/s^2, size
/// 0.5 m.
std::string pair(const std::string& more) {
  return "points:\n  - {name: a, mass: 1, at: [0, 0, 0]}\n  - {name: b, mass: 1, at: [1, 0, 0]}\n"
         "links: [{spring: [a, b], stiffness: 100}]\n" +
         more;
}

/// Returns the pair with both ends displaced along the line, and with a spin about an axis across the line.
std::string stretched_and_spun(double displacement, double spin) {
  const std::string d = std::to_string(displacement);
  return pair("initial:\n  angular_velocity: [0, 0, " + std::to_string(spin) +
              "]\n  points: {a: {displacement: [-" + d + ", 0, 0]}, b: {displacement: [" + d + ", 0, 0]}}\n");
}

/// Returns the last STATUS of a log, which must contain more than two.
freeflex_msgs::status_t last_status(const std::string& path) {
  io::LogReader log(path);
  io::LogEvent event;
  freeflex_msgs::status_t status{};
  int num_statuses = 0;
  while (log.next(event)) {
    if (event.channel != "FREEFLEX_STATUS") continue;
    EXPECT_TRUE(io::decode_message(event.bytes, status));
    ++num_statuses;
  }
  EXPECT_GT(num_statuses, 2);
  return status;
}

class Run : public ::testing::Test {
 protected:
  Outcome run_scene(const std::string& scene, const std::string& arguments) {
    write_text(folder_ / "scene.yaml", scene);
    return run("cd " + folder_.path() + " && " + kFreeflex + " run scene.yaml " + arguments);
  }
  TemporaryFolder folder_;
};

TEST_F(Run, SameInputGivesTheSameFile) {
  for (const char* name : {"a.log", "b.log", "a.csv", "b.csv"}) {
    const Outcome outcome =
        run(kFreeflex + " run " + kGolden + "frame.plan --until 0.5 --out " + folder_ / name);
    ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  }
  EXPECT_EQ(read_text(folder_ / "a.log"), read_text(folder_ / "b.log"));
  EXPECT_EQ(read_text(folder_ / "a.csv"), read_text(folder_ / "b.csv"));
}

/// Returns every STATUS of a log.
std::vector<freeflex_msgs::status_t> statuses(const std::string& path) {
  io::LogReader log(path);
  io::LogEvent event;
  std::vector<freeflex_msgs::status_t> all;
  while (log.next(event))
    if (event.channel == "FREEFLEX_STATUS") {
      EXPECT_TRUE(io::decode_message(event.bytes, all.emplace_back()));
    }
  return all;
}

// the log contains the verdict that the run prints, so plots of the log can show it. As in a daemon, the
// verdict on a tick is published later; a run that ends later by this delay ends with the same verdict
TEST_F(Run, ALogContainsTheVerdictsAsLateAsADaemonPublishesThem) {
  const std::string scene = "publish: {status: 1000}\n" + stretched_and_spun(0.2, 1.0);
  write_text(folder_ / "scene.yaml", scene);
  const Json plan = Json::parse(run(kFreeflex + " plan --json " + folder_ / "scene.yaml").out);
  const auto delay = std::llround(1000.0 * plan["verdict"]["delay"].get<double>());
  const auto step = std::llround(1000.0 * plan["verdict"]["step"].get<double>());
  ASSERT_GT(delay, 50);
  const Outcome late =
      run_scene(scene, "--until " + std::to_string(2.0 + 0.001 * static_cast<double>(delay)) +
                           " --json --out late.log");
  ASSERT_EQ(late.exit_code, 0) << late.err;
  for (const freeflex_msgs::status_t& status : statuses(folder_ / "late.log")) {
    const std::int64_t newest = status.tick - delay;
    EXPECT_EQ(status.judged_tick, newest < step ? -1 : newest / step * step) << status.tick;
    if (newest < step) {
      EXPECT_EQ(status.validity, freeflex_msgs::status_t::NOT_JUDGED) << status.tick;
      EXPECT_EQ(status.validity_cause, "no tick is judged yet");
    }
  }
  const Outcome outcome = run_scene(scene, "--until 2 --json --out a.log");
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  const Json printed = Json::parse(outcome.out);
  ASSERT_GT(printed["worst"]["validity"], 0) << "the verdict must differ from the default `good`";
  EXPECT_EQ(last_status(folder_ / "a.log").tick, printed["ticks"]);
  const freeflex_msgs::status_t status = last_status(folder_ / "late.log");
  EXPECT_EQ(status.judged_tick, printed["judged_tick"]);
  EXPECT_EQ(status.validity, printed["validity"]);
  EXPECT_EQ(status.validity_cause, printed["cause"]);
  EXPECT_EQ(status.position_error, printed["position_error"]);
  EXPECT_EQ(status.attitude_error, printed["attitude_error"]);
  EXPECT_EQ(status.deformation_error, printed["deformation_error"]);
  EXPECT_EQ(status.shadow_error, printed["shadow_error"]);
  EXPECT_EQ(status.error_scale, printed["scale"]);
  EXPECT_EQ(status.worst_validity, printed["worst"]["validity"]);
  EXPECT_EQ(status.worst_validity_tick, printed["worst"]["tick"]);
  EXPECT_EQ(status.worst_validity_cause, printed["worst"]["cause"]);
}

// the STATUS in the log of a run has the same figures as the STATUS of the daemon
TEST_F(Run, ALogContainsTheDrifts) {
  const Outcome outcome = run_scene("rate: 50\nfidelity: coupled\n" + stretched_and_spun(0.01, 1.0),
                                    "--until 2 --json --out a.log");
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  const freeflex_msgs::status_t status = last_status(folder_ / "a.log");
  // no load acts, so the drift of the energy is an error of the step, and 50 Hz is a coarse rate for 2.25 Hz
  EXPECT_GT(status.energy_drift, 1e-12);
  EXPECT_LT(status.energy_drift, 1e-2);
}

TEST_F(Run, ATableHasTheNamedColumnsInEveryRow) {
  const Outcome outcome =
      run(kFreeflex + " run " + kScenes + "boom.yaml --until 0.1 --out " + folder_ / "a.csv");
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  std::istringstream lines(read_text(folder_ / "a.csv"));
  std::string line;
  std::getline(lines, line);
  EXPECT_TRUE(line.starts_with("tick,time,x,y,z,qw,qx,qy,qz,vx,vy,vz,wx,wy,wz,hx,hy,hz,q1,")) << line;
  EXPECT_TRUE(contains(line, ",point.tip.x,point.tip.y,point.tip.z,"));
  const auto columns = std::count(line.begin(), line.end(), ',');
  int rows = 0;
  while (std::getline(lines, line)) {
    EXPECT_EQ(std::count(line.begin(), line.end(), ','), columns);
    ++rows;
  }
  // rows at 50 Hz over 0.1 s have the ticks 0, 20, 40, 60, 80, 100
  EXPECT_EQ(rows, 6);
}

TEST_F(Run, RefusesACommandLineWithoutAnEndTime) {
  const Outcome outcome = run(kFreeflex + " run " + kScenes + "boom.yaml --out " + folder_ / "never.log");
  EXPECT_EQ(outcome.exit_code, 2);
  EXPECT_TRUE(contains(outcome.err, "--until"));
}

TEST_F(Run, AFullDiskOrAnUnwritableFolderGivesExitOne) {
  const Outcome full = run(kFreeflex + " run " + kScenes + "boom.yaml --until 10 --out /dev/full");
  EXPECT_EQ(full.exit_code, 1);
  EXPECT_TRUE(contains(full.err, "No space left")) << full.err;
  EXPECT_EQ(run(kFreeflex + " run " + kScenes + "boom.yaml --until 1 --out /nonexistent/a.log").exit_code, 1);
}

// a file system is mounted that is full after some hundred ticks
TEST_F(Run, OnAFullDiskTheRunSoFarIsKeptAndCanBeReplayed) {
  const std::string mounted =
      "unshare -rm sh -c 'mount -t tmpfs -o size=256k none " + folder_.path() + " && ";
  if (run(mounted + "true'").exit_code != 0) GTEST_SKIP() << "the kernel refuses a private mount";
  const std::string scene = kScenes + "boom.yaml", at = folder_.path() + "/";
  const auto fill = [&](const std::string& name, const std::string& more) {
    return run(mounted + kFreeflex + " run " + scene + " --until 1000 --out " + at + name + "; echo $?; ls " +
               at + "; " + more + "'");
  };
  const Outcome log = fill("a.log", kFreeflex + " replay " + at + "a.log.partial; echo $?");
  EXPECT_TRUE(log.out.starts_with("1\na.log.partial\nidentical to the bit over ")) << log.out << log.err;
  EXPECT_TRUE(log.out.ends_with("\n0\n")) << log.out;
  EXPECT_TRUE(contains(
      log.err, "a.log.partial: No space left on device; the file is kept and contains the run up to tick "))
      << log.err;
  EXPECT_TRUE(contains(log.err, " of 1000000")) << log.err;
  // every row of the table is complete, with as many columns as the header
  const Outcome table = fill("a.csv", "awk -F, \"{print NF}\" " + at + "a.csv.partial | sort -u | wc -l; " +
                                          "tail -c 1 " + at + "a.csv.partial | od -An -c");
  EXPECT_EQ(table.out, "1\na.csv.partial\n1\n  \\n\n") << table.err;
}

TEST_F(Run, AtASizeLimitTheRunSoFarIsKeptAndTheJsonReportsIt) {
  const Outcome outcome = run("ulimit -f 200; cd " + folder_.path() + "; " + kFreeflex + " run " + kScenes +
                              "boom.yaml --json --until 1000 --out a.log");
  EXPECT_EQ(outcome.exit_code, 1) << outcome.err;
  const Json json = Json::parse(outcome.out);
  EXPECT_EQ(json["output"], "a.log.partial");
  EXPECT_EQ(json["complete"], false);
  EXPECT_GT(json["ticks"], 0);
  EXPECT_LT(json["ticks"], 1'000'000);
  const Outcome replayed = run(kFreeflex + " replay --json " + folder_ / "a.log.partial");
  EXPECT_EQ(replayed.exit_code, 0) << replayed.err;
  // the last record is at most 20 ticks, the period of STATE, after the last STATE
  EXPECT_LE(json["ticks"].get<int>() - Json::parse(replayed.out)["ticks"].get<int>(), 20);
}

TEST_F(Run, WithoutAFilePrintsOnlyTheSummary) {
  const Outcome outcome = run_scene(stretched_and_spun(2e-4, 0.01), "--until 2");
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_TRUE(contains(outcome.out, ": 2000 ticks, 2 s\n")) << outcome.out;
  EXPECT_TRUE(contains(outcome.out, "verdict at the end: good\n")) << outcome.out;
  EXPECT_TRUE(contains(outcome.out, " m (displacement); good up to 2 %")) << outcome.out;
  EXPECT_FALSE(contains(outcome.out, "ratio")) << outcome.out;
  EXPECT_EQ(run("ls " + folder_.path()).out, "scene.yaml\n");
  const Outcome json = run_scene(stretched_and_spun(2e-4, 0.01), "--until 2 --json");
  EXPECT_TRUE(Json::parse(json.out)["output"].is_null()) << json.out;
  EXPECT_EQ(Json::parse(json.out)["ticks"], 2000);
}

TEST_F(Run, AnInterruptedFileIsMarkedAndCanBeReplayed) {
  // the run takes far longer than 1 s, after which SIGINT is sent, so SIGINT arrives during the run
  const Outcome outcome = run("timeout --preserve-status -s INT 1 " + kFreeflex + " run " + kGolden +
                              "frame.plan --until 1e8 --out " + folder_ / "a.log");
  EXPECT_EQ(outcome.exit_code, 130) << outcome.err;
  EXPECT_FALSE(std::filesystem::exists(folder_ / "a.log"));
  const Outcome replayed =
      run(kFreeflex + " replay " + folder_ / "a.log.partial --plan " + kGolden + "frame.plan");
  EXPECT_EQ(replayed.exit_code, 0) << replayed.err << replayed.out;
}

TEST_F(Run, InputFilesAreNeverOverwritten) {
  const std::string list = "rotor.yaml rotor_points.csv rotor_stiffness.mtx";
  ASSERT_EQ(run("cd " + kScenes + " && cp " + list + " " + folder_.path()).exit_code, 0);
  const std::string in_folder = "cd " + folder_.path() + " && " + kFreeflex + " ";
  ASSERT_EQ(run(in_folder + "run rotor.yaml --until 0.01 --out flight.log").exit_code, 0);
  ASSERT_EQ(
      run("cd " + folder_.path() + " && ln -s rotor_stiffness.mtx link.log && cp rotor.yaml next.log.partial")
          .exit_code,
      0);
  const auto whole = [&] {
    std::string text;
    for (const char* name :
         {"rotor.yaml", "rotor_points.csv", "rotor_stiffness.mtx", "flight.log", "next.log.partial"})
      text += read_text(folder_ / name);
    return text;
  };
  const std::string before = whole();
  for (const char* arguments :
       {"compile rotor.yaml -o rotor_points.csv", "compile rotor.yaml -o ./rotor_stiffness.mtx",
        "run rotor.yaml --until 0.01 --out rotor_points.csv", "run rotor.yaml --until 0.01 --out link.log",
        "run next.log.partial --until 0.01 --out next.log",
        "run rotor.yaml --log flight.log --out flight.log"}) {
    const Outcome outcome = run(in_folder + arguments);
    EXPECT_EQ(outcome.exit_code, 2) << arguments << outcome.err;
    EXPECT_TRUE(contains(outcome.err, "name another file to write")) << outcome.err;
    EXPECT_TRUE(whole() == before) << arguments;
  }
}

TEST_F(Run, TheFileExtensionInAnyCaseSelectsTheFormat) {
  ASSERT_EQ(run_scene(pair(""), "--until 0.1 --out a.csv").exit_code, 0);
  ASSERT_EQ(run_scene(pair(""), "--until 0.1 --out b.CSV").exit_code, 0);
  ASSERT_EQ(run_scene(pair(""), "--until 0.1 --out c.Log").exit_code, 0);
  EXPECT_EQ(read_text(folder_ / "a.csv"), read_text(folder_ / "b.CSV"));
  EXPECT_EQ(run("cd " + folder_.path() + " && " + kFreeflex + " replay c.Log").exit_code, 0);
  for (const char* name : {"a.txt", "flight", "a.csv.gz", ".csv", "'a csv'"}) {
    const Outcome outcome = run_scene(pair(""), "--until 0.1 --out " + std::string(name));
    EXPECT_EQ(outcome.exit_code, 2) << name;
    EXPECT_TRUE(contains(outcome.err, "must be NAME.csv (a table), NAME.log (an LCM log) or - (a table on"))
        << outcome.err;
    EXPECT_FALSE(std::filesystem::exists(folder_ / name)) << name;
  }
}

TEST_F(Run, ADashWritesOnlyTheTableToStandardOutput) {
  ASSERT_EQ(run_scene(pair(""), "--until 0.1 --out a.csv").exit_code, 0);
  const Outcome piped = run_scene(pair(""), "--until 0.1 --out -");
  EXPECT_EQ(piped.exit_code, 0) << piped.err;
  EXPECT_EQ(piped.out, read_text(folder_ / "a.csv"));
  EXPECT_TRUE(contains(piped.err, "standard output: 100 ticks, 0.1 s\n")) << piped.err;
  for (const char* name : {"-", "-.partial"}) EXPECT_FALSE(std::filesystem::exists(folder_ / name)) << name;
  const Outcome json = run_scene(pair(""), "--until 0.1 --json --out -");
  EXPECT_EQ(json.exit_code, 2);
  EXPECT_EQ(json.out, "");
  EXPECT_TRUE(contains(json.err, "--json needs a file for --out")) << json.err;
  const Outcome full = run_scene(pair(""), "--until 0.1 --out - >/dev/full");
  EXPECT_EQ(full.exit_code, 1);
  EXPECT_TRUE(contains(full.err, "standard output")) << full.err;
}

/// Returns a scene of 700 points whose set-up takes many seconds.
std::string slow_scene() {
  std::string points = "points:\n", links = "links:\n";
  for (int i = 0; i < 700; ++i) {
    const auto name = [](int k) { return "p" + std::to_string(k); };
    points += "  - {name: " + name(i) + ", mass: 1, at: [" + std::to_string(i) + ", " +
              std::to_string(i * i % 7) + ", " + std::to_string(i * 3 % 5) + "]}\n";
    for (int k = std::max(0, i - 4); k < i; ++k)
      links += "  - {spring: [" + name(k) + ", " + name(i) + "], stiffness: 1000}\n";
  }
  return points + links;
}

// a shell without job control starts its background commands with SIGINT ignored, but SIGINT must end them
TEST_F(Run, AnInterruptDuringTheSetUpEndsEachCommandWithoutOutput) {
  write_text(folder_ / "slow.yaml", slow_scene());
  for (const char* signal : {"INT", "TERM"}) {
    const std::string start =
        "for c in 'run slow.yaml --until 1 --out a.log' 'run slow.yaml --until 1 --out -' "
        "'compile slow.yaml -o a.plan' 'modes --json slow.yaml'; do " +
        kFreeflex + " $c & pids=\"$pids $!\"; done; ";
    // the script waits until each command catches SIGINT, which is the second bit of SigCgt
    const std::string wait =
        "for p in $pids; do until grep -q '^SigCgt:.*[2367abef]$' /proc/$p/status; do sleep 0.1; done; "
        "done; ";
    const std::string end =
        "sleep 0.5; kill -" + std::string(signal) + " $pids; for p in $pids; do wait $p; echo $?; done";
    const Outcome outcome = run("cd " + folder_.path() + " && " + start + wait + end);
    EXPECT_EQ(outcome.out, "130\n130\n130\n130\n") << signal;
    const std::string line = "freeflex: interrupted before there was a result\n";
    EXPECT_EQ(outcome.err, line + line + line + line) << signal;
    EXPECT_EQ(run("ls " + folder_.path()).out, "slow.yaml\n") << signal;
  }
}

TEST_F(Run, ReportsTheRatiosOfAStretchedAndSpunPair) {
  // the displacement is largest at the start, and the spin about an axis across the line of the pair stays
  // constant
  const Outcome outcome = run_scene(stretched_and_spun(2e-4, 0.1), "--until 2 --json --out a.csv");
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  const Json json = Json::parse(outcome.out);
  const double spin_ratio = 0.1 * 0.1 / 200.0 * 0.5 / 2e-4;
  EXPECT_NEAR(json["displacement_ratio"], 2e-4 / 0.5, 1e-16);  // rounding error of a position over the size
  EXPECT_NEAR(json["spin_ratio"], spin_ratio, 1e-13 * spin_ratio);
  EXPECT_TRUE(contains(outcome.err, "the run left the validity of this rung")) << outcome.err;
  EXPECT_TRUE(contains(outcome.err, "README, 'When not to trust it'")) << outcome.err;
  EXPECT_FALSE(contains(outcome.err, "displacement ratio")) << outcome.err;
}

// the summary gives one error of the displacements, on which the verdict is based
TEST_F(Run, TheSummaryHasOneErrorEstimate) {
  const std::string scene = stretched_and_spun(2e-4, 0.01);
  const Outcome text = run_scene(scene, "--until 2 --out a.csv");
  const Json json = Json::parse(run_scene(scene, "--until 2 --json --out a.csv").out);
  const double percent = 100.0 * json["deformation_error"].get<double>() / json["scale"].get<double>();
  std::ostringstream expected;
  expected << std::setprecision(2) << "estimated error at the end: " << percent << " % of ";
  EXPECT_TRUE(contains(text.out, "verdict at the end: good\n")) << text.out;
  EXPECT_TRUE(contains(text.out, expected.str())) << text.out << expected.str();
  EXPECT_TRUE(contains(text.out, " m (displacement); good up to 2 %, outside above 20 %\n")) << text.out;
  EXPECT_FALSE(contains(text.out, "ratio")) << text.out;
  EXPECT_TRUE(text.err.empty()) << text.err;
}

TEST_F(Run, AVibrationThroughZeroDoesNotRaiseTheSpinRatio) {
  // the pair starts undeformed and reaches 0.2 mm after a quarter of its period of 444 ticks, and every peak
  // is within 8 ticks of a sample
  const double velocity = 2e-4 * std::sqrt(200.0);
  std::ostringstream text;
  text << std::setprecision(17) << velocity;
  const std::string v = text.str();
  const Outcome outcome =
      run_scene(pair("initial:\n  angular_velocity: [0, 0, 0.01]\n  points: {a: {velocity: [-" + v +
                     ", 0, 0]}, b: {velocity: [" + v + ", 0, 0]}}\n"),
                "--until 5 --json --out a.csv");
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  const double spin_ratio = 0.01 * 0.01 / 200.0 * 0.5 / 2e-4;
  EXPECT_NEAR(Json::parse(outcome.out)["spin_ratio"], spin_ratio, 0.01 * spin_ratio);
  EXPECT_TRUE(outcome.err.empty()) << outcome.err;
}

TEST_F(Run, WithoutPublishedPointsTheRatiosAreUnknown) {
  const std::string scene = stretched_and_spun(2e-2, 3.0) + "publish: {points: {of: []}, groups: []}\n";
  const Outcome json = run_scene(scene, "--until 1 --json --out a.csv");
  ASSERT_EQ(json.exit_code, 0) << json.err;
  EXPECT_TRUE(Json::parse(json.out)["displacement_ratio"].is_null()) << json.out;
  EXPECT_TRUE(Json::parse(json.out)["spin_ratio"].is_null()) << json.out;
}

TEST_F(Run, TheErrorOnANonFiniteStateGivesCauseAndRemedy) {
  const Outcome outcome = run_scene(pair("loads: [{forces: {b: [1e308, 0, 0]}}]\n"), "--until 9 --out a.log");
  EXPECT_EQ(outcome.exit_code, 1);
  for (const char* part :
       {"is not finite", "loads or spin are far too large", "smaller loads", "nothing was written"})
    EXPECT_TRUE(contains(outcome.err, part)) << outcome.err;
  EXPECT_FALSE(std::filesystem::exists(folder_ / "a.log"));
}

// the scene is the pair with unstable feedback of 1e4 N s/m and no load
TEST_F(Run, TheErrorOnANonFiniteStateMentionsFeedback) {
  const Outcome outcome = run_scene(
      pair("initial: {modes: {1: {q: 1e-3}}}\nfeedback: {at: a, velocity: 1e4}\n"), "--until 1 --out a.log");
  EXPECT_EQ(outcome.exit_code, 1);
  EXPECT_TRUE(contains(outcome.err, "the feedback is unstable, or loads")) << outcome.err;
  EXPECT_TRUE(contains(outcome.err, "signs and sizes of gains")) << outcome.err;
}

TEST_F(Run, NoTwoColumnsHaveTheSameName) {
  const Outcome outcome = run_scene(
      "points:\n  - {name: a, mass: 1, at: [0, 0, 0]}\n  - {name: a.x, mass: 1, at: [1, 0, 0]}\n"
      "  - {name: x, mass: 1, at: [0, 1, 0]}\n  - {name: tick, mass: 1, at: [0, 0, 1]}\n"
      "links:\n  - {name: a, beam: [a, a.x], EA: 1, GJ: 1, EIy: 1, EIz: 1}\n"
      "  - {name: a.1, spring: [x, tick], stiffness: 1}\n  - {name: tick, spring: [a, x], stiffness: 1}\n"
      "  - {name: a.x, spring: [a, tick], stiffness: 1}\n",
      "--until 0 --out a.csv");
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  std::istringstream table(read_text(folder_ / "a.csv"));
  std::string header;
  std::getline(table, header);
  std::istringstream names(header);
  std::set<std::string> seen;
  for (std::string name; std::getline(names, name, ',');)
    EXPECT_TRUE(seen.insert(name).second) << name << " twice in " << header;
  for (const char* name : {"tick", "x", "point.a.x", "point.a.x.x", "point.tick.z", "link.a.1", "link.a.12",
                           "link.a.1.axial", "link.tick.axial", "link.a.x.axial"})
    EXPECT_TRUE(seen.contains(name)) << name << " not in " << header;
}

TEST_F(Run, WithoutPublishedStatesATableIsRefusedAndALogGivesAWarning) {
  const std::string scene = pair("publish: {state: 0}\n");
  const Outcome table = run_scene(scene, "--until 1 --out a.csv");
  EXPECT_EQ(table.exit_code, 2);
  EXPECT_TRUE(contains(table.err, "publishes no state") && contains(table.err, "a rate [Hz]")) << table.err;
  EXPECT_FALSE(std::filesystem::exists(folder_ / "a.csv"));
  const Outcome log = run_scene(scene, "--until 1 --out a.log");
  EXPECT_EQ(log.exit_code, 0);
  EXPECT_TRUE(contains(log.err, "warning: the scene publishes no state")) << log.err;
}

TEST_F(Run, ALogOfAnotherPlanIsReported) {
  // the recording pushes point 3, but the scene has only two points
  const Outcome outcome = run_scene(pair(""), "--log " + kGolden + "frame.log --out a.log");
  EXPECT_EQ(outcome.exit_code, 2) << outcome.err;
  EXPECT_TRUE(contains(outcome.err, "the log belongs to another plan")) << outcome.err;
  EXPECT_FALSE(contains(outcome.err, "incomplete")) << outcome.err;
}

TEST_F(Run, ARunWithASettingIsReplayedByThePlanCompiledWithThatSetting) {
  const std::string set = "--set points.b.mass=3 --set 'links.*.stiffness=400' ";
  const Outcome outcome = run_scene(stretched_and_spun(1e-3, 0.0), set + "--until 0.1 --out set.log");
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  const std::string in_folder = "cd " + folder_.path() + " && " + kFreeflex;
  ASSERT_EQ(run(in_folder + " compile " + set + "scene.yaml -o set.plan").exit_code, 0);
  EXPECT_EQ(run(in_folder + " replay set.log --plan set.plan").exit_code, 0);
  const Outcome other = run(in_folder + " replay set.log --plan scene.yaml");
  EXPECT_EQ(other.exit_code, 2) << "without the settings the scene gives another plan";
  EXPECT_TRUE(contains(other.err, "fingerprint")) << other.err;
}

TEST_F(Run, AFlagWithAValueIsRefused) {
  write_text(folder_ / "scene.yaml", pair(""));
  const std::string run_scene = "cd " + folder_.path() + " && " + kFreeflex + " run scene.yaml --until 1 ";
  for (const std::string flag : {"--explain", "--json"}) {
    const Outcome outcome = run(run_scene + flag + "=2");
    EXPECT_EQ(outcome.exit_code, 2) << flag;
    EXPECT_TRUE(contains(outcome.err, "error: " + flag + " takes no value; omit '=' and the text after it\n"))
        << outcome.err;
  }
}

TEST_F(Run, AWrongSettingIsRefusedByEveryProgramInTheSameWords) {
  write_text(folder_ / "scene.yaml", pair(""));
  const std::string in_folder = "cd " + folder_.path() + " && ";
  const std::string message = "--set points.b.mass=-3: error: point 'b': mass is -3 kg, but must be >= 0\n";
  for (const std::string& command :
       {kFreeflex + " check scene.yaml", kFreeflex + " modes scene.yaml", kFreeflex + " plan scene.yaml",
        kFreeflex + " run scene.yaml --until 1 "
                    "--out a.log",
        kFreeflex + " compile scene.yaml -o a.plan", kFreeflexd + " scene.yaml --until 1"}) {
    const Outcome outcome = run(in_folder + command + " --set points.b.mass=-3");
    EXPECT_EQ(outcome.exit_code, 2) << command;
    EXPECT_TRUE(contains(outcome.err, message)) << command << ": " << outcome.err;
    const Outcome bare = run(in_folder + command + " --set points.b.mass");
    EXPECT_EQ(bare.exit_code, 2) << command;
    EXPECT_TRUE(contains(bare.err,
                         "the value is 'points.b.mass', but must be PATH=VALUE, as in points.hub.mass=41 or "
                         "'links.*.E=6.9e10'"))
        << command << ": " << bare.err;
  }
}

}  // namespace
}  // namespace freeflex::testing
