// Connects the tools to the operator's socket of a daemon.
#pragma once

#include <chrono>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "service/io/wire/operator_address.hpp"

namespace freeflex::tools {

/// One connection, over which the daemon sends scene_t and ack_t, each message in one packet. The connection
/// cannot be copied, and only one thread may use it.
class OperatorLink {
 public:
  using Handler = std::function<void(std::span<const std::byte>)>;

  /// Connects to the first path in the list at which a daemon listens.
  explicit OperatorLink(const service::OperatorPlaces& places);
  ~OperatorLink();
  OperatorLink(const OperatorLink&) = delete;
  OperatorLink& operator=(const OperatorLink&) = delete;

  /// Returns the reason why there is no connection, or an empty text if there is no error.
  const std::string& error() const { return error_; }
  /// Returns the path of the connected socket.
  const std::string& path() const { return path_; }
  bool send(std::span<const std::byte> bytes);
  /// Passes messages to the handler until done() is true. Returns false if, before that, the time runs out or
  /// the daemon closes the connection.
  bool wait(std::chrono::milliseconds time, const std::function<bool()>& done, const Handler& handler);

 private:
  std::string path_;
  std::string error_;
  int fd_ = -1;
  std::vector<std::byte> buffer_;
};

}  // namespace freeflex::tools
