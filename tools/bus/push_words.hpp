// Rewords rejections of the daemon with the option names of freeflex push.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <string_view>

namespace freeflex::tools {

/// Returns the name of a "point", "group" or "wheel" with this index in the scene, or an empty text if it is
/// unknown.
using NameOf = std::function<std::string(std::string_view kind, std::int64_t index)>;

/// Returns ack_t.text after replacing indices by names, and fields of messages by options. All other text
/// stays the same.
std::string in_push_words(std::string text, const NameOf& name_of);

}  // namespace freeflex::tools
