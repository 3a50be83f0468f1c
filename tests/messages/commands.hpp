// Commands and the scene they are checked against, shared by the message tests.
#pragma once

#include <cstddef>
#include <random>
#include <vector>

#include "freeflex_msgs/control_t.hpp"
#include "freeflex_msgs/force_t.hpp"
#include "service/io/wire/codec.hpp"

namespace freeflex::testing {

inline constexpr std::int64_t kSession = 7'000'000'001;

/// 300 points, all but 299 pushable; groups: 0 spatial, 1 on the x axis, 2 one point, 3 with a point without
/// rows. Limits 100 N and 50 N m.
io::NameTable make_names();

/// 3 forces and 2 wrenches that make_names() allows.
freeflex_msgs::force_t make_force();
/// RUN.
freeflex_msgs::control_t make_control();
/// A message that make_names() allows, its counts, values and text random.
freeflex_msgs::force_t random_force(std::mt19937_64& engine, int most_forces = 256, int most_wrenches = 3);

/// decode_force of the message's bytes in kSession.
io::Admission decode(const freeflex_msgs::force_t& message, const io::NameTable& names,
                     ForceCommand& command);
io::Admission decode(const freeflex_msgs::force_t& message);
io::Admission decode(const freeflex_msgs::control_t& message);

}  // namespace freeflex::testing
