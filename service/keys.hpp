// Reads key files. A key says who may send commands, and which commands. A file is a YAML mapping of id,
// secret and allow-lists. A key file must be private to the user who runs the program.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "core/plan.hpp"
#include "core/step/command.hpp"
#include "freeflex_msgs/control_t.hpp"
#include "messages/seal.hpp"

namespace freeflex::service {

/// All controls except CLEAR. A key may send CLEAR only if the key's list of controls contains CLEAR, because
/// CLEAR acts on the pushes of other senders.
inline constexpr std::uint32_t kMostControls = ~(1U << freeflex_msgs::control_t::CLEAR);

/// What a key may do, within the limits of the scene.
struct Grants {
  bool has_force = true;                   // may send on FORCE
  bool has_control = true;                 // may send on CONTROL
  std::uint32_t controls = kMostControls;  // bit c: may send control_t command c
  std::vector<bool> points;                // by index; empty: all are allowed
  std::vector<bool> groups;                // by index; empty: all are allowed
  std::vector<bool> wheels;                // wheels in the allowed points, by index; empty: all
  double largest_force = 0.0;          // [N] largest force of each entry of a command; 0: only the scene's
                                       // limit applies
  double largest_torque = 0.0;         // [N m] likewise
  int num_slots = kMaxSlotNumber + 1;  // slots 0 to num_slots - 1
  double commands_per_second = 0.0;    // [1/s] 0: no limit
};

/// Returns true if a key may have this id: a valid name of a sender on the bus, not reserved for the
/// operator's socket.
bool is_key_id(const std::string& id);
inline constexpr const char* kKeyIdAllowed = "1 to 31 of A-Z a-z 0-9 _ . - and not begin with local.";

struct Key {
  SealingKey sealing;
  Grants grants;
  std::string file;
};

struct KeysResult {
  std::vector<Key> keys;  // ordered by id, ascending, empty if there is a fault
  std::string faults;     // text for the user, with file, position and remedy, but never a secret
};
/// Loads the key in a file, or the keys in all files NAME.key of a folder. It is a fault if there is no key.
KeysResult load_keys(const std::string& path, const Plan& plan);
/// Loads the key in a file without its allow-lists, for a program that seals commands.
KeysResult load_key(const std::string& file);

/// Writes a key file with a new secret, mode 0600. Never overwrites a file. Returns an empty string, or the
/// error.
std::string make_key(const std::string& file, const std::string& id);

}  // namespace freeflex::service
