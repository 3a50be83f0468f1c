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
  TextPlace noticed;  // position of what showed the fault: an item, a wrong closing bracket or the end of the
                      // text
  // the closing bracket at this position, if it does not match the innermost opening bracket; else 0
  char wrong_closing = 0;
};

/// Scans the text until it ends, a bracket of the other kind is closed, or an item of the surrounding block
/// begins. Returns the brackets that are open there, but only the innermost one at a wrong closing bracket.
/// Returns nullopt if all brackets are closed or a quote is not closed. Skips quoted text and comments. Call
/// only for text that is known to be faulty.
std::optional<UnclosedBrackets> find_unclosed(std::string_view text);

/// Returns "flow mapping without a closing brace; it was opened on line 2, column 5: close it with '}'".
std::string describe(const UnclosedBrackets& unclosed);

}  // namespace freeflex::io::reader
