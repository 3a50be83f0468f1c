// The operator's way in: a socket beside the bus, which nobody on the bus can close.
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

/// A unix socket (SOCK_SEQPACKET, mode 0600) for whoever runs the daemon, and for root. Who connects gets the
/// pages of the scene (scene_t), sends force_t and control_t and gets an ack_t for each; a message is one
/// packet, as it would stand in an LCM message. One thread, the supervisor's.
class OperatorSocket {
 public:
  static constexpr int kMostConnections = 8;

  /// \param senders  of the bus: those that are cleared lose their places there
  OperatorSocket(const Plan& plan, const Identity& identity, Output& output, SenderTable& senders);
  ~OperatorSocket();
  OperatorSocket(const OperatorSocket&) = delete;
  OperatorSocket& operator=(const OperatorSocket&) = delete;

  /// Listens at the path; where a daemon died a socket is left behind, which is replaced. Empty, or why not
  /// (for a person).
  std::string open(const std::string& path);
  /// Handles what comes within this time, or sleeps so long.
  void serve(std::chrono::milliseconds time);

 private:
  /// A command, as its answer names it.
  struct Asked {
    std::array<char, kSenderSize> sender;
    std::int64_t sequence;
    bool operator==(const Asked&) const = default;
  };
  static constexpr std::size_t kMostAsked = 1024;  // four times as many as the loop lets wait
  struct Connection {
    int fd = -1;
    std::int64_t last_sequence = 0;
    std::deque<Asked> asked;  // what the loop has of it, the latest kMostAsked
    std::deque<std::vector<std::byte>> outbox;
  };
  void accept_one();
  bool read_one(Connection& connection);  // false: it has gone
  void take(Connection& connection, std::span<const std::byte> bytes, std::int64_t received_ns);
  bool flush(Connection& connection);  // false: it has gone
  void deliver_answers();
  Connection* find_asker(const Asked& asked);  // null: it has gone
  void put(Connection& connection, std::vector<std::byte> bytes);

  const Plan& plan_;
  const Identity& identity_;
  Output& output_;
  SenderTable& senders_;
  std::unique_ptr<io::NameTable> names_;
  std::unique_ptr<InboundEntry> entry_;
  std::vector<std::byte> buffer_;
  std::string path_;                 // "": nothing is open
  std::pair<dev_t, ino_t> place_{};  // what was bound there
  int fd_ = -1;
  std::vector<Connection> connections_;
};

}  // namespace freeflex::service
