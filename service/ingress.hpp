// The process that owns liblcm's receiving side, and the daemon's hold on it. liblcm's reader thread can be
// killed by two UDP packets, so nothing that simulates may receive.
#pragma once

#include <sys/types.h>

#include <chrono>
#include <cstdint>
#include <optional>
#include <string>

#include "service/shared.hpp"

namespace freeflex::service {

/// What shmat returns when it fails.
inline void* const kNotAttached = reinterpret_cast<void*>(-1);

/// Why an ingress ended by itself (its exit status).
enum class IngressEnd : int {
  kDaemonGone = 0,
  kBadBlock = 10,       // the shared block could not be mapped
  kNoRoute = 11,        // lcm_create or lcm_subscribe failed
  kReceiveFailed = 12,  // lcm_handle_timeout failed
  kGrown = 13,          // memory grew by 128 MB: liblcm keeps every channel name it has seen for ever
};

/// Receives into the block until the daemon is gone or liblcm fails. Blocks.
IngressEnd run_ingress(SharedBlock& block);

/// When argv is `PROGRAM --ingress-block ID` this process is an ingress: receives until its daemon is gone
/// and returns the exit status. Else empty. To be called first in main of every program that uses
/// IngressProcess.  \param body  what it does with the block; tests have one that is hostile
std::optional<int> run_if_ingress(int argc, char** argv, IngressEnd (*body)(SharedBlock&) = run_ingress);

/// Empty when prefix can be the first part of channel names, else what is allowed.
std::string check_prefix(const std::string& prefix);

/// Owns the shared block and keeps an ingress process alive. The ingress is killed when the thread that
/// started it ends: start and poll belong to threads that live until stop. One thread at a time.
class IngressProcess {
 public:
  IngressProcess() = default;
  ~IngressProcess();
  IngressProcess(const IngressProcess&) = delete;
  IngressProcess& operator=(const IngressProcess&) = delete;

  struct Options {
    std::int64_t session = 0;
    std::string lcm_url;                       // "": LCM's default
    std::string channel_prefix;                // 1 to 32 of A-Z a-z 0-9 _ -
    bool are_keys_required = false;            // commands are handed over as bytes
    std::chrono::milliseconds timeout{15000};  // liblcm tests itself for up to 10 s
  };
  /// Starts the ingress and waits until it is subscribed. Returns an empty string, or why it is not (for a
  /// person); then nothing runs. Allocates about 10 MB of shared memory.
  std::string start(const Options& options, const io::NameTable& names);

  /// Looks after the process: call it every few milliseconds. Restarts one that has ended, at once after a
  /// life of a second, else after a pause that doubles from 5 ms to 100 ms. Returns what happened, usually
  /// nothing.
  std::string poll();

  /// Ends the ingress; the block stays.
  void stop();

  /// \pre start succeeded
  SharedBlock& block() { return *block_; }
  std::int64_t num_restarts() const { return num_restarts_; }
  /// -1 when none runs just now.
  pid_t pid() const { return pid_; }

 private:
  using Clock = std::chrono::steady_clock;

  std::string make_block(const Options& options, const io::NameTable& names);
  std::string spawn();
  std::string wait_until_ready(std::chrono::milliseconds timeout);
  bool reap(int& status);

  SharedBlock* block_ = nullptr;
  int block_id_ = -1;  // of its System V segment
  pid_t pid_ = -1;
  bool is_wanted_ = false;
  std::int64_t num_restarts_ = 0;
  Clock::time_point started_{};
  Clock::time_point restart_at_{};
  std::chrono::milliseconds pause_{0};
};

}  // namespace freeflex::service
