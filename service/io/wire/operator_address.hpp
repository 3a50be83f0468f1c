// Where the operator of a daemon finds it without the bus.
#pragma once

#include <sys/un.h>

#include <array>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/step/command.hpp"

namespace freeflex::service {

/// What names of senders on the operator's socket begin with, and no others do.
inline constexpr std::string_view kOperatorSender = "local.";
inline bool is_operator(const std::array<char, kSenderSize>& sender) noexcept {
  return std::string_view(sender.data(), kOperatorSender.size()) == kOperatorSender;
}

/// Target of CLEAR for every sender of the bus.
inline constexpr std::array<char, kSenderSize> kEverySender{'*'};
/// True when CLEAR with this target is about the sender.
inline bool is_target(const std::array<char, kSenderSize>& target,
                      const std::array<char, kSenderSize>& sender) noexcept {
  return target == kEverySender ? !is_operator(sender) : target == sender;
}

/// Where folders for the operator's socket are looked for. Tests have others.
struct OperatorRoots {
  std::string runtime;  // $XDG_RUNTIME_DIR; "": not set
  std::string users = "/run/user";
  std::string system = "/run/freeflex";
  std::string temporary = "/tmp";
};
OperatorRoots operator_roots();

/// The path of the socket, or why there is no place for one (for a person).
struct OperatorPlace {
  std::string path;
  std::string fault;
};
/// Returns the path of the socket of a daemon of this user. Its folder is the first of $XDG_RUNTIME_DIR,
/// /run/user/UID and /run/freeflex that belongs to this user and that nobody else may write to. If none does,
/// it is the folder freeflexd-UID in /tmp, which is created if it is missing and must pass the same check.
OperatorPlace choose_operator_place(const std::string& prefix, const OperatorRoots& roots = operator_roots());
/// Where a daemon of this user may listen, the likeliest first, and why it may not elsewhere (for a person).
struct OperatorPlaces {
  std::vector<std::string> paths;
  std::string faults;
};
/// Returns the places for a prefix. Root also finds the socket of a service in /run/freeflex.
OperatorPlaces operator_places(const std::string& prefix, const OperatorRoots& roots = operator_roots());

/// Empty when the path is too long for a socket (107 characters).
std::optional<sockaddr_un> unix_address(const std::string& path);

}  // namespace freeflex::service
