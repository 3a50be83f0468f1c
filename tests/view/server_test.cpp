// These tests check the server of the page, in particular access, the messages to a browser, and browsers
// that stop reading.
#include "tools/view/server.hpp"

#include <gtest/gtest.h>
#include <unistd.h>

#include <atomic>
#include <chrono>
#include <cstring>
#include <fstream>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "tests/view/connection.hpp"

namespace freeflex::testing {
namespace {

using tools::PageServer;
using Clock = std::chrono::steady_clock;

/// Returns the resident memory of this process [bytes].
std::size_t resident_memory() {
  std::ifstream file("/proc/self/statm");
  std::size_t all = 0, resident = 0;
  file >> all >> resident;
  return resident * static_cast<std::size_t>(::sysconf(_SC_PAGESIZE));
}

class ViewServer : public ::testing::Test {
 protected:
  ViewServer() {
    const std::string url = server_.url();
    port_ = std::stoi(url.substr(url.find(":", 7) + 1));
    token_ = url.substr(url.find("token=") + 6);
  }
  std::string get(const std::string& path, const std::string& host) {
    Connection connection(port_);
    connection.send("GET " + path + " HTTP/1.1\r\nHost: " + host + "\r\nConnection: close\r\n\r\n");
    std::string answer = connection.read_head();
    const std::size_t size = answer.find("Content-Length: ");
    if (size != std::string::npos) answer += connection.read(std::stoul(answer.substr(size + 16)));
    return answer;
  }
  std::string own() const { return "127.0.0.1:" + std::to_string(port_); }
  std::string open_socket(Connection& connection, const std::string& origin, const std::string& token) {
    return connection.open_socket(port_, origin, token);
  }
  std::string taken() {
    const std::lock_guard lock(mutex_);
    return taken_;
  }
  static tools::Bytes bytes_of(const std::string& text) {
    std::vector<std::byte> bytes(text.size());
    std::memcpy(bytes.data(), text.data(), text.size());
    return std::make_shared<const std::vector<std::byte>>(std::move(bytes));
  }

  std::mutex mutex_;
  std::string taken_;
  PageServer server_{{"<html>the page</html>", {std::byte{'b'}}, {}}, 0, [this](std::string_view text) {
                       const std::lock_guard lock(mutex_);
                       taken_ = text;
                     }};
  int port_ = 0;
  std::string token_;
};

TEST_F(ViewServer, GivesThePageToEveryRequestWithTheToken) {
  ASSERT_TRUE(server_.error().empty()) << server_.error();
  const std::string page = get("/?token=" + token_, own());
  EXPECT_TRUE(page.starts_with("HTTP/1.1 200")) << page;
  EXPECT_TRUE(page.ends_with("<html>the page</html>"));
  EXPECT_NE(page.find("Content-Security-Policy: default-src 'none'"), std::string::npos);
  EXPECT_TRUE(get("/body?token=" + token_, "localhost:" + std::to_string(port_)).ends_with("\r\n\r\nb"));
  EXPECT_TRUE(get("/motion?token=" + token_, own()).starts_with("HTTP/1.1 204"));
  EXPECT_TRUE(get("/other?token=" + token_, own()).starts_with("HTTP/1.1 404"));
}

TEST_F(ViewServer, RefusesRequestsWithoutTheTokenOrFromAForeignOrigin) {
  EXPECT_TRUE(get("/", own()).starts_with("HTTP/1.1 403"));
  EXPECT_TRUE(get("/?token=" + std::string(32, '0'), own()).starts_with("HTTP/1.1 403"));
  EXPECT_TRUE(get("/?token=" + token_.substr(1), own()).starts_with("HTTP/1.1 403"));
  // a foreign host name may resolve to this machine
  EXPECT_TRUE(get("/?token=" + token_, "evil.example:" + std::to_string(port_)).starts_with("HTTP/1.1 403"));
  EXPECT_TRUE(get("/body?token=" + token_, "evil.example").starts_with("HTTP/1.1 403"));
  for (const auto& [origin, token] : {std::pair<std::string, std::string>{"http://evil.example", token_},
                                      {"null", token_},
                                      {"http://" + own() + ".evil.example", token_},
                                      {"http://" + own(), "wrong"}}) {
    Connection connection(port_);
    EXPECT_FALSE(open_socket(connection, origin, token).starts_with("HTTP/1.1 101")) << origin;
  }
}

TEST_F(ViewServer, SendsTheLatestMessagesToABrowserThatJoinsLate) {
  server_.send_latest("status", "first");
  server_.send_latest("status", "second");
  Connection connection(port_);
  ASSERT_TRUE(open_socket(connection, "http://" + own(), token_).starts_with("HTTP/1.1 101"));
  EXPECT_EQ(connection.read_frame(), (std::pair<int, std::string>{1, "second"}));
  server_.send(PageServer::Kind::kState, bytes_of("a frame"));
  EXPECT_EQ(connection.read_frame(), (std::pair<int, std::string>{2, "a frame"}));
  server_.send_once("answered");
  EXPECT_EQ(connection.read_frame(), (std::pair<int, std::string>{1, "answered"}));
  connection.send_text("hello");
  for (int k = 0; k < 500 && taken().empty(); ++k) std::this_thread::sleep_for(std::chrono::milliseconds(10));
  EXPECT_EQ(taken(), "hello");
}

// the server does not wait for the browser that does not read, so the other browser gets frames and texts
TEST_F(ViewServer, ABrowserThatStopsReadingDelaysNoOtherBrowser) {
  Connection stalled(port_), other(port_);
  ASSERT_TRUE(open_socket(stalled, "http://" + own(), token_).starts_with("HTTP/1.1 101"));
  ASSERT_TRUE(open_socket(other, "http://" + own(), token_).starts_with("HTTP/1.1 101"));
  const auto large = bytes_of(std::string(1 << 20, 'x'));
  Clock::duration longest{};
  for (int k = 0; k < 200; ++k) {
    const Clock::time_point before = Clock::now();
    server_.send(PageServer::Kind::kState, large);
    server_.send_once("text " + std::to_string(k));
    longest = std::max(longest, Clock::now() - before);
  }
  // if send() waited for a socket, it would take some milliseconds per megabyte, and would never return for
  // the stalled browser
  EXPECT_LT(longest, std::chrono::seconds(1));
  bool has_frame = false, has_text = false;
  for (int k = 0; k < 300 && !(has_frame && has_text); ++k) {
    const auto [opcode, content] = other.read_frame();
    has_frame = has_frame || (opcode == 2 && content.size() == 1 << 20);
    has_text = has_text || content == "text 199";
  }
  EXPECT_TRUE(has_frame);
  EXPECT_TRUE(has_text);
}

TEST_F(ViewServer, AcceptsEightBrowsersAndRefusesTheNextWithTheCause) {
  std::vector<std::unique_ptr<Connection>> all;
  for (int k = 0; k < tools::kMostViewers; ++k) {
    all.push_back(std::make_unique<Connection>(port_));
    ASSERT_TRUE(open_socket(*all.back(), "http://" + own(), token_).starts_with("HTTP/1.1 101"));
  }
  // the test waits until the last browser has joined
  server_.send_latest("status", "there");
  for (const auto& connection : all) EXPECT_EQ(connection->read_frame().second, "there");
  Connection late(port_);
  ASSERT_TRUE(open_socket(late, "http://" + own(), token_).starts_with("HTTP/1.1 101"));
  EXPECT_NE(late.read_frame().second.find("too many browsers"), std::string::npos);
}

// For each kind of incomplete header the test opens as many connections without a token as the server keeps.
// These connections are older than the request for the page, but the request must be answered within 5 s, the
// timeout of a read
TEST_F(ViewServer, ConnectionsWithIncompleteHeadersBlockNobody) {
  constexpr int kOfAKind = 64;
  std::vector<std::unique_ptr<Connection>> silent, slow;
  for (int k = 0; k < kOfAKind; ++k) {
    silent.push_back(std::make_unique<Connection>(port_));
    silent.back()->send("GET / HTTP/1.1\r\n");
    slow.push_back(std::make_unique<Connection>(port_));
    slow.back()->send("GET / HTTP/1.1\r\nX: ");
  }
  std::atomic<bool> is_over = false;
  std::thread dribble([&] {
    while (!is_over) {
      for (const auto& connection : slow) connection->try_send("x");
      std::this_thread::sleep_for(std::chrono::milliseconds(20));
    }
  });
  EXPECT_TRUE(get("/?token=" + token_, own()).ends_with("<html>the page</html>"));
  Connection browser(port_);
  EXPECT_TRUE(open_socket(browser, "http://" + own(), token_).starts_with("HTTP/1.1 101"));
  for (const auto& connection : slow) EXPECT_TRUE(connection->is_closed_by_server());
  for (const auto& connection : silent) EXPECT_TRUE(connection->is_closed_by_server());
  is_over = true;
  dribble.join();
  // a connection that has the token stays open
  server_.send_latest("status", "there");
  EXPECT_EQ(browser.read_frame().second, "there");
}

TEST_F(ViewServer, ALongHeaderIsRefused) {
  Connection connection(port_);
  connection.try_send("GET /?token=" + token_ + " HTTP/1.1\r\nHost: " + own() + "\r\n");
  for (int k = 0; k < 20; ++k)
    connection.try_send("X-" + std::to_string(k) + ": " + std::string(1000, 'x') + "\r\n");
  connection.try_send("\r\n");
  EXPECT_TRUE(connection.read_head().starts_with("HTTP/1.1 431"));
  EXPECT_TRUE(connection.is_closed_by_server());
}

TEST_F(ViewServer, InvalidRequestsAreRefused) {
  Connection connection(port_);
  connection.send("hello\r\n\r\n");
  EXPECT_TRUE(connection.read_head().starts_with("HTTP/1.1 400"));
  Connection post(port_);
  post.send("POST /?token=" + token_ + " HTTP/1.1\r\nHost: " + own() + "\r\n\r\n");
  EXPECT_TRUE(post.read_head().starts_with("HTTP/1.1 405"));
}

// the server closes the connection because of the announced length, before it stores any byte of the frame
TEST_F(ViewServer, AFrameAboveTheLimitClosesItsConnectionBeforeItIsStored) {
  const std::string announced("\x81\xff\x00\x00\x01\x00\x00\x00\x00\x00\x00\x00\x00\x00", 14);  // 2^40 bytes
  Connection connection(port_);
  ASSERT_TRUE(open_socket(connection, "http://" + own(), token_).starts_with("HTTP/1.1 101"));
  const std::string piece(1 << 20, 'x');
  const std::size_t before = resident_memory();
  EXPECT_TRUE(connection.try_send(announced));
  const auto [opcode, content] = connection.read_frame();
  EXPECT_EQ(opcode, 8);
  EXPECT_EQ(content.substr(0, 2), "\x03\xf1");  // 1009: message too big
  for (int k = 0; k < 64 && connection.try_send(piece); ++k) continue;
  EXPECT_LT(resident_memory(), before + (std::size_t{16} << 20));
}

TEST_F(ViewServer, ATextAboveTheLimitIsIgnoredAndClosesItsConnection) {
  Connection connection(port_);
  ASSERT_TRUE(open_socket(connection, "http://" + own(), token_).starts_with("HTTP/1.1 101"));
  connection.send(std::string("\x81\xfe\x10\x01\x00\x00\x00\x00", 8) + std::string(4097, 'x'));
  EXPECT_EQ(connection.read_frame().first, 8);
  EXPECT_TRUE(taken().empty());
}

TEST_F(ViewServer, AFrameWithoutAMaskClosesItsConnection) {
  Connection connection(port_);
  ASSERT_TRUE(open_socket(connection, "http://" + own(), token_).starts_with("HTTP/1.1 101"));
  connection.send(std::string("\x81\x05hello", 7));
  const auto [opcode, content] = connection.read_frame();
  EXPECT_EQ(opcode, 8);
  EXPECT_EQ(content.substr(0, 2), "\x03\xea");  // 1002: protocol error
  EXPECT_TRUE(taken().empty());
}

TEST(ViewServerPort, APortInUseIsReported) {
  PageServer first({"", {}, {}}, 0, [](std::string_view) {});
  const std::string url = first.url();
  const int port = std::stoi(url.substr(url.find(":", 7) + 1));
  const PageServer second({"", {}, {}}, port, [](std::string_view) {});
  EXPECT_NE(second.error().find("another --port"), std::string::npos) << second.error();
}

}  // namespace
}  // namespace freeflex::testing
