// What links in YAML and in tables share.
#pragma once

#include <optional>
#include <vector>

namespace freeflex::io::reader {

/// The first point that a link names twice, or nullopt.
std::optional<int> find_repeated(const std::vector<int>& points);

}  // namespace freeflex::io::reader
