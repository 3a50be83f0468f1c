// These tests check the messages on wrong command lines, which freeflex and freeflexd give in the same words.
#include <gtest/gtest.h>

#include <string>
#include <utility>
#include <vector>

#include "tests/tools/shell.hpp"

namespace freeflex::testing {
namespace {

TEST(CommandLine, AMisspeltWordIsAnsweredWithASimilarWord) {
  const std::vector<std::pair<std::string, std::string>> misspelt{
      {"chek a.yaml",
       "there is no command 'chek' (did you mean 'check'?); the commands are check, schema, modes, "},
      {"check --jsno a.yaml", "there is no option '--jsno' (did you mean '--json'?)"},
      {"run a.yaml --untl=3", "there is no option '--untl=3' (did you mean '--until'?)"},
      {"--versoin", "there is no option '--versoin' (did you mean '--version'?)"},
      {"check a.yaml b.yaml", "'b.yaml' is one argument too many; omit it"},
      {"modes --count=-1 a.yaml",
       "--count: the value is '-1', but must be a whole number from 0 to 2147483647"},
      {"modes --count=99999999999999999999 a.yaml", "must be a whole number from 0 to 2147483647"},
      {"compile a.yaml -o a.plan --rate 0",
       "--rate: the value is '0', but must be a number from 0.001 to 1000000 [Hz]"}};
  for (const auto& [arguments, text] : misspelt) {
    const Outcome outcome = run(kFreeflex + " " + arguments);
    EXPECT_EQ(outcome.exit_code, 2) << arguments;
    EXPECT_TRUE(contains(outcome.err, text)) << outcome.err;
  }
}

TEST(CommandLine, VectorsMustBeThreeNumbers) {
  const std::vector<std::pair<std::string, std::string>> refused{
      {"push --point a --force 5", "--force 5: must be three finite numbers X,Y,Z in newton, as 0,5,0"},
      {"push --point a --force 1,2,3,4", "--force 1,2,3,4: must be three finite numbers X,Y,Z in newton"},
      {"push --point a --force 1,x,3", "--force 1,x,3: must be three finite numbers X,Y,Z in newton"},
      {"push --point a --force nan,0,0", "--force nan,0,0: must be three finite numbers X,Y,Z in newton"},
      {"push --group a --torque 1,2", "--torque 1,2: must be three finite numbers X,Y,Z in newton metre"},
      {"loads a.yaml --spin 1", "--spin 1: must be three finite numbers X,Y,Z in rad/s"}};
  for (const auto& [arguments, text] : refused) {
    const Outcome outcome = run(kFreeflex + " " + arguments);
    EXPECT_EQ(outcome.exit_code, 2) << arguments;
    EXPECT_TRUE(contains(outcome.err, "error: " + text)) << outcome.err;
  }
  // The three numbers may be negative, and may be separate words. Only the rung of the scene is then refused
  for (const char* taken : {"--spin 0,0,-1 ", "--spin 0 0 -1 "})
    EXPECT_TRUE(contains(run(kFreeflex + " loads " + taken + kScenes + "boom.yaml").err, "spin-loaded"))
        << taken;
}

TEST(CommandLine, OptionsWithoutEffectOverASocketAreRefused) {
  const std::string push = kFreeflex + " push --control hold --timeout 0.3 ";
  for (const auto& [options, words] : std::vector<std::pair<std::string, std::string>>{
           {"--socket --lcm-url udpm://239.255.76.67:7667?ttl=0", "--socket cannot be used with --lcm-url"},
           {"--socket /nowhere.sock --prefix A", "--socket PATH cannot be used with --prefix"}}) {
    const Outcome outcome = run(push + options);
    EXPECT_EQ(outcome.exit_code, 2) << options;
    EXPECT_TRUE(contains(outcome.err, words)) << outcome.err;
  }
  // if no path is given, the prefix selects the socket
  EXPECT_TRUE(contains(run(push + "--prefix NOBODYS_ --socket").err, "no daemon at"));
}

TEST(CommandLine, OptionsWithoutEffectAndWrongFileNamesAreRefused) {
  const std::string log = kGolden + "frame.log";
  for (const auto& [arguments, words] : std::vector<std::pair<std::string, std::string>>{
           {"push --wheel a=1 --axes body", "--axes needs --point or --group"},
           {"view " + log + " --html a.html --port 8000", "--html cannot be used with --port"},
           {"view " + log + " --html a.csv", "must be a name that ends with .html"},
           {"schema --out a.yaml", "must be a name that ends with .json"},
           {"compile " + kScenes + "boom.yaml -o " + log, "exists and is not a plan file"}}) {
    const Outcome outcome = run(kFreeflex + " " + arguments);
    EXPECT_EQ(outcome.exit_code, 2) << arguments;
    EXPECT_TRUE(contains(outcome.err, words)) << outcome.err;
  }
}

TEST(CommandLine, TheFormerOptionStabilityIsAnsweredWithTheNewCommand) {
  for (const char* arguments : {"report --stability", "report --stability --quick --out x"}) {
    const Outcome outcome = run(kFreeflex + " " + arguments);
    EXPECT_EQ(outcome.exit_code, 2) << arguments;
    EXPECT_TRUE(contains(outcome.err, "--stability: use freeflex stability")) << outcome.err;
  }
  EXPECT_FALSE(contains(run(kFreeflex + " report --help").out, "--stability"));
}

TEST(CommandLine, TheDaemonRefusesNumbersThatTheSceneReaderRefuses) {
  for (const char* number : {"0x10", "' 5'", "010", "inf"}) {
    const Outcome outcome =
        run("timeout 20 " + kFreeflexd + " " + kScenes + "boom.yaml --until 0.1 --rate " + number);
    EXPECT_EQ(outcome.exit_code, 2) << number << outcome.err;
    EXPECT_TRUE(contains(outcome.err, "--rate: the value is '")) << outcome.err;
  }
}

TEST(CommandLine, TheDaemonWithoutASceneShowsItsUsage) {
  const Outcome outcome = run(kFreeflexd);
  EXPECT_EQ(outcome.exit_code, 2);
  for (const char* part :
       {"SCENE is missing", "Usage: freeflexd [OPTIONS] SCENE", "--lcm-url", "Exit codes:"})
    EXPECT_TRUE(contains(outcome.err, part)) << outcome.err;
  EXPECT_EQ(outcome.out, "");
}

// returns the message without the name of the program and without the line on how to get help
std::string words_of(const std::string& err) {
  std::string words = err.substr(0, err.find("\nTry '"));
  for (const char* program : {"freeflexd: ", "freeflex: "})
    if (words.starts_with(program)) words.erase(0, std::string(program).size());
  return words.ends_with('\n') ? words.substr(0, words.size() - 1) : words;
}

TEST(CommandLine, BothProgramsReportAFaultInTheSameWords) {
  const TemporaryFolder folder;
  write_text(folder / "good.yaml", read_text(kScenes + "boom.yaml"));
  write_text(folder / "bad.yaml",
             "points:\n  - {name: a, mass: -1, at: [0, 0, 0]}\n  - {name: b, mass: 1, at: [0, 0]}\n");
  write_text(folder / "cut.plan", "freeflex");
  const std::vector<std::pair<std::string, std::string>> faults{
      {"none.yaml", "none.yaml: error: cannot read 'none.yaml': No such file or directory"},
      {"bad.yaml", "bad.yaml:2:21: error: point 'a': mass is -1 kg, but must be >= 0"},
      {"cut.plan", "cut.plan"},
      {"", "error: SCENE is missing"},
      {"good.yaml --rat 5", "error: there is no option '--rat' (did you mean '--rate'?)"},
      {"good.yaml more.yaml", "error: 'more.yaml' is one argument too many; omit it"},
      {"good.yaml --rate 0",
       "error: --rate: the value is '0', but must be a number from 0.001 to 1000000 [Hz]"},
      {"good.yaml --rate", "error: --rate: its value is missing"},
      {"good.yaml --rate 5 --rate 6", "error: --rate is given more than once; give it once"},
      {"good.yaml --prefix no/slash",
       "error: --prefix: the value is 'no/slash', but must be 1 to 32 of A-Z a-z 0-9 _ -"}};
  for (const auto& [arguments, words] : faults) {
    const std::string line = "cd " + folder.path() + " && timeout 20 ";
    // freeflex gets --until and --out, because it would report their absence before the fault
    const Outcome daemon = run(line + kFreeflexd + " " + (arguments.empty() ? "--hold" : arguments));
    const Outcome tool = run(line + kFreeflex + " run --until 1 --out a.log " + arguments);
    EXPECT_EQ(daemon.exit_code, 2) << arguments << daemon.err;
    EXPECT_EQ(tool.exit_code, 2) << arguments << tool.err;
    EXPECT_EQ(words_of(daemon.err), words_of(tool.err)) << arguments;
    EXPECT_TRUE(words_of(tool.err).starts_with(words)) << tool.err;
    EXPECT_TRUE(daemon.out.empty() && tool.out.empty()) << arguments;
  }
}

// under feedback the motion grows as exp(t / 22 ms), which overflows a double within a tick of 1000 s
TEST(CommandLine, BothProgramsRefuseARateThatDoesNotSuitTheScene) {
  const TemporaryFolder folder;
  write_text(folder / "a.yaml",
             "points:\n  - {name: a, mass: 1, at: [0, 0, 0]}\n  - {name: b, mass: 1, at: [1, 0, 0]}\n"
             "links: [{spring: [a, b], stiffness: 100}]\nfeedback: {at: a, velocity: 100}\n");
  const std::string line = "cd " + folder.path() + " && timeout 20 ";
  const Outcome daemon = run(line + kFreeflexd + " a.yaml --rate 0.001 --time asap --until 1");
  const Outcome tool = run(line + kFreeflex + " compile a.yaml -o a.plan --rate 0.001");
  EXPECT_EQ(daemon.exit_code, 2) << daemon.err;
  EXPECT_EQ(tool.exit_code, 2) << tool.err;
  EXPECT_EQ(daemon.err, tool.err);
  EXPECT_TRUE(contains(tool.err, "a.yaml: error: --rate 0.001 is not possible for the scene, because "))
      << tool.err;
  EXPECT_FALSE(std::filesystem::exists(folder / "a.plan"));
}

TEST(CommandLine, AnInvalidChoiceIsAnsweredWithTheChoices) {
  const std::vector<std::pair<std::string, std::string>> refused{
      {kFreeflex + " push --point a --force 0,0,1 --axes bdy", "--axes: found 'bdy'; allowed: world, body"},
      {kFreeflex + " inspect a.yaml --basis x",
       "--basis: found 'x'; allowed: collinear, planar, spatial, formal, householder, modes, auto"},
      {kFreeflex + " plan a.yaml --keep gravity x", "--keep: found 'x'; allowed: all, damping, gravity, "},
      {kFreeflexd + " a.yaml --log-level loud",
       "--log-level: found 'loud'; allowed: debug, info, warning, error, off"},
      {kFreeflexd + " a.yaml --time fast",
       "--time: the value is 'fast', but must be realtime, scaled=K with K > 0, lockstep or asap"}};
  for (const auto& [line, words] : refused) {
    const Outcome outcome = run(line);
    EXPECT_EQ(outcome.exit_code, 2) << line;
    EXPECT_TRUE(contains(outcome.err, ": error: " + words)) << outcome.err;
  }
}

}  // namespace
}  // namespace freeflex::testing
