// What freeflex push is asked for: its options, their rules, and the message that they make.
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
  std::vector<std::string> wheels;  // NAME=TORQUE
  std::vector<double> force;        // [N] (3), or not given
  std::vector<double> torque;       // [N m] (3), or not given
  std::string axes = "world";
  std::optional<double> duration;  // [s]
  std::optional<double> lease;     // [s]
  bool clear = false;
  int slot = 0;
  std::optional<std::int64_t> at_tick;
  bool late_ok = false;
  std::string sender;  // empty: "push", over the socket "local.push"
  std::string key;     // file; empty: the command goes as it is
  std::string control;
  std::string clear_sender;  // whose pushes end; *: every sender of the bus
  double timeout = 3.0;      // [s]
  bool json = false;
  std::optional<std::string> socket;  // the operator's in place of the bus; empty: the usual one
};

/// What is wrong with the options, as far as it needs no daemon: what contradicts, has no effect or is
/// missing. Empty: nothing. \param command  that parsed them
std::string find_push_fault(const CLI::App& command, const PushOptions& options);

/// True when the command is a control_t, which needs no scene.
bool is_control(const PushOptions& options);
/// \pre find_push_fault found nothing, is_control
freeflex_msgs::control_t make_control(const PushOptions& options);

/// Names become indices, seconds become ticks. An unknown name is explained and gives nullopt.
/// \pre find_push_fault found nothing
std::optional<freeflex_msgs::force_t> make_force(const PushOptions& options, const SceneCatalogue& scene);

/// What the daemon's ticks make of a duration or lease that is no whole number of them; empty: as asked.
/// \param rate  [Hz] of the daemon's ticks
std::string rounded_duration(const PushOptions& options, double rate);

}  // namespace freeflex::tools
