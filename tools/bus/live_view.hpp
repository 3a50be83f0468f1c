// Shows the live state of a structure on a terminal.
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

/// On a terminal, draws each page over the previous page, and cuts the page to the size of the terminal.
/// Otherwise prints the pages one after another.
class Screen {
 public:
  explicit Screen(bool is_terminal);
  ~Screen();
  Screen(const Screen&) = delete;
  Screen& operator=(const Screen&) = delete;
  void show(const std::string& text);
  /// Returns the number of lines that fit on the terminal.
  int num_rows() const;

 private:
  bool is_terminal_;
};

/// Keeps the latest messages of a daemon and formats them.
class LiveView {
 public:
  void take(const std::string& suffix, const BusMessage& message);
  /// Returns the full view.  \param bus  description of the bus  \param num_rows  number of lines to use;
  /// below 28, three modes are shown instead of six
  std::string page(const std::string& bus, int num_rows) const;
  /// Returns the most important values in one line.
  std::string line() const;

 private:
  void take_status(const freeflex_msgs::status_t& status);
  void take_points(const freeflex_msgs::points_t& points);
  // returns true for the session of the latest STATUS, and before the first STATUS for every session
  bool is_of_daemon(std::int64_t session) const;
  void note(const std::string& text);
  std::string rate_text() const;
  double silence_in_seconds() const;  // since the last message
  std::string header_text() const;
  std::string motion_text() const;
  std::string validity_text() const;
  std::string elastic_text(std::size_t num_modes) const;
  std::string timing_text() const;
  std::string commands_text() const;

  SceneCatalogue scene_;
  std::optional<freeflex_msgs::status_t> status_;
  std::optional<freeflex_msgs::state_t> state_;
  // [Hz] ticks per second of wall clock; empty until two STATUS of one session have arrived
  std::optional<double> measured_rate_;
  std::int64_t points_tick_ = -1;
  double largest_displacement_ = 0.0;  // [m] largest displacement of the published points at points_tick_
  std::int32_t largest_point_ = -1;
  std::int64_t last_heard_us_ = 0;  // [us] wall clock
  std::deque<std::string> notes_;   // latest commands and answers
  std::int64_t other_session_ = 0;  // session of the last STATUS from another daemon
  std::int64_t other_heard_us_ = 0;
  bool sees_two_ = false;  // true if two daemons send messages on the prefix
  std::string unread_;     // the reason why a STATUS could not be read; shown until one is read
};

}  // namespace freeflex::tools
