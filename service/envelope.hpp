// The receiving end of messages/seal.hpp. No thread, no allocation.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string_view>

#include "messages/seal.hpp"

namespace freeflex::service {

/// An envelope_t where it lies: views into its bytes.
struct Envelope {
  std::string_view key_id;  // a name, 1 to 31 of A-Z a-z 0-9 _ . -
  std::int64_t session = 0;
  std::int64_t sequence = 0;
  std::int64_t valid_until = 0;  // [us]
  std::span<const std::byte> body;
  std::span<const std::byte> before_tag;
  std::span<const std::byte> tag;  // (32)
};

/// Empty unless the bytes are exactly one envelope_t whose key id is a name.
std::optional<Envelope> read_envelope(std::span<const std::byte> bytes) noexcept;

/// True when the holder of the key sealed these bytes for this channel. Takes as long for a wrong tag as for
/// the right one.
bool has_right_tag(const Envelope& envelope, std::string_view channel, const SealingKey& key) noexcept;

}  // namespace freeflex::service
