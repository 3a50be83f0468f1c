// Limits of the service on commands and their senders. These limits do not affect the physics.
#pragma once

namespace freeflex {

struct CommandLimits {
  double max_age = 1.0;        // [s] > 0, longest time from reception to decision
  double sender_share = 0.25;  // [-] > 0, <= 1, largest fraction of slots and waiting commands of one sender
  double max_hold = 60.0;      // [s] > 0, longest time for which a command from the bus may wait or act
  bool operator==(const CommandLimits&) const = default;
};

}  // namespace freeflex
