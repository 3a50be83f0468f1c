// This file defines a bus client that does not use liblcm's receiver, and classes for programs that run as
// child processes. The client reads unfragmented LCM messages from a plain socket, so packets that kill
// liblcm do not harm it.
#pragma once

#include <sys/types.h>

#include <chrono>
#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "freeflex_msgs/ack_t.hpp"
#include "freeflex_msgs/applied_t.hpp"
#include "freeflex_msgs/control_t.hpp"
#include "freeflex_msgs/state_t.hpp"
#include "freeflex_msgs/status_t.hpp"
#include "messages/seal.hpp"
#include "service/io/wire/codec.hpp"
#include "tests/support/lcm_packets.hpp"

namespace freeflex::testing {

/// A time far longer than any test needs, so that a wait ends without result only if a program hangs.
inline constexpr std::chrono::seconds kPatience{60};

/// Sends commands to one prefix and stores all messages of the daemon.
class BusClient {
 public:
  explicit BusClient(std::string prefix, const char* group = "239.255.76.67");
  ~BusClient();
  BusClient(const BusClient&) = delete;
  BusClient& operator=(const BusClient&) = delete;

  /// Reads messages until the condition is true. Returns false if the condition stays false for kPatience.
  bool until(const std::function<bool()>& condition);
  /// Reads the messages that have arrived.
  void read() { receive(0); }

  void send(const ForceCommand& command);
  std::int64_t send_control(std::int32_t command, std::int64_t count = 0, const std::string& target = "");
  /// Waits for the answer to this sequence number and returns it. The reason is -1 if no answer came.
  freeflex_msgs::ack_t answer(std::int64_t sequence);
  /// Waits for a STATUS with a mode other than STARTING and stores its session. Returns false if none came.
  bool meet();

  std::optional<SealingKey> key;  // if given, seals the commands that this client sends
  std::int64_t session = 0;
  std::int64_t next_sequence = 1;
  std::vector<freeflex_msgs::ack_t> acks;
  std::vector<freeflex_msgs::applied_t> applied;
  std::map<std::int64_t, freeflex_msgs::state_t> states;  // by tick
  std::vector<freeflex_msgs::status_t> statuses;
  std::map<std::string, std::int64_t> num_messages;  // by channel
  int num_early_states = 0;  // states that arrived before an APPLIED entry that they include
  PacketSender packets;

 private:
  template <class Command>
  void publish(const char* suffix, const Command& command);
  void receive(int timeout_ms);
  void take(const std::string& channel, std::span<const std::byte> payload);

  std::string prefix_;
  int fd_ = -1;
  std::vector<std::byte> buffer_;
};

/// Runs a program and writes its output into a temporary file. The destructor kills the program.
class Process {
 public:
  /// Starts the program. With a priority above 0 the program runs under SCHED_FIFO, if the system allows it.
  explicit Process(const std::vector<std::string>& arguments, int priority = 0);
  ~Process();
  Process(const Process&) = delete;
  Process& operator=(const Process&) = delete;

  pid_t pid() const { return pid_; }
  void signal(int number) const;
  /// Returns the exit status, 1000 + signal if a signal ended the program, or -1 if it does not end within
  /// kPatience.
  int wait();
  /// Returns what the program has written to standard output and standard error so far.
  std::string output() const;

 private:
  pid_t pid_ = -1;
  std::string log_;
};

/// Records one prefix with the unmodified lcm-logger. The recording has begun when the constructor returns.
/// lcm-logger queues 31 messages and drops any more, so lcm-logger runs at a priority above ordinary
/// programs. If the machine stalls for some 20 ms, messages are still lost.
class Recorder {
 public:
  Recorder(const std::string& prefix, const std::string& log);
  /// Ends the recording when all that was sent before is in the file. Returns "" or the error.
  std::string stop();

 private:
  std::string last_channel_, log_;
  Process logger_;
};

/// Returns the path of a program of the build.
std::string program(const std::string& name);
/// Returns the path of a shipped scene.
std::string scene_path(const std::string& name);

}  // namespace freeflex::testing
