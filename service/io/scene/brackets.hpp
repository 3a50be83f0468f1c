// Brackets of YAML text that nothing closes: libfyaml notices them late, and names another fault.
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
  TextPlace noticed;              // where the next item, the wrong closing bracket or the end stands
  char wrong_closing = 0;         // that which stands there in place of the innermost one's
};

/// The first brackets that stay open: the text ends, another one is closed, or an item of the block around
/// them begins. Quotes and comments are passed over. Meant for text that is known to be faulty.
std::optional<UnclosedBrackets> find_unclosed(std::string_view text);

/// "flow mapping without a closing brace; it was opened on line 2, column 5: close it with '}'"
std::string describe(const UnclosedBrackets& unclosed);

}  // namespace freeflex::io::reader
