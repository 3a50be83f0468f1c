// The WebSocket of one browser, with Boost.Beast.
#pragma once

#include <boost/asio/steady_timer.hpp>
#include <boost/beast/core/flat_buffer.hpp>
#include <boost/beast/core/tcp_stream.hpp>
#include <boost/beast/http/empty_body.hpp>
#include <boost/beast/http/message.hpp>
#include <boost/beast/websocket/stream.hpp>
#include <chrono>
#include <cstddef>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <string_view>

#include "tools/view/server.hpp"

namespace freeflex::tools {

using PageRequest = boost::beast::http::request<boost::beast::http::empty_body>;

/// Data that waits for a browser: the newest frame of each kind, the newest text of each name, and the latest
/// texts without a name.
struct Mail {
  Bytes state, loads;
  std::map<std::string, std::string> latest;
  std::deque<std::string> texts;

  void add_text(const std::string& text);
  /// Adds newer mail. A newer frame of a kind, or text of a name, replaces the older one.
  void add(const Mail& newer);
};

/// Sends mail to one browser and reads its texts. Every function runs on the thread of the stream.
class Viewer : public std::enable_shared_from_this<Viewer> {
 public:
  using Take = std::function<void(std::string_view)>;
  using Leave = std::function<void(const std::shared_ptr<Viewer>&)>;

  explicit Viewer(boost::beast::tcp_stream stream);

  /// Answers the browser's request and begins to send.  \param leave  called once, when the connection has
  /// ended
  void start(const PageRequest& request, const Take* take, Leave leave);
  /// Answers the browser's request, sends one text and closes the connection.
  void refuse(const PageRequest& request, std::string text);
  void put(const Mail& mail);

 private:
  using Clock = std::chrono::steady_clock;
  struct Frame {
    std::string text;
    Bytes bytes;  // null: a text frame
  };

  void read();
  void send();
  void collect();
  void end();

  boost::beast::websocket::stream<boost::beast::tcp_stream, false> stream_;
  boost::asio::steady_timer pause_;
  boost::beast::flat_buffer received_;
  const Take* take_ = nullptr;
  Leave leave_;
  Mail mail_;
  std::deque<Frame> frames_;  // the first frame is being written if is_writing_
  Clock::time_point next_;    // earliest time of the next frames
  bool is_ready_ = false, is_writing_ = false, is_paused_ = false;
};

}  // namespace freeflex::tools
