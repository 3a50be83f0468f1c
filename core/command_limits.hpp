// What the service allows those who command. No physics.
#pragma once

namespace freeflex {

struct CommandLimits {
  double max_age = 1.0;        // [s] > 0, from reception to decision
  double sender_share = 0.25;  // [-] of slots and waiting commands, for one sender on the bus; > 0, <= 1
  double max_hold = 60.0;      // [s] > 0, longest time that a command from the bus may wait or act
  bool operator==(const CommandLimits&) const = default;
};

}  // namespace freeflex
