#include "tools/view/server.hpp"

#include <civetweb.h>
#include <sys/random.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <cstring>
#include <thread>
#include <utility>

namespace freeflex::tools {
namespace {

constexpr std::size_t kMostWaiting = 64;                     // texts of one browser
constexpr double kTraffic = 150e3;                           // [bytes/s] of states to one browser
constexpr std::chrono::microseconds kLeastInterval{16'000};  // 60 a second, of states
constexpr std::size_t kMostFromPage = 4096;                  // [bytes] of a text

std::string make_token() {
  std::array<unsigned char, 16> bytes{};
  if (getrandom(bytes.data(), bytes.size(), 0) != static_cast<ssize_t>(bytes.size())) return {};
  std::string token;
  for (const unsigned char byte : bytes) {
    constexpr const char* kDigits = "0123456789abcdef";
    token += kDigits[byte >> 4];
    token += kDigits[byte & 15];
  }
  return token;
}

/// Equal in time that does not tell where they differ.
bool are_equal(const std::string& a, const std::string& b) {
  if (a.size() != b.size()) return false;
  unsigned difference = 0;
  for (std::size_t k = 0; k < a.size(); ++k)
    difference |= static_cast<unsigned char>(a[k]) ^ static_cast<unsigned char>(b[k]);
  return difference == 0;
}

}  // namespace

class Viewer {
 public:
  explicit Viewer(mg_connection* connection) : connection_(connection), sender_([this] { send_all(); }) {}
  ~Viewer() {
    {
      const std::lock_guard lock(mutex_);
      is_over_ = true;
    }
    is_waiting_.notify_one();
    sender_.join();
  }
  Viewer(const Viewer&) = delete;
  Viewer& operator=(const Viewer&) = delete;

  void put(PageServer::Kind kind, const Bytes& frame) {
    {
      const std::lock_guard lock(mutex_);
      (kind == PageServer::Kind::kState ? state_ : loads_) = frame;
    }
    is_waiting_.notify_one();
  }
  void put(const std::string& name, const std::string& text) {
    {
      const std::lock_guard lock(mutex_);
      if (!name.empty()) {
        latest_[name] = text;
      } else {
        if (texts_.size() == kMostWaiting) texts_.pop_front();
        texts_.push_back(text);
      }
    }
    is_waiting_.notify_one();
  }

 private:
  using Clock = std::chrono::steady_clock;

  void send_all() {
    Clock::time_point next = Clock::now();
    std::unique_lock lock(mutex_);
    while (true) {
      const auto has_text = [this] { return is_over_ || !texts_.empty() || !latest_.empty(); };
      if (state_ || loads_)
        is_waiting_.wait_until(lock, next, has_text);
      else
        is_waiting_.wait(lock, [&] { return has_text() || state_ || loads_; });
      if (is_over_) return;
      std::deque<std::string> texts = std::exchange(texts_, {});
      for (auto& [name, text] : std::exchange(latest_, {})) texts.push_back(text);
      Bytes state, loads;
      if (Clock::now() >= next)
        state = std::exchange(state_, nullptr), loads = std::exchange(loads_, nullptr);
      lock.unlock();
      for (const std::string& text : texts) write(MG_WEBSOCKET_OPCODE_TEXT, text.data(), text.size());
      std::size_t size = 0;
      for (const Bytes& frame : {loads, state}) {
        if (!frame) continue;
        write(MG_WEBSOCKET_OPCODE_BINARY, reinterpret_cast<const char*>(frame->data()), frame->size());
        size += frame->size();
      }
      // from one due time to the next: states that come at another rate keep theirs on the average
      const auto paced =
          std::chrono::microseconds(static_cast<std::int64_t>(1e6 * static_cast<double>(size) / kTraffic));
      if (size > 0) next = std::max(next + std::max(kLeastInterval, paced), Clock::now());
      lock.lock();
    }
  }
  void write(int opcode, const char* data, std::size_t size) {
    // one that cannot be reached any more ends by its own connection's thread
    if (!is_gone_ && mg_websocket_write(connection_, opcode, data, size) <= 0) is_gone_ = true;
  }

  mg_connection* connection_;
  std::mutex mutex_;  // of what follows, but is_gone_
  std::condition_variable is_waiting_;
  Bytes state_, loads_;
  std::map<std::string, std::string> latest_;
  std::deque<std::string> texts_;
  bool is_over_ = false;
  bool is_gone_ = false;  // of the sender alone
  std::thread sender_;    // last: it reads all of the above
};

/// What civetweb calls.
struct Handlers {
  static PageServer& server(void* data) { return *static_cast<PageServer*>(data); }
  static int request(mg_connection* connection, void* data) { return server(data).answer(connection); }
  static int connect(const mg_connection* connection, void* data) {
    return server(data).may_enter(connection, true) ? 0 : 1;
  }
  static void ready(mg_connection* connection, void* data) { server(data).join(connection); }
  static int receive(mg_connection*, int bits, char* text, std::size_t size, void* data) {
    constexpr int kOpcode = 0xf;
    if ((bits & kOpcode) == MG_WEBSOCKET_OPCODE_CONNECTION_CLOSE) return 0;
    if ((bits & kOpcode) == MG_WEBSOCKET_OPCODE_TEXT && size <= kMostFromPage)
      server(data).take_({text, size});
    return 1;
  }
  static void close(const mg_connection* connection, void* data) { server(data).leave(connection); }
};

PageServer::PageServer(Content content, int port, Take take)
    : content_(std::move(content)), take_(std::move(take)), token_(make_token()) {
  mg_init_library(0);
  const std::string address = "127.0.0.1:" + std::to_string(port), threads = std::to_string(kMostViewers + 4);
  std::array<const char*, 13> options{"listening_ports",
                                      address.c_str(),
                                      "num_threads",
                                      threads.c_str(),
                                      "request_timeout_ms",
                                      "10000",
                                      "websocket_timeout_ms",
                                      "10000",
                                      "enable_websocket_ping_pong",
                                      "yes",
                                      "tcp_nodelay",
                                      "1",
                                      nullptr};
  mg_callbacks callbacks{};
  context_ = token_.empty() ? nullptr : mg_start(&callbacks, this, options.data());
  if (context_ == nullptr) {
    error_ = token_.empty()
                 ? "the system gives no random numbers"
                 : "no server at " + address + ": " + std::strerror(errno) + "; another --port, or 0 for any";
    return;
  }
  mg_server_port found{};
  if (mg_get_server_ports(context_, 1, &found) == 1) port_ = found.port;
  mg_set_request_handler(context_, "/", &Handlers::request, this);
  mg_set_websocket_handler(context_, "/ws$", &Handlers::connect, &Handlers::ready, &Handlers::receive,
                           &Handlers::close, this);
}

PageServer::~PageServer() {
  if (context_ != nullptr) mg_stop(context_);
  mg_exit_library();
}

std::string PageServer::url() const {
  return "http://127.0.0.1:" + std::to_string(port_) + "/?token=" + token_;
}

/// By its own names alone, with the token; a WebSocket from its own page.
bool PageServer::may_enter(const mg_connection* connection, bool is_socket) const {
  const std::string port = ":" + std::to_string(port_);
  const auto is_own = [&](const char* name, const std::string& front) {
    const char* found = mg_get_header(connection, name);
    return found != nullptr && (found == front + "127.0.0.1" + port || found == front + "localhost" + port);
  };
  if (!is_own("Host", "") || (is_socket && !is_own("Origin", "http://"))) return false;
  const char* query = mg_get_request_info(connection)->query_string;
  std::array<char, 64> token{};
  return query != nullptr &&
         mg_get_var(query, std::strlen(query), "token", token.data(), token.size()) >= 0 &&
         are_equal(token.data(), token_);
}

int PageServer::answer(mg_connection* connection) {
  const mg_request_info* request = mg_get_request_info(connection);
  const auto send = [connection](const char* status, const char* type, std::string_view content,
                                 const std::string& more) {
    mg_printf(connection,
              "HTTP/1.1 %s\r\nContent-Type: %s\r\nContent-Length: %zu\r\nCache-Control: no-store\r\n"
              "X-Content-Type-Options: nosniff\r\n%s\r\n",
              status, type, content.size(), more.c_str());
    if (!content.empty()) mg_write(connection, content.data(), content.size());
    return std::stoi(status);
  };
  const auto send_bytes = [&](const std::vector<std::byte>& bytes) {
    return send("200 OK", "application/octet-stream",
                {reinterpret_cast<const char*>(bytes.data()), bytes.size()}, "");
  };
  if (std::strcmp(request->request_method, "GET") != 0)
    return send("405 Method Not Allowed", "text/plain", "GET alone", "");
  if (!may_enter(connection, false))
    return send("403 Forbidden", "text/plain", "open the address that freeflex view printed, with its token",
                "");
  const std::string_view path = request->local_uri;
  const std::string port = std::to_string(port_);
  if (path == "/")
    return send(
        "200 OK", "text/html; charset=utf-8", content_.html,
        "Content-Security-Policy: default-src 'none'; script-src 'unsafe-inline'; style-src 'unsafe-inline'; "
        "connect-src 'self' ws://127.0.0.1:" +
            port + " ws://localhost:" + port +
            "\r\n"
            "Referrer-Policy: no-referrer\r\nX-Frame-Options: DENY\r\n");
  if (path == "/body") return send_bytes(content_.body);
  if (path == "/motion")
    return content_.motion.empty() ? send("204 No Content", "text/plain", "", "")
                                   : send_bytes(content_.motion);
  return send("404 Not Found", "text/plain", "there are /, /body, /motion and /ws", "");
}

bool PageServer::join(mg_connection* connection) {
  const std::lock_guard lock(mutex_);
  if (viewers_.size() >= static_cast<std::size_t>(kMostViewers)) {
    constexpr std::string_view kFull = R"({"notice":"as many browsers look on as may: close one of them"})";
    mg_websocket_write(connection, MG_WEBSOCKET_OPCODE_TEXT, kFull.data(), kFull.size());
    mg_websocket_write(connection, MG_WEBSOCKET_OPCODE_CONNECTION_CLOSE, nullptr, 0);
    return false;
  }
  const auto viewer = std::make_shared<Viewer>(connection);
  for (const auto& [name, text] : latest_) viewer->put(name, text);
  viewers_[connection] = viewer;
  return true;
}

void PageServer::leave(const mg_connection* connection) {
  // it is destroyed behind the lock, for its sender may still write
  std::shared_ptr<Viewer> gone;
  {
    const std::lock_guard lock(mutex_);
    const auto found = viewers_.find(connection);
    if (found == viewers_.end()) return;
    gone = std::move(found->second);
    viewers_.erase(found);
  }
}

void PageServer::send(Kind kind, const Bytes& frame) {
  const std::lock_guard lock(mutex_);
  for (const auto& [connection, viewer] : viewers_) viewer->put(kind, frame);
}

void PageServer::send_latest(const std::string& name, const std::string& text) {
  const std::lock_guard lock(mutex_);
  latest_[name] = text;
  for (const auto& [connection, viewer] : viewers_) viewer->put(name, text);
}

void PageServer::send_once(const std::string& text) {
  const std::lock_guard lock(mutex_);
  for (const auto& [connection, viewer] : viewers_) viewer->put("", text);
}

}  // namespace freeflex::tools
