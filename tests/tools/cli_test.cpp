// These tests check the exit codes, the texts and the JSON of the command line.
#include <gtest/gtest.h>

#include <cmath>
#include <complex>
#include <nlohmann/json.hpp>
#include <sstream>

#include "tests/tools/shell.hpp"

namespace freeflex::testing {
namespace {

using Json = nlohmann::json;

TEST(CommandLine, HelpOfEveryCommandShowsAnExampleAndExitCodes) {
  for (const char* command : {"check", "modes", "inspect", "loads", "plan", "report", "stability", "compile",
                              "run", "push", "monitor", "replay"}) {
    const Outcome outcome = run(kFreeflex + " " + command + " --help");
    EXPECT_EQ(outcome.exit_code, 0) << command;
    EXPECT_TRUE(contains(outcome.out, std::string("freeflex ") + command)) << outcome.out;
    EXPECT_TRUE(contains(outcome.out, "Exit codes: 0 ")) << outcome.out;
  }
}

TEST(CommandLine, WrongUsageGivesExitTwo) {
  for (const char* arguments : {"",
                                "nonsense",
                                "check",
                                "modes --count x a.yaml",
                                "modes --spin 1,2 a.yaml",
                                "modes --spin 0..0 a.yaml",
                                "modes --at 1 a.yaml",
                                "modes --spin 1 --plot a.svg a.yaml",
                                "run a.yaml",
                                "push",
                                "push --point a --control run",
                                "push --control jump",
                                "push --point a --duration 1 --lease 1",
                                "push --point a --axes sideways",
                                "push --point a",
                                "push --wheel a=1 --torque 0,0,1",
                                "push --wheel a",
                                "push --point a=1,2",
                                "push --point a=1,2,3x",
                                "push --point a --force 0,0,1 --sender 'a b'",
                                "push --point a --force 0,0,1 --duration 1e300",
                                "push --clear --force 0,0,1",
                                "push --control run --duration 1",
                                "push --point a=1,2,3 --force 1,1,1",
                                "push --point a --force 1,1,1 --late-ok",
                                "push --clear --axes body",
                                "push --clear --late-ok",
                                "push --point a --force 0x1,0,0",
                                "push --point a=0,0,0x1",
                                "push --point a=inf,0,0",
                                "push --point a --force 1,1,1 --duration ' 5'",
                                "push --point a --force 1,1,1 --slot 64",
                                "push --point a --force 1,1,1 --at-tick -1",
                                "push --point a --force 1,1,1 --at-tick 010",
                                "push --point a --force 1,1,1 --at-tick 99999999999999999999",
                                "push --control step=0",
                                "push --control step=99999999999999999999",
                                "monitor --count 99999999999999999999",
                                "run a.yaml --until 1 --out b.log --session 4",
                                "run a.yaml --until 1 --out b.csv --prefix OTHER",
                                "run a.yaml --out b.log --log c.log --session 99999999999999999999",
                                "run a.yaml --out b.log --until 0x10",
                                "monitor --live --json",
                                "monitor --interval nan",
                                "monitor --duration 0",
                                "monitor --prefix 'A.*'",
                                "replay",
                                "compile a.yaml",
                                "compile a.yaml -o b.plan --rate nan",
                                "run a.yaml --out b.log --until nan",
                                "run a.yaml --out b.log --until -1",
                                "run a.yaml --out '' --until 1"}) {
    const Outcome outcome = run(kFreeflex + " " + arguments);
    EXPECT_EQ(outcome.exit_code, 2) << arguments << ": " << outcome.err;
    EXPECT_FALSE(outcome.err.empty()) << arguments;
    EXPECT_TRUE(outcome.out.empty()) << arguments << ": " << outcome.out;
  }
}

TEST(CommandLine, OutputThatCannotBeWrittenGivesExitOne) {
  for (const char* arguments : {"check", "modes", "modes --json"}) {
    const Outcome outcome = run(kFreeflex + " " + arguments + " " + kScenes + "boom.yaml >/dev/full");
    EXPECT_EQ(outcome.exit_code, 1) << arguments;
    EXPECT_TRUE(contains(outcome.err, "standard output")) << outcome.err;
  }
}

// `ulimit -f 1` limits files to one block, and the files to which the shell redirects the output stay smaller
TEST(CommandLine, AFileAtItsSizeLimitGivesExitOneAndKillsNoProcess) {
  const TemporaryFolder folder;
  const std::string limited = "ulimit -f 1; cd " + folder.path() + "; " + kFreeflex + " ";
  const Outcome compiled = run(limited + "compile " + kScenes + "boom.yaml -o a.plan");
  EXPECT_EQ(compiled.exit_code, 1) << compiled.err;
  EXPECT_TRUE(contains(compiled.err, "File too large")) << compiled.err;
  EXPECT_FALSE(std::filesystem::exists(folder / "a.plan"));
  const Outcome ran = run(limited + "run " + kScenes + "boom.yaml --until 10 --out a.log");
  EXPECT_EQ(ran.exit_code, 1) << ran.err;
  EXPECT_TRUE(contains(ran.err, "File too large")) << ran.err;
}

TEST(CommandLine, ABadUrlGivesExitTwoAndTheMessageSaysWhatIsAllowed) {
  for (const char* url :
       {"nonsense", "tcpq://127.0.0.1:1", "udpm://1.2.3.4:1", "udpm://239.255.76.67:7667?ttl=x"}) {
    for (const char* arguments : {"push --point tip --force 0,0,1", "monitor --duration 1"}) {
      const Outcome outcome =
          run("LCM_DEFAULT_URL='" + std::string(url) + "' " + kFreeflex + " " + arguments);
      EXPECT_EQ(outcome.exit_code, 2) << url;
      EXPECT_TRUE(contains(outcome.err, url) && contains(outcome.err, "must be ")) << outcome.err;
    }
  }
}

TEST(CommandLine, InputFilesAreNeverOverwritten) {
  const TemporaryFolder folder;
  const std::string scene = read_text(kScenes + "boom.yaml");
  write_text(folder / "a.yaml", scene);
  std::filesystem::create_symlink("a.yaml", folder / "b.log");
  for (const char* arguments :
       {"compile a.yaml -o ./a.yaml", "run a.yaml --until 1 --out ../$(basename $PWD)/a.yaml",
        "run a.yaml --until 1 --out ../$(basename $PWD)/b.log"}) {
    const Outcome outcome = run("cd " + folder.path() + " && " + kFreeflex + " " + arguments);
    EXPECT_EQ(outcome.exit_code, 2) << arguments << outcome.err;
    EXPECT_EQ(read_text(folder / "a.yaml"), scene);
  }
}

// two points cannot take a torque about their line, one point cannot take any torque, and the response to
// 1e308 N is not finite
TEST(Loads, LoadsWithoutAStaticResponseGiveExitTwoAndTheCause) {
  const TemporaryFolder folder;
  write_text(folder / "a.yaml",
             "points:\n  - {name: a, mass: 1, at: [0, 0, 0]}\n  - {name: b, mass: 3, at: [2, 0, 0]}\n"
             "  - {name: c, mass: 1, at: [3, 1, 0]}\n  - {name: d, mass: 1, at: [3, 0, 1]}\n"
             "links:\n  - {spring: [a, b, c, d, a, c], stiffness: 10}\n  - {spring: [b, d], stiffness: 10}\n"
             "groups: {l: [a, b], p: [c], body: [a..d]}\n");
  const std::vector<std::pair<std::string, std::string>> refused{
      {"--wrench l=0,0,0,5,0,0",
       "group 'l' cannot support 5 N m of the torque, because its points lie on a line, and this component "
       "acts "
       "about that line"},
      {"--wrench l=0,0,0,5,1,0", "group 'l' cannot support 5 N m of the torque"},
      {"--wrench p=0,0,0,0,0,7",
       "group 'p' cannot support 7 N m of the torque, because its points lie at one position"},
      {"--force a=1e308,0,0", "the result is not finite, because the load is too large"}};
  for (const auto& [arguments, words] : refused) {
    const Outcome outcome = run(kFreeflex + " loads " + folder / "a.yaml" + " " + arguments);
    EXPECT_EQ(outcome.exit_code, 2) << arguments;
    EXPECT_TRUE(outcome.out.empty()) << outcome.out;
    EXPECT_TRUE(contains(outcome.err, words)) << outcome.err;
  }
  for (const char* taken : {"--wrench l=0,0,0,0,5,0", "--wrench p=1,0,0,0,0,0", "--wrench body=0,0,0,5,0,0"})
    EXPECT_EQ(run(kFreeflex + " loads " + folder / "a.yaml" + " " + taken).exit_code, 0) << taken;
}

TEST(Loads, AreReportedWithTheNameOfTheScene) {
  const std::string line = kFreeflex + " loads " + kScenes + "boom.yaml --force tip=0,5,0";
  EXPECT_TRUE(run(line).out.starts_with("boom: 4 points, 3 links\nresultant          0 5 0 N, "))
      << run(line).out;
  EXPECT_EQ(Json::parse(run(line + " --json").out)["name"], "boom");
}

TEST(Check, AGoodPlanFileGivesExitZeroAndATruncatedOneExitTwo) {
  const TemporaryFolder folder;
  ASSERT_EQ(run(kFreeflex + " compile " + kScenes + "boom.yaml -o " + folder / "boom.plan").exit_code, 0);
  const Outcome good = run(kFreeflex + " check " + folder / "boom.plan");
  EXPECT_EQ(good.exit_code, 0) << good.err;
  EXPECT_TRUE(contains(good.out, "boom.plan: good, 4 points, 3 links, 6 rigid and 6 elastic freedoms"))
      << good.out;
  const std::string plan = read_text(folder / "boom.plan");
  write_text(folder / "cut.plan", std::string_view(plan).substr(0, plan.size() - 1));
  const Outcome cut = run(kFreeflex + " check --json " + folder / "cut.plan");
  EXPECT_EQ(cut.exit_code, 2);
  EXPECT_TRUE(
      contains(Json::parse(cut.out)["faults"][0]["message"].get<std::string>(), "the plan is cut off after "))
      << cut.out;
}

TEST(Check, AGoodSceneGivesExitZeroAndOneLine) {
  const Outcome outcome = run(kFreeflex + " check " + kScenes + "boom.yaml");
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_TRUE(contains(outcome.out, "boom.yaml: good, 4 points, 3 links, 6 rigid and 6 elastic freedoms"));
  EXPECT_TRUE(outcome.err.empty()) << outcome.err;
}

TEST(Check, ReportsEveryFaultWithItsLine) {
  const TemporaryFolder folder;
  write_text(
      folder / "bad.yaml",
      "points:\n  - {name: a, mass: -1, at: [0, 0, 0]}\n  - {name: b, mass: 1, at: [0, 0]}\ncolour: red\n");
  const Outcome outcome = run("cd " + folder.path() + " && " + kFreeflex + " check bad.yaml");
  EXPECT_EQ(outcome.exit_code, 2);
  EXPECT_TRUE(contains(outcome.err, "bad.yaml:2:")) << outcome.err;
  EXPECT_TRUE(contains(outcome.err, "bad.yaml:3:")) << outcome.err;
  EXPECT_TRUE(contains(outcome.err, "bad.yaml:4:")) << outcome.err;
  EXPECT_TRUE(outcome.out.empty()) << outcome.out;
}

TEST(Check, JsonContainsTheFaultWithItsLine) {
  const TemporaryFolder folder;
  write_text(folder / "bad.yaml", "points:\n  - {name: a, mass: -1, at: [0, 0, 0]}\n");
  const Outcome outcome = run(kFreeflex + " check --json " + folder / "bad.yaml");
  EXPECT_EQ(outcome.exit_code, 2);
  const Json json = Json::parse(outcome.out);
  EXPECT_EQ(json["ok"], false);
  ASSERT_EQ(json["faults"].size(), 1u) << outcome.out;
  EXPECT_EQ(json["faults"][0]["line"], 2);
  EXPECT_EQ(json["faults"][0]["severity"], "error");
}

TEST(Check, AMissingFileGivesExitTwo) {
  const Outcome outcome = run(kFreeflex + " check /nonexistent/scene.yaml");
  EXPECT_EQ(outcome.exit_code, 2);
  EXPECT_TRUE(contains(outcome.err, "/nonexistent/scene.yaml")) << outcome.err;
}

TEST(Modes, JsonAndTextGiveTheClosedFormOfTwoMassesAndASpring) {
  // two masses m on a spring of stiffness k have one elastic frequency, sqrt(2 k / m) / (2 pi), and five
  // rigid freedoms
  const TemporaryFolder folder;
  write_text(folder / "two.yaml",
             "points:\n  - {name: a, mass: 2, at: [0, 0, 0]}\n  - {name: b, mass: 2, at: [3, 0, "
             "0]}\nlinks:\n  - {spring: [a, b], stiffness: 50}\n");
  const Outcome outcome = run(kFreeflex + " modes --json " + folder / "two.yaml");
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  const Json json = Json::parse(outcome.out);
  EXPECT_DOUBLE_EQ(json["mass"], 4.0);
  EXPECT_DOUBLE_EQ(json["centre"][0], 1.5);
  EXPECT_NEAR(json["principal_moments"][0], 0.0, 1e-14);
  EXPECT_NEAR(json["principal_moments"][2], 9.0, 1e-13);
  EXPECT_EQ(json["rigid_freedoms"], 5);
  ASSERT_EQ(json["modes"].size(), 1u);
  const double expected = std::sqrt(2 * 50.0 / 2.0) / (2.0 * std::acos(-1.0));
  EXPECT_NEAR(json["modes"][0]["frequency"], expected, 1e-14);
  const Outcome text = run(kFreeflex + " modes " + folder / "two.yaml");
  EXPECT_TRUE(contains(text.out, "rigid freedoms     5 (collinear)")) << text.out;
  EXPECT_TRUE(contains(text.out, "1.125395395")) << text.out;
}

// for two masses m on a spring of stiffness k, omega^2 = 2 k / m
TEST(Modes, ModesDependOnTheValuesSetOnTheCommandLine) {
  const TemporaryFolder folder;
  write_text(folder / "pair.yaml",
             "points: [{name: a, mass: 1, at: [0, 0, 0]}, {name: b, mass: 1, at: [1, 0, 0]}]\n"
             "links: {spring: [a, b], stiffness: 100}\n");
  const auto frequency = [&](const std::string& settings) {
    const Outcome outcome = run(kFreeflex + " modes --json " + settings + folder / "pair.yaml");
    EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
    return nlohmann::json::parse(outcome.out)["modes"][0]["frequency"].get<double>();
  };
  const double pi = std::acos(-1.0);
  EXPECT_NEAR(frequency(""), std::sqrt(200.0) / (2.0 * pi), 1e-12);
  EXPECT_NEAR(frequency("--set 'points.*.mass=4' --set links.1.stiffness=50 "), 5.0 / (2.0 * pi), 1e-12);
}

// Three masses of 1 kg in a row are joined by two springs of stiffness k, and a dashpot c acts in parallel
// with the first spring. The elongations u and w of the springs obey u'' = -2 (c u' + k u) + k w, w'' = c u'
// + k u - 2 k w. With c = 2 N s/m and k = 100 N/m the eigenvalues s are the roots of s^4 + 4 s^3 + 400 s^2 +
// 600 s + 30000.
TEST(Modes, IncludeTheCouplingDueToDashpots) {
  const TemporaryFolder folder;
  write_text(folder / "row.yaml",
             "points:\n  - {name: a, mass: 1, at: [0, 0, 0]}\n  - {name: b, mass: 1, at: [1, 0, 0]}\n"
             "  - {name: c, mass: 1, at: [2, 0, 0]}\nlinks:\n  - {spring: [a, b], stiffness: 100}\n"
             "  - {spring: [b, c], stiffness: 100}\n  - {dashpot: [a, b], damping: 2}\n");
  const Outcome outcome = run(kFreeflex + " modes --json " + folder / "row.yaml");
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  const Json json = Json::parse(outcome.out);
  const std::complex<double> roots[] = {{-0.499820642418, 10.064025223391},
                                        {-1.500179357582, 17.123543882107}};
  std::size_t found = 0;
  for (const Json& mode : json["modes"]) {
    if (mode["frequency"] == 0.0) continue;
    ASSERT_LT(found, 2U);
    const std::complex<double> s = roots[found++];
    EXPECT_NEAR(mode["decay_rate"], -s.real(), 1e-9) << mode;
    EXPECT_NEAR(mode["damped_frequency"], s.imag() / (2.0 * std::acos(-1.0)), 1e-9) << mode;
    EXPECT_NEAR(mode["damping_ratio"], -s.real() / std::abs(s), 1e-10) << mode;
  }
  EXPECT_EQ(found, 2U);
  EXPECT_TRUE(json["step_error"].is_null());
  const Outcome text = run(kFreeflex + " modes " + folder / "row.yaml");
  EXPECT_TRUE(contains(text.out, "damped [Hz]")) << text.out;
  EXPECT_TRUE(contains(text.out, "coupled            dashpots couple 2 modes of ")) << text.out;
}

TEST(Modes, TheRepeatedFrequencyOfTheRotorIsMarked) {
  const Outcome outcome = run(kFreeflex + " modes --json " + kScenes + "rotor.yaml");
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  const Json modes = Json::parse(outcome.out)["modes"];
  EXPECT_EQ(modes[0]["cluster"], modes[1]["cluster"]);
  EXPECT_NE(modes[1]["cluster"], modes[2]["cluster"]);
}

// Eleven points of 1 kg on beams with EI = 2200 N m^2. A follower thrust of 20 EI / L^2 = 440 N at one end
// lowers the lowest frequency to 7.4125 rad/s, a spin of 0.34 of 8.7853 rad/s raises it to 10.2314 rad/s
// (true_beam_test).
TEST(Modes, ASpinningBeamAndARocketHaveOtherFrequencies) {
  const TemporaryFolder folder;
  std::string text = "rate: 1000\npoints:\n";
  for (int i = 0; i < 11; ++i)
    text += "  - {name: p" + std::to_string(i) + ", mass: 1, at: [" + std::to_string(i) + ", 0, 0]}\n";
  text += "links:\n";
  for (int i = 0; i < 10; ++i)
    text += "  - {beam: [p" + std::to_string(i) + ", p" + std::to_string(i + 1) +
            "], EA: 1e7, GJ: 2200, EIy: 2200, EIz: 2200, y_axis: [0, 1, 0]}\n";
  text += "loads: [{name: thrust, axes: local, forces: {p0: [440, 0, 0]}}]\n";
  write_text(folder / "beam.yaml", text);
  const auto motions = [&](const std::string& arguments) {
    const Outcome outcome = run(kFreeflex + " modes --json " + folder / "beam.yaml" + arguments);
    EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
    return Json::parse(outcome.out)["steady"];
  };
  const Json rocket = motions(" --loads");
  ASSERT_EQ(rocket.size(), 1u);
  EXPECT_NEAR(2.0 * M_PI * rocket[0]["motions"][0]["frequency"].get<double>(), 7.4125, 1e-4);
  const Json spinning = motions(" --spin 0,0,2.987");
  EXPECT_NEAR(2.0 * M_PI * spinning[0]["motions"][1]["frequency"].get<double>(), 10.2314, 1e-4);
  EXPECT_LT(spinning[0]["accuracy"], 1e-8);
  const Json range = motions(" --spin 0..2.987 --plot " + folder / "campbell.svg");
  ASSERT_EQ(range.size(), 41u);
  EXPECT_NEAR(range[0]["motions"][0]["frequency"].get<double>() * 2.0 * M_PI, 8.7853, 1e-4);
  EXPECT_TRUE(contains(read_text(folder / "campbell.svg"), "<svg"));
  const std::string table = run(kFreeflex + " modes " + folder / "beam.yaml" + " --spin 0..2.987").out;
  EXPECT_TRUE(contains(table, "axis of spin       0 0 1 (body axes), at 2.987 rad/s\n")) << table;
  const Outcome refused = run(kFreeflex + " modes " + folder / "beam.yaml" + " --spin 1,0,0");
  EXPECT_EQ(refused.exit_code, 1);
  EXPECT_TRUE(contains(refused.err, "all points lie on a line")) << refused.err;
}

// The box tumbles at every spin about its axis of intermediate inertia (closed form 0.57735 1/s at 1 rad/s).
TEST(Modes, ARangeOfSpinsSaysWhereAMotionGrows) {
  const Outcome outcome =
      run(kFreeflex + " modes " + kScenes + "gallery/tumbling_box.yaml --spin 0..0,1,0 --count 1");
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_TRUE(contains(outcome.out, "  1               0 *  ")) << outcome.out;
  EXPECT_TRUE(
      contains(outcome.out, "from 0.025 to 1 rad/s some motion grows, at most by 0.5774 1/s at 1 rad/s"))
      << outcome.out;
}

// The tip force of the great bend turns the heavy hub with 1.156e8 N m over 1e9 kg m^2, which does not matter
// to the beam.
TEST(Modes, AnAccelerationBySmallMomentsIsSaid) {
  const std::string scene = kScenes + "gallery/great_bend.yaml --loads --count 1";
  const Outcome outcome = run(kFreeflex + " modes " + scene);
  EXPECT_TRUE(contains(outcome.out, "not quite steady   the loads accelerate the rotation by 0 0 -0.11556"))
      << outcome.out << outcome.err;
}

// The angle between the two springs is a mechanism, on which feedback acts. The angle oscillates if the
// feedback pulls it back, and grows if the feedback pushes it away.
TEST(Modes, AMechanismUnderFeedbackIsListed) {
  const TemporaryFolder folder;
  const auto text_of = [&](const std::string& gains) {
    write_text(
        folder / "hinge.yaml",
        "rate: 1000\npoints:\n  - {name: a, mass: 1, at: [0, 0, 0]}\n  - {name: b, mass: 1, at: [1, 0, "
        "0]}\n  - {name: c, mass: 1, at: [2, 0.5, 0]}\nlinks:\n  - {spring: [a, b], stiffness: 1000}\n  - "
        "{spring: [b, c], stiffness: 1000}\n" +
            gains);
    return run(kFreeflex + " modes " + folder / "hinge.yaml").out;
  };
  const std::string held =
      text_of("feedback: [{at: c, displacement: [0, -50, 0], velocity: [0, -0.5, 0]}]\n");
  EXPECT_TRUE(contains(held, "     1  0                 0.3178029494      0.009938   a mechanism\n")) << held;
  const std::string pushed = text_of("feedback: [{at: c, displacement: [0, 50, 0]}]\n");
  EXPECT_TRUE(contains(pushed, "     1  0                 grows             -1         a mechanism\n"))
      << pushed;
  EXPECT_FALSE(contains(text_of(""), "a mechanism\n"));
}

TEST(Modes, ThePointsOfAMechanismAreReported) {
  // springs along a line do not resist bending, so the three points have one mechanism in each of two
  // perpendicular planes
  const Outcome outcome = run(kFreeflex + " modes --json " + kGolden + "chain.yaml");
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  const Json json = Json::parse(outcome.out);
  ASSERT_EQ(json["mechanisms"].size(), 2u);
  EXPECT_EQ(json["mechanisms"][0].size(), 1u) << json["mechanisms"];
  EXPECT_EQ(json["modes"][0]["frequency"], 0.0);
  EXPECT_EQ(json["modes"][1]["frequency"], 0.0);
  EXPECT_GT(json["modes"][2]["frequency"], 1.0);
  EXPECT_TRUE(contains(run(kFreeflex + " modes " + kGolden + "chain.yaml").out, "mode 1 moves "));
}

TEST(Compile, ACompiledPlanGivesTheModesOfItsScene) {
  const TemporaryFolder folder;
  const Outcome outcome =
      run(kFreeflex + " compile --json " + kScenes + "boom.yaml -o " + folder / "boom.plan");
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_EQ(Json::parse(outcome.out)["elastic_freedoms"], 6);
  EXPECT_EQ(run(kFreeflex + " modes --json " + folder / "boom.plan").out,
            run(kFreeflex + " modes --json " + kScenes + "boom.yaml").out);
}

TEST(Compile, AnUnwritablePlanGivesExitOneAndADamagedPlanExitTwo) {
  EXPECT_EQ(run(kFreeflex + " compile " + kScenes + "boom.yaml -o /nonexistent/boom.plan").exit_code, 1);
  const TemporaryFolder folder;
  ASSERT_EQ(run(kFreeflex + " compile " + kScenes + "boom.yaml -o " + folder / "boom.plan").exit_code, 0);
  std::string plan = read_text(folder / "boom.plan");
  plan[plan.size() / 2] = static_cast<char>(plan[plan.size() / 2] ^ 1);
  write_text(folder / "boom.plan", plan);
  const Outcome outcome = run(kFreeflex + " modes " + folder / "boom.plan");
  EXPECT_EQ(outcome.exit_code, 2);
  EXPECT_TRUE(contains(outcome.err, "boom.plan")) << outcome.err;
}

TEST(Scripts, WrongArgumentsAreAnsweredWithUsage) {
  const std::string top = std::string(FREEFLEX_SOURCE_DIR) + "/";
  for (const char* script : {"tests/bits/one_set_of_bits", "tests/reference/check_core_is_pure.sh"}) {
    const Outcome help = run(top + script + " --help");
    EXPECT_EQ(help.exit_code, 0) << help.err;
    EXPECT_TRUE(contains(help.out, "Exit codes: 0 ")) << help.out;
    for (const char* arguments : {"", "a", "/nonexistent 1 --record", "/nonexistent x"}) {
      const Outcome wrong = run(top + script + " " + arguments);
      EXPECT_EQ(wrong.exit_code, 2) << script << " " << arguments << wrong.err;
      EXPECT_TRUE(contains(wrong.err, "usage: ")) << wrong.err;
    }
  }
  const Outcome option = run(top + "tools/private-network --bogus");
  EXPECT_EQ(option.exit_code, 2);
  EXPECT_TRUE(contains(option.err, "usage: ")) << option.err;
}

TEST(CommandLine, AClosedPipeEndsTheProgramWithoutAMessage) {
  const Outcome outcome = run(kFreeflex + " modes --count 0 " + kScenes + "rotor.yaml | head -n 1");
  EXPECT_TRUE(outcome.err.empty()) << outcome.err;
}

}  // namespace
}  // namespace freeflex::testing
