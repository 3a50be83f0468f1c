// The receiving side of messages/seal.hpp. Starts no thread and allocates nothing.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string_view>

#include "messages/seal.hpp"

namespace freeflex::service {

/// Views into the bytes of an envelope_t.
struct Envelope {
  std::string_view key_id;  // a name, 1 to 31 of A-Z a-z 0-9 _ . -
  std::int64_t session = 0;
  std::int64_t sequence = 0;
  std::int64_t valid_until = 0;  // [us]
  std::span<const std::byte> body;
  std::span<const std::byte> before_tag;
  std::span<const std::byte> tag;  // (32)
};

/// Returns the envelope, or nullopt if the bytes are not exactly one envelope_t or its key id is not a valid
/// name.
std::optional<Envelope> read_envelope(std::span<const std::byte> bytes) noexcept;

/// Returns true if the envelope was sealed for this channel with this key. Compares in constant time.
bool has_right_tag(const Envelope& envelope, std::string_view channel, const SealingKey& key) noexcept;

}  // namespace freeflex::service
