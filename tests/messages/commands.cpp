#include "tests/messages/commands.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <memory>
#include <numeric>

namespace freeflex::testing {

io::NameTable make_names() {
  io::NameTable names;
  names.num_points = 300;
  names.num_groups = 4;
  names.force_limit = 100.0;
  names.torque_limit = 50.0;
  names.num_pushable = 299;
  std::iota(names.pushable.begin(), names.pushable.begin() + names.num_pushable, 0);
  names.groups[0] = {3, {}, 1};
  names.groups[1] = {2, {1.0, 0.0, 0.0}, 1};
  names.groups[2] = {0, {}, 1};
  names.groups[3] = {3, {}, 0};
  return names;
}

freeflex_msgs::force_t make_force() {
  freeflex_msgs::force_t message{};
  message.utime = 1'234'567;
  message.session = kSession;
  message.sender = "pusher-1.a_B";
  message.sequence = 42;
  message.slot = 5;
  message.axes = 1;
  message.start_tick = 1000;
  message.late_policy = 1;
  message.duration_ticks = 77;
  message.forces = {{0, {1.0, -2.0, 0.1}}, {298, {0.0, -0.0, 5e-324}}, {17, {1.0 / 3.0, 1e-300, -60.0}}};
  message.wrenches = {{0, {1.0, 2.0, 3.0}, {-4.0, 5.0, 0.1}}, {1, {0.3, 0.2, 0.1}, {0.0, 7.0, -8.0}}};
  message.num_forces = 3;
  message.num_wrenches = 2;
  return message;
}

freeflex_msgs::control_t make_control() {
  freeflex_msgs::control_t message{};
  message.session = kSession;
  message.sender = "desk";
  message.sequence = 3;
  message.command = freeflex_msgs::control_t::RUN;
  return message;
}

freeflex_msgs::force_t random_force(std::mt19937_64& engine, int most_forces, int most_wrenches) {
  const auto below = [&engine](int limit) {
    return static_cast<int>(engine() % static_cast<std::uint64_t>(limit));
  };
  // returns a finite double of magnitude 10 or less from random bits. Subnormals and zeros occur
  const auto any = [&engine]() {
    while (true) {
      const double value = std::bit_cast<double>(static_cast<std::uint64_t>(engine()));
      if (std::isfinite(value) && std::fabs(value) <= 10.0) return value;
    }
  };
  freeflex_msgs::force_t message = make_force();
  message.sender.resize(static_cast<std::size_t>(1 + below(31)));
  for (char& c : message.sender) c = "ABCXYZabcxyz0189_.-"[below(19)];
  message.utime = static_cast<std::int64_t>(engine());
  message.sequence = static_cast<std::int64_t>(engine());
  message.slot = below(64);
  message.axes = below(2);
  message.num_forces = below(most_forces + 1);
  message.num_wrenches = below(most_wrenches + 1);
  std::vector<int> points(299);
  std::iota(points.begin(), points.end(), 0);
  std::shuffle(points.begin(), points.end(), engine);
  message.forces.resize(static_cast<std::size_t>(message.num_forces));
  message.wrenches.resize(static_cast<std::size_t>(message.num_wrenches));
  for (std::size_t i = 0; i < message.forces.size(); ++i) {
    message.forces[i].point = points[i];
    std::generate_n(message.forces[i].force, 3, any);
  }
  for (std::size_t i = 0; i < message.wrenches.size(); ++i) {
    message.wrenches[i].group = static_cast<std::int32_t>(i);
    std::generate_n(message.wrenches[i].force, 3, any);
    std::generate_n(message.wrenches[i].torque, 3, any);
    if (i == 1) message.wrenches[i].torque[0] = 0.0;  // group 1 accepts no torque about its line
    if (i == 2)
      std::fill_n(message.wrenches[i].torque, 3, 0.0);  // group 2 has one point and accepts no torque
  }
  return message;
}

io::Admission decode(const freeflex_msgs::force_t& message, const io::NameTable& names,
                     ForceCommand& command) {
  return io::decode_force(io::encode(message), kSession, names, command);
}

io::Admission decode(const freeflex_msgs::force_t& message) {
  ForceCommand command;
  return decode(message, make_names(), command);
}

io::Admission decode(const freeflex_msgs::control_t& message) {
  io::ControlCommand command;
  return io::decode_control(io::encode(message), kSession, command);
}

}  // namespace freeflex::testing
