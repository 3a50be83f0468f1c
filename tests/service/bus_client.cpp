#include "tests/service/bus_client.hpp"

#include <arpa/inet.h>
#include <errno.h>
#include <fcntl.h>
#include <netinet/in.h>
#include <poll.h>
#include <signal.h>
#include <spawn.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <thread>

#include "messages/channels.hpp"

namespace freeflex::testing {

namespace {

constexpr std::size_t kHeader = 8;               // [bytes] "LC02" and the sequence number
constexpr int kReceiveBuffer = 8 * 1024 * 1024;  // [bytes] requested size
constexpr int kRecorderPriority = 1;             // above ordinary programs, below the daemon

/// Returns whether the last 64 kB of a file contain a text.
bool contains(const std::string& path, const std::string& text) {
  constexpr std::streamoff kTail = 65536;
  std::ifstream file(path, std::ios::binary | std::ios::ate);
  file.seekg(std::max<std::streamoff>(0, file.tellg() - kTail));
  return std::string(std::istreambuf_iterator<char>(file), {}).find(text) != std::string::npos;
}

std::int64_t wall_us() {
  return std::chrono::duration_cast<std::chrono::microseconds>(
             std::chrono::system_clock::now().time_since_epoch())
      .count();
}

template <class Message>
bool decode_whole(std::span<const std::byte> payload, Message& message) {
  const int size = static_cast<int>(payload.size());
  return message.decode(payload.data(), 0, size) == size;
}

}  // namespace

BusClient::BusClient(std::string prefix, const char* group_address)
    : packets(group_address),
      prefix_(std::move(prefix)),
      fd_(socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0)),
      buffer_(70'000) {
  const int on = 1;
  setsockopt(fd_, SOL_SOCKET, SO_REUSEADDR, &on, sizeof on);
  setsockopt(fd_, SOL_SOCKET, SO_REUSEPORT, &on, sizeof on);
  // a process with CAP_NET_ADMIN may exceed the system's limit
  if (setsockopt(fd_, SOL_SOCKET, SO_RCVBUFFORCE, &kReceiveBuffer, sizeof kReceiveBuffer) != 0) {
    setsockopt(fd_, SOL_SOCKET, SO_RCVBUF, &kReceiveBuffer, sizeof kReceiveBuffer);
  }
  sockaddr_in here{};
  here.sin_family = AF_INET;
  here.sin_port = htons(7667);
  inet_pton(AF_INET, group_address, &here.sin_addr);
  bind(fd_, reinterpret_cast<const sockaddr*>(&here), sizeof here);
  ip_mreq group{};
  inet_pton(AF_INET, group_address, &group.imr_multiaddr);
  setsockopt(fd_, IPPROTO_IP, IP_ADD_MEMBERSHIP, &group, sizeof group);
}

BusClient::~BusClient() { close(fd_); }

bool BusClient::until(const std::function<bool()>& condition) {
  const auto deadline = std::chrono::steady_clock::now() + kPatience;
  while (!condition()) {
    if (std::chrono::steady_clock::now() > deadline) return false;
    receive(1);
  }
  return true;
}

void BusClient::receive(int timeout_ms) {
  pollfd readable{fd_, POLLIN, 0};
  if (poll(&readable, 1, timeout_ms) <= 0) return;
  for (;;) {
    const ssize_t size = recv(fd_, buffer_.data(), buffer_.size(), MSG_DONTWAIT);
    if (size < 0) return;
    const auto packet = std::span(buffer_).first(static_cast<std::size_t>(size));
    if (packet.size() <= kHeader || std::memcmp(packet.data(), "LC02", 4) != 0) continue;
    const auto* name = reinterpret_cast<const char*>(packet.data()) + kHeader;
    const std::size_t length = strnlen(name, packet.size() - kHeader);
    if (kHeader + length + 1 > packet.size()) continue;
    take(std::string(name, length), packet.subspan(kHeader + length + 1));
  }
}

void BusClient::take(const std::string& channel, std::span<const std::byte> payload) {
  if (!channel.starts_with(prefix_)) return;
  const std::string suffix = channel.substr(prefix_.size());
  ++num_messages[suffix];
  if (suffix == channels::kAck) {
    if (freeflex_msgs::ack_t ack; decode_whole(payload, ack)) acks.push_back(ack);
  } else if (suffix == channels::kApplied) {
    if (freeflex_msgs::applied_t entry; decode_whole(payload, entry)) applied.push_back(entry);
  } else if (suffix == channels::kState) {
    freeflex_msgs::state_t state;
    if (!decode_whole(payload, state)) return;
    if (state.applied_count > static_cast<std::int64_t>(applied.size())) ++num_early_states;
    states[state.tick] = state;
  } else if (suffix == channels::kStatus) {
    if (freeflex_msgs::status_t status; decode_whole(payload, status)) statuses.push_back(status);
  }
}

template <class Command>
void BusClient::publish(const char* suffix, const Command& command) {
  constexpr std::int64_t kValidity = 50'000'000;  // [us] long enough even if the machine stalls
  const std::string channel = prefix_ + suffix;
  packets.publish(channel, key ? seal(command, channel, *key, wall_us() + kValidity) : io::encode(command));
}

void BusClient::send(const ForceCommand& command) {
  publish(channels::kForce, io::to_message(command, session, wall_us()));
}

std::int64_t BusClient::send_control(std::int32_t command, std::int64_t count, const std::string& target) {
  freeflex_msgs::control_t control{};
  control.utime = wall_us();
  control.session = session;
  control.sender = "test";
  control.sequence = next_sequence++;
  control.command = command;
  control.count = count;
  control.target = target;
  publish(channels::kControl, control);
  return control.sequence;
}

freeflex_msgs::ack_t BusClient::answer(std::int64_t sequence) {
  freeflex_msgs::ack_t found{};
  found.reason = -1;
  until([&] {
    for (const auto& ack : acks) {
      if (ack.sender == "test" && ack.sequence == sequence) found = ack;
    }
    return found.reason != -1;
  });
  return found;
}

bool BusClient::meet() {
  statuses.clear();
  // a daemon in mode STARTING takes no commands and may still give way to another daemon
  const auto is_up = [this] {
    return !statuses.empty() && statuses.back().mode != freeflex_msgs::status_t::STARTING;
  };
  if (!until(is_up)) return false;
  session = statuses.back().session;
  return true;
}

Process::Process(const std::vector<std::string>& arguments, int priority) {
  log_ = (std::filesystem::temp_directory_path() / "freeflex-process-XXXXXX").string();
  const int fd = mkostemp(log_.data(), O_CLOEXEC);
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_adddup2(&actions, fd, STDOUT_FILENO);
  posix_spawn_file_actions_adddup2(&actions, fd, STDERR_FILENO);
  std::vector<char*> argv;
  for (const std::string& argument : arguments) argv.push_back(const_cast<char*>(argument.c_str()));
  argv.push_back(nullptr);
  posix_spawnattr_t attributes;
  posix_spawnattr_init(&attributes);
  const sched_param parameters{.sched_priority = priority};
  posix_spawnattr_setschedpolicy(&attributes, SCHED_FIFO);
  posix_spawnattr_setschedparam(&attributes, &parameters);
  posix_spawnattr_setflags(&attributes, priority > 0 ? POSIX_SPAWN_SETSCHEDULER : 0);
  int error = posix_spawnp(&pid_, argv[0], &actions, &attributes, argv.data(), environ);
  if (error == EPERM && priority > 0) {
    error = posix_spawnp(&pid_, argv[0], &actions, nullptr, argv.data(), environ);
  }
  if (error != 0) pid_ = -1;
  posix_spawnattr_destroy(&attributes);
  posix_spawn_file_actions_destroy(&actions);
  close(fd);
}

Process::~Process() {
  if (pid_ > 0) {
    kill(pid_, SIGKILL);
    waitpid(pid_, nullptr, 0);
  }
  unlink(log_.c_str());
}

void Process::signal(int number) const {
  if (pid_ > 0) kill(pid_, number);
}

int Process::wait() {
  const auto deadline = std::chrono::steady_clock::now() + kPatience;
  while (pid_ > 0 && std::chrono::steady_clock::now() < deadline) {
    int status = 0;
    if (waitpid(pid_, &status, WNOHANG) == pid_) {
      pid_ = -1;
      return WIFEXITED(status) ? WEXITSTATUS(status) : 1000 + WTERMSIG(status);
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(2));
  }
  return -1;
}

std::string Process::output() const {
  std::ostringstream text;
  text << std::ifstream(log_).rdbuf();
  return text.str();
}

/// Returns the URL of LCM's default bus with a socket buffer of 4 MB, or the kernel's limit if that is less.
static std::string recording_url() {
  std::int64_t size = 4 * 1024 * 1024;
  std::int64_t most = 0;  // [bytes] stays 0 if the file is missing, as in some network namespaces
  if (std::ifstream("/proc/sys/net/core/rmem_max") >> most) size = std::min(size, most);
  return "udpm://239.255.76.67:7667?ttl=0&recv_buf_size=" + std::to_string(size);
}

/// Sends messages on a channel until a condition holds. Returns false if it does not hold in time.
template <class Condition>
static bool send_until(const std::string& channel, const Condition& holds) {
  PacketSender packets;
  const auto deadline = std::chrono::steady_clock::now() + kPatience;
  while (std::chrono::steady_clock::now() < deadline) {
    packets.publish(channel, std::array<std::byte, 1>{});
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
    if (holds()) return true;
  }
  return false;
}

Recorder::Recorder(const std::string& prefix, const std::string& log)
    : last_channel_(prefix + "_LAST"),
      log_(log),
      logger_({"lcm-logger", "-q", "-f", "-c", prefix + "_.*", "--lcm-url", recording_url(), log},
              kRecorderPriority) {
  // lcm-logger does not report that it is ready
  send_until(prefix + "_PROBE", [&log] {
    std::error_code none;
    const auto size = std::filesystem::file_size(log, none);
    return !none && size > 0;
  });
}

std::string Recorder::stop() {
  // lcm-logger drops what waits in its socket when it ends
  const bool is_drained = send_until(last_channel_, [this] { return contains(log_, last_channel_); });
  logger_.signal(SIGINT);
  const int status = logger_.wait();
  if (!is_drained) return "lcm-logger did not write the last message";
  return status == 0 ? "" : "lcm-logger ended with " + std::to_string(status) + ": " + logger_.output();
}

std::string program(const std::string& name) { return std::string(FREEFLEX_BIN_DIR) + "/" + name; }
std::string scene_path(const std::string& name) {
  return std::string(FREEFLEX_SOURCE_DIR) + "/service/scenes/" + name;
}

}  // namespace freeflex::testing
