// The socket on which messages arrive. The daemon opens one and reads nothing from it: its ingress does.
// Other programs have one in a BusConnection.
#pragma once

#include <sys/types.h>

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>

namespace freeflex::service {

/// A multicast socket for an LCM bus, whatever process reads it. Its queue outlives each of them.
class BusSocket {
 public:
  BusSocket() = default;
  ~BusSocket();
  BusSocket(const BusSocket&) = delete;
  BusSocket& operator=(const BusSocket&) = delete;

  /// Binds the group's own address, so unicast packets do not arrive; joins the group and waits until a
  /// packet of its own has come back. With a prefix the kernel lets through from then on only its channels
  /// FORCE, CONTROL and STATUS: what else is on the bus takes no place in the queue. With an empty prefix it
  /// lets everything through. Empty, or why not (for a person).
  /// \pre check_lcm_url(url) and find_network_fault(url) are empty
  std::string open(const std::string& url, const std::string& prefix, std::chrono::milliseconds timeout);
  void close();

  int fd() const { return fd_; }
  /// [B] Queue that the kernel gave.
  int receive_buffer() const;
  /// [-] How full the queue is; beyond 1 packets are lost. (The kernel counts those that the filter refuses
  /// among those that it dropped, so its count tells nothing.)
  double fill() const;

 private:
  int fd_ = -1;
};

/// A packet taken out of a socket.
struct ReceivedPacket {
  ssize_t size = -1;             // [B]; -1: none
  std::int64_t received_ns = 0;  // CLOCK_BOOTTIME when the kernel took it in, not when it was read
  std::int64_t utime = 0;        // [us] wall clock at the same moment; 0: the kernel did not stamp it
};
/// Takes one packet out; waits as long as the socket's SO_RCVTIMEO says. Where the kernel did not stamp it
/// the time is now. One system call.  \param flags  of recvmsg
ReceivedPacket receive_packet(int fd, std::span<std::byte> buffer, int flags = 0) noexcept;

/// [ns] How often whoever reads the bus is woken at least.
inline constexpr std::chrono::milliseconds kReceiveWait{20};

}  // namespace freeflex::service
