// The rights that the ingress gives up before it reads the first packet.
#pragma once

#include <sys/types.h>

#include <cstdint>
#include <string>

namespace freeflex::service {

/// The user that an ingress runs as. By default this is the daemon's user.
struct IngressUser {
  static constexpr std::int64_t kSame = -1;
  std::int64_t uid = kSame;
  std::int64_t gid = kSame;
};
/// Finds the user of that name. For an empty name, finds `nobody` if this process may start and end processes
/// of other users (CAP_SETUID, CAP_SETGID, CAP_KILL), and otherwise the daemon's user. Returns an empty
/// string, or the error.
std::string find_ingress_user(const std::string& name, IngressUser& user);

/// Bits for the parts of the confinement that failed.
inline constexpr std::uint32_t kLacksUser = 1, kLacksFilter = 2;
/// Returns a text for the log that lists the failed parts, or an empty text for 0. Ignores other bits.
std::string describe_lacks(std::uint32_t lacks);

/// Confines this process, which must have a single thread and must have opened all files that it needs. From
/// then on the process can read its socket, wait, read the clock, allocate memory (64 MB, not executable) and
/// end. The process has no capability and cannot gain one. It cannot open a file, start a process, write a
/// file or leave a core file. Any other system call ends the process. The process ends when its parent ends.
/// \return bits of the parts that failed
std::uint32_t confine(const IngressUser& user);

}  // namespace freeflex::service
