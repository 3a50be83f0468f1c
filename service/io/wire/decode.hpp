// Generated decode behind the walk.
#pragma once

#include <cstddef>
#include <limits>
#include <span>

#include "freeflex_msgs/wire_layouts.hpp"
#include "service/io/wire/wire_walk.hpp"

namespace freeflex::io {

/// Generated decode; false when it does not take exactly these bytes.
/// \pre the bytes passed a walk by the message's layout, and there are at most 2^31 - 1 of them
template <class Message>
bool decode_walked(std::span<const std::byte> bytes, Message& message) {
  const int size = static_cast<int>(bytes.size());
  return message.decode(bytes.data(), 0, size) == size;
}

/// For bytes from a file or the bus that need not be trusted. False when they are not exactly one message of
/// this type and version.
template <wire::HasLayout Message>
bool decode_message(std::span<const std::byte> bytes, Message& message) {
  if (bytes.size() > static_cast<std::size_t>(std::numeric_limits<int>::max())) return false;
  return fits_layout(bytes, *wire::layout_of<Message>) && decode_walked(bytes, message);
}

}  // namespace freeflex::io
