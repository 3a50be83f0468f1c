// The daemon's reasons in the words of freeflex push.
#pragma once

#include <span>
#include <string>

namespace freeflex::tools {

/// ack_t.text for whoever typed the command: entries become names, fields become options. What has no other
/// word stays as it is. \param points, groups  names in the order of the command's forces and wrenches
std::string in_push_words(std::string text, std::span<const std::string> points,
                          std::span<const std::string> groups);

}  // namespace freeflex::tools
