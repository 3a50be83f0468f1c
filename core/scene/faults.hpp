// This code makes the text of a fault. The text says what was found, what is allowed and how to fix the
// fault.
#pragma once

#include <sstream>
#include <string>
#include <utility>

#include "core/scene/scene.hpp"

namespace freeflex {

/// Returns the arguments joined as text. Doubles have up to nine digits, enough to recognise the input.
template <typename... Parts>
std::string join_text(const Parts&... parts) {
  std::ostringstream out;
  out.precision(9);
  (out << ... << parts);
  return out.str();
}

inline void add_error(Faults& faults, const Origin& origin, std::string message) {
  faults.push_back({Fault::Severity::kError, origin, std::move(message)});
}

inline void add_warning(Faults& faults, const Origin& origin, std::string message) {
  faults.push_back({Fault::Severity::kWarning, origin, std::move(message)});
}

/// Remedy at the end of messages about lack of memory.
inline constexpr const char* kMoreMemory =
    "; ask for fewer modes with modes: {count: N}, publish and push fewer points and links, or allow more "
    "memory (ulimit -v)";

/// Returns 'name' in quotes, or "number i" (from 1) for an item without a name.
std::string quoted(const std::string& name, int index);

/// Returns the label of a link in messages. The label is 'name', or the position in the source list if the
/// link has no name.
std::string called(const Link& link, int index);

/// Returns the names of the given points, at most `limit` of them: "a, b, c and 4 more".
std::string point_names(const Scene& scene, const std::vector<int>& points, int limit);

}  // namespace freeflex
