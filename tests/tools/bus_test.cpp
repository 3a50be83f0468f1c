// These tests run `freeflex push`, `freeflex monitor` and LCM's logger and player with a daemon in a private
// network.
#include <gtest/gtest.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <sstream>

#include "tests/support/network_tests.hpp"
#include "tests/tools/json_fields.hpp"
#include "tests/tools/shell.hpp"

namespace freeflex::testing {
namespace {

using Json = nlohmann::json;

class OnTheBus : public ::testing::Test {
 protected:
  void SetUp() override {
    if (!refusal.empty()) GTEST_SKIP() << refusal;
  }
  /// Runs a script while a daemon runs the scene, and then stops the daemon. In the script, $F is freeflex,
  /// $D is freeflexd, $P is freeflex push with a timeout of 60 s, and $T is a folder.
  Outcome with_daemon(const std::string& script, const std::string& scene = kGolden + "frame.plan") {
    return run("F=" + kFreeflex + "; P=\"$F push --timeout 60\"; D=" + kFreeflexd + "; T=" + folder_.path() +
               "; export XDG_RUNTIME_DIR=$T; $D " + scene + " --log-level error & daemon=$!; (" + script +
               "); code=$?; kill $daemon 2>/dev/null; wait $daemon; exit $code");
  }
  TemporaryFolder folder_;
};

TEST_F(OnTheBus, APushIsAcceptedAndItsTickIsPrinted) {
  const Outcome outcome = with_daemon("$P --json --point tip --force -1,0,0 --duration 0.1");
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  const Json json = Json::parse(outcome.out);
  EXPECT_EQ(json["accepted"], true);
  EXPECT_GE(json["tick"], 0);
}

TEST_F(OnTheBus, OnePushAppliesAForceToEachOfItsPoints) {
  // tick 4000 comes only after the monitor has begun to listen
  const Outcome outcome = with_daemon(
      "$P --point tip=0,0.5,3 --point hub=0,-5e-1,-3 --point mid --force 1,2,3 --at-tick 4000 >&2 && "
      "$F monitor --channel APPLIED --json --count 1 --duration 20");
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  const Json command = Json::parse(outcome.out)["message"]["command"];
  EXPECT_EQ(command["forces"],
            Json::parse(R"([{"point": 3, "force": [0.0, 0.5, 3.0]}, {"point": 0, "force": [0.0, -0.5, -3.0]},
                            {"point": 1, "force": [1.0, 2.0, 3.0]}])"))
      << outcome.out;
}

// a tick of the golden plan lasts 1 ms
TEST_F(OnTheBus, PushWarnsIfADurationIsRoundedToTicks) {
  const std::string push = "$P --point tip --force 0,0,1 ";
  for (const auto& [asked, words] : std::vector<std::pair<std::string, std::string>>{
           {"--duration 1e-5", "--duration 1e-05 s is 0.01 ticks, so it lasts 1 tick, 0.001 s"},
           {"--lease 0.0024", "--lease 0.0024 s is 2.4 ticks, so it lasts 2 ticks, 0.002 s"}}) {
    const Outcome outcome = with_daemon(push + asked);
    EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
    EXPECT_TRUE(contains(outcome.err, "warning: " + words)) << outcome.err;
  }
  EXPECT_FALSE(contains(with_daemon(push + "--duration 0.1").err, "warning"));
}

TEST_F(OnTheBus, ARejectedPushPrintsTheReason) {
  const Outcome outcome = with_daemon("$P --point tip --force 0,0,1 --at-tick 0");
  EXPECT_EQ(outcome.exit_code, 1) << outcome.err;
  EXPECT_TRUE(contains(outcome.out, "rejected at tick ")) << outcome.out;
  EXPECT_TRUE(contains(outcome.out, " (late): ")) << outcome.out;
}

TEST_F(OnTheBus, RejectionsContainTheNamesOfPointsAndOptions) {
  write_text(
      folder_ / "four.yaml",
      "points:\n  - {mass: 1, at: [0, 0, 0]}\n  - {mass: 1, at: [1, 0, 0]}\n  - {mass: 1, at: [0, 1, 0]}\n"
      "  - {mass: 1, at: [0, 0, 1]}\nlinks: [{spring: ['1', '2', '3', '4', '1'], stiffness: 1000}]\n"
      "groups: {base: [1, 2, 3]}\ncommands: {points: [1, 2, 3], force_limit: 10}\n");
  const Outcome outcome = with_daemon(
      "$P --point 1=0,0,1 --point 3=0,0,20; $P --point 4=0,0,1; $P --group base --force "
      "0,0,11; "
      "$P --point 1=0,0,1 --at-tick 0; $P --control shapes=99; $P --control step=5; "
      "$P --json --point 3=0,0,20",
      folder_ / "four.yaml");
  EXPECT_EQ(outcome.exit_code, 1) << outcome.err;
  for (const char* part :
       {"(over_limit): point '3' has |force| 20 N", "(not_pushable): point '4' may not be pushed",
        "(over_limit): group 'base' has |force| 11 N", "(late): --at-tick 0 has passed", "or add --late-ok",
        "(bad_control): --control shapes=99 must be a mode from 1 to 6",
        "(wrong_mode): --control step=N applies only while holding; send --control hold first",
        "\"text\": \"point '3' has "})
    EXPECT_TRUE(contains(outcome.out, part)) << part << " not in " << outcome.out << outcome.err;
}

TEST_F(OnTheBus, PushToAnUnknownNameListsTheKnownNames) {
  const Outcome outcome = with_daemon("$P --point nose --force 0,0,1");
  EXPECT_EQ(outcome.exit_code, 2);
  EXPECT_TRUE(contains(outcome.err, "there is no point 'nose' in scene 'frame'")) << outcome.err;
  EXPECT_TRUE(contains(outcome.err, "tip")) << outcome.err;
  const Outcome near = with_daemon("$P --point tpi --force 0,0,1");
  EXPECT_TRUE(contains(near.err, "did you mean 'tip'?")) << near.err;
  EXPECT_EQ(with_daemon("$P --group nose --torque 0,0,1").exit_code, 2);
}

TEST_F(OnTheBus, PushWithoutADaemonReportsUrlAndPrefix) {
  const Outcome outcome = run(kFreeflex + " push --point tip --force 0,0,1 --timeout 0.3");
  EXPECT_EQ(outcome.exit_code, 1);
  EXPECT_TRUE(contains(outcome.err, "no message of a daemon has come")) << outcome.err;
  EXPECT_TRUE(contains(outcome.err, "udpm://239.255.76.67:7667")) << outcome.err;
  EXPECT_TRUE(contains(outcome.err, "FREEFLEX_")) << outcome.err;
}

TEST_F(OnTheBus, PushOverTheSocketFindsItsDefaultPath) {
  const Outcome outcome = with_daemon(
      "while ! $P --socket --point tip --force 0,0,1 2>$T/err; do grep -q 'no daemon at' $T/err || "
      "exit 9; "
      "sleep 0.05; done; $P --socket --control hold; $P --socket --point nose --force 0,0,1");
  EXPECT_EQ(outcome.exit_code, 2) << outcome.err;
  EXPECT_TRUE(contains(outcome.out, "accepted by the daemon of scene 'frame': takes effect at tick "))
      << outcome.out << outcome.err;
  EXPECT_TRUE(contains(outcome.err, "there is no point 'nose' in scene 'frame'")) << outcome.err;
}

TEST_F(OnTheBus, ControlStopsTheDaemon) {
  const Outcome outcome = run("F=" + kFreeflex + "; " + kFreeflexd + " " + kGolden +
                              "frame.plan --log-level error & daemon=$!; $F push --timeout 60 --control stop "
                              "|| kill $daemon; wait $daemon");
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
}

TEST_F(OnTheBus, PushSealsItsCommandWithAKey) {
  const std::string key = folder_ / "pilot.key";
  ASSERT_EQ(run(kFreeflex + " keygen pilot --out " + key).exit_code, 0);
  const Outcome outcome = with_daemon(
      "$P --point tip --force -1,0,0 --key $T/pilot.key && $P --control hold --key $T/pilot.key && "
      "$P --control run; $F keygen stranger --out $T/other.key && "
      "$F push --control run --key $T/other.key --timeout 1; "
      "$F monitor --channel CONTROL --json --count 1 --duration 60 & monitor=$!; "
      "while kill -0 $monitor 2>/dev/null; do $P --control hold --key $T/pilot.key; done",
      kGolden + "frame.plan --keys " + key);
  EXPECT_TRUE(contains(outcome.out, "accepted: takes effect at tick ")) << outcome.out << outcome.err;
  EXPECT_TRUE(
      contains(outcome.out, "(key_required): this daemon accepts only commands with a key; add --key FILE"))
      << outcome.out << outcome.err;
  EXPECT_TRUE(contains(outcome.err, "Do the daemon's --keys contain this key")) << outcome.err;
  // a sealed command is signed but not encrypted, so `freeflex monitor` can read it
  EXPECT_TRUE(contains(outcome.out, R"("key_id":"pilot")")) << outcome.out;
  EXPECT_TRUE(contains(outcome.out, R"("command":"hold")")) << outcome.out;
}

TEST_F(OnTheBus, PushRefusesAKeyThatOthersCanRead) {
  const std::string key = folder_ / "pilot.key";
  ASSERT_EQ(run(kFreeflex + " keygen pilot --out " + key + " && chmod 644 " + key).exit_code, 0);
  const Outcome outcome = run(kFreeflex + " push --control stop --key " + key);
  EXPECT_EQ(outcome.exit_code, 2);
  EXPECT_TRUE(contains(outcome.err, "chmod 600 '" + key + "'")) << outcome.err;
  const Outcome twice = run(kFreeflex + " push --control stop --sender a --key " + key);
  EXPECT_EQ(twice.exit_code, 2);
  EXPECT_TRUE(contains(twice.err, "--key cannot be used with --sender")) << twice.err;
}

TEST_F(OnTheBus, MonitorCountsEveryChannel) {
  const Outcome outcome = with_daemon("$F monitor --json --duration 2.2 --interval 2");
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  const Json channels = Json::parse(outcome.out.substr(0, outcome.out.find('\n')))["channels"];
  for (const char* channel : {"FREEFLEX_STATE", "FREEFLEX_STATUS", "FREEFLEX_SCENE"}) {
    ASSERT_TRUE(channels.contains(channel)) << channels;
    EXPECT_GT(channels[channel]["count"], 0);
    EXPECT_GT(channels[channel]["bytes"], 0);
    EXPECT_TRUE(channels[channel]["last"].is_object());
  }
}

TEST_F(OnTheBus, MonitorPrintsEachMessageOfAChannelAsOneLineOfJson) {
  const Outcome outcome = with_daemon("$F monitor --channel STATE --json --count 3");
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  std::istringstream lines(outcome.out);
  std::string line;
  int count = 0;
  for (; std::getline(lines, line); ++count) EXPECT_EQ(Json::parse(line)["message"]["q"].size(), 6u);
  EXPECT_EQ(count, 3);
}

TEST_F(OnTheBus, HelpListsTheJsonFieldsOfPushAndMonitor) {
  const Json answer = Json::parse(with_daemon("$P --json --point tip --force 0,0,1").out);
  EXPECT_EQ(undocumented(answer, run(kFreeflex + " push --help").out), "") << answer;
  const std::string help = run(kFreeflex + " monitor --help").out;
  Json table = Json::parse(with_daemon("$F monitor --json --count 3 --duration 30 --interval 20").out);
  Json& channels = table["channels"];
  ASSERT_FALSE(channels.empty());
  // the help of monitor does not list channel names and message fields, so they are removed
  for (auto& [name, channel] : channels.items()) {
    channel["last"] = nullptr;
    EXPECT_EQ(undocumented(channel, help), "") << name;
  }
  table["channels"] = nullptr;
  EXPECT_EQ(undocumented(table, help), "");
  Json message = Json::parse(with_daemon("$F monitor --channel SCENE --json --count 1").out);
  EXPECT_EQ(message["message"]["plan_fingerprint"].get<std::string>().size(), 16u) << message;
  message["message"] = nullptr;
  EXPECT_EQ(undocumented(message, help), "");
}

TEST_F(OnTheBus, MonitorGivesExitOneIfItHearsFewerMessagesThanCount) {
  const Outcome outcome = with_daemon("$F monitor --channel 'ST.TE' --count 1 --duration 0.5");
  EXPECT_EQ(outcome.exit_code, 1);
  EXPECT_TRUE(contains(outcome.err, "no message has come on FREEFLEX_ST.TE")) << outcome.err;
}

TEST_F(OnTheBus, MonitorGivesExitOneIfItHearsNothing) {
  const Outcome other = with_daemon("$F monitor --channel NOSUCH --duration 0.5");
  EXPECT_EQ(other.exit_code, 1) << other.err;
  EXPECT_TRUE(contains(other.err, "no message has come on FREEFLEX_NOSUCH")) << other.err;
  EXPECT_EQ(run(kFreeflex + " monitor --duration 0.3 --json").exit_code, 1);
  EXPECT_EQ(run(kFreeflex + " monitor --live --duration 0.3").exit_code, 1);
}

TEST_F(OnTheBus, MonitorReportsOnceThatNothingIsHeard) {
  // the monitor runs for ten intervals but prints only one line
  for (const char* what : {"--count 1", "--channel STATE --count 1", "--live"}) {
    const Outcome outcome = run(kFreeflex + " monitor " + what + " --interval 0.1 --duration 1");
    EXPECT_EQ(outcome.exit_code, 1) << what;
    const std::string text = outcome.out + outcome.err;
    EXPECT_EQ(std::count(text.begin(), text.end(), '\n'), 1) << what << ": " << text;
    EXPECT_TRUE(contains(text, "no message has come") || contains(text, "waiting for a daemon")) << text;
  }
}

TEST_F(OnTheBus, MonitorPrintsNoRateBeforeItCanBeMeasured) {
  const Outcome table = with_daemon("$F monitor --json --count 3 --duration 30 --interval 20");
  ASSERT_EQ(table.exit_code, 0) << table.err;
  const Json channels = Json::parse(table.out)["channels"];
  ASSERT_FALSE(channels.empty());
  for (const auto& [name, channel] : channels.items()) {
    EXPECT_TRUE(channel["rate"].is_null()) << name << channel;
    EXPECT_TRUE(channel["bytes_per_second"].is_null()) << name << channel;
  }
  const Outcome text = with_daemon("$F monitor --count 1 --interval 20");
  EXPECT_TRUE(contains(text.out, "        -          - ")) << text.out;
  const Outcome live = with_daemon("$F monitor --live --count 1");
  EXPECT_EQ(live.exit_code, 2);
  EXPECT_TRUE(contains(live.err, "--live cannot be used with --count")) << live.err;
}

TEST_F(OnTheBus, ClearEndsTheForceInTheSlot) {
  const Outcome outcome = with_daemon(
      "$P --point tip --force 0,0,1 --duration 50 && $P --clear && "
      "$F monitor --channel STATUS --json --count 1");
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  const std::size_t start = outcome.out.find('{');
  ASSERT_NE(start, std::string::npos) << outcome.out;
  EXPECT_EQ(Json::parse(outcome.out.substr(start))["message"]["num_slots"], 0) << outcome.out;
}

TEST_F(OnTheBus, LiveMonitorPrintsLinesIfThereIsNoTerminal) {
  const Outcome outcome = with_daemon("$F monitor --live --duration 1.5 --interval 0.5");
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  // the frame spins, and its rung has no centrifugal load, so the verdict is not `good`
  EXPECT_FALSE(contains(outcome.out, ", running, good, rate ")) << outcome.out;
  EXPECT_TRUE(contains(outcome.out, "largest displacement")) << outcome.out;
  EXPECT_FALSE(contains(outcome.out, "\033")) << outcome.out;
}

TEST_F(OnTheBus, ARecordingAndTheRecordingOfItsPlaybackReplayToTheBit) {
  // While lcm-logger waits for a processor, only 31 messages are queued, and further messages are lost. So
  // lcm-logger gets a priority above ordinary programs, if the system allows that, and a recording that
  // replay reports as incomplete (exit code 3) is made again
  const std::string record = R"(
rt="chrt -f 1"; $rt true 2>/dev/null || rt=
record() { rm -f "$1"; $rt lcm-logger -q -c '^FREEFLEX_.*' "$1" >&2 & logger=$!; sleep 0.3; }
end_record() { sleep 0.3; kill -INT $logger; wait $logger; }
fly() {
  record $T/one.log
  $D $PLAN --log-level error & daemon=$!
  $P --point tip --force 0,0,5 --duration 0.2
  $P --group base --torque 0,0,1 --axes body --lease 0.1
  $P --control stop; wait $daemon
  end_record
}
play() { record $T/two.log; lcm-logplayer $T/one.log >&2; end_record; }
whole() { # COMMAND LOG
  for attempt in 1 2 3 4 5; do
    $1; $F replay $2; code=$?
    [ $code = 3 ] || return $code
  done
  return 3
}
whole fly $T/one.log && whole play $T/two.log
)";
  const Outcome outcome = run("F=" + kFreeflex + "; P=\"$F push --timeout 60\"; D=" + kFreeflexd +
                              "; PLAN=" + kGolden + "frame.plan; T=" + folder_.path() + record);
  EXPECT_EQ(outcome.exit_code, 0) << outcome.out << outcome.err;
  // the text appears once for the recording and once for the recording of its playback
  const std::size_t first = outcome.out.find("identical to the bit over ");
  ASSERT_NE(first, std::string::npos) << outcome.out << outcome.err;
  EXPECT_NE(outcome.out.find("identical to the bit over ", first + 1), std::string::npos)
      << outcome.out << outcome.err;
}

}  // namespace
}  // namespace freeflex::testing

int main(int argc, char** argv) { return freeflex::testing::run_network_tests(argc, argv); }
