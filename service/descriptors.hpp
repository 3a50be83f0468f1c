// Helpers for file descriptors and for errors of system calls.
#pragma once

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <string>

#include "service/limits.hpp"

namespace freeflex::service {

/// Moves a descriptor to a number above those that the ingress uses, with close-on-exec. Closes the old
/// number. Returns -1 and sets errno on failure.
inline int move_up(int fd) {
  constexpr int kFirst = 16;
  if (fd < 0) return -1;
  const int moved = fcntl(fd, F_DUPFD_CLOEXEC, kFirst);
  // the kernel returns EINVAL if the limit of open files is below the number
  const int error = errno == EINVAL ? EMFILE : errno;
  close(fd);
  errno = error;
  return moved;
}

/// Returns "what: call: text of errno", followed by the limit of this process that may have caused the error.
inline std::string call_fault(const char* what, const char* call) {
  const int error = errno;
  return std::string(what) + ", because " + call + " failed: " + std::strerror(error) + explain_limits(error);
}

}  // namespace freeflex::service
