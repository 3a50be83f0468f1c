// Versions of the messages: which earlier one bytes are of, for a refusal that names it.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>

namespace freeflex::io {

/// Version of the .lcm files of this tree: major and minor number of the project's.
extern const char* const kMessagesVersion;

/// A type whose fields were others in an earlier version. Up to and with `sequence`, or `session` where there
/// is none, the front of the messages has been the same in all versions.
struct EarlierType {
  std::string_view name;  // "state_t"
  std::int64_t fingerprint = 0;
  const char* version = "";  // "0.3"
};
/// By the fingerprint in front of the bytes; null when it is none of an earlier version's, or this version's
/// too: a type that did not change is read. Allocates nothing.
const EarlierType* find_earlier(std::span<const std::byte> bytes) noexcept;

/// Why bytes from a file or the bus are no message of this version: "sent by version 0.3 of the messages,
/// this is 0.5", or that they are damaged.
std::string explain_unread(std::span<const std::byte> bytes);

}  // namespace freeflex::io
