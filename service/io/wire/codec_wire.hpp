// The front of a command, read before any generated decode. For the codec and the verifier.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string_view>

namespace freeflex::io {

/// What stands in front of every command.
struct Head {
  std::int64_t session = 0;
  std::string_view sender;  // into the bytes, without the terminator
  std::int64_t sequence = 0;
};
/// Empty when the bytes end too early or the sender's string is not one terminated string.
std::optional<Head> read_head(std::span<const std::byte> bytes) noexcept;

/// True for an envelope_t in place of a command; of what is too long nothing is read.
bool is_envelope(std::span<const std::byte> bytes) noexcept;
/// The command inside an envelope, which nobody has looked at. Empty when the bytes are not exactly one.
std::optional<std::span<const std::byte>> find_body(std::span<const std::byte> bytes) noexcept;

/// snprintf into text; nothing when text is empty.
__attribute__((format(printf, 2, 3))) void print(std::span<char> text, const char* format, ...) noexcept;

}  // namespace freeflex::io
