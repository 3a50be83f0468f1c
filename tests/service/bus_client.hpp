// A bus without liblcm's receiver: whole LCM messages read off a plain socket, so that hostile packets that
// kill liblcm pass by. And the daemon as a child process.
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

/// Far above any machine's need: only a hang is a failure.
inline constexpr std::chrono::seconds kPatience{60};

/// Sends commands to one prefix and keeps what the daemon answers.
class BusClient {
 public:
  explicit BusClient(std::string prefix, const char* group = "239.255.76.67");
  ~BusClient();
  BusClient(const BusClient&) = delete;
  BusClient& operator=(const BusClient&) = delete;

  /// Reads what has come, and more until it holds. False when kPatience ran out.
  bool until(const std::function<bool()>& condition);
  /// Reads what has come.
  void read() { receive(0); }

  void send(const ForceCommand& command);
  std::int64_t send_control(std::int32_t command, std::int64_t count = 0, const std::string& target = "");
  /// The answer to a sequence number of ours, waited for; reason -1 when none came.
  freeflex_msgs::ack_t answer(std::int64_t sequence);
  /// Takes the session from the next STATUS; false when none came.
  bool meet();

  std::optional<SealingKey> key;  // of sender "test": commands are sealed with it
  std::int64_t session = 0;
  std::int64_t next_sequence = 1;
  std::vector<freeflex_msgs::ack_t> acks;
  std::vector<freeflex_msgs::applied_t> applied;
  std::map<std::int64_t, freeflex_msgs::state_t> states;  // by tick
  std::vector<freeflex_msgs::status_t> statuses;
  std::map<std::string, std::int64_t> num_messages;  // by channel
  int num_early_states = 0;                          // that came before an APPLIED they contain
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

/// A program with its standard error in a file of its own; killed when it goes out of scope.
class Process {
 public:
  /// With a priority above 0 under SCHED_FIFO, where the system gives it.
  explicit Process(const std::vector<std::string>& arguments, int priority = 0);
  ~Process();
  Process(const Process&) = delete;
  Process& operator=(const Process&) = delete;

  pid_t pid() const { return pid_; }
  void signal(int number) const;
  /// Exit status, or 1000 + signal; -1 when it did not end in kPatience.
  int wait();
  /// What it wrote to standard output and error so far.
  std::string output() const;

 private:
  pid_t pid_ = -1;
  std::string log_;
};

/// The unmodified lcm-logger on one prefix, from the constructor's return on. It keeps 31 messages that it
/// has not yet handled and drops what comes then, so it runs before ordinary programs; a machine that stands
/// still for some 20 ms loses a part all the same.
class Recorder {
 public:
  Recorder(const std::string& prefix, const std::string& log);
  /// Ends the recording. Empty, or what went wrong.
  std::string stop();

 private:
  Process logger_;
};

/// Path of a program of the build.
std::string program(const std::string& name);
/// Path of a scene of the project.
std::string scene_path(const std::string& name);

}  // namespace freeflex::testing
