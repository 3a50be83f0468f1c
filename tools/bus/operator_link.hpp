// The operator's socket of a daemon, as a tool sees it.
#pragma once

#include <chrono>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "service/io/wire/operator_address.hpp"

namespace freeflex::tools {

/// One connection. What the daemon sends is scene_t and ack_t, each message one packet. Not copyable, one
/// thread.
class OperatorLink {
 public:
  using Handler = std::function<void(std::span<const std::byte>)>;

  /// Connects to the first of the places at which a daemon listens.
  explicit OperatorLink(const service::OperatorPlaces& places);
  ~OperatorLink();
  OperatorLink(const OperatorLink&) = delete;
  OperatorLink& operator=(const OperatorLink&) = delete;

  /// Empty, or why there is no connection.
  const std::string& error() const { return error_; }
  /// Of the socket that it is connected to.
  const std::string& path() const { return path_; }
  bool send(std::span<const std::byte> bytes);
  /// Hands over messages until time runs out, the daemon closes or done() holds. False unless it holds.
  bool wait(std::chrono::milliseconds time, const std::function<bool()>& done, const Handler& handler);

 private:
  std::string path_;
  std::string error_;
  int fd_ = -1;
  std::vector<std::byte> buffer_;
};

}  // namespace freeflex::tools
