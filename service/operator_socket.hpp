// The operator's socket, over which commands reach the daemon even if somebody blocks the bus.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "service/output.hpp"
#include "service/status.hpp"

namespace freeflex::service {

/// A unix socket (SOCK_SEQPACKET, mode 0600) for the user who runs the daemon, and for root. A client
/// receives the pages of the scene (scene_t), sends force_t and control_t and receives an ack_t for each. One
/// packet contains one message, encoded as on LCM. Used only by the supervisor's thread.
class OperatorSocket {
 public:
  static constexpr int kMostConnections = 8;

  /// \param senders  table of senders on the bus, in which cleared senders lose their places
  OperatorSocket(const Plan& plan, const Identity& identity, Output& output, SenderTable& senders);
  ~OperatorSocket();
  OperatorSocket(const OperatorSocket&) = delete;
  OperatorSocket& operator=(const OperatorSocket&) = delete;

  /// Listens on the path. Replaces a socket file that an ended daemon left behind. Returns an empty string,
  /// or the error for the user.
  std::string open(const std::string& path);
  /// Waits for messages, at most for this time, and handles those that have arrived. If the socket is not
  /// open, sleeps for this time.
  void serve(std::chrono::milliseconds time);

 private:
  /// Sender and sequence, which identify the command that an answer belongs to.
  struct Asked {
    std::array<char, kSenderSize> sender;
    std::int64_t sequence;
    bool operator==(const Asked&) const = default;
  };
  // four times the number of commands that can wait in the loop
  static constexpr std::size_t kMostAsked = 1024;
  struct Connection {
    int fd = -1;
    std::int64_t last_sequence = 0;
    std::deque<Asked> asked;  // the latest kMostAsked commands passed to the loop
    std::deque<std::vector<std::byte>> outbox;
  };
  void accept_one();
  bool read_one(Connection& connection);  // false if the client has gone or does not read
  void take(Connection& connection, std::span<const std::byte> bytes, std::int64_t received_ns);
  bool flush(Connection& connection);  // false if the client has gone
  void deliver_answers();
  Connection* find_asker(const Asked& asked);  // nullptr if the client has gone
  void put(Connection& connection, std::vector<std::byte> bytes);

  const Plan& plan_;
  const Identity& identity_;
  Output& output_;
  SenderTable& senders_;
  std::unique_ptr<io::NameTable> names_;
  std::unique_ptr<InboundEntry> entry_;
  std::vector<std::byte> buffer_;
  std::string path_;                 // empty if not open
  std::pair<dev_t, ino_t> place_{};  // device and inode of the bound socket
  int fd_ = -1;
  std::vector<Connection> connections_;
};

}  // namespace freeflex::service
