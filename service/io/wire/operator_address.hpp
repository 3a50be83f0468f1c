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

/// $XDG_RUNTIME_DIR/freeflexd-PREFIX.sock, or /tmp/freeflexd-UID/PREFIX.sock where there is no such folder.
std::string operator_socket_path(const std::string& prefix);

/// Empty when the path is too long for a socket (107 characters).
std::optional<sockaddr_un> unix_address(const std::string& path);

}  // namespace freeflex::service
