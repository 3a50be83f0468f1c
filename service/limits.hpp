// Which limit of the process may be why a system call failed.
#pragma once

#include <string>

namespace freeflex::service {

/// Continues the text of an error: the limits that can cause it, what of them is used, and the remedy. Empty
/// for errors that no limit causes. \param error  errno: ENOMEM, EAGAIN (of a thread, a process or locked
/// memory) or EMFILE
std::string explain_limits(int error);

}  // namespace freeflex::service
