// Used for links in YAML and for links in tables.
#pragma once

#include <optional>
#include <vector>

namespace freeflex::io::reader {

/// Returns the first point that a link lists twice, or nullopt.
std::optional<int> find_repeated(const std::vector<int>& points);

}  // namespace freeflex::io::reader
