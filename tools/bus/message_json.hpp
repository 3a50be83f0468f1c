// Messages as JSON and as one line of text.
#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <string_view>

#include "tools/terminal/console.hpp"
#include "tools/terminal/json.hpp"

namespace freeflex::tools {

/// What is known of a message by its channel.
// NOLINTNEXTLINE(bugprone-exception-escape): the move of Json is noexcept, whatever it calls
struct DecodedMessage {
  Json fields;          // null: not one of ours, or damaged
  std::string summary;  // one line, may be empty
  // Messages of one stream follow each other at equal steps of number; empty stream: not numbered.
  std::string stream;
  std::int64_t number = 0;
  std::int64_t step = 0;  // 0: the smallest step seen
};

/// Decodes by the part of the channel name after the prefix ("_STATE"). Never throws.
DecodedMessage decode_by_suffix(std::string_view suffix, std::span<const std::byte> bytes);

}  // namespace freeflex::tools
