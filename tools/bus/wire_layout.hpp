// Decoding of messages from files and from the bus that need not be trusted.
#pragma once

#include <cstddef>
#include <span>
#include <string_view>

#include "freeflex_msgs/ack_t.hpp"
#include "freeflex_msgs/applied_t.hpp"
#include "freeflex_msgs/control_t.hpp"
#include "freeflex_msgs/force_t.hpp"
#include "freeflex_msgs/loads_t.hpp"
#include "freeflex_msgs/points_t.hpp"
#include "freeflex_msgs/scene_t.hpp"
#include "freeflex_msgs/shapes_t.hpp"
#include "freeflex_msgs/state_t.hpp"
#include "freeflex_msgs/status_t.hpp"

namespace freeflex::tools {

/// True when the bytes after the fingerprint are exactly one message of the layout. lcm-gen's decode trusts
/// counts: it throws, allocates without bound or reads past the end on a wrong one, so this goes before it.
///   8 4 1    so many bytes
///   s        string: length with terminator, characters, NUL
///   #        count (int32) of an array further on; must not be negative
///   [K:...]  what follows the colon, as often as count K (from 0) of the enclosing [] or message says
/// Blanks mean nothing.
bool fits_layout(std::span<const std::byte> bytes, std::string_view layout);

/// The layout of each message type (messages/NAME.lcm).
std::string_view layout_of(const freeflex_msgs::ack_t&);
std::string_view layout_of(const freeflex_msgs::applied_t&);
std::string_view layout_of(const freeflex_msgs::control_t&);
std::string_view layout_of(const freeflex_msgs::force_t&);
std::string_view layout_of(const freeflex_msgs::loads_t&);
std::string_view layout_of(const freeflex_msgs::points_t&);
std::string_view layout_of(const freeflex_msgs::scene_t&);
std::string_view layout_of(const freeflex_msgs::shapes_t&);
std::string_view layout_of(const freeflex_msgs::state_t&);
std::string_view layout_of(const freeflex_msgs::status_t&);

/// False when the bytes are not exactly one message of this type and version.
template <class Message>
bool decode_message(std::span<const std::byte> bytes, Message& message) {
  if (!fits_layout(bytes, layout_of(message))) return false;
  const int size = static_cast<int>(bytes.size());
  return message.decode(bytes.data(), 0, size) == size;
}

}  // namespace freeflex::tools
