// Descriptors that a process is started with, and what to say when a system call fails.
#pragma once

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <string>

namespace freeflex::service {

/// The same file above the numbers at which the ingress expects its own, closed by exec; -1 with errno.
inline int move_up(int fd) {
  constexpr int kFirst = 16;
  if (fd < 0) return -1;
  const int moved = fcntl(fd, F_DUPFD_CLOEXEC, kFirst);
  const int error = errno;
  close(fd);
  errno = error;
  return moved;
}

/// "what: call: what errno means"
inline std::string call_fault(const char* what, const char* call) {
  return std::string(what) + ": " + call + ": " + std::strerror(errno);
}

}  // namespace freeflex::service
