// What the ingress gives up before it looks at the first packet.
#pragma once

#include <sys/types.h>

#include <cstdint>
#include <string>

namespace freeflex::service {

/// Whose rights an ingress has. Not changed: the daemon's.
struct IngressUser {
  static constexpr std::int64_t kSame = -1;
  std::int64_t uid = kSame;
  std::int64_t gid = kSame;
};
/// The user of that name, "" for nobody where this process may start processes of other users and end them
/// again (CAP_SETUID, CAP_SETGID, CAP_KILL), else the daemon's. Empty, or what is wrong with the name.
std::string find_ingress_user(const std::string& name, IngressUser& user);

/// What confine() could not do, as bits.
inline constexpr std::uint32_t kLacksUser = 1, kLacksFilter = 2;
/// A text for a log; empty for 0. Bits beyond are nothing.
std::string describe_lacks(std::uint32_t lacks);

/// To be called by a process of one thread that has all it needs. From then on it can read its socket, wait,
/// look at the clock, have memory (64 MB, none of it executable) and end; it has no capability and gains
/// none, opens and starts nothing, writes no file and leaves no core. Any other system call ends it. Dies
/// with its parent. \return what could not be done
std::uint32_t confine(const IngressUser& user);

}  // namespace freeflex::service
