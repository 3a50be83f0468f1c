// Limits of the service on commands and their senders. These limits do not affect the physics.
#pragma once

namespace freeflex {

struct CommandLimits {
  double max_age = 1.0;        // [s] > 0, longest time from reception of a command to the decision on it
  double sender_share = 0.25;  // [-] > 0, <= 1, largest fraction of all slots, and of all waiting commands,
                               // for one sender
  double max_hold = 60.0;      // [s] > 0, longest time for which a command from the bus may wait for its
                               // start, or act
  bool operator==(const CommandLimits&) const = default;
};

}  // namespace freeflex
