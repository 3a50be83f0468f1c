// The path of the operator's socket, and the names of the senders that use the socket.
#pragma once

#include <sys/un.h>

#include <array>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/step/command.hpp"

namespace freeflex::service {

/// First part of the names of all senders on the operator's socket. No other name of a sender begins with
/// this part.
inline constexpr std::string_view kOperatorSender = "local.";
inline bool is_operator(const std::array<char, kSenderSize>& sender) noexcept {
  return std::string_view(sender.data(), kOperatorSender.size()) == kOperatorSender;
}

/// Target of CLEAR for every sender of the bus.
inline constexpr std::array<char, kSenderSize> kEverySender{'*'};
/// Returns true if CLEAR with this target clears the sender.
inline bool is_target(const std::array<char, kSenderSize>& target,
                      const std::array<char, kSenderSize>& sender) noexcept {
  return target == kEverySender ? !is_operator(sender) : target == sender;
}

/// Folders in which the operator's socket may be. Tests use other folders.
struct OperatorRoots {
  std::string runtime;  // $XDG_RUNTIME_DIR, empty if not set
  std::string users = "/run/user";
  std::string system = "/run/freeflex";
  std::string temporary = "/tmp";
};
OperatorRoots operator_roots();

/// Holds the path of the socket, or the fault in words for the user.
struct OperatorPlace {
  std::string path;
  std::string fault;
};
/// Returns the path of the socket of a daemon of this user. The folder of the socket is the first of
/// $XDG_RUNTIME_DIR, /run/user/UID and /run/freeflex that belongs to this user, that nobody else may write
/// to, and in which the path has at most 107 characters. If none of these folders passes, the folder is
/// /tmp/freeflexd-UID, which is created if it is missing and must pass the same check.
OperatorPlace choose_operator_place(const std::string& prefix, const OperatorRoots& roots = operator_roots());
/// Paths on which a daemon of this user may listen, the likeliest first, and a text for the user that says
/// why other folders are unsuitable.
struct OperatorPlaces {
  std::vector<std::string> paths;
  std::string faults;
};
/// Returns the places for a prefix. For root, the places include the socket of a service in /run/freeflex.
OperatorPlaces operator_places(const std::string& prefix, const OperatorRoots& roots = operator_roots());

/// Returns the address, or nullopt if the path is empty or too long for a socket (more than 107 characters).
std::optional<sockaddr_un> unix_address(const std::string& path);

}  // namespace freeflex::service
