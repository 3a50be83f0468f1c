// The page over HTTP on loopback, and a WebSocket to each browser that looks at it.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

namespace freeflex::tools {

using Bytes = std::shared_ptr<const std::vector<std::byte>>;

/// Browsers that may look on at one time.
inline constexpr int kMostViewers = 8;

/// Serves from one thread of its own. A client needs the token in the URL, and a WebSocket needs the page's
/// own origin as well. A connection without the token has one second and 16 KB for its header, and at most 64
/// such connections are held: a new one takes the place of the oldest.
class PageServer {
 public:
  struct Content {
    std::string html;
    std::vector<std::byte> body;    // at /body
    std::vector<std::byte> motion;  // at /motion; empty: there is none
  };
  /// Text from a page, called by the server's thread.
  using Take = std::function<void(std::string_view)>;

  /// \param port  0: any that is free
  PageServer(Content content, int port, Take take);
  ~PageServer();
  PageServer(const PageServer&) = delete;
  PageServer& operator=(const PageServer&) = delete;

  /// Empty, or why there is no server.
  const std::string& error() const { return error_; }
  std::string url() const;

  /// Frames of a kind replace those that a browser has not taken yet. Any thread may call what follows.
  enum class Kind : std::uint8_t { kState, kLoads };
  void send(Kind kind, const Bytes& frame);
  /// Texts of a name replace each other, and come first to a browser that joins.
  void send_latest(const std::string& name, const std::string& text);
  /// To every browser that is there now: the last 64 that it has not taken.
  void send_once(const std::string& text);

 private:
  class Loop;

  std::string error_;
  std::unique_ptr<Loop> loop_;  // null where there is no server
};

}  // namespace freeflex::tools
