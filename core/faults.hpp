// Faults of an input, and their texts. A text says what was found, what is allowed and how to fix the fault.
#pragma once

#include <algorithm>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

namespace freeflex {

/// The position in the input at which an item was written. `source` is an index into Scene::sources. Line and
/// column are numbered from 1, and 0 means unknown.
struct Origin {
  int source = -1;
  int line = 0;
  int column = 0;
};

/// One fault in the input. An error prevents a plan. A warning is reported, but the set-up continues.
struct Fault {
  enum class Severity { kError, kWarning };
  Severity severity = Severity::kError;
  Origin origin{};
  std::string message;  // what was found, what is allowed, how to fix it
};
using Faults = std::vector<Fault>;

/// Returns whether at least one fault is an error.
inline bool has_error(const Faults& faults) {
  return std::any_of(faults.begin(), faults.end(),
                     [](const Fault& fault) { return fault.severity == Fault::Severity::kError; });
}

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
inline std::string quoted(const std::string& name, int index) {
  return name.empty() ? join_text("number ", index + 1) : join_text("'", name, "'");
}

}  // namespace freeflex
