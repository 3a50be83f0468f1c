// The small motions of a scene about a steady motion, for `freeflex modes --spin` and `--loads`.
#pragma once

#include <optional>
#include <string>

#include "service/io/scene/input.hpp"

namespace freeflex::tools {

/// What `freeflex modes --spin` and `--loads` ask for.
struct SteadyOptions {
  std::string scene;  // file
  io::Settings settings;
  std::string spin;                // X,Y,Z or W [rad/s], after "0.." a range; empty: none
  std::optional<double> loads_at;  // [s] time at which built-in loads have the values that they keep
  std::string plot;                // picture file of a range, empty for no picture
  int count = 0;                   // motions to print, 0 for all
  bool json = false;
};

/// Returns an empty text, or the error in the value of --spin.
std::string check_spin(const std::string& text);

/// Prints the small motions about the steady motion of a scene, or about those with a range of spins, and
/// draws the latter. Returns the exit code.
int steady_modes(const SteadyOptions& options);

}  // namespace freeflex::tools
