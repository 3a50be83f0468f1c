#include "tools/view/server.hpp"

#include <sys/random.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/beast/core/flat_buffer.hpp>
#include <boost/beast/core/tcp_stream.hpp>
#include <boost/beast/http.hpp>
#include <boost/beast/websocket/rfc6455.hpp>
#include <chrono>
#include <deque>
#include <map>
#include <mutex>
#include <optional>
#include <set>
#include <thread>
#include <utility>

#include "tools/view/viewer.hpp"

namespace freeflex::tools {
namespace {

namespace asio = boost::asio;
namespace http = boost::beast::http;
using asio::ip::tcp;
using boost::system::error_code;

constexpr std::chrono::seconds kHeaderTime{1};    // time for a complete header, in any number of reads
constexpr std::size_t kMostHeader = 16384;        // [bytes]
constexpr std::size_t kMostUnauthenticated = 64;  // connections whose header is incomplete or was refused
constexpr std::size_t kMostDownloads = 32;        // connections that receive the page or its data
constexpr std::chrono::seconds kWriteTime{10};    // time in which a client must accept a part of an answer
constexpr std::chrono::seconds kCloseTime{1};     // time after the answer in which a client must close
constexpr std::chrono::milliseconds kAcceptPause{
    100};  // pause after a failed accept, for example if there are no free file descriptors

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

/// Compares two texts in a time that does not depend on the position of the first difference.
bool are_equal(std::string_view a, std::string_view b) {
  if (a.size() != b.size()) return false;
  unsigned difference = 0;
  for (std::size_t k = 0; k < a.size(); ++k)
    difference |= static_cast<unsigned char>(a[k]) ^ static_cast<unsigned char>(b[k]);
  return difference == 0;
}

std::string_view view_of(boost::beast::string_view text) { return {text.data(), text.size()}; }
std::string_view view_of(const std::vector<std::byte>& bytes) {
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

/// Returns the value of `token` in a query, or an empty text if there is none.
std::string_view token_in(std::string_view query) {
  constexpr std::string_view kName = "token=";
  while (!query.empty()) {
    const std::string_view field = query.substr(0, query.find('&'));
    if (field.starts_with(kName)) return field.substr(kName.size());
    query.remove_prefix(std::min(query.size(), field.size() + 1));
  }
  return {};
}

using Answer = http::response<http::span_body<const char>>;

}  // namespace

/// The server's thread and its state.
class PageServer::Loop {
 public:
  Loop(Content content, Take take) : content_(std::move(content)), take_(std::move(take)) {}
  ~Loop() {
    io_.stop();
    if (thread_.joinable()) thread_.join();
  }
  Loop(const Loop&) = delete;
  Loop& operator=(const Loop&) = delete;

  /// Returns an empty text or the reason why there is no server.
  std::string start(int port);
  std::string url() const;
  template <typename Change>
  void post(const Change& change);
  bool has_viewers() const { return num_viewers_ > 0; }

 private:
  class Visitor;
  /// List of connections of one kind. If the list is full, a new connection closes the oldest connection.
  class ConnectionList {
   public:
    explicit ConnectionList(std::size_t most) : most_(most) {}
    void add(const std::shared_ptr<Visitor>& visitor);
    void remove(const std::shared_ptr<Visitor>& visitor);

   private:
    std::size_t most_;
    std::deque<std::weak_ptr<Visitor>> all_;  // ordered by age
  };

  void accept();
  void deliver();
  void join(boost::beast::tcp_stream stream, const PageRequest& request);
  bool may_enter(const PageRequest& request, bool is_socket) const;
  Answer answer(const PageRequest& request, bool is_entitled) const;

  const Content content_;
  const Take take_;
  std::string token_;
  int port_ = 0;
  asio::io_context io_{1};  // declared before the members that use it
  tcp::acceptor acceptor_{io_};
  asio::steady_timer pause_{io_};
  ConnectionList unauthenticated_{kMostUnauthenticated}, downloads_{kMostDownloads};
  std::set<std::shared_ptr<Viewer>> viewers_;
  std::map<std::string, std::string> latest_;  // newest text of each name, for browsers that connect later
  std::atomic<std::size_t> num_viewers_ = 0;
  std::mutex mutex_;  // guards mail_ and is_posted_
  Mail mail_;         // from other threads
  bool is_posted_ = false;
  std::thread thread_;
};

/// Handles one connection until its request is answered or becomes a WebSocket.
class PageServer::Loop::Visitor : public std::enable_shared_from_this<Visitor> {
 public:
  Visitor(Loop& loop, tcp::socket socket) : loop_(loop), stream_(std::move(socket)), received_(kMostHeader) {
    parser_.header_limit(kMostHeader);
  }
  void start() {
    stream_.expires_after(kHeaderTime);
    http::async_read_header(
        stream_, received_, parser_,
        [self = shared_from_this()](error_code error, std::size_t) { self->take(error); });
  }
  void close() { stream_.close(); }

 private:
  void take(error_code error) {
    if (error == http::error::header_limit || error == http::error::buffer_overflow)
      return refuse(http::status::request_header_fields_too_large, "the header is above 16 KB");
    const bool is_malformed = error.category() == make_error_code(http::error::end_of_stream).category() &&
                              error != http::error::end_of_stream && error != http::error::partial_message;
    if (error && !is_malformed) return;  // the time ran out, or the client closed the connection
    if (error) return refuse(http::status::bad_request, "this is not an HTTP/1.1 request");
    const PageRequest& request = parser_.get();
    const bool is_socket = boost::beast::websocket::is_upgrade(request);
    const bool is_entitled = loop_.may_enter(request, is_socket);
    if (is_entitled) loop_.unauthenticated_.remove(shared_from_this());
    if (is_entitled && is_socket && view_of(request.target()).starts_with("/ws?")) {
      stream_.expires_never();
      return loop_.join(std::move(stream_), request);
    }
    if (is_entitled) loop_.downloads_.add(shared_from_this());
    answer_ = loop_.answer(request, is_entitled);
    write();
  }
  void refuse(http::status status, std::string_view text) {
    answer_.result(status);
    answer_.body() = {text.data(), text.size()};
    write();
  }
  void write() {
    answer_.version(11);
    answer_.keep_alive(false);
    answer_.content_length(answer_.body().size());
    serializer_.emplace(answer_);
    write_some();
  }
  void write_some() {
    stream_.expires_after(kWriteTime);
    http::async_write_some(stream_, *serializer_, [self = shared_from_this()](error_code error, std::size_t) {
      if (error) return;
      if (!self->serializer_->is_done()) return self->write_some();
      self->stream_.socket().shutdown(tcp::socket::shutdown_send, error);
      self->stream_.expires_after(kCloseTime);
      self->drain();
    });
  }
  /// Reads until the client closes the connection. If the server closed the connection while bytes are
  /// unread, the system would reset the connection, and the client could lose the answer.
  void drain() {
    stream_.async_read_some(asio::buffer(rest_), [self = shared_from_this()](error_code error, std::size_t) {
      if (!error) self->drain();
    });
  }

  Loop& loop_;
  boost::beast::tcp_stream stream_;
  boost::beast::flat_buffer received_;
  http::request_parser<http::empty_body> parser_;
  Answer answer_;
  std::optional<http::response_serializer<http::span_body<const char>>> serializer_;
  std::array<char, 1024> rest_{};
};

void PageServer::Loop::ConnectionList::add(const std::shared_ptr<Visitor>& visitor) {
  std::erase_if(all_, [](const auto& one) { return one.expired(); });
  if (all_.size() == most_) {
    if (const std::shared_ptr<Visitor> oldest = all_.front().lock()) oldest->close();
    all_.pop_front();
  }
  all_.push_back(visitor);
}

void PageServer::Loop::ConnectionList::remove(const std::shared_ptr<Visitor>& visitor) {
  std::erase_if(all_, [&](const auto& one) { return one.lock() == visitor; });
}

std::string PageServer::Loop::start(int port) {
  token_ = make_token();
  if (token_.empty()) return "the system gives no random numbers";
  const tcp::endpoint address(asio::ip::address_v4::loopback(), static_cast<std::uint16_t>(port));
  error_code error;
  acceptor_.open(address.protocol(), error);
  if (!error) acceptor_.set_option(tcp::acceptor::reuse_address(true), error);
  if (!error) acceptor_.bind(address, error);
  if (!error) acceptor_.listen(tcp::acceptor::max_listen_connections, error);
  if (error)
    return "the server cannot start at 127.0.0.1:" + std::to_string(port) + ": " + error.message() +
           "; give another --port, or 0 for any free one";
  port_ = acceptor_.local_endpoint().port();
  accept();
  thread_ = std::thread([this] { io_.run(); });
  return {};
}

std::string PageServer::Loop::url() const {
  return "http://127.0.0.1:" + std::to_string(port_) + "/?token=" + token_;
}

void PageServer::Loop::accept() {
  acceptor_.async_accept([this](error_code error, tcp::socket socket) {
    if (error) {
      pause_.expires_after(kAcceptPause);
      return pause_.async_wait([this](error_code ended) {
        if (!ended) accept();
      });
    }
    error_code ignored;
    socket.set_option(tcp::no_delay(true), ignored);
    const auto visitor = std::make_shared<Visitor>(*this, std::move(socket));
    unauthenticated_.add(visitor);
    visitor->start();
    accept();
  });
}

/// Returns true if a request names this server and has the token. A WebSocket request must also have the
/// page's origin.
bool PageServer::Loop::may_enter(const PageRequest& request, bool is_socket) const {
  const std::string port = ":" + std::to_string(port_);
  const auto is_own = [&](http::field name, const std::string& front) {
    const std::string_view found = view_of(request[name]);
    return found == front + "127.0.0.1" + port || found == front + "localhost" + port;
  };
  const std::string_view target = view_of(request.target());
  const std::size_t query = target.find('?');
  return is_own(http::field::host, "") && (!is_socket || is_own(http::field::origin, "http://")) &&
         query != std::string_view::npos && are_equal(token_in(target.substr(query + 1)), token_);
}

Answer PageServer::Loop::answer(const PageRequest& request, bool is_entitled) const {
  Answer answer;
  answer.set(http::field::cache_control, "no-store");
  answer.set("X-Content-Type-Options", "nosniff");
  const auto fill = [&](http::status status, const char* type, std::string_view content) {
    answer.result(status);
    answer.set(http::field::content_type, type);
    answer.body() = {content.data(), content.size()};
    return std::move(answer);
  };
  if (request.method() != http::verb::get)
    return fill(http::status::method_not_allowed, "text/plain", "only GET is allowed");
  if (!is_entitled)
    return fill(http::status::forbidden, "text/plain",
                "open the address that freeflex view printed, with its token");
  const std::string_view target = view_of(request.target()), path = target.substr(0, target.find('?'));
  if (path == "/") {
    const std::string port = std::to_string(port_);
    answer.set(
        "Content-Security-Policy",
        "default-src 'none'; script-src 'unsafe-inline'; style-src 'unsafe-inline'; connect-src 'self' "
        "ws://127.0.0.1:" +
            port + " ws://localhost:" + port);
    answer.set("Referrer-Policy", "no-referrer");
    answer.set("X-Frame-Options", "DENY");
    return fill(http::status::ok, "text/html; charset=utf-8", content_.html);
  }
  if (path == "/body") return fill(http::status::ok, "application/octet-stream", view_of(content_.body));
  if (path == "/motion")
    return fill(content_.motion.empty() ? http::status::no_content : http::status::ok,
                "application/octet-stream", view_of(content_.motion));
  return fill(http::status::not_found, "text/plain", "the server has only /, /body, /motion and /ws");
}

void PageServer::Loop::join(boost::beast::tcp_stream stream, const PageRequest& request) {
  const auto viewer = std::make_shared<Viewer>(std::move(stream));
  if (viewers_.size() >= index(kMostViewers))
    return viewer->refuse(request, R"({"notice":"too many browsers show this page; close one"})");
  viewers_.insert(viewer);
  num_viewers_ = viewers_.size();
  Mail first;
  first.latest = latest_;
  viewer->put(first);
  viewer->start(request, &take_, [this](const std::shared_ptr<Viewer>& gone) {
    viewers_.erase(gone);
    num_viewers_ = viewers_.size();
  });
}

/// Adds mail for the server's thread, and wakes the thread once for all waiting mail.
template <typename Change>
void PageServer::Loop::post(const Change& change) {
  const std::lock_guard lock(mutex_);
  change(mail_);
  if (!std::exchange(is_posted_, true)) asio::post(io_, [this] { deliver(); });
}

void PageServer::Loop::deliver() {
  Mail mail;
  {
    const std::lock_guard lock(mutex_);
    mail = std::exchange(mail_, {});
    is_posted_ = false;
  }
  for (const auto& [name, text] : mail.latest) latest_[name] = text;
  for (const std::shared_ptr<Viewer>& viewer : viewers_) viewer->put(mail);
}

PageServer::PageServer(Content content, int port, Take take)
    : loop_(std::make_unique<Loop>(std::move(content), std::move(take))) {
  error_ = loop_->start(port);
}

PageServer::~PageServer() = default;

std::string PageServer::url() const { return loop_->url(); }

void PageServer::send(Kind kind, const Bytes& frame) {
  if (!loop_->has_viewers()) return;
  loop_->post([&](Mail& mail) { (kind == Kind::kState ? mail.state : mail.loads) = frame; });
}

void PageServer::send_latest(const std::string& name, const std::string& text) {
  loop_->post([&](Mail& mail) { mail.latest[name] = text; });
}

void PageServer::send_once(const std::string& text) {
  loop_->post([&](Mail& mail) { mail.add_text(text); });
}

}  // namespace freeflex::tools
