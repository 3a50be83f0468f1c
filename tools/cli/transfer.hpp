// The parts of freeflex modes about transfer functions and held structures.
#pragma once

#include <string>

#include "service/io/scene/input.hpp"

namespace freeflex::tools {

struct TransferOptions {
  std::string scene;
  io::Settings settings;
  std::string pair;  // INPUT:OUTPUT
  std::string held;  // point or group
  std::string plot;
  int count = 30;  // modes to print; 0: all
  bool json = false;
};

/// Returns an empty text if the value is INPUT:OUTPUT, else the error.
std::string check_pair(const std::string& value);
/// Prints the gain of each mode from an input to an output, and draws the transfer function. Returns the exit
/// code.
int print_transfer(const TransferOptions& options);
/// Prints frequencies and effective masses of a structure of which a point or a group is held. Returns the
/// exit code.
int print_held(const TransferOptions& options);

}  // namespace freeflex::tools
