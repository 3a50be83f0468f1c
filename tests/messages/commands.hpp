// These functions make commands for the tests of messages, and the table against which the commands are
// checked.
#pragma once

#include <cstddef>
#include <random>
#include <vector>

#include "freeflex_msgs/control_t.hpp"
#include "freeflex_msgs/force_t.hpp"
#include "service/io/wire/codec.hpp"

namespace freeflex::testing {

inline constexpr std::int64_t kSession = 7'000'000'001;

/// Returns a table of 300 points, all pushable except the last (number 299), and of four groups: 0 spatial, 1
/// on the x axis, 2 of one point, 3 with a point without mode-shape rows. The limits are 100 N and 50 N m.
io::NameTable make_names();

/// Returns a command of 3 forces and 2 wrenches that is valid with the table make_names().
freeflex_msgs::force_t make_force();
/// Returns the control RUN.
freeflex_msgs::control_t make_control();
/// Returns a message with random counts, values and text that is valid with the table make_names().
freeflex_msgs::force_t random_force(std::mt19937_64& engine, int most_forces = 256, int most_wrenches = 3);

/// Returns the answer of decode_force or decode_control to the bytes of the message in session kSession.
io::Admission decode(const freeflex_msgs::force_t& message, const io::NameTable& names,
                     ForceCommand& command);
io::Admission decode(const freeflex_msgs::force_t& message);
io::Admission decode(const freeflex_msgs::control_t& message);

}  // namespace freeflex::testing
