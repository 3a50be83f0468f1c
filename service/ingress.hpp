// The processes that parse network packets, and the class with which the daemon controls them. The process
// that simulates never parses network packets.
#pragma once

#include <sys/types.h>

#include <array>
#include <cassert>
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

/// A program that is started as `PROGRAM --ingress SEAT BLOCK SETTINGS UID GID`, with the descriptors below,
/// runs as an ingress.
inline constexpr const char* kIngressOption = "--ingress";
inline constexpr int kBlockFd = 3, kSettingsFd = 4;
inline constexpr int kSocketFd = 5;  // socket of the bus
inline constexpr int kOrderFd = 6;   // the process begins to receive when this descriptor becomes readable

/// Exit status of an ingress that no signal ended.
enum class IngressEnd : int {
  kDaemonGone = 0,
  kBadBlock = 10,  // the shared memory could not be mapped
};

/// Waits until kOrderFd is readable, then receives into the block of shared memory. Returns when the daemon
/// has ended.
IngressEnd run_ingress(SharedBlock& block, const IngressSettings& settings, int seat);

/// The body of an ingress process. It is called after the process has been confined.
using IngressBody = IngressEnd (*)(SharedBlock& block, const IngressSettings& settings, int seat);
/// Runs this process as an ingress if argv asks for an ingress. The ingress receives until its daemon has
/// ended, and then this function returns the exit status. Returns nullopt for other arguments. Every program
/// that uses IngressProcess must call this function first in main. \param body  tests pass a hostile body
std::optional<int> run_if_ingress(int argc, char** argv, IngressBody body = run_ingress);

/// Returns an empty string if the prefix is valid as the first part of channel names, else the error.
std::string check_prefix(const std::string& prefix);

/// Owns the shared block, the socket and two processes. One process receives, and the other stands by. If the
/// receiving process ends or hangs, the standby continues with the same socket and block, and a new standby
/// is started. The system kills a process when the thread that started it ends, so the threads that call
/// start and poll must live until stop. Only one thread at a time may call a function of this object.
class IngressProcess {
 public:
  IngressProcess() = default;
  ~IngressProcess();
  IngressProcess(const IngressProcess&) = delete;
  IngressProcess& operator=(const IngressProcess&) = delete;

  struct Options {
    std::int64_t session = 0;
    std::string lcm_url;             // empty: LCM's default
    std::string channel_prefix;      // 1 to 32 of A-Z a-z 0-9 _ -
    std::string user;                // user that the processes run as; empty: see find_ingress_user
    bool are_keys_required = false;  // true: the ingress passes commands undecoded to the verifier
    std::chrono::milliseconds timeout{
        15000};  // longest wait for a packet on the bus, and then for the receiving process to be ready
  };
  /// Opens the socket, starts both processes and waits until the receiving process is ready. Returns an empty
  /// string, or the error for the user. After an error no process runs. Allocates about 10 MB of shared
  /// memory.
  std::string start(const Options& options, const io::NameTable& names);

  /// Supervises the processes, and must be called every few milliseconds. A process that was ready and has
  /// ended is replaced at once. A process that ended before it was ready is replaced after a pause, which
  /// doubles at each successive failure, from 5 ms up to 100 ms. Returns a log text about these events,
  /// usually empty.
  std::string poll();

  /// Ends the processes and closes the socket, but keeps the block.
  void stop();

  /// \pre start succeeded
  SharedBlock& block() {
    assert(block_ != nullptr);
    return *block_;
  }
  const BusSocket& socket() const { return socket_; }
  bool has_private_memory() const { return block_memory_ && block_memory_->is_private(); }
  /// Parts of the receiving process's confinement that failed (describe_lacks), and the user that it runs as.
  std::uint32_t lacks() const { return block_->seats[active_].lacks.load(); }
  const IngressUser& user() const { return user_; }
  /// Number of processes that were replaced, and how many of them hung.
  std::int64_t num_restarts() const { return num_restarts_; }
  std::int64_t num_hangs() const { return num_hangs_; }
  /// The ids of the receiving process and of the standby. An id is -1 if its process does not exist at the
  /// moment.
  pid_t pid() const { return workers_[active_].pid; }
  pid_t standby_pid() const { return workers_[1 - active_].pid; }
  /// Returns true if both processes are ready.
  bool is_complete() const { return is_ready(0) && is_ready(1); }

 private:
  using Clock = std::chrono::steady_clock;

  /// One of the two processes.
  struct Worker {
    pid_t pid = -1;
    int order_fd = -1;  // a write to this descriptor is the order to receive
    HangWatch watch;
    bool was_ready = false;
    std::string hang;  // how the process hung, empty if it was not killed for a hang
  };

  // number of failed starts in a row after which start() gives up
  static constexpr int kMostFailedStarts = 5;
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
  std::size_t active_ = 0;  // seat of the receiving process
  bool is_wanted_ = false;
  std::int64_t num_restarts_ = 0;
  std::int64_t num_hangs_ = 0;
  int num_failed_starts_ = 0;          // starts in a row that failed before the process was ready
  bool has_explained_filter_ = false;  // an earlier event explained the filter of system calls
  Clock::time_point spawn_at_{};
  std::chrono::milliseconds pause_{0};
};

}  // namespace freeflex::service
