#include "service/ingress.hpp"

#include <fcntl.h>
#include <lcm/lcm.h>
#include <signal.h>
#include <stdlib.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/shm.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstring>

#include "messages/channels.hpp"
#include "service/ingress_inlet.hpp"

namespace freeflex::service {
namespace {

constexpr int kReceiveBuffer = 4 * 1024 * 1024;               // [B] 430 commands of the largest size
constexpr std::int64_t kMaxGrowth = std::int64_t{128} << 20;  // [B] above what it had when ready
constexpr int kLookMillis = 200;  // [ms] longest wait between looks at parent and memory

/// One subscription: where its messages go.
struct Subscription {
  Inlet* inlet;
  void (Inlet::*deliver)(std::span<const std::byte>) noexcept;
  std::string channel;
};

/// liblcm calls this from lcm_handle_timeout; an exception must not pass through C.
void on_message(const lcm_recv_buf_t* buffer, const char* channel, void* user) noexcept {
  const auto& subscription = *static_cast<const Subscription*>(user);
  if (subscription.channel != channel) return;  // a subscription is a regular expression
  // a packet shorter than the channel name that liblcm read out of old bytes makes the size wrap to
  // about 2^32; of anything above the limit the codec looks at no byte
  const std::size_t size = std::min<std::size_t>(buffer->data_size, channels::kMaxMessageBytes + 1);
  const auto* first = static_cast<const std::byte*>(buffer->data);
  (subscription.inlet->*subscription.deliver)({first, size});
}

/// The URL with a request for a receive buffer, no larger than the kernel gives (liblcm prints a warning
/// else).
std::string with_receive_buffer(const std::string& url) {
  if (url.find("recv_buf_size") != std::string::npos) return url;
  int size = kReceiveBuffer;
  if (std::FILE* file = std::fopen("/proc/sys/net/core/rmem_max", "r"); file != nullptr) {
    int most = 0;
    if (std::fscanf(file, "%d", &most) == 1 && most > 0) size = std::min(size, most);
    std::fclose(file);
  }
  return url + (url.find('?') == std::string::npos ? "?" : "&") + "recv_buf_size=" + std::to_string(size);
}

/// [B] Receive buffer of liblcm's socket, which it does not name: the largest of this process's UDP sockets.
int find_receive_buffer() {
  constexpr int kLargestDescriptor = 64;  // this process opens about ten
  int largest = 0;
  for (int fd = 0; fd < kLargestDescriptor; ++fd) {
    int type = 0;
    int size = 0;
    socklen_t length = sizeof(type);
    if (getsockopt(fd, SOL_SOCKET, SO_TYPE, &type, &length) != 0 || type != SOCK_DGRAM) continue;
    length = sizeof(size);
    if (getsockopt(fd, SOL_SOCKET, SO_RCVBUF, &size, &length) == 0) largest = std::max(largest, size);
  }
  return largest / 2;  // the kernel reports twice what it was asked for
}

/// [B] Resident memory that is not shared; 0 when /proc says nothing.
std::int64_t private_memory() {
  long total = 0;
  long resident = 0;
  long shared = 0;
  if (std::FILE* file = std::fopen("/proc/self/statm", "r"); file != nullptr) {
    if (std::fscanf(file, "%ld %ld %ld", &total, &resident, &shared) != 3) resident = shared = 0;
    std::fclose(file);
  }
  return static_cast<std::int64_t>(resident - shared) * sysconf(_SC_PAGESIZE);
}

bool is_daemon_gone(const SharedBlock& block) { return getppid() != block.settings.daemon_pid; }

/// Dies with the daemon and not before: a signal to the whole group (Ctrl-C, a terminal that closes, a
/// service manager) is the daemon's to answer. Leaves no core file behind a hostile packet. Writes to no log:
/// what liblcm says can be provoked without end, a pipe that nobody reads would hold it for ever, and the
/// daemon says in its own words what counts.
void prepare_process() {
  prctl(PR_SET_PDEATHSIG, SIGKILL);
  for (const int number : {SIGINT, SIGTERM, SIGHUP}) signal(number, SIG_IGN);
  const rlimit none{0, 0};
  setrlimit(RLIMIT_CORE, &none);
  if (const int nowhere = open("/dev/null", O_RDWR | O_CLOEXEC); nowhere >= 0) {
    for (const int fd : {STDOUT_FILENO, STDERR_FILENO}) dup2(nowhere, fd);
    close(nowhere);
  }
}

IngressEnd receive(lcm_t* lcm, const SharedBlock& block) {
  using Clock = std::chrono::steady_clock;
  const std::int64_t memory_at_start = private_memory();
  Clock::time_point next_look = Clock::now();
  while (true) {
    if (lcm_handle_timeout(lcm, kLookMillis) < 0) return IngressEnd::kReceiveFailed;
    if (Clock::now() < next_look) continue;
    next_look = Clock::now() + std::chrono::milliseconds(kLookMillis);
    if (is_daemon_gone(block)) return IngressEnd::kDaemonGone;
    if (private_memory() - memory_at_start > kMaxGrowth) return IngressEnd::kGrown;
  }
}

}  // namespace

IngressEnd run_ingress(SharedBlock& block) {
  prepare_process();
  if (is_daemon_gone(block)) return IngressEnd::kDaemonGone;
  lcm_t* lcm = lcm_create(with_receive_buffer(block.settings.lcm_url.data()).c_str());
  if (lcm == nullptr) return IngressEnd::kNoRoute;
  Inlet inlet(block);
  const std::string prefix = block.settings.channel_prefix.data();
  std::array<Subscription, 3> subscriptions{{{&inlet, &Inlet::on_force, prefix + channels::kForce},
                                             {&inlet, &Inlet::on_control, prefix + channels::kControl},
                                             {&inlet, &Inlet::on_status, prefix + channels::kStatus}}};
  for (Subscription& subscription : subscriptions) {
    lcm_subscription_t* handle = lcm_subscribe(lcm, subscription.channel.c_str(), on_message, &subscription);
    if (handle == nullptr) return IngressEnd::kNoRoute;
    // no limit: liblcm drops the newest without a word, our ring answers
    lcm_subscription_set_queue_capacity(handle, 0);
  }
  block.receive_buffer.store(find_receive_buffer());
  block.is_ready.store(1);
  return receive(lcm, block);
}

std::optional<int> run_if_ingress(int argc, char** argv, IngressEnd (*body)(SharedBlock&)) {
  if (argc != 3 || std::strcmp(argv[1], "--ingress-block") != 0) return std::nullopt;
  void* memory = shmat(std::atoi(argv[2]), nullptr, 0);
  // what hostile bytes can overwrite here must not be what they are checked against
  if (memory == kNotAttached || mprotect(memory, SharedBlock::kSettingsSize, PROT_READ) != 0) {
    return static_cast<int>(IngressEnd::kBadBlock);
  }
  return static_cast<int>(body(*static_cast<SharedBlock*>(memory)));
}

}  // namespace freeflex::service
