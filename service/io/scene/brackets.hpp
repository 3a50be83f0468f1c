// Finds unclosed brackets in YAML text. libfyaml notices such brackets late and reports a different fault.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "service/io/scene/text.hpp"

namespace freeflex::io::reader {

struct UnclosedBrackets {
  struct Bracket {
    char opening;  // { or [
    TextPlace place;
  };
  std::vector<Bracket> brackets;  // innermost first, at least one
  TextPlace noticed;  // position of the item, of the wrong closing bracket or of the end of the text that
                      // showed the fault
  // the closing bracket at that position, if it does not match the innermost one; else 0
  char wrong_closing = 0;
};

/// Returns the first brackets that are still open when the text ends, when a bracket of the other kind is
/// closed, or when an item of the surrounding block begins. Skips quotes and comments. Call only for text
/// that is known to be faulty.
std::optional<UnclosedBrackets> find_unclosed(std::string_view text);

/// Returns "flow mapping without a closing brace; it was opened on line 2, column 5: close it with '}'".
std::string describe(const UnclosedBrackets& unclosed);

}  // namespace freeflex::io::reader
