// Converts messages to JSON and to one line of text.
#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <string_view>

#include "tools/terminal/console.hpp"
#include "tools/terminal/json.hpp"

namespace freeflex::tools {

/// A message that was decoded according to its channel.
// NOLINTNEXTLINE(bugprone-exception-escape): moving a Json never throws
struct DecodedMessage {
  Json fields;          // null if the message is not a message of freeflex, or is damaged
  std::string summary;  // one line, may be empty
  // Messages of one stream have numbers in equal steps. If the stream is empty, the message is not numbered.
  std::string stream;
  std::int64_t number = 0;
  std::int64_t step = 0;  // difference of successive numbers; 0: take the smallest one that occurs
};

/// Decodes a message by the suffix of its channel name, without the prefix ("_STATE"). Never throws.
DecodedMessage decode_by_suffix(std::string_view suffix, std::span<const std::byte> bytes);

}  // namespace freeflex::tools
