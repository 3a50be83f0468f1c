// The body of an ingress process.
#include "service/ingress.hpp"

#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <sys/socket.h>
#include <time.h>
#include <unistd.h>

#include <array>
#include <cstdlib>
#include <cstring>

#include "service/bus_socket.hpp"
#include "service/ingress_confinement.hpp"
#include "service/ingress_memory.hpp"
#include "service/packet_handler.hpp"

namespace freeflex::service {
namespace {

constexpr std::size_t kMaxPacket = 65536;  // [B] largest UDP packet
constexpr int kTurnsBetweenLooks = 64;     // iterations of the loop between checks that the parent still runs

bool is_daemon_gone(const IngressSettings& settings) { return getppid() != settings.daemon_pid; }

/// Ignores signals that are sent to the whole process group (Ctrl-C, a closing terminal, a service manager),
/// because the daemon handles these signals. Redirects the standard streams to /dev/null. The ingress must
/// not log, because packets could cause endless output, and a pipe that nobody reads would block the ingress.
/// The daemon logs the events of the ingress.
void leave_group_and_log() {
  for (const int number : {SIGINT, SIGTERM, SIGHUP}) signal(number, SIG_IGN);
  if (const int nowhere = open("/dev/null", O_RDWR | O_CLOEXEC); nowhere >= 0) {
    for (const int fd : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO}) dup2(nowhere, fd);
    close(nowhere);
  }
}

/// Makes every system call of the loop once before the first packet. If a preloaded library replaces one of
/// these calls by a forbidden call, the process ends here, where no packet can be the cause.
void try_allowed_calls() {
  pollfd order{kOrderFd, POLLIN, 0};
  poll(&order, 1, 0);
  getppid();
  std::byte nowhere{};
  receive_packet(kOrderFd, std::span(&nowhere, 1), MSG_DONTWAIT);  // this call fails, because kOrderFd is not
                                                                   // a socket
  timespec now{};
  clock_gettime(CLOCK_REALTIME, &now);
  // large enough that the allocator asks the system for memory
  constexpr std::size_t kSize = std::size_t{1} << 20;
  std::free(std::malloc(kSize));
}

}  // namespace

IngressEnd run_ingress(SharedBlock& block, const IngressSettings& settings, int seat) {
  static std::array<std::byte, kMaxPacket> buffer;
  PacketHandler packet_handler(block, settings);
  std::atomic<std::uint64_t>& beat = block.seats[index(seat)].beat;
  bool is_active = false;
  for (int turn = 0;; ++turn) {
    beat.fetch_add(1, std::memory_order_relaxed);
    if (turn % kTurnsBetweenLooks == 0 && is_daemon_gone(settings)) return IngressEnd::kDaemonGone;
    if (!is_active) {
      pollfd order{kOrderFd, POLLIN, 0};
      is_active = poll(&order, 1, static_cast<int>(kReceiveWait.count())) == 1;
      continue;
    }
    // the packet leaves the queue before it is parsed, so a packet that kills this process cannot kill its
    // successor
    const ReceivedPacket packet = receive_packet(kSocketFd, buffer);
    if (packet.size > 0)
      packet_handler.on_packet(std::span(buffer).first(index(packet.size)), packet.received_ns);
  }
}

std::optional<int> run_if_ingress(int argc, char** argv, IngressBody body) {
  if (argc != 7 || std::strcmp(argv[1], kIngressOption) != 0) return std::nullopt;
  const int seat = std::atoi(argv[2]) == 0 ? 0 : 1;
  leave_group_and_log();
  void* const memory = attach_memory(argv[3], sizeof(SharedBlock), true);
  // the settings are mapped read-only, so that a hostile packet cannot change the limits against which
  // packets are checked
  void* const settings = attach_memory(argv[4], sizeof(IngressSettings), false);
  if (memory == nullptr || settings == nullptr) return static_cast<int>(IngressEnd::kBadBlock);
  auto& block = *static_cast<SharedBlock*>(memory);
  block.seats[index(seat)].lacks.store(confine({std::atoll(argv[5]), std::atoll(argv[6])}));
  try_allowed_calls();
  return static_cast<int>(body(block, *static_cast<const IngressSettings*>(settings), seat));
}

}  // namespace freeflex::service
