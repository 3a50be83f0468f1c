#include "service/bus_socket.hpp"

#include <arpa/inet.h>
#include <linux/filter.h>
#include <linux/sock_diag.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <time.h>
#include <unistd.h>

#include <algorithm>
#include <cassert>
#include <cerrno>
#include <cstring>
#include <string_view>
#include <vector>

#include "messages/channels.hpp"
#include "service/clock.hpp"
#include "service/descriptors.hpp"
#include "service/io/wire/lcm_packet.hpp"
#include "service/io/wire/lcm_url.hpp"

namespace freeflex::service {

namespace {

constexpr int kReceiveBuffer = 4 * 1024 * 1024;  // [B] room for 430 commands of the largest size
constexpr int kProbeMillis = 100;                // [ms] time between test packets
// liblcm tests itself with this packet, and every program on the bus ignores the packet
constexpr std::string_view kProbe{"LC02\0\0\0\0LCM_SELF_TEST\0", 22};

constexpr const char* kCannotReceive = "the process cannot receive from the bus";

/// Classic BPF program that passes a packet if it is a short message on FORCE, STATUS or CONTROL of the
/// prefix, or the first fragment of a longer message on FORCE or CONTROL. Offsets count from the start of the
/// UDP header. If the program loads a byte beyond the end of a packet, the kernel drops the packet.
class ChannelFilter {
 public:
  explicit ChannelFilter(const std::string& prefix) {
    add(kShortMark, kShortHeader, prefix, {channels::kForce, channels::kStatus, channels::kControl});
    add(kFragmentMark, kFragmentHeader, prefix, {channels::kForce, channels::kControl});
    put(BPF_STMT(BPF_RET | BPF_K, 0));
  }
  bool attach(int fd) {
    const sock_fprog program{static_cast<unsigned short>(code_.size()), code_.data()};
    const int on = 1;
    return setsockopt(fd, SOL_SOCKET, SO_ATTACH_FILTER, &program, sizeof program) == 0 &&
           setsockopt(fd, SOL_SOCKET, SO_LOCK_FILTER, &on, sizeof on) == 0;
  }

 private:
  static constexpr std::uint32_t kUdpHeader = 8;  // [B]
  static constexpr std::uint32_t kAll = 0xFFFFFFFF;

  void put(sock_filter instruction) { code_.push_back(instruction); }

  /// Adds instructions that compare the bytes at the offset with the text and jump at the first difference.
  /// The target of these jumps is not known yet, so their places are appended to `open`.
  void match(std::string_view text, std::size_t offset, std::vector<std::size_t>& open) {
    for (std::size_t i = 0; i < text.size(); ++i) {
      put(BPF_STMT(BPF_LD | BPF_B | BPF_ABS, kUdpHeader + static_cast<std::uint32_t>(offset + i)));
      open.push_back(code_.size());
      put(BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, static_cast<std::uint8_t>(text[i]), 0, 0));
    }
  }
  /// Makes the instruction that is added next the target of the jumps in `open`.
  void close(std::vector<std::size_t>& open) {
    for (const std::size_t at : open) code_[at].jf = static_cast<std::uint8_t>(code_.size() - at - 1);
    open.clear();
  }
  void add(std::string_view mark, std::size_t header, const std::string& prefix,
           std::initializer_list<const char*> suffixes) {
    std::vector<std::size_t> other_kind, other_suffix;
    match(mark, 0, other_kind);
    match(prefix, header, other_kind);
    for (const char* suffix : suffixes) {
      // the NUL is compared too, so that a channel with a longer name does not match
      match({suffix, std::strlen(suffix) + 1}, header + prefix.size(), other_suffix);
      put(BPF_STMT(BPF_RET | BPF_K, kAll));
      close(other_suffix);
    }
    close(other_kind);
  }

  std::vector<sock_filter> code_;
};

/// Sends test packets to the group until any packet arrives at the socket. The packet that arrived stays in
/// the queue. Returns an empty string, or the error.
std::string test_reception(int fd, const LcmAddress& address, std::chrono::milliseconds timeout) {
  sockaddr_in group{};
  group.sin_family = AF_INET;
  group.sin_port = htons(address.port);
  group.sin_addr.s_addr = address.group;
  // a TTL of 0 keeps the test packets on this machine
  const unsigned char ttl = 0;
  setsockopt(fd, IPPROTO_IP, IP_MULTICAST_TTL, &ttl, sizeof ttl);
  const auto deadline = std::chrono::steady_clock::now() + timeout;
  while (std::chrono::steady_clock::now() < deadline) {
    sendto(fd, kProbe.data(), kProbe.size(), 0, reinterpret_cast<const sockaddr*>(&group), sizeof group);
    pollfd readable{fd, POLLIN, 0};
    if (poll(&readable, 1, kProbeMillis) == 1) return {};
  }
  return "a packet to the bus did not come back in " + std::to_string(timeout.count()) +
         " ms, because something between this process and the group's address (a packet filter perhaps) "
         "drops packets; check the packet filter";
}

}  // namespace

BusSocket::~BusSocket() { close(); }

void BusSocket::close() {
  if (fd_ >= 0) ::close(fd_);
  fd_ = -1;
}

std::string BusSocket::open(const std::string& url, const std::string& prefix,
                            std::chrono::milliseconds timeout) {
  assert(check_lcm_url(url).empty());
  close();
  const LcmAddress address = read_lcm_url(url);
  fd_ = move_up(socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0));
  if (fd_ < 0) return call_fault(kCannotReceive, "socket");
  const int on = 1;
  setsockopt(fd_, SOL_SOCKET, SO_REUSEADDR, &on, sizeof on);
  setsockopt(fd_, SOL_SOCKET, SO_REUSEPORT, &on, sizeof on);
  setsockopt(fd_, SOL_SOCKET, SO_TIMESTAMPNS, &on, sizeof on);
  const timeval wait{0, std::chrono::microseconds(kReceiveWait).count()};
  setsockopt(fd_, SOL_SOCKET, SO_RCVTIMEO, &wait, sizeof wait);
  // SO_RCVBUFFORCE can exceed the system's limit, but only a process with CAP_NET_ADMIN may use it
  const int size = address.receive_buffer > 0 ? address.receive_buffer : kReceiveBuffer;
  if (setsockopt(fd_, SOL_SOCKET, SO_RCVBUFFORCE, &size, sizeof size) != 0)
    setsockopt(fd_, SOL_SOCKET, SO_RCVBUF, &size, sizeof size);
  sockaddr_in here{};
  here.sin_family = AF_INET;
  here.sin_port = htons(address.port);
  here.sin_addr.s_addr = address.group;
  if (bind(fd_, reinterpret_cast<const sockaddr*>(&here), sizeof here) != 0)
    return call_fault(kCannotReceive, "bind");
  ip_mreq membership{};
  membership.imr_multiaddr.s_addr = address.group;
  if (setsockopt(fd_, IPPROTO_IP, IP_ADD_MEMBERSHIP, &membership, sizeof membership) != 0)
    return call_fault(kCannotReceive, "IP_ADD_MEMBERSHIP");
  if (std::string fault = test_reception(fd_, address, timeout); !fault.empty()) return fault;
  // if the kernel refuses the filter, only performance is lost
  if (!prefix.empty()) ChannelFilter(prefix).attach(fd_);
  return {};
}

int BusSocket::receive_buffer() const {
  int size = 0;
  socklen_t length = sizeof size;
  if (getsockopt(fd_, SOL_SOCKET, SO_RCVBUF, &size, &length) != 0) return 0;
  return size / 2;  // the kernel reports twice the requested size
}

double BusSocket::fill() const {
  std::uint32_t values[SK_MEMINFO_VARS] = {};
  socklen_t length = sizeof values;
  if (getsockopt(fd_, SOL_SOCKET, SO_MEMINFO, values, &length) != 0 || values[SK_MEMINFO_RCVBUF] == 0)
    return 0.0;
  return static_cast<double>(values[SK_MEMINFO_RMEM_ALLOC]) / values[SK_MEMINFO_RCVBUF];
}

ReceivedPacket receive_packet(int fd, std::span<std::byte> buffer, int flags) noexcept {
  iovec into{buffer.data(), buffer.size()};
  alignas(cmsghdr) char control[CMSG_SPACE(sizeof(timespec))];
  msghdr message{};
  message.msg_iov = &into;
  message.msg_iovlen = 1;
  message.msg_control = control;
  message.msg_controllen = sizeof control;
  ReceivedPacket packet{recvmsg(fd, &message, flags), boot_ns()};
  if (packet.size < 0) return packet;
  const cmsghdr* const stamp = CMSG_FIRSTHDR(&message);
  if (stamp == nullptr || stamp->cmsg_level != SOL_SOCKET || stamp->cmsg_type != SCM_TIMESTAMPNS)
    return packet;
  // the stamp is wall-clock time, and that clock may be set at any time, so received_ns uses only the age of
  // the packet
  timespec came{};
  timespec now{};
  std::memcpy(&came, CMSG_DATA(stamp), sizeof came);
  clock_gettime(CLOCK_REALTIME, &now);
  packet.utime = came.tv_sec * 1'000'000 + came.tv_nsec / 1000;
  const std::int64_t age_ns = (now.tv_sec - came.tv_sec) * 1'000'000'000 + (now.tv_nsec - came.tv_nsec);
  packet.received_ns -= std::clamp<std::int64_t>(age_ns, 0, packet.received_ns);
  return packet;
}

}  // namespace freeflex::service
