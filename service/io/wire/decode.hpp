// Calls generated decoders after checking the bytes.
#pragma once

#include <cstddef>
#include <limits>
#include <span>

#include "freeflex_msgs/wire_layouts.hpp"
#include "service/io/wire/wire_walk.hpp"

namespace freeflex::io {

/// Decodes a message. Returns false if the decoder does not consume exactly these bytes.
/// \pre the bytes were checked against the message's layout (walk), and there are at most 2^31 - 1 bytes
template <class Message>
bool decode_walked(std::span<const std::byte> bytes, Message& message) {
  const int size = static_cast<int>(bytes.size());
  return message.decode(bytes.data(), 0, size) == size;
}

/// Decodes untrusted bytes from a file or the bus. Returns false if the bytes are not exactly one message of
/// this type and version.
template <wire::HasLayout Message>
bool decode_message(std::span<const std::byte> bytes, Message& message) {
  if (bytes.size() > index(std::numeric_limits<int>::max())) return false;
  return fits_layout(bytes, *wire::layout_of<Message>) && decode_walked(bytes, message);
}

}  // namespace freeflex::io
