// Words for faults: what was found, what is allowed, how to fix it.
#pragma once

#include <sstream>
#include <string>
#include <utility>

#include "core/scene/scene.hpp"

namespace freeflex {

/// The parts joined as text; doubles with up to nine digits, enough to recognise what a person wrote.
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

/// What helps where memory ran out.
inline constexpr const char* kMoreMemory =
    "; ask for fewer modes with modes: {count: N}, publish and push fewer points and links, or allow more "
    "memory (ulimit -v)";

/// 'name' in quotes, or "number i" (from 1) when the item has no name.
std::string quoted(const std::string& name, int index);

/// What messages call a link: 'name', or where it stands when it was written without one.
std::string called(const Link& link, int index);

/// "a, b, c and 4 more": at most limit names of the given points.
std::string point_names(const Scene& scene, const std::vector<int>& points, int limit);

}  // namespace freeflex
