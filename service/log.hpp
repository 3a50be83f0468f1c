// The log: a queue of lines, and a thread that writes them to standard error.
#pragma once

#include <string>

namespace freeflex::service {

/// Starts the log. The lines of spdlog's default logger then go to a queue and from there to standard error,
/// so that no caller waits for a slow or broken terminal. Lines that cannot be written are lost.
/// \param level  lowest level that is written
void start_log(const std::string& level);

/// Prints a text for the user without a prefix and at any log level. Any thread may call this function.
/// \pre start_log() was called
void print_plainly(const std::string& text);

/// Writes the queued lines. If the terminal or pipe does not accept the lines within a second, ends the
/// process with the status.
void end_log(int status);

}  // namespace freeflex::service
