// Serves the page over HTTP on loopback, and a WebSocket to each browser that shows it.
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

/// Largest number of browsers at one time.
inline constexpr int kMostViewers = 8;

/// Serves the page on a thread of its own. A client needs the token in the URL, and a WebSocket also needs
/// the page's own origin. A connection without the token has one second and 16 KB for its header. At most 64
/// such connections are kept, so a new one replaces the oldest.
class PageServer {
 public:
  struct Content {
    std::string html;
    std::vector<std::byte> body;    // served at /body
    std::vector<std::byte> motion;  // served at /motion; empty: there is no motion
  };
  /// Function that is called on the server's thread with each text from a page.
  using Take = std::function<void(std::string_view)>;

  /// \param port  0: any free port
  PageServer(Content content, int port, Take take);
  ~PageServer();
  PageServer(const PageServer&) = delete;
  PageServer& operator=(const PageServer&) = delete;

  /// Returns the reason why there is no server, or an empty text if there is no error.
  const std::string& error() const { return error_; }
  std::string url() const;

  // Any thread may call the following functions.
  /// Kinds of frames. A new frame replaces a frame of the same kind that was not yet sent to a browser.
  enum class Kind : std::uint8_t { kState, kLoads };
  void send(Kind kind, const Bytes& frame);
  /// Sends a text, which replaces an earlier text of the same name. A browser that connects first gets the
  /// latest text of each name.
  void send_latest(const std::string& name, const std::string& text);
  /// Sends a text to every connected browser. For each browser, the last 64 texts that were not yet sent are
  /// kept.
  void send_once(const std::string& text);

 private:
  class Loop;

  std::string error_;
  std::unique_ptr<Loop> loop_;  // null if there is no server
};

}  // namespace freeflex::tools
