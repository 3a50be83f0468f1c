#include "service/operator_socket.hpp"

#include <fmt/format.h>
#include <poll.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <thread>

#include "freeflex_msgs/control_t.hpp"
#include "messages/channels.hpp"
#include "service/bus_socket.hpp"
#include "service/descriptors.hpp"
#include "service/io/wire/operator_address.hpp"
#include "service/publisher.hpp"

namespace freeflex::service {

using io::Reason;

namespace {

constexpr const char* kNoSocket = "the operator's socket cannot be made";
constexpr int kBacklog = 8;
constexpr std::size_t kMostWaiting = 4096;  // a connection with this many unread messages is closed

/// Removes a socket file if nobody listens on it. Returns an empty string, or the reason why the path is not
/// free.
std::string clear_place(const std::string& path, const sockaddr_un& address) {
  struct stat found {};
  if (lstat(path.c_str(), &found) != 0) return {};
  if (!S_ISSOCK(found.st_mode))
    return fmt::format("{}, because {} exists and is not a socket; give --socket PATH with a free path",
                       kNoSocket, path);
  const int probe = socket(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC, 0);
  const bool is_live = connect(probe, reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0 ||
                       errno != ECONNREFUSED;
  close(probe);
  if (is_live)
    return fmt::format(
        "{}, because another program listens on {} and push --socket would reach that one; stop it, start "
        "this one with another --prefix or --socket PATH, or give --socket none",
        kNoSocket, path);
  unlink(path.c_str());
  return {};
}

/// Returns true if the peer runs as this user or as root.
bool is_owner(int fd) {
  ucred peer{};
  socklen_t length = sizeof peer;
  return getsockopt(fd, SOL_SOCKET, SO_PEERCRED, &peer, &length) == 0 &&
         (peer.uid == geteuid() || peer.uid == 0);
}

}  // namespace

OperatorSocket::OperatorSocket(const Plan& plan, const Identity& identity, Output& output,
                               SenderTable& senders)
    : plan_(plan),
      identity_(identity),
      output_(output),
      senders_(senders),
      names_(std::make_unique<io::NameTable>()),
      entry_(std::make_unique<InboundEntry>()),
      buffer_(channels::kMaxMessageBytes) {
  io::fill_name_table(plan, *names_);
}

OperatorSocket::~OperatorSocket() {
  for (const Connection& connection : connections_) ::close(connection.fd);
  if (fd_ < 0) return;
  ::close(fd_);
  // removes only the file that this daemon bound, because another daemon may have bound the path since
  struct stat found {};
  if (lstat(path_.c_str(), &found) == 0 && std::pair(found.st_dev, found.st_ino) == place_)
    unlink(path_.c_str());
}

std::string OperatorSocket::open(const std::string& path) {
  const std::optional<sockaddr_un> address = unix_address(path);
  if (!address)
    return fmt::format(
        "{}, because the path '{}' is longer than 107 characters; give a shorter --socket PATH", kNoSocket,
        path);
  if (std::string fault = clear_place(path, *address); !fault.empty()) return fault;
  const int fd = socket(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
  if (fd < 0) return call_fault(kNoSocket, "socket");
  // nobody can connect before listen(), so the mode before chmod() does not matter
  const char* failed = nullptr;
  if (bind(fd, reinterpret_cast<const sockaddr*>(&*address), sizeof *address) != 0)
    failed = "bind";
  else if (chmod(path.c_str(), 0600) != 0)
    failed = "chmod";
  else if (listen(fd, kBacklog) != 0)
    failed = "listen";
  if (failed != nullptr) {
    std::string fault =
        call_fault(kNoSocket, failed) + " (" + path + "); give --socket PATH, or --socket none";
    ::close(fd);
    return fault;
  }
  struct stat bound {};
  if (lstat(path.c_str(), &bound) == 0) place_ = {bound.st_dev, bound.st_ino};
  fd_ = fd;
  path_ = path;
  return {};
}

void OperatorSocket::serve(std::chrono::milliseconds time) {
  std::vector<pollfd> ready;
  if (fd_ >= 0) ready.push_back({fd_, POLLIN, 0});
  for (const Connection& connection : connections_)
    ready.push_back(
        {connection.fd, static_cast<short>(connection.outbox.empty() ? POLLIN : POLLIN | POLLOUT), 0});
  if (poll(ready.data(), ready.size(), static_cast<int>(time.count())) < 0) std::this_thread::sleep_for(time);
  deliver_answers();
  const auto has_gone = [this](Connection& connection) {
    if (read_one(connection) && flush(connection)) return false;
    ::close(connection.fd);
    return true;
  };
  std::erase_if(connections_, has_gone);
  if (!ready.empty() && (ready.front().revents & POLLIN) != 0) accept_one();
}

void OperatorSocket::accept_one() {
  const int fd = accept4(fd_, nullptr, nullptr, SOCK_CLOEXEC | SOCK_NONBLOCK);
  if (fd < 0) return;
  if (connections_.size() == kMostConnections || !is_owner(fd)) {
    ::close(fd);
    return;
  }
  const int on = 1;
  setsockopt(fd, SOL_SOCKET, SO_TIMESTAMPNS, &on, sizeof on);
  Connection& connection = connections_.emplace_back();
  connection.fd = fd;
  const io::Stamp stamp{
      .utime = 0, .session = identity_.session, .plan_fingerprint = identity_.plan_fingerprint};
  for (const auto& page : io::make_scene_messages(plan_, false, identity_.plan_file, stamp))
    connection.outbox.push_back(io::encode(page));
  flush(connection);
}

bool OperatorSocket::read_one(Connection& connection) {
  const ReceivedPacket packet = receive_packet(connection.fd, buffer_, MSG_DONTWAIT | MSG_TRUNC);
  if (packet.size < 0) return errno == EAGAIN || errno == EINTR;
  if (packet.size == 0) return false;
  // a message that does not fit the buffer is longer than every command, so decoding its first bytes rejects
  // it
  const std::size_t size = std::min(index(packet.size), buffer_.size());
  take(connection, std::span(buffer_).first(size), packet.received_ns);
  return connection.outbox.size() < kMostWaiting;
}

void OperatorSocket::take(Connection& connection, std::span<const std::byte> bytes,
                          std::int64_t received_ns) {
  output_.num_operator_received.fetch_add(1, std::memory_order_relaxed);
  entry_->received_ns = received_ns;
  entry_->kind = InboundKind::kControl;
  io::Admission admission = io::decode_control(bytes, identity_.session, entry_->control);
  if (admission.reason == Reason::kWrongType) {
    entry_->kind = InboundKind::kForce;
    admission = io::decode_force(bytes, identity_.session, *names_, entry_->force);
  }
  const auto refuse = [&admission](Reason reason, const std::string& text) {
    admission.reason = reason;
    std::snprintf(admission.text.data(), admission.text.size(), "%s", text.c_str());
  };
  if (admission.reason == Reason::kNoKeys)
    refuse(Reason::kNoKeys, "this socket uses no keys; send the command without an envelope");
  if (admission.reason == Reason::kAccepted) {
    if (!is_operator(admission.sender))
      refuse(Reason::kBadSender, fmt::format("sender {} must have a name on this socket that begins with {}",
                                             admission.sender.data(), kOperatorSender));
    else if (admission.sequence <= connection.last_sequence)
      refuse(Reason::kStaleSequence,
             fmt::format("sequence number {} of sender {} must be greater than {}, its last one",
                         admission.sequence, admission.sender.data(), connection.last_sequence));
    else if (find_asker({admission.sender, admission.sequence}) != nullptr)
      refuse(Reason::kStaleSequence, fmt::format("sequence number {} of {} also came over another "
                                                 "connection; use another sender name, or numbers from a "
                                                 "clock",
                                                 admission.sequence, admission.sender.data()));
  }
  if (admission.reason == Reason::kAccepted) {
    connection.last_sequence = admission.sequence;
    connection.asked.push_back({admission.sender, admission.sequence});
    if (connection.asked.size() > kMostAsked) connection.asked.pop_front();
    if (output_.operator_commands.try_push(*entry_)) {
      const bool is_clear =
          entry_->kind == InboundKind::kControl && entry_->control.command == freeflex_msgs::control_t::CLEAR;
      if (is_clear) release_places(senders_, entry_->control.target);
      return;
    }
    connection.asked.pop_back();
    refuse(Reason::kQueueFull, "earlier commands still wait for the loop; send again later");
  }
  output_.operator_rejected[static_cast<std::size_t>(admission.reason)].fetch_add(1,
                                                                                  std::memory_order_relaxed);
  put(connection,
      io::encode(make_ack(admission, output_.tick.load(std::memory_order_relaxed), identity_.session)));
}

OperatorSocket::Connection* OperatorSocket::find_asker(const Asked& asked) {
  for (Connection& connection : connections_)
    if (std::find(connection.asked.rbegin(), connection.asked.rend(), asked) != connection.asked.rend())
      return &connection;
  return nullptr;
}

/// Sends each answer of the loop to the connection that its command came from.
void OperatorSocket::deliver_answers() {
  for (AckEntry entry; output_.operator_acks.try_pop(entry);)
    if (Connection* const connection = find_asker({entry.sender, entry.sequence}); connection != nullptr)
      put(*connection, io::encode(make_ack(entry, identity_)));
}

void OperatorSocket::put(Connection& connection, std::vector<std::byte> bytes) {
  connection.outbox.push_back(std::move(bytes));
}

bool OperatorSocket::flush(Connection& connection) {
  while (!connection.outbox.empty()) {
    const std::vector<std::byte>& bytes = connection.outbox.front();
    if (send(connection.fd, bytes.data(), bytes.size(), MSG_DONTWAIT | MSG_NOSIGNAL) < 0)
      return errno == EAGAIN || errno == EINTR || errno == ENOBUFS;
    connection.outbox.pop_front();
  }
  return true;
}

}  // namespace freeflex::service
