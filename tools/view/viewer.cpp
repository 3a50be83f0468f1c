#include "tools/view/viewer.hpp"

#include <algorithm>
#include <boost/asio/buffer.hpp>
#include <utility>

namespace freeflex::tools {
namespace {

namespace websocket = boost::beast::websocket;

constexpr std::size_t kMostWaiting = 64;  // texts that wait for one browser
constexpr double kTraffic = 150e3;        // [bytes/s] limit of the states sent to one browser
constexpr std::chrono::microseconds kLeastInterval{16'000};  // pause between states: at most 62.5 a second
constexpr std::size_t kMostFromPage = 4096;                  // [bytes] limit of a text from the page
constexpr std::chrono::seconds kHandshakeTime{2};            // time limit for opening and for closing
// silence until the connection is closed; after half of this time, a ping is sent
constexpr std::chrono::seconds kIdleTime{10};

}  // namespace

void Mail::add_text(const std::string& text) {
  if (texts.size() == kMostWaiting) texts.pop_front();
  texts.push_back(text);
}

void Mail::add(const Mail& newer) {
  if (newer.state) state = newer.state;
  if (newer.loads) loads = newer.loads;
  for (const auto& [name, text] : newer.latest) latest[name] = text;
  for (const std::string& text : newer.texts) add_text(text);
}

Viewer::Viewer(boost::beast::tcp_stream stream)
    : stream_(std::move(stream)),
      pause_(stream_.get_executor()),
      received_(kMostFromPage),
      next_(Clock::now()) {
  websocket::stream_base::timeout limits{};
  limits.handshake_timeout = kHandshakeTime;
  limits.idle_timeout = kIdleTime;
  limits.keep_alive_pings = true;
  stream_.set_option(limits);
  // the announced length is checked against this limit before any byte is stored
  stream_.read_message_max(kMostFromPage);
  stream_.auto_fragment(false);
}

void Viewer::start(const PageRequest& request, const Take* take, Leave leave) {
  take_ = take;
  leave_ = std::move(leave);
  stream_.async_accept(request, [self = shared_from_this()](boost::system::error_code error) {
    if (error) return self->end();
    self->is_ready_ = true;
    self->read();
    self->send();
  });
}

void Viewer::refuse(const PageRequest& request, std::string text) {
  frames_.push_back({std::move(text), nullptr});
  stream_.async_accept(request, [self = shared_from_this()](boost::system::error_code error) {
    if (error) return;
    const auto close = [self](boost::system::error_code failed, std::size_t) {
      if (!failed)
        self->stream_.async_close(websocket::close_code::try_again_later,
                                  [self](boost::system::error_code) {});
    };
    self->stream_.text(true);
    self->stream_.async_write(boost::asio::buffer(self->frames_.front().text), close);
  });
}

void Viewer::put(const Mail& mail) {
  mail_.add(mail);
  send();
}

void Viewer::read() {
  stream_.async_read(received_, [self = shared_from_this()](boost::system::error_code error, std::size_t) {
    if (error) return self->end();
    const auto data = self->received_.cdata();
    if (self->stream_.got_text()) (*self->take_)({static_cast<const char*>(data.data()), data.size()});
    self->received_.consume(self->received_.size());
    self->read();
  });
}

/// Writes the frames one after another, until none is left.
void Viewer::send() {
  if (!is_ready_ || is_writing_) return;
  if (frames_.empty()) collect();
  if (frames_.empty()) return;
  is_writing_ = true;
  const Frame& frame = frames_.front();
  stream_.binary(frame.bytes != nullptr);
  stream_.async_write(frame.bytes ? boost::asio::buffer(*frame.bytes) : boost::asio::buffer(frame.text),
                      [self = shared_from_this()](boost::system::error_code error, std::size_t) {
                        self->is_writing_ = false;
                        if (error) return self->end();
                        self->frames_.pop_front();
                        self->send();
                      });
}

/// Appends the mail that may be sent now to the list of frames.
void Viewer::collect() {
  for (std::string& text : std::exchange(mail_.texts, {})) frames_.push_back({std::move(text), nullptr});
  for (auto& [name, text] : std::exchange(mail_.latest, {})) frames_.push_back({std::move(text), nullptr});
  if (!mail_.state && !mail_.loads) return;
  const Clock::time_point now = Clock::now();
  if (now < next_) {
    if (std::exchange(is_paused_, true)) return;
    pause_.expires_at(next_);
    pause_.async_wait([weak = weak_from_this()](boost::system::error_code error) {
      const std::shared_ptr<Viewer> self = weak.lock();
      if (error || !self) return;
      self->is_paused_ = false;
      self->send();
    });
    return;
  }
  std::size_t size = 0;
  for (Bytes* waiting : {&mail_.loads, &mail_.state}) {
    if (!*waiting) continue;
    size += (*waiting)->size();
    frames_.push_back({{}, std::exchange(*waiting, nullptr)});
  }
  // the pause begins when the frame was due and not when it was sent, so that delays do not lower the average
  // rate
  const auto paced =
      std::chrono::microseconds(static_cast<std::int64_t>(1e6 * static_cast<double>(size) / kTraffic));
  next_ = std::max(next_ + std::max(kLeastInterval, paced), now);
}

void Viewer::end() {
  is_ready_ = false;
  boost::beast::get_lowest_layer(stream_).close();
  if (const Leave leave = std::exchange(leave_, nullptr)) leave(shared_from_this());
}

}  // namespace freeflex::tools
