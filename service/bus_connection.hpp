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

/// Views of a received message in the connection's buffer. The next receive() overwrites the buffer.
struct BusMessage {
  std::string_view channel;
  std::span<const std::byte> bytes;
  std::int64_t utime = 0;  // [us] since 1970: time at which the kernel received the message
};

/// Receives and sends without liblcm. The receiver of liblcm 1.3.1 to 1.5.2 crashes on two kinds of crafted
/// packets: a fragment whose offset plus size overflows 32 bits, and a fragment shorter than its header.
/// Reads each packet with read_lcm_packet, as the daemon's ingress does, and keeps no state between packets.
/// Drops fragments, since every message of freeflex fits one datagram. Used by one thread.
class BusConnection {
 public:
  BusConnection();

  /// Joins the bus. Returns an empty string, or the error for the user.
  /// \pre check_lcm_url(url) and find_network_fault(url) return an empty string
  std::string open(const std::string& url, std::chrono::milliseconds timeout = kOpenTimeout);
  /// Returns the next message, or nullopt if none arrives within `time` or a signal ends the wait. A packet
  /// that is not a message counts in num_ignored() and does not prolong the wait.
  std::optional<BusMessage> receive(std::chrono::milliseconds time);
  /// Sends one message. Returns false if the network refuses the message, or if the message does not fit one
  /// datagram.
  bool publish(std::string_view channel, std::span<const std::byte> bytes);

  /// Number of packets that were not messages: fragments, and packets that read_lcm_packet refused.
  std::int64_t num_ignored() const { return num_ignored_; }
  /// The descriptor for poll(), or -1 before open().
  int fd() const { return socket_.fd(); }

  /// Time within which a packet must arrive after open() has begun to send test packets to the bus.
  static constexpr std::chrono::milliseconds kOpenTimeout{10'000};

 private:
  BusSocket socket_;
  std::vector<std::byte> buffer_;
  std::string url_;
  std::uint32_t sequence_ = 0;
  std::int64_t num_ignored_ = 0;
};

}  // namespace freeflex::service
