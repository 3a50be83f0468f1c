// Walks over the bytes of a message, using the tables that are generated from the .lcm files. The decoders of
// lcm-gen trust counts. If a count is wrong, such a decoder throws, allocates without bound or reads past the
// end. Therefore a walk precedes every decoding of untrusted bytes. The walk allocates nothing and reads
// nothing outside the span.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string_view>

#include "core/index.hpp"
#include "messages/wire_layout.hpp"

namespace freeflex::io {

/// Returns the big-endian integer at an offset, or nullopt if the integer does not lie within the bytes.
template <class Integer>
std::optional<Integer> integer_at(std::span<const std::byte> bytes, std::int64_t at) noexcept {
  const auto end = static_cast<std::int64_t>(bytes.size());
  if (at < 0 || at > end - static_cast<std::int64_t>(sizeof(Integer))) return std::nullopt;
  std::uint64_t bits = 0;
  for (const std::byte byte : bytes.subspan(index(at), sizeof(Integer)))
    bits = bits << 8 | std::to_integer<std::uint64_t>(byte);
  return static_cast<Integer>(bits);
}

/// Returns the characters of the string whose length is at an offset, without the terminator, or nullopt if
/// the length is below 1 or extends past the bytes, or the last character is not NUL. On the wire a string of
/// `size` characters takes 4 + size + 1 bytes.
std::optional<std::string_view> string_at(std::span<const std::byte> bytes, std::int64_t at) noexcept;

/// Result of a walk: the place at which it stopped, and the size and counts up to there.
struct WireWalk {
  enum class Stop : std::uint8_t {
    kEnd,           // after the last field
    kBadString,     // the walk stopped at a string that string_at refuses
    kMissingCount,  // the walk stopped at an array whose count, or another count of the same struct, lies
                    // beyond the bytes
    kNegativeCount  // the walk stopped at an array while a count of its struct is negative
  };
  Stop stop = Stop::kEnd;
  std::int64_t size = 0;  // [bytes] size of fingerprint and fields before the stop; may exceed the number of
                          // bytes
  /// Counts of the message itself, 0 if a count could not be read. Counts of structs inside the message are
  /// not included.
  std::array<std::int32_t, wire::kMaxCounts> counts{};
};
/// Walks over the message's fields. Continues past the end of the bytes while the sizes of the next fields
/// are known, so that `size` is the length that the message should have. The time of a walk is bounded by the
/// number of bytes, whatever the counts are.
WireWalk walk_message(std::span<const std::byte> bytes, const wire::Layout& layout) noexcept;

/// Returns true if the bytes after the fingerprint are exactly the fields of one message of the layout. Does
/// not check the fingerprint.
bool fits_layout(std::span<const std::byte> bytes, const wire::Layout& layout) noexcept;

}  // namespace freeflex::io
