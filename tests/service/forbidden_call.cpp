// This file is a library to preload. The poll() of this library also opens a file, as a library that fakes
// the clock would do to read its settings.
#include <fcntl.h>
#include <poll.h>
#include <sys/syscall.h>
#include <unistd.h>

extern "C" __attribute__((visibility("default"))) int poll(pollfd* descriptors, nfds_t count,
                                                           int timeout_ms) {
  if (const int fd = open("/dev/null", O_RDONLY | O_CLOEXEC); fd >= 0) close(fd);
  return static_cast<int>(syscall(SYS_poll, descriptors, count, timeout_ms));
}
