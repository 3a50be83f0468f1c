// Descriptors that a process is started with, and what to say when a system call fails.
#pragma once

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <string>

#include "service/limits.hpp"

namespace freeflex::service {

/// The same file above the numbers at which the ingress expects its own, closed by exec; -1 with errno.
inline int move_up(int fd) {
  constexpr int kFirst = 16;
  if (fd < 0) return -1;
  const int moved = fcntl(fd, F_DUPFD_CLOEXEC, kFirst);
  // where the limit of open files is not above the number the system calls that invalid
  const int error = errno == EINVAL ? EMFILE : errno;
  close(fd);
  errno = error;
  return moved;
}

/// "what: call: what errno means", and the limit of this process that may be why.
inline std::string call_fault(const char* what, const char* call) {
  const int error = errno;
  return std::string(what) + ": " + call + ": " + std::strerror(error) + explain_limits(error);
}

}  // namespace freeflex::service
