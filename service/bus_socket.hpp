// The socket on which messages arrive. The daemon opens one socket, and only the daemon's ingress reads from
// it. Other programs use a BusConnection, which contains a BusSocket.
#pragma once

#include <sys/types.h>

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>

namespace freeflex::service {

/// A multicast socket for an LCM bus. Several processes may read the socket one after another, because the
/// socket keeps its queue of packets when a process ends.
class BusSocket {
 public:
  BusSocket() = default;
  ~BusSocket();
  BusSocket(const BusSocket&) = delete;
  BusSocket& operator=(const BusSocket&) = delete;

  /// Binds the address of the multicast group, so unicast packets do not arrive. Joins the group, and sends
  /// test packets to the group until a packet arrives at the socket. If a prefix is given, the kernel then
  /// passes only the channels FORCE, CONTROL and STATUS of this prefix, so other messages do not fill the
  /// queue. If the prefix is empty, the kernel passes all channels. Returns an empty string, or the error for
  /// the user.
  /// \pre check_lcm_url(url) and find_network_fault(url) return an empty string
  std::string open(const std::string& url, const std::string& prefix, std::chrono::milliseconds timeout);
  void close();

  int fd() const { return fd_; }
  /// Returns the size of the queue that the kernel granted [B].
  int receive_buffer() const;
  /// Returns the filled fraction of the queue [-]. While the fraction is above 1, the kernel drops the
  /// packets that arrive. (The kernel's count of dropped packets is not used, because this count includes the
  /// packets that the filter refused.)
  double fill() const;

 private:
  int fd_ = -1;
};

/// A packet read from a socket.
struct ReceivedPacket {
  ssize_t size = -1;             // [B], -1 for no packet
  std::int64_t received_ns = 0;  // CLOCK_BOOTTIME at which the kernel received the packet
  std::int64_t utime = 0;        // [us] wall clock at the time of reception, 0 if the kernel gave no time
};
/// Waits for one packet, at most for the socket's SO_RCVTIMEO, and reads it with one recvmsg(). If the kernel
/// gave no time of reception, received_ns is the present time.  \param flags  of recvmsg
ReceivedPacket receive_packet(int fd, std::span<std::byte> buffer, int flags = 0) noexcept;

/// [ms] Longest time that a process waits for one packet of the bus.
inline constexpr std::chrono::milliseconds kReceiveWait{20};

}  // namespace freeflex::service
