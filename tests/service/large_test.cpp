// The test compiles a mast of 10,000 points from its files, and runs it in a daemon at 1 kHz. The test prints
// time and memory of set-up and daemon, and the duration of ticks while 20 points are pushed and read.
// FREEFLEX_LARGE_BAYS and FREEFLEX_LARGE_MODES change the size: 25000 bays and 300 modes give 100,000 points
// and a set-up of about 80 s. If FREEFLEX_LARGE_PLAN is the absolute path of a plan from an earlier run,
// that plan is used without a set-up.
#include <gtest/gtest.h>
#include <sys/resource.h>

#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <thread>

#include "messages/channels.hpp"
#include "tests/scene/temporary_folder.hpp"
#include "tests/service/bus_client.hpp"
#include "tests/service/latency.hpp"
#include "tests/service/rig.hpp"
#include "tests/support/private_network.hpp"

namespace freeflex::testing {
namespace {

using freeflex_msgs::control_t;
using freeflex_msgs::status_t;
using std::chrono::microseconds;
using std::chrono::steady_clock;

constexpr int kNamed = 20;
constexpr int kSeconds = 20;
constexpr microseconds kCommandPeriod{2000};
constexpr int kPushes = std::chrono::seconds(kSeconds) / kCommandPeriod;

std::string no_network;  // reason why there is no private network; empty if there is one

int from_environment(const char* name, int otherwise) {
  const char* value = std::getenv(name);
  return value == nullptr ? otherwise : std::atoi(value);
}

/// Writes the mast of service/scenes/truss104.yaml with more bays. The scene lets commands push 20 points
/// along the mast, and publishes them.
struct Mast {
  int bays = from_environment("FREEFLEX_LARGE_BAYS", 2500);
  int modes = from_environment("FREEFLEX_LARGE_MODES", 100);
  int num_points() const { return 4 * bays; }
  int named(int k) const {
    return 4 * static_cast<int>(std::lround(k * (bays - 1.0) / (kNamed - 1))) + k % 4;
  }

  void write(const TemporaryFolder& folder) const {
    std::ostringstream points, springs, scene;
    points << "mass,x,y,z\n";
    springs << "from,to,stiffness\n";
    for (int i = 0; i < bays; ++i) {
      const auto spring = [&](int bay, int a, int other_bay, int b) {
        springs << 4 * bay + a % 4 + 1 << ',' << 4 * other_bay + b % 4 + 1 << ",1e5\n";
      };
      for (int c = 0; c < 4; ++c)
        points << "1," << i << ',' << (c == 1 || c == 2 ? 0.5 : -0.5) << ',' << (c > 1 ? 0.5 : -0.5) << '\n';
      for (int c = 0; c < 4; ++c) spring(i, c, i, c + 1);
      spring(i, 0, i, 2);
      spring(i, 1, i, 3);
      for (int c = 0; c < 4 && i + 1 < bays; ++c) {
        spring(i, c, i + 1, c);
        spring(i, c, i + 1, c + 1);
        spring(i, c + 1, i + 1, c);
      }
    }
    std::string names;
    for (int k = 0; k < kNamed; ++k) names += (k > 0 ? ", '" : "'") + std::to_string(named(k) + 1) + "'";
    scene << "name: mast\npoints: {csv: points.csv}\nlinks: {csv: springs.csv}\nmodes: {count: " << modes
          << "}\ndamping: {ratio: 0.005}\npublish: {points: {of: [" << names << "]}}\ncommands: {points: ["
          << names << "]}\n";
    folder.write("points.csv", points.str());
    folder.write("springs.csv", springs.str());
    folder.write("mast.yaml", scene.str());
  }
};

/// Returns the value [MB] of the line with this name in /proc/PID/status.
double status_MB(pid_t pid, const std::string& name) {
  std::ifstream status("/proc/" + std::to_string(pid) + "/status");
  for (std::string line; std::getline(status, line);)
    if (line.starts_with(name + ":")) return 1e-3 * std::stod(line.substr(name.size() + 1));
  return 0.0;
}

double seconds_since(steady_clock::time_point start) {
  return std::chrono::duration<double>(steady_clock::now() - start).count();
}

/// Runs a program to its end and prints its time and memory. Returns its output.
std::string run(const std::vector<std::string>& arguments) {
  const auto start = steady_clock::now();
  Process process(arguments);
  double peak = 0.0;
  int status = -1;
  while (std::filesystem::exists("/proc/" + std::to_string(process.pid()) + "/exe")) {
    peak = std::max(peak, status_MB(process.pid(), "VmHWM"));
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
  status = process.wait();
  EXPECT_EQ(status, 0) << process.output();
  std::printf("freeflex %s: %.1f s, at most %.0f MB\n", arguments[1].c_str(), seconds_since(start), peak);
  return process.output();
}

/// Sends 500 pushes a second for kSeconds, on the points that the scene lets commands push, so that the slots
/// change at every second tick.
void push_for_a_while(BusClient& client, const Mast& mast) {
  auto next = steady_clock::now();
  for (int i = 0; i < kPushes; ++i) {
    ForceCommand push = make_push(client.next_sequence++, i % 8, -1, mast.named(i % kNamed), 0.1);
    push.duration_ticks = 50;
    client.send(push);
    next += kCommandPeriod;
    client.read();
    std::this_thread::sleep_until(next);
  }
}

TEST(Large, ADaemonOnAMastOfManyPointsNeedsLittleMemory) {
  if (!no_network.empty()) GTEST_SKIP() << no_network;
  const Mast mast;
  const TemporaryFolder folder;
  const char* given = std::getenv("FREEFLEX_LARGE_PLAN");
  const std::string plan = given == nullptr ? "mast.plan" : given;
  if (given == nullptr) {
    mast.write(folder);
    std::printf("%s", run({program("freeflex"), "compile", "mast.yaml", "-o", plan}).c_str());
  }
  const std::string checked = run({program("freeflex"), "check", plan});
  EXPECT_NE(checked.find("20 of " + std::to_string(mast.num_points()) + " listed on the bus"),
            std::string::npos)
      << checked;
  run({program("freeflex"), "run", plan, "--until", "10", "--out", "mast.csv"});

  print_cyclictest("cyclictest before", 10);
  BusClient client("LARGE");
  Process daemon({program("freeflexd"), plan, "--prefix", "LARGE"});
  ASSERT_TRUE(client.meet()) << daemon.output();
  push_for_a_while(client, mast);
  // A command waits for its tick. A STATUS that is made meanwhile counts it as received, but not as accepted.
  EXPECT_TRUE(client.until([&] { return client.statuses.back().commands_accepted >= kPushes; }));
  const status_t last = client.statuses.back();
  std::printf("%-28s %10s %10s %10s %10s\n", "[us]", "p50", "p99", "p99.9", "max");
  print_row("lateness", four(last.lateness_us));
  print_row("compute", four(last.compute_us));
  const double resident = status_MB(daemon.pid(), "VmRSS"), peak = status_MB(daemon.pid(), "VmHWM");
  std::printf("daemon: VmRSS %.0f MB, VmHWM %.0f MB, %lld commands accepted of %lld, %lld overruns\n",
              resident, peak, static_cast<long long>(last.commands_accepted),
              static_cast<long long>(last.commands_received), static_cast<long long>(last.overruns));
  EXPECT_LT(resident, 300.0);
  EXPECT_EQ(last.commands_accepted, kPushes);
  EXPECT_EQ(last.commands_received, kPushes);
  EXPECT_EQ(last.num_rejections, 0);
  // the scene is sent once a second and lists only the points that it publishes and lets commands push
  EXPECT_LE(client.num_messages.at(channels::kScene), (kNamed + 2) * (kSeconds + 5));
  EXPECT_EQ(client.answer(client.send_control(control_t::STOP)).reason, 0);
  EXPECT_EQ(daemon.wait(), 0);
  print_cyclictest("cyclictest after", 10);
}

}  // namespace
}  // namespace freeflex::testing

int main(int argc, char** argv) {
  ::testing::InitGoogleTest(&argc, argv);
  freeflex::testing::no_network = freeflex::testing::enter_private_network();
  return RUN_ALL_TESTS();
}
