// Reads the first fields of a command before a generated decoder is called. The codec and the verifier use
// these functions.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string_view>

namespace freeflex::io {

/// Fields that every command begins with.
struct Head {
  std::int64_t session = 0;
  std::string_view sender;  // view into the bytes, without the terminator
  std::int64_t sequence = 0;
};
/// Returns the first fields, or nullopt if the bytes end too early or the sender is not one terminated
/// string.
std::optional<Head> read_head(std::span<const std::byte> bytes) noexcept;

/// Returns true if the bytes begin with the fingerprint of envelope_t and are not more than
/// channels::kMaxMessageBytes.
bool is_envelope(std::span<const std::byte> bytes) noexcept;
/// Returns the bytes of the command inside an envelope, which are not checked, or nullopt if the bytes are
/// not exactly one envelope.
std::optional<std::span<const std::byte>> find_body(std::span<const std::byte> bytes) noexcept;

/// Formats into text as snprintf does, but does nothing if text is an empty span.
__attribute__((format(printf, 2, 3))) void print(std::span<char> text, const char* format, ...) noexcept;

}  // namespace freeflex::io
