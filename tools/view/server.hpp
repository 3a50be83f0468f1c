// The page over HTTP on loopback, and a WebSocket to each browser that looks at it.
#pragma once

#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <set>
#include <span>
#include <string>
#include <string_view>
#include <vector>

struct mg_context;
struct mg_connection;

namespace freeflex::tools {

using Bytes = std::shared_ptr<const std::vector<std::byte>>;

/// Browsers that may look on at one time.
inline constexpr int kMostViewers = 8;

/// One browser. What it has not taken is replaced by what is newer, so that one that stops reading holds
/// nothing up and grows nothing.
class Viewer;

/// Serves from threads of its own. Whoever has the URL, with the token in it, may look and command; a page of
/// another origin may not.
class PageServer {
 public:
  struct Content {
    std::string html;
    std::vector<std::byte> body;    // at /body
    std::vector<std::byte> motion;  // at /motion; empty: there is none
  };
  /// Text from a page, called by any of the server's threads.
  using Take = std::function<void(std::string_view)>;

  /// \param port  0: any that is free
  PageServer(Content content, int port, Take take);
  ~PageServer();
  PageServer(const PageServer&) = delete;
  PageServer& operator=(const PageServer&) = delete;

  /// Empty, or why there is no server.
  const std::string& error() const { return error_; }
  std::string url() const;

  /// Frames of a kind replace those that a browser has not taken yet.
  enum class Kind : std::uint8_t { kState, kLoads };
  void send(Kind kind, const Bytes& frame);
  /// Texts of a name replace each other, and come first to a browser that joins.
  void send_latest(const std::string& name, const std::string& text);
  /// To every browser that is there now: the last 64 that it has not taken.
  void send_once(const std::string& text);

 private:
  friend struct Handlers;
  int answer(mg_connection* connection);
  bool may_enter(const mg_connection* connection, bool is_socket) const;
  bool join(mg_connection* connection);
  void leave(const mg_connection* connection);

  Content content_;
  Take take_;
  std::string error_, token_;
  int port_ = 0;
  mg_context* context_ = nullptr;
  std::mutex mutex_;  // of what follows
  std::map<const mg_connection*, std::shared_ptr<Viewer>> viewers_;
  std::map<std::string, std::string> latest_;
};

}  // namespace freeflex::tools
