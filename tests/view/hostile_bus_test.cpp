// These tests send hostile messages on the bus of a daemon. `freeflex view` and `freeflex monitor` must keep
// running, must grow by less than 8 MB, and must still show the daemon.
#include <gtest/gtest.h>
#include <signal.h>

#include <cmath>
#include <cstdlib>
#include <fstream>
#include <limits>
#include <nlohmann/json.hpp>
#include <optional>
#include <thread>

#include "freeflex_msgs/loads_t.hpp"
#include "freeflex_msgs/points_t.hpp"
#include "freeflex_msgs/scene_t.hpp"
#include "messages/channels.hpp"
#include "tests/service/bus_client.hpp"
#include "tests/support/network_tests.hpp"
#include "tests/view/connection.hpp"

namespace freeflex::testing {
namespace {

constexpr std::int32_t kMost = std::numeric_limits<std::int32_t>::max();
constexpr const char* kNotUtf8 = "tip\xC3\x28\xFF";

// [kB] the growth of a program's peak memory under attack must be below this limit
constexpr long kMostGrowth = 8'000;

/// Returns the peak memory [kB] of a process.
long peak_memory(pid_t pid) {
  std::ifstream file("/proc/" + std::to_string(pid) + "/status");
  for (std::string line; std::getline(file, line);)
    if (line.starts_with("VmHWM:")) return std::stol(line.substr(6));
  return -1;
}

/// Waits until the condition is true. Returns false if the condition stays false for kPatience.
template <class Condition>
bool eventually(Condition condition) {
  const auto end = std::chrono::steady_clock::now() + kPatience;
  while (!condition()) {
    if (std::chrono::steady_clock::now() > end) return false;
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
  return true;
}

class BesideStrangers : public ::testing::Test {
 protected:
  void SetUp() override {
    if (!refusal.empty()) GTEST_SKIP() << refusal;
#if defined(__SANITIZE_ADDRESS__)
    // without this option the sanitizer would keep freed memory, and the programs would grow
    const char* const options = std::getenv("ASAN_OPTIONS");
    setenv("ASAN_OPTIONS", (std::string(options != nullptr ? options : "") + ":quarantine_size_mb=0").c_str(),
           1);
#endif
    // this scene publishes loads, so `freeflex view` collects pages of LOADS
    daemon_.emplace(
        std::vector<std::string>{program("freeflexd"), scene_path("satellite.yaml"), "--log-level", "error"});
    bus_.emplace(channels::kDefaultPrefix);
    ASSERT_TRUE(bus_->meet());
  }

  /// Sends packets that kill liblcm's receiver.
  void send_crafted_packets() {
    PacketSender& packets = bus_->packets;
    for (const char* suffix : {channels::kStatus, channels::kState, channels::kLoads, channels::kAck}) {
      const std::string channel = channels::kDefaultPrefix + std::string(suffix);
      EXPECT_TRUE(packets.send_wrapping_fragment(channel));
      EXPECT_TRUE(packets.send_fragment_runt(channel));
      EXPECT_TRUE(packets.send_cut_channel(channel));
      EXPECT_TRUE(packets.send_first_fragment(channel, 0xFFFFFFFF, 1000));
    }
    const std::byte empty[1]{};
    EXPECT_TRUE(packets.send(std::span(empty).first(0)));
    EXPECT_TRUE(packets.send(empty));
  }

  /// Sends pages in the daemon's session, each of which claims to be one of 2^31 - 1 pages.
  void send_endless_pages(int count) {
    freeflex_msgs::loads_t loads{};
    freeflex_msgs::points_t points{};
    freeflex_msgs::scene_t scene{};
    loads.session = points.session = scene.session = bus_->session;
    loads.num_pages = points.num_pages = scene.num_pages = kMost;
    loads.tick = points.tick = std::numeric_limits<std::int64_t>::max();
    loads.links = {{0, 7000, std::vector<double>(7000, 1.0)}};
    loads.num_links = 1;
    scene.total_points = scene.total_links = scene.total_groups = scene.total_elastic = kMost;
    for (int k = 0; k < count; ++k) {
      loads.page = points.page = scene.page = k;
      publish(channels::kLoads, loads);
      publish(channels::kPoints, points);
      publish(channels::kScene, scene);
    }
  }

  /// Sends messages with text that is not UTF-8.
  void send_broken_text() {
    freeflex_msgs::status_t status = bus_->statuses.back();
    status.fault = status.validity_cause = status.replan = kNotUtf8;
    publish(channels::kStatus, status);
    freeflex_msgs::ack_t ack{};
    ack.session = bus_->session;
    ack.sender = ack.text = kNotUtf8;
    publish(channels::kAck, ack);
    bus_->packets.publish(std::string(channels::kDefaultPrefix) + "_" + kNotUtf8, {});
    bus_->packets.publish(kNotUtf8, {});
  }

  /// Sends empty messages on `count` unknown channels.
  void send_new_channels(int count) {
    for (int k = 0; k < count; ++k)
      bus_->packets.publish("FREEFLEX_STRANGER_" + std::to_string(k) + std::string(40, 'x'), {});
  }

  template <class Message>
  void publish(const char* suffix, const Message& message) {
    EXPECT_TRUE(bus_->packets.publish(std::string(channels::kDefaultPrefix) + suffix, io::encode(message)));
  }

  static void expect_alive(const Process& program) {
    EXPECT_EQ(kill(program.pid(), 0), 0);
    std::ifstream stat("/proc/" + std::to_string(program.pid()) + "/stat");
    std::string text;
    std::getline(stat, text);
    EXPECT_EQ(text.find(") Z "), std::string::npos) << program.output();
  }

  std::optional<Process> daemon_;
  std::optional<BusClient> bus_;
};

TEST_F(BesideStrangers, MonitorKeepsRunningAndShowsTheDaemon) {
  for (const std::vector<std::string>& words : {std::vector<std::string>{"--live", "--interval", "0.05"},
                                                {"--json", "--interval", "0.05"},
                                                {"--interval", "0.05"},
                                                {"--channel", "STATUS"},
                                                {"--channel", "ACK", "--json"}}) {
    std::vector<std::string> line{program("freeflex"), "monitor"};
    line.insert(line.end(), words.begin(), words.end());
    Process monitor(line);
    const bool is_ack = words[1] == "ACK";
    const std::string mark = words[0] == "--live" ? "tick " : is_ack ? "_ACK" : "FREEFLEX_STATUS";
    // waits for three more outputs, so that the last of them shows a message that arrived after the hostile
    // messages. For the monitor of ACK, sends commands, which the daemon answers
    const auto goes_on = [&] {
      for (int k = 0; k < 3; ++k) {
        const std::size_t shown = monitor.output().size();
        const bool does = eventually([&] {
          if (is_ack) bus_->send_control(freeflex_msgs::control_t::RUN);
          return monitor.output().find(mark, shown) != std::string::npos;
        });
        if (!does) return false;
      }
      return true;
    };
    ASSERT_TRUE(goes_on()) << words.back();
    send_crafted_packets();
    send_endless_pages(100);
    send_broken_text();
    ASSERT_TRUE(goes_on()) << words.back();
    expect_alive(monitor);
    const long before = peak_memory(monitor.pid());
    send_endless_pages(300);
    send_new_channels(2000);
    EXPECT_TRUE(goes_on()) << words.back();
    expect_alive(monitor);
    // if the 300 pages of 56 kB were kept, they would take 17 MB; the monitor lists at most 256 of the 2000
    // channels
    EXPECT_LT(peak_memory(monitor.pid()), before + kMostGrowth) << words.back();
  }
}

TEST_F(BesideStrangers, ViewKeepsRunningAndShowsTheDaemon) {
  Process view({program("freeflex"), "view", scene_path("satellite.yaml")});
  ASSERT_TRUE(eventually(
      [&] { return view.output().find("token=") != std::string::npos && view.output().ends_with("\n"); }));
  const std::string url = view.output();
  const std::size_t colon = url.find("127.0.0.1:") + 10, mark = url.find("token=") + 6;
  const int port = std::stoi(url.substr(colon));
  const std::string token = url.substr(mark, url.find_last_not_of("\n") + 1 - mark);
  Connection browser(port);
  ASSERT_TRUE(browser.open_socket(port, "http://127.0.0.1:" + std::to_string(port), token)
                  .starts_with("HTTP/1.1 101"));
  // returns the next text that contains `part`, or "" if none came. A read waits for 5 s. A view
  // that is built with a sanitizer may send nothing for longer than 10 s while it reads 150 pages.
  const auto next_text = [&](const std::string& part) {
    constexpr int kMostSilent = 12;
    for (int k = 0, num_silent = 0; k < 5000 && num_silent < kMostSilent; ++k) {
      const auto [opcode, text] = browser.read_frame();
      if (opcode < 0) ++num_silent;
      if (opcode == 1 && text.find(part) != std::string::npos) return text;
    }
    return std::string();
  };
  ASSERT_NE(next_text("\"status\""), "");
  send_crafted_packets();
  send_endless_pages(50);
  send_broken_text();
  const std::string replaced = next_text("tip\xEF\xBF\xBD(");
  EXPECT_NE(replaced, "") << "bytes that are not UTF-8 are shown as U+FFFD";
  const long before = peak_memory(view.pid());
  // 1000 pages of 56 kB, which would take 56 MB if they were kept
  for (int round = 0; round < 10; ++round) {
    send_endless_pages(100);
    ASSERT_NE(next_text("\"status\""), "");
  }
  expect_alive(view);
  EXPECT_LT(peak_memory(view.pid()), before + kMostGrowth);

  // a name is cut to at most 32 bytes at the end of a character, here to 31 bytes before a character of two
  // bytes
  browser.send_text(R"({"push":null,"by":")" + std::string(31, 'a') + "\xC3\xA9\"}");
  const std::string answer = next_text("\"ack\"");
  EXPECT_NE(answer.find("\"by\":\"" + std::string(31, 'a') + "\""), std::string::npos) << answer;
  const nlohmann::json status = nlohmann::json::parse(next_text("\"status\""));
  EXPECT_EQ(status["status"]["session"], bus_->session);
}

}  // namespace
}  // namespace freeflex::testing

int main(int argc, char** argv) { return freeflex::testing::run_network_tests(argc, argv); }
