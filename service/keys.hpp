// Files of keys: who may command, and what. A file is a YAML mapping of id, secret and allow-lists; it must
// be private to the user who runs the program.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "core/step/command.hpp"
#include "core/step/plan.hpp"
#include "freeflex_msgs/control_t.hpp"
#include "messages/seal.hpp"

namespace freeflex::service {

/// All but CLEAR, which acts on what others have: a key must name it.
inline constexpr std::uint32_t kMostControls = ~(1U << freeflex_msgs::control_t::CLEAR);

/// What a key may do, beside what the scene lets commands do.
struct Grants {
  bool has_force = true;                   // may send on FORCE
  bool has_control = true;                 // may send on CONTROL
  std::uint32_t controls = kMostControls;  // bit c: control_t command c
  std::vector<bool> points;                // by index; empty: all
  std::vector<bool> groups;                // by index; empty: all
  std::vector<bool> wheels;                // by index, those in its points; empty: all
  double largest_force = 0.0;              // [N] of each entry; 0: the scene's limit alone
  double largest_torque = 0.0;             // [N m]
  int num_slots = kMaxSlotNumber + 1;      // slots 0 to num_slots - 1
  double commands_per_second = 0.0;        // [1/s] 0: any number
};

/// Names of senders on the bus: those of the operator's socket are no names of keys.
bool is_key_id(const std::string& id);
inline constexpr const char* kKeyIdAllowed = "1 to 31 of A-Z a-z 0-9 _ . -, not beginning with local.";

struct Key {
  SealingKey sealing;
  Grants grants;
  std::string file;
};

struct KeysResult {
  std::vector<Key> keys;  // by id, ascending; empty when there is a fault
  std::string faults;     // for a person, with places and the way out; never a secret
};
/// The key of a file, or those of every NAME.key of a folder, at least one.
KeysResult load_keys(const std::string& path, const Plan& plan);
/// The key of a file, its allow-lists not looked at: for who signs.
KeysResult load_key(const std::string& file);

/// Makes a file with a new secret, mode 0600. Never writes over one. Empty, or what went wrong.
std::string make_key(const std::string& file, const std::string& id);

}  // namespace freeflex::service
