// The bytes of a command walked by hand, before any generated decode. Private to the codec.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string_view>

#include "service/io/wire/reason.hpp"

namespace freeflex::io {

/// What stands in front of force_t and control_t alike.
struct Head {
  std::int64_t session = 0;
  std::string_view sender;  // into the bytes, without the terminator
  std::int64_t sequence = 0;
  std::size_t size = 0;  // bytes up to here, fingerprint included
};
/// Empty when the bytes end too early or the sender's string is not one terminated string.
std::optional<Head> read_head(std::span<const std::byte> bytes) noexcept;

/// As wire_check_force and wire_check_control of codec.hpp, with the finding in words.
Reason check_force_layout(std::span<const std::byte> bytes, std::span<char> text) noexcept;
Reason check_control_layout(std::span<const std::byte> bytes, std::span<char> text) noexcept;

/// snprintf into text; nothing when text is empty.
__attribute__((format(printf, 2, 3))) void print(std::span<char> text, const char* format, ...) noexcept;

}  // namespace freeflex::io
