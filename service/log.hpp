// The log: a queue, and a thread that writes it to standard error.
#pragma once

#include <string>

namespace freeflex::service {

/// Lines of spdlog's default logger go to a queue and from there to standard error: whoever logs never waits
/// for a slow or broken terminal. Lines that cannot be written are lost.  \param level  least that is written
void start_log(const std::string& level);

/// A text for the person who started the daemon: as it is, whatever the level of the log. Any thread.
/// \pre start_log
void say_plainly(const std::string& text);

/// Writes out what is queued. Ends the process with status when a terminal or a pipe takes nothing.
void end_log(int status);

}  // namespace freeflex::service
