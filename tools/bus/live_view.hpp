// The live state of a structure on a terminal.
#pragma once

#include <array>
#include <cstdint>
#include <deque>
#include <map>
#include <optional>
#include <string>

#include "freeflex_msgs/points_t.hpp"
#include "freeflex_msgs/state_t.hpp"
#include "freeflex_msgs/status_t.hpp"
#include "tools/bus/bus.hpp"

namespace freeflex::tools {

/// Draws pages over each other on a terminal, cut to its size; elsewhere prints them one after another.
class Screen {
 public:
  explicit Screen(bool is_terminal);
  ~Screen();
  Screen(const Screen&) = delete;
  Screen& operator=(const Screen&) = delete;
  void show(const std::string& text);
  /// Lines that fit.
  int num_rows() const;

 private:
  bool is_terminal_;
};

/// Keeps the latest of what the daemon publishes and lays it out.
class LiveView {
 public:
  void take(const std::string& suffix, const BusMessage& message);
  /// The full view. \param bus  where it comes from  \param num_rows  lines to use, 24 or more to show all
  std::string page(const std::string& bus, int num_rows) const;
  /// The most important figures in one line.
  std::string line() const;

 private:
  void take_status(const freeflex_msgs::status_t& status);
  void take_points(const freeflex_msgs::points_t& points);
  bool is_of_daemon(std::int64_t session) const;  // whose STATUS came last, or none came
  void note(const std::string& text);
  std::string rate_text() const;
  double silence_in_seconds() const;  // since anything was heard of the daemon
  std::string header_text() const;
  std::string motion_text() const;
  std::string validity_text() const;
  std::string elastic_text(std::size_t num_modes) const;
  std::string timing_text() const;
  std::string commands_text() const;

  SceneCatalogue scene_;
  std::optional<freeflex_msgs::status_t> status_;
  std::optional<freeflex_msgs::state_t> state_;
  std::optional<double> measured_rate_;  // [Hz] ticks per second of wall clock; needs two status
  std::int64_t points_tick_ = -1;
  double largest_displacement_ = 0.0;  // [m] of the published points at points_tick_
  std::int32_t largest_point_ = -1;
  std::int64_t last_heard_us_ = 0;  // [us] wall clock
  std::deque<std::string> notes_;   // latest commands and answers
  std::int64_t other_session_ = 0;  // of the status before those of this session
  std::int64_t other_heard_us_ = 0;
  bool sees_two_ = false;  // both are heard
  std::string unread_;     // why the last STATUS could not be read, while none was
};

}  // namespace freeflex::tools
