// Gives the process a private network. UDP multicast works over the loopback interface of this network, and
// no packet leaves it. Header only.
#pragma once

#include <arpa/inet.h>
#include <errno.h>
#include <fcntl.h>
#include <net/if.h>
#include <net/route.h>
#include <netinet/in.h>
#include <sched.h>
#include <sys/ioctl.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <string>
#include <system_error>

namespace freeflex::testing {

inline bool write_file(const char* path, const std::string& text) {
  const int fd = open(path, O_WRONLY | O_CLOEXEC);
  if (fd < 0) return false;
  const bool is_whole = write(fd, text.data(), text.size()) == static_cast<ssize_t>(text.size());
  close(fd);
  return is_whole;
}

/// Brings the loopback interface up with multicast and the route that LCM needs. Returns an error text, which
/// is empty on success.
inline std::string set_up_loopback() {
  const int fd = socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  if (fd < 0) return std::string("socket: ") + std::strerror(errno);
  ifreq interface {};
  std::strcpy(interface.ifr_name, "lo");
  interface.ifr_flags = IFF_UP | IFF_RUNNING | IFF_LOOPBACK | IFF_MULTICAST;
  rtentry route{};
  const auto put = [](sockaddr& where, const char* address) {
    sockaddr_in internet{};
    internet.sin_family = AF_INET;
    inet_pton(AF_INET, address, &internet.sin_addr);
    std::memcpy(&where, &internet, sizeof(internet));
  };
  put(route.rt_dst, "224.0.0.0");
  put(route.rt_genmask, "240.0.0.0");
  route.rt_flags = RTF_UP;
  route.rt_dev = interface.ifr_name;
  std::string fault;
  if (ioctl(fd, SIOCSIFFLAGS, &interface) != 0) {
    fault = std::string("lo up: ") + std::strerror(errno);
  } else if (ioctl(fd, SIOCADDRT, &route) != 0) {
    fault = std::string("multicast route: ") + std::strerror(errno);
  }
  close(fd);
  return fault;
}

/// A folder for operators' sockets that exists as long as this process and is separate from the folder of the
/// user's other daemons.
class RuntimeFolder {
 public:
  RuntimeFolder() {
    if (mkdtemp(path_) != nullptr) setenv("XDG_RUNTIME_DIR", path_, 1);
  }
  ~RuntimeFolder() {
    std::error_code ignored;
    if (getpid() == owner_) std::filesystem::remove_all(path_, ignored);
  }
  RuntimeFolder(const RuntimeFolder&) = delete;
  RuntimeFolder& operator=(const RuntimeFolder&) = delete;

 private:
  char path_[32] = "/tmp/freeflex-runtime-XXXXXX";
  pid_t owner_ = getpid();
};

/// Moves this process, and every process and thread that it starts later, into a private network namespace
/// (and, if the process is not root, into a user namespace), and sets XDG_RUNTIME_DIR. Must be called in main
/// before any thread starts. Returns an empty string on success. If the kernel refuses, returns the reason;
/// the process then stays in its network, and tests that need a private network are skipped with this reason.
inline std::string enter_private_network() {
  const uid_t user = getuid();
  const gid_t group = getgid();
  const int flags = geteuid() == 0 ? CLONE_NEWNET : CLONE_NEWUSER | CLONE_NEWNET;
  if (unshare(flags) != 0)
    return std::string("no private network namespace: unshare: ") + std::strerror(errno);
  if ((flags & CLONE_NEWUSER) != 0) {
    // A process whose user is not mapped in its user namespace loses its rights at the next exec. A failure
    // to write these files is harmless.
    write_file("/proc/self/setgroups", "deny");
    write_file("/proc/self/uid_map", "0 " + std::to_string(user) + " 1");
    write_file("/proc/self/gid_map", "0 " + std::to_string(group) + " 1");
  }
  static const RuntimeFolder runtime;
  const std::string fault = set_up_loopback();
  return fault.empty() ? fault : "no private network namespace: " + fault;
}

}  // namespace freeflex::testing
