// The command line of this example is controller POINT POINT GAIN [KEYFILE]. The controller acts as an active
// strut between two points. The force on the second point is -GAIN [N s/m] times the speed at which the
// distance of the points grows, and the force on the first point is opposite. The pair of forces damps
// elastic motion and does not change the rigid motion. Exit codes: 0 as soon as the largest speed within 1 s
// is at most 1 % of the largest speed within the first second; 1 if this does not happen within 60 s, or if
// no daemon publishes the points; 2 for wrong arguments or names.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>

#include "service/client/client.hpp"

namespace client = freeflex::client;

int main(int argc, char** argv) try {
  const double gain = argc == 4 || argc == 5 ? std::strtod(argv[3], nullptr) : 0.0;
  if (!(gain > 0.0)) return std::fprintf(stderr, "usage: controller POINT POINT GAIN [KEYFILE]\n"), 2;
  client::Daemon daemon({.sender = "example-controller",
                         .key_file = argc == 5 ? argv[4] : "",
                         .timeout = std::chrono::seconds(10)});
  std::int64_t session = 0;
  double start = 0.0, window = 0.0;   // [s] time of the first points, and start of the current window of 1 s
  double largest = 0.0, first = 0.0;  // [m/s] largest speed in the current window, and in the first window
  while (true) {
    const client::PointsTick& tick = daemon.next_points();
    const double time = static_cast<double>(tick.tick) / daemon.status().rate;
    if (tick.session != session) {  // the first session, or a new one after a restart of the daemon
      session = tick.session;
      start = window = time;
      largest = first = 0.0;
    }
    const auto& a = tick.at(daemon.point(argv[1]));
    const auto& b = tick.at(daemon.point(argv[2]));
    client::Vector line{}, push{}, pull{};
    for (int k = 0; k < 3; ++k) line[k] = b.position[k] - a.position[k];
    const double length = std::hypot(line[0], line[1], line[2]);
    double speed = 0.0;  // [m/s] d(length)/dt
    for (int k = 0; k < 3; ++k) speed += line[k] / length * (b.velocity[k] - a.velocity[k]);
    for (int k = 0; k < 3; ++k) pull[k] = -(push[k] = -gain * speed * line[k] / length);
    try {  // the lease ends the force within 0.2 s if this program dies
      daemon.push({.forces = {{argv[1], pull}, {argv[2], push}}, .lease = 0.2});
    } catch (const client::Restarted&) {
    }
    largest = std::max(largest, std::abs(speed));
    if (time < window + 1.0) continue;
    if (window == start) first = largest;
    if (const bool is_quiet = largest <= 0.01 * first; is_quiet || time > start + 60.0) {
      std::printf("speed along the line: %.6f m/s -> %.6f m/s after %.1f s\n", first, largest, time - start);
      return is_quiet ? 0 : 1;
    }
    window = time;
    largest = 0.0;
  }
} catch (const client::Error& error) {
  std::fprintf(stderr, "controller: %s\n", error.what());
  return dynamic_cast<const client::UnknownName*>(&error) != nullptr ? 2 : 1;
}
