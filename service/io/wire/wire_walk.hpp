// The one walk over the bytes of a message, by the tables made from the .lcm files. lcm-gen's decode trusts
// counts: on a wrong one it throws, allocates without bound or reads past the end. So a walk goes before
// every decode of bytes that need not be trusted. Allocates nothing, reads nothing outside the span.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string_view>

#include "messages/wire_layout.hpp"

namespace freeflex::io {

/// Big-endian integer at a byte; empty when it is not whole within the bytes.
template <class Integer>
std::optional<Integer> integer_at(std::span<const std::byte> bytes, std::int64_t at) noexcept {
  const auto end = static_cast<std::int64_t>(bytes.size());
  if (at < 0 || at > end - static_cast<std::int64_t>(sizeof(Integer))) return std::nullopt;
  std::uint64_t bits = 0;
  for (const std::byte byte : bytes.subspan(static_cast<std::size_t>(at), sizeof(Integer)))
    bits = bits << 8 | std::to_integer<std::uint64_t>(byte);
  return static_cast<Integer>(bits);
}

/// Characters of the string whose length stands at a byte, without the terminator; empty when the length is
/// below 1, reaches beyond the bytes or does not end at a NUL. On the wire it takes 4 + size + 1 bytes.
std::optional<std::string_view> string_at(std::span<const std::byte> bytes, std::int64_t at) noexcept;

/// How far the bytes determine a message.
struct WireWalk {
  enum class Stop : std::uint8_t {
    kEnd,           // after the last field
    kBadString,     // at a string that string_at refuses
    kMissingCount,  // at an array whose count, or a count beside it, lies beyond the bytes
    kNegativeCount  // at an array while a count of its struct is negative
  };
  Stop stop = Stop::kEnd;
  std::int64_t size = 0;  // [bytes] of the fields before the stop, fingerprint included; may exceed the bytes
  /// Of the message itself, not of structs inside it, as far as they could be read.
  std::array<std::int32_t, wire::kMaxCounts> counts{};
};
/// Takes the message's fields one after the other. Where nothing but sizes is missing it goes on past the end
/// of the bytes, so that size says how long the message should be. Time is bounded by the number of bytes.
WireWalk walk_message(std::span<const std::byte> bytes, const wire::Layout& layout) noexcept;

/// True when the bytes after the fingerprint are exactly one message of the layout.
bool fits_layout(std::span<const std::byte> bytes, const wire::Layout& layout) noexcept;

}  // namespace freeflex::io
