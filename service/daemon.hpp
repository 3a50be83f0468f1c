// Constructs, runs and stops the parts of freeflexd.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "service/io/scene/input.hpp"
#include "service/loop.hpp"
#include "service/signals.hpp"

namespace freeflex::service {

struct DaemonOptions {
  std::string input;         // scene or plan file
  io::Settings settings;     // values that replace values of the scene (--set)
  std::string lcm_url;       // empty: LCM_DEFAULT_URL, else LCM's default
  std::string prefix;        // first part of every channel name
  std::string socket;        // path of the operator's socket, empty for the default, "none" for no socket
  std::string ingress_user;  // user that the ingress runs as; empty: see find_ingress_user
  double rate = 0.0;         // [Hz] 0: the scene's rate
  double until = 0.0;        // [s] simulated time at which the daemon ends, 0: never
  bool starts_holding = false;
  bool takes_over = false;  // true: starts even if another daemon uses the prefix
  // key file, or folder of key files: commands on the bus must be sealed with one of the keys. Without a
  // value, no keys are needed.
  std::optional<std::string> keys;
  Timing timing{};
  // whether the motion is judged; without a value, if the machine has at least 3 processors
  std::optional<bool> judges;
};

/// Exit codes of the process.
enum ExitCode : int { kClean = 0, kRuntimeFailure = 1, kUsage = 2 };

/// Runs the daemon until it stops. Returns the exit code.
/// \pre start_log() was called
/// \param signals  constructed before any thread is started, including the thread of the log
int run_daemon(const DaemonOptions& options, SignalWatch& signals);

}  // namespace freeflex::service
