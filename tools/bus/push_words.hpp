// The daemon's reasons in the words of freeflex push.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <string_view>

namespace freeflex::tools {

/// The name of a "point", "group" or "wheel" by its index in the scene; empty where none is known.
using NameOf = std::function<std::string(std::string_view kind, std::int64_t index)>;

/// Returns ack_t.text in the words of whoever typed the command: indices become names, fields become options.
/// What has no other word stays as it is.
std::string in_push_words(std::string text, const NameOf& name_of);

}  // namespace freeflex::tools
