// The processes that parse what comes over the network, and the daemon's hold on them. Nothing that simulates
// parses the network.
#pragma once

#include <sys/types.h>

#include <array>
#include <chrono>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>

#include "service/bus_socket.hpp"
#include "service/hang_watch.hpp"
#include "service/ingress_confinement.hpp"
#include "service/ingress_memory.hpp"
#include "service/shared.hpp"

namespace freeflex::service {

/// `PROGRAM --ingress SEAT BLOCK SETTINGS UID GID`, with these descriptors, is an ingress.
inline constexpr const char* kIngressOption = "--ingress";
inline constexpr int kBlockFd = 3, kSettingsFd = 4;
inline constexpr int kSocketFd = 5;  // the bus
inline constexpr int kOrderFd = 6;   // readable: receive

/// Why an ingress ended by itself (its exit status).
enum class IngressEnd : int {
  kDaemonGone = 0,
  kBadBlock = 10,  // the shared memory could not be mapped
};

/// Stands by until kOrderFd is readable, then receives into the block until the daemon is gone. Blocks.
IngressEnd run_ingress(SharedBlock& block, const IngressSettings& settings, int seat);

/// What an ingress does with its memory, confined already.
using IngressBody = IngressEnd (*)(SharedBlock& block, const IngressSettings& settings, int seat);
/// When argv says so this process is an ingress: receives until its daemon is gone and returns the exit
/// status. Else empty. To be called first in main of every program that uses IngressProcess.
/// \param body  tests have one that is hostile
std::optional<int> run_if_ingress(int argc, char** argv, IngressBody body = run_ingress);

/// Empty when prefix can be the first part of channel names, else what is allowed.
std::string check_prefix(const std::string& prefix);

/// Owns the shared block, the socket and two processes: one receives, one stands by. When the first ends or
/// hangs the second goes on with the same socket and block, and another is started to stand by. They are
/// killed when the thread that started them ends: start and poll belong to threads that live until stop. One
/// thread at a time.
class IngressProcess {
 public:
  IngressProcess() = default;
  ~IngressProcess();
  IngressProcess(const IngressProcess&) = delete;
  IngressProcess& operator=(const IngressProcess&) = delete;

  struct Options {
    std::int64_t session = 0;
    std::string lcm_url;             // "": LCM's default
    std::string channel_prefix;      // 1 to 32 of A-Z a-z 0-9 _ -
    std::string user;                // whose rights it has; "": find_ingress_user
    bool are_keys_required = false;  // commands are handed over as bytes
    std::chrono::milliseconds timeout{
        15000};  // for a packet to come back from the bus, and for the processes
  };
  /// Opens the socket, starts both processes and waits until one receives. Returns an empty string, or why it
  /// does not (for a person); then nothing runs. Allocates about 10 MB of shared memory.
  std::string start(const Options& options, const io::NameTable& names);

  /// Looks after the processes: call it every few milliseconds. One that has ended is replaced at once, one
  /// that ends before it is ready after a pause that doubles from 5 ms to 100 ms. Returns what happened,
  /// usually nothing.
  std::string poll();

  /// Ends the processes and closes the socket; the block stays.
  void stop();

  /// \pre start succeeded
  SharedBlock& block() { return *block_; }
  const BusSocket& socket() const { return socket_; }
  bool has_private_memory() const { return block_memory_ && block_memory_->is_private(); }
  /// What the one that receives says that it could not give up (describe_lacks), and whose rights it has.
  std::uint32_t lacks() const { return block_->seats[active_].lacks.load(); }
  const IngressUser& user() const { return user_; }
  /// Processes that were replaced, and those of them that hung.
  std::int64_t num_restarts() const { return num_restarts_; }
  std::int64_t num_hangs() const { return num_hangs_; }
  /// Of the one that receives, of the one that stands by; -1 when there is none just now.
  pid_t pid() const { return workers_[active_].pid; }
  pid_t standby_pid() const { return workers_[1 - active_].pid; }
  /// Both are ready.
  bool is_complete() const { return is_ready(0) && is_ready(1); }

 private:
  using Clock = std::chrono::steady_clock;

  /// A process at its seat.
  struct Worker {
    pid_t pid = -1;
    int order_fd = -1;  // tells it to receive
    HangWatch watch;
    bool was_ready = false;
    std::string hang;  // in what way it hung, when that is why it was killed
  };

  static constexpr int kMostFailedStarts = 5;  // in a row, when start() gives up
  std::string make_memory(const Options& options, const io::NameTable& names);
  std::string spawn(std::size_t seat);
  std::string spawn_missing();
  std::string wait_until_ready(std::chrono::milliseconds timeout);
  bool is_ready(std::size_t seat) const;
  void look_for_hang(std::size_t seat);
  std::string reap(std::size_t seat);
  void promote(std::size_t seat);
  void forget(Worker& worker);

  std::unique_ptr<SharedMemory> block_memory_, settings_memory_;
  SharedBlock* block_ = nullptr;
  BusSocket socket_;
  IngressUser user_;
  std::array<Worker, 2> workers_;
  std::size_t active_ = 0;  // seat of the one that receives
  bool is_wanted_ = false;
  std::int64_t num_restarts_ = 0;
  std::int64_t num_hangs_ = 0;
  int num_failed_starts_ = 0;          // processes that ended before they were ready, since one was
  bool has_explained_filter_ = false;  // in an event
  Clock::time_point spawn_at_{};
  std::chrono::milliseconds pause_{0};
};

}  // namespace freeflex::service
