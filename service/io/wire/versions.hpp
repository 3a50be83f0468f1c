// Recognizes messages of earlier versions, so that a refusal can report the version.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>

namespace freeflex::io {

/// Version of the .lcm files of this source tree: the project's major and minor number.
extern const char* const kMessagesVersion;

/// A message type of an earlier version. In all versions a message of this type begins with the same fields,
/// up to and including `sequence`, or up to `session` if the message has no `sequence`.
struct EarlierType {
  std::string_view name;  // "state_t"
  std::int64_t fingerprint = 0;
  const char* version = "";  // "0.3"
};
/// Finds the earlier type by the fingerprint at the start of the bytes. Returns nullptr if no earlier version
/// has the fingerprint. Also returns nullptr if a type of this version has the fingerprint, because the type
/// is then unchanged and can be read. Allocates nothing.
const EarlierType* find_earlier(std::span<const std::byte> bytes) noexcept;

/// Returns the reason why bytes from a file or the bus are not a message of this version: "of version 0.3 of
/// the messages, but this program reads version 0.5", or that the bytes are damaged or of an unknown version.
std::string explain_unread(std::span<const std::byte> bytes);

}  // namespace freeflex::io
