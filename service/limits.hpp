// Finds the limits of the process that may have made a system call fail.
#pragma once

#include <string>

namespace freeflex::service {

/// Returns text to append to an error message: the limits that can cause the error, how much is used, and the
/// remedy. Returns an empty string if no limit can cause the error.  \param error  errno: ENOMEM, EAGAIN
/// (from starting a thread or a process, or from locking memory) or EMFILE
std::string explain_limits(int error);

}  // namespace freeflex::service
