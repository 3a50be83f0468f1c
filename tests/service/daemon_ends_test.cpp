// The real freeflexd ends cleanly on signals, and reports the cause if it cannot start.
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/prctl.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>

#include "freeflex_msgs/control_t.hpp"
#include "freeflex_msgs/status_t.hpp"
#include "service/clock.hpp"
#include "tests/service/daemon_fixture.hpp"
#include "tests/service/rig.hpp"
#include "tests/support/send_signal.hpp"

namespace freeflex::testing {
namespace {

using freeflex_msgs::status_t;

struct End {
  std::string set_up;        // shell commands before the daemon starts
  std::vector<int> signals;  // signals sent one after another without a pause
};

TEST_F(Daemon, EndsCleanlyOnASignalHoweverItWasStarted) {
  // a shell without job control ignores SIGINT for its background jobs
  const std::vector<End> ends{{"", {SIGINT}},
                              {"", {SIGTERM}},
                              {"", {SIGHUP}},
                              {"trap '' INT;", {SIGINT}},
                              {"trap '' INT TERM;", {SIGTERM}},
                              {"", {SIGINT, SIGINT, SIGINT}}};
  for (const End& end : ends) {
    const std::string what = end.set_up + " " + strsignal(end.signals[0]);
    BusClient client("S");
    Process daemon(by_shell(end.set_up, command_line("S")));
    ASSERT_TRUE(client.meet()) << what << daemon.output();
    const pid_t ingress = find_ingress(daemon);
    ASSERT_GT(ingress, 0);
    for (const int number : end.signals) daemon.signal(number);
    EXPECT_EQ(daemon.wait(), 0) << what;
    EXPECT_NE(daemon.output().find(std::string("SIG") + sigabbrev_np(end.signals[0]) + ": "),
              std::string::npos)
        << what << daemon.output();
    EXPECT_TRUE(client.until([&] { return client.statuses.back().mode == status_t::STOPPED; })) << what;
    EXPECT_FALSE(send_signal(ingress, 0)) << what << ": the ingress was left behind";
  }
}

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
constexpr bool kIsInstrumented = true;
#else
constexpr bool kIsInstrumented = false;
#endif

/// The limits of address space range from too little for the loader to enough for the whole program.
TEST_F(Daemon, WithLittleAddressSpaceItRunsOrReportsTheLimit) {
  if (kIsInstrumented) GTEST_SKIP() << "a sanitizer takes terabytes of address space";
  int num_refused = 0;
  int num_run = 0;
  // between 24 and 30 MB the thread that ends the log cannot be created
  for (int megabytes = 24; megabytes <= 420; megabytes += megabytes < 30 ? 2 : megabytes < 120 ? 20 : 100) {
    const std::string limit = "ulimit -v " + std::to_string(1000 * megabytes) + ";";
    Process daemon(by_shell(limit, command_line("AS", {"--until", "0.01", "--socket", "none"})));
    const int status = daemon.wait();
    const std::string output = daemon.output();
    if (status == 0) {
      ++num_run;
      continue;
    }
    // the loader fails before any code of freeflexd runs
    if (status == 127 && output.find("error while loading shared libraries") != std::string::npos) continue;
    ++num_refused;
    // if the exit status is 2, the message comes from the set-up of the scene
    const std::string found =
        "Address space is limited to " + std::to_string(std::lround(1.024 * megabytes)) + " MB";
    const std::string named = status == 2 ? "allow more memory (ulimit -v)" : found;
    EXPECT_TRUE(status == 1 || status == 2) << megabytes << " MB: " << output;
    EXPECT_NE(output.find(named), std::string::npos) << megabytes << " MB: " << output;
    EXPECT_NE(output.find("ulimit -v"), std::string::npos) << megabytes << " MB: " << output;
  }
  EXPECT_GT(num_run, 0);
  EXPECT_GT(num_refused, 0);
}

TEST_F(Daemon, ReportsALimitOfOpenFilesThatIsTooLow) {
  Process daemon(by_shell("ulimit -n 12;", command_line("NF", {"--until", "0.01", "--socket", "none"})));
  EXPECT_EQ(daemon.wait(), 1);
  EXPECT_NE(daemon.output().find("Open files are limited to 12; allow more with ulimit -n"),
            std::string::npos)
      << daemon.output();
}

TEST_F(Daemon, ReportsAPreloadedLibraryThatMakesForbiddenSystemCalls) {
  if (kIsInstrumented) GTEST_SKIP() << "with a sanitizer there is no filter";
  if (prctl(PR_GET_SECCOMP) < 0) GTEST_SKIP() << "this kernel cannot filter system calls";
  const std::string library = FREEFLEX_FORBIDDEN_CALL;
  Process daemon(by_shell("export LD_PRELOAD=" + library + ";", command_line("FC", {"--socket", "none"})));
  EXPECT_EQ(daemon.wait(), 1) << daemon.output();
  const std::string output = daemon.output();
  EXPECT_NE(output.find("the ingress process cannot be started, because 5 successive starts failed at once"),
            std::string::npos)
      << output;
  EXPECT_NE(output.find("made a system call that its filter forbids. LD_PRELOAD is set to '" + library + "'"),
            std::string::npos)
      << output;
}

TEST_F(Daemon, EndsCleanlyOnASignalDuringStartUp) {
  BusClient client("F");
  Process daemon(command_line("F"));
  // the scene has been read, and now the ingress starts or the daemon listens to the bus
  ASSERT_TRUE(client.until([&] { return daemon.output().find("104 points") != std::string::npos; }));
  daemon.signal(SIGTERM);
  EXPECT_EQ(daemon.wait(), 0);
  EXPECT_NE(daemon.output().find("before the first tick"), std::string::npos) << daemon.output();
}

TEST_F(Daemon, LeavesNoIngressProcessIfItIsKilled) {
  BusClient client("G");
  Process daemon(command_line("G", {"--hold"}));
  ASSERT_TRUE(client.meet()) << daemon.output();
  const pid_t ingress = find_ingress(daemon);
  ASSERT_GT(ingress, 0);
  daemon.signal(SIGKILL);
  EXPECT_EQ(daemon.wait(), 1000 + SIGKILL);
  const auto is_gone = [ingress] {
    std::ifstream stat("/proc/" + std::to_string(ingress) + "/stat");
    std::string pid, name, state;
    // a zombie that has not been reaped has ended too
    return !(stat >> pid >> name >> state) || state == "Z";
  };
  EXPECT_TRUE(client.until(is_gone));
}

TEST_F(Daemon, AcceptsCommandsAfterRepeatedKillsOfItsIngress) {
  BusClient client("K");
  // beside other work, a daemon that is built with a sanitizer may take longer than a second to answer
  Process daemon(command_line("K", {"--set", "commands.max_age=30"}));
  ASSERT_TRUE(client.meet()) << daemon.output();
  for (int i = 0; i < 10; ++i) {
    const std::int64_t before = client.statuses.back().ingress_restarts;
    ASSERT_TRUE(client.until([&] { return find_ingress(daemon) > 0; })) << i;
    ASSERT_TRUE(send_signal(find_ingress(daemon), SIGKILL)) << i;
    ASSERT_TRUE(client.until([&] { return client.statuses.back().ingress_restarts > before; })) << i;
  }
  client.send(make_push(client.next_sequence));
  EXPECT_EQ(client.answer(client.next_sequence).reason, 0);
}

TEST_F(Daemon, RunsOnAfterSigstopAndSigcontAndPublishesASlip) {
  BusClient client("L");
  Process daemon(command_line("L"));
  ASSERT_TRUE(client.meet()) << daemon.output();
  daemon.signal(SIGSTOP);
  const auto end = std::chrono::steady_clock::now() + 3 * std::chrono::nanoseconds(service::Pacer::kCatchUp);
  ASSERT_TRUE(client.until([&] { return std::chrono::steady_clock::now() > end; }));
  client.read();
  const std::int64_t stood = client.statuses.back().tick;
  daemon.signal(SIGCONT);
  EXPECT_TRUE(client.until(
      [&] { return client.statuses.back().slips >= 1 && client.statuses.back().tick > stood + 100; }));
  EXPECT_GE(client.statuses.back().overruns, 1);
  EXPECT_EQ(client.statuses.back().mode, status_t::RUNNING);
  EXPECT_TRUE(client.until([&] {
    return daemon.output().find("the process did not run") != std::string::npos;
  })) << daemon.output();
  EXPECT_EQ(daemon.output().find("does not hold the period"), std::string::npos) << daemon.output();
}

/// Returns true if every thread of the process has stopped, which takes some time after SIGSTOP.
bool has_stopped(const Process& process) {
  const std::filesystem::directory_iterator tasks("/proc/" + std::to_string(process.pid()) + "/task");
  return std::all_of(begin(tasks), end(tasks), [](const auto& task) {
    std::ifstream file(task.path() / "stat");
    std::string line;
    std::getline(file, line);
    const std::size_t name_end = line.rfind(')');
    return name_end != std::string::npos && line.substr(name_end + 2, 1) == "T";
  });
}

TEST_F(Daemon, CommandsThatWaitedForAStoppedDaemonAreRefusedAsTooOld) {
  for (const char* mode : {"--log-level", "--hold"}) {
    const bool holds = std::string(mode) == "--hold";
    BusClient client("Y");
    Process daemon(
        command_line("Y", holds ? std::vector<std::string>{mode} : std::vector<std::string>{mode, "info"}));
    ASSERT_TRUE(client.meet()) << daemon.output();
    daemon.signal(SIGSTOP);
    ASSERT_TRUE(client.until([&] { return has_stopped(daemon); }));
    const ForceCommand push = make_push(client.next_sequence++);
    client.send(push);
    const std::int64_t control = client.send_control(freeflex_msgs::control_t::RESET);
    // the scene sets no max_age, so the limit is 1 s
    const auto end = std::chrono::steady_clock::now() + std::chrono::milliseconds(1200);
    ASSERT_TRUE(client.until([&] { return std::chrono::steady_clock::now() > end; }));
    daemon.signal(SIGCONT);
    const auto refused = client.answer(push.sequence);
    EXPECT_EQ(refused.reason, static_cast<int>(io::Reason::kTooOld)) << mode;
    EXPECT_NE(refused.text.find("for its decision, but may wait at most 1 s"), std::string::npos)
        << refused.text;
    EXPECT_EQ(client.answer(control).reason, static_cast<int>(io::Reason::kTooOld)) << mode;
    client.send(make_push(client.next_sequence));
    EXPECT_EQ(client.answer(client.next_sequence).reason, 0) << "a new command is accepted";
  }
}

TEST_F(Daemon, TheSceneSetsTheLargestAgeOfCommandsAndTheShareOfASender) {
  const std::string scene = temporary_path("limits.yaml");
  std::ofstream(scene) << "points: [{mass: 1, at: [0, 0, 0]}, {mass: 1, at: [1, 0, 0]}]\n"
                          "links: [{spring: [1, 2], stiffness: 100}]\n"
                          "commands: {max_age: 0.2, sender_share: 0.03125}\n";
  BusClient client("Y2");
  Process daemon({program("freeflexd"), scene, "--prefix", "Y2"});
  ASSERT_TRUE(client.meet()) << daemon.output();
  for (const int slot : {0, 1, 2}) {
    ForceCommand push = make_push(client.next_sequence++);
    push.slot = slot;
    client.send(push);
    EXPECT_EQ(client.answer(push.sequence).reason, slot < 2 ? 0 : static_cast<int>(io::Reason::kNoSlotFree))
        << "a sender has 0.03125 of 64 slots, which is 2";
  }
  daemon.signal(SIGSTOP);
  ASSERT_TRUE(client.until([&] { return has_stopped(daemon); }));
  const std::int64_t control = client.send_control(freeflex_msgs::control_t::RESET);
  const auto end = std::chrono::steady_clock::now() + std::chrono::milliseconds(400);
  ASSERT_TRUE(client.until([&] { return std::chrono::steady_clock::now() > end; }));
  daemon.signal(SIGCONT);
  const auto refused = client.answer(control);
  EXPECT_EQ(refused.reason, static_cast<int>(io::Reason::kTooOld));
  EXPECT_NE(refused.text.find("for its decision, but may wait at most 0.2 s"), std::string::npos)
      << refused.text;
  std::filesystem::remove(scene);
}

TEST_F(Daemon, EndsAfterOneTickIfUntilIsShorterThanATick) {
  Process daemon(command_line("M", {"--until", "1e-9"}));
  EXPECT_EQ(daemon.wait(), 0);
  EXPECT_NE(daemon.output().find("ended as requested: 1 ticks"), std::string::npos) << daemon.output();
}

TEST_F(Daemon, ReportsEachFaultOfItsCommandLine) {
  const auto expect = [](std::vector<std::string> arguments, int status, const std::string& words) {
    arguments.insert(arguments.begin(), program("freeflexd"));
    Process daemon(arguments);
    EXPECT_EQ(daemon.wait(), status) << words;
    EXPECT_NE(daemon.output().find(words), std::string::npos) << daemon.output();
  };
  const std::string scene = scene_path("boom.yaml");
  expect({}, 2, "SCENE");
  expect({}, 2, "Usage: freeflexd");
  expect({"--help"}, 0, "LCM_DEFAULT_URL");
  expect({scene, "--rat", "5"}, 2, "--rat");
  expect({scene, "--time", "fast"}, 2, "lockstep");
  expect({scene, "--time", "scaled=0"}, 2, "scaled=K");
  expect({scene, "--time", "scaled=1e-300"}, 2, "a tick would last");
  expect({scene, "--rate", "-5"}, 2, "'-5'");
  expect({scene, "--rate", "0"}, 2, "from 0.001 to 1000000");
  expect({scene, "--rate", "1e9"}, 2, "from 0.001 to 1000000");
  expect({scene, "--rate", "nan"}, 2, "'nan'");
  expect({scene, "--until", "0"}, 2, "'0'");
  expect({scene, "--until", "1e300"}, 2, "ticks, but may be at most 1e15 ticks");
  expect({"nowhere.yaml"}, 2, "nowhere.yaml");
  expect({scene, "--lcm-url", "memq://"}, 2, "udpm://");
  expect({scene, "--lcm-url", "udpm://10.0.0.1:7667"}, 2, "multicast address");
  expect({scene, "--prefix", "no/slash"}, 2, "prefix");
  expect({scene, "--ingress-user", "nosuch"}, 2, "nosuch");
}

TEST_F(Daemon, RefusesATruncatedPlan) {
  const std::string plan = temporary_path("cut.plan");
  Process compile({program("freeflex"), "compile", scene_path("boom.yaml"), "-o", plan});
  ASSERT_EQ(compile.wait(), 0) << compile.output();
  std::filesystem::resize_file(plan, std::filesystem::file_size(plan) - 1);
  Process daemon({program("freeflexd"), plan});
  EXPECT_EQ(daemon.wait(), 2);
  EXPECT_NE(daemon.output().find("the plan is cut off after"), std::string::npos) << daemon.output();
  std::filesystem::remove(plan);
}

TEST_F(Daemon, ReportsTheCommandsThatAddAMissingMulticastRoute) {
  // a network namespace whose loopback interface is down has no route
  Process daemon({"unshare", "-n", program("freeflexd"), scene_path("boom.yaml")});
  EXPECT_EQ(daemon.wait(), 1);
  const std::string output = daemon.output();
  EXPECT_NE(output.find("ip link set lo up multicast on"), std::string::npos) << output;
  EXPECT_NE(output.find("ip route add 239.0.0.0/8 dev lo"), std::string::npos) << output;
}

}  // namespace
}  // namespace freeflex::testing
