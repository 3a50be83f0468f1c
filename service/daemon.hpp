// Puts the parts of freeflexd together and takes them apart again.
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
  io::Settings settings;     // values set in the scene
  std::string lcm_url;       // empty: LCM_DEFAULT_URL, else LCM's default
  std::string prefix;        // of every channel
  std::string socket;        // path of the operator's socket; empty: the usual one, "none": none
  std::string ingress_user;  // whose rights the ingress has; empty: nobody where that is possible
  double rate = 0.0;         // [Hz] 0: the scene's
  double until = 0.0;        // [s] simulated; 0: until told to stop
  bool starts_holding = false;
  bool takes_over = false;          // starts although another daemon is heard on the prefix
  std::optional<std::string> keys;  // file or folder: commands on the bus are taken under these keys only
  Timing timing{};
};

/// What the process ends with.
enum ExitCode : int { kClean = 0, kRuntimeFailure = 1, kUsage = 2 };

/// Runs the daemon until it is told to stop.
/// \pre start_log
/// \param signals  constructed before any thread, the log's included
int run_daemon(const DaemonOptions& options, SignalWatch& signals);

}  // namespace freeflex::service
