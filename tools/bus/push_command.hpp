// Checks the options of freeflex push, and makes the message that the options describe.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "freeflex_msgs/control_t.hpp"
#include "freeflex_msgs/force_t.hpp"
#include "tools/bus/bus.hpp"

namespace freeflex::tools {

struct PushOptions {
  BusOptions bus;
  std::vector<std::string> points;
  std::vector<std::string> groups;
  std::vector<std::string> wheels;  // each NAME=TORQUE
  std::vector<double> force;        // [N] (3), empty if not given
  std::vector<double> torque;       // [N m] (3), empty if not given
  std::string axes = "world";
  std::optional<double> duration;  // [s]
  std::optional<double> lease;     // [s]
  bool clear = false;
  int slot = 0;
  std::optional<std::int64_t> at_tick;
  bool late_ok = false;
  std::string sender;  // empty: "push", or "local.push" over the socket
  std::string key;     // key file, empty if the command is not sealed
  std::string control;
  std::string clear_sender;  // sender whose pushes end; *: every sender of the bus
  double timeout = 3.0;      // [s]
  bool json = false;
  std::optional<std::string>
      socket;  // path of the operator's socket, which replaces the bus; an empty path means the default
};

/// Returns a text about the first option that contradicts another option, has no effect or is missing, or an
/// empty text if there is none. Does not find faults that only a daemon can detect.  \param command  command
/// that parsed the options
std::string find_push_fault(const CLI::App& command, const PushOptions& options);

/// Returns true if the command is a control_t, which needs no scene.
bool is_control(const PushOptions& options);
/// Returns the control_t that the options describe.  \pre find_push_fault returned an empty text, and
/// is_control is true
freeflex_msgs::control_t make_control(const PushOptions& options);

/// Returns the force_t that the options describe, with indices instead of names and ticks instead of seconds.
/// If a name is unknown, prints an error and returns nullopt.  \pre find_push_fault returned an empty text
std::optional<freeflex_msgs::force_t> make_force(const PushOptions& options, const SceneCatalogue& scene);

/// Returns a warning if rounding to whole ticks changes the duration or lease by more than 1 %. Otherwise
/// returns an empty text.
/// \param rate  [Hz] of the daemon's ticks
std::string rounded_duration(const PushOptions& options, double rate);

}  // namespace freeflex::tools
