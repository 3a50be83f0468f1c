// The readers of links in YAML and of links in tables share this function.
#pragma once

#include <optional>
#include <vector>

namespace freeflex::io::reader {

/// Returns the first point that a link lists twice, or nullopt.
std::optional<int> find_repeated(const std::vector<int>& points);

}  // namespace freeflex::io::reader
