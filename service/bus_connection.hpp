// A connection to the bus for programs that listen: freeflex view, monitor and push, and the client library.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "service/bus_socket.hpp"

namespace freeflex::service {

/// A message as it came: views of the connection's buffer, which the next receive() overwrites.
struct BusMessage {
  std::string_view channel;
  std::span<const std::byte> bytes;
  std::int64_t utime = 0;  // [us] since 1970, when the kernel took it in
};

/// Receives and sends without liblcm, whose receiver two crafted packets kill (in 1.3.1 to 1.5.2: a fragment
/// whose offset and size wrap 32 bits, and a fragment shorter than its header). It reads each packet with
/// read_lcm_packet, as the daemon's ingress does, and keeps nothing from one packet to the next. It drops
/// fragments, since every message of freeflex fits one datagram. One thread.
class BusConnection {
 public:
  BusConnection();

  /// Joins the bus. Empty, or why that fails, for a person.
  /// \pre check_lcm_url(url) and find_network_fault(url) are empty
  std::string open(const std::string& url, std::chrono::milliseconds timeout = kOpenTimeout);
  /// Returns the next message, or nothing when none came within the time. Packets that are no message use the
  /// time up and are counted.
  std::optional<BusMessage> receive(std::chrono::milliseconds time);
  /// Sends one message. False when the network does not take it, or it does not fit one datagram.
  bool publish(std::string_view channel, std::span<const std::byte> bytes);

  /// Packets that were no message: fragments, and what the reader refuses.
  std::int64_t num_ignored() const { return num_ignored_; }
  /// For poll; -1 before open().
  int fd() const { return socket_.fd(); }

  /// Time for a packet of its own to come back.
  static constexpr std::chrono::milliseconds kOpenTimeout{10'000};

 private:
  BusSocket socket_;
  std::vector<std::byte> buffer_;
  std::string url_;
  std::uint32_t sequence_ = 0;
  std::int64_t num_ignored_ = 0;
};

}  // namespace freeflex::service
