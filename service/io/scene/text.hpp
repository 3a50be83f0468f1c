// Text of a scene: numbers without units, names, and what a person may have meant.
#pragma once

#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace freeflex::io::reader {

enum class Bound { kAny, kNonNegative, kPositive, kPoissonRatio, kTickRate };

/// Numbers from the least to the most, which belong to it or do not.
struct Range {
  double least = -std::numeric_limits<double>::infinity();
  double most = std::numeric_limits<double>::infinity();
  bool has_least = true, has_most = true;

  bool holds(double value) const {
    return (has_least ? value >= least : value > least) && (has_most ? value <= most : value < most);
  }
};
Range range_of(Bound bound);

/// What a number stands for: its SI unit ("-" for none) and its range.
struct Quantity {
  std::string_view unit;
  Bound bound = Bound::kAny;
};

/// "a number > 0 [N/m]"
std::string describe(const Quantity& quantity);

struct NumberResult {
  std::optional<double> value;
  std::string problem;  // continues "stiffness ", empty with a value
};
/// Decimal number in the C locale, finite, in range. Refused with a reason: nan, inf, hexadecimal, leading
/// zeros (octal to some readers), decimal commas, underscores, and units, which are converted in the text.
NumberResult parse_number(std::string_view text, const Quantity& quantity);

/// Decimal integer from `least` to `most`, or nullopt.
std::optional<std::int64_t> parse_integer(std::string_view text, std::int64_t least, std::int64_t most);

/// Shortest decimal text that reads back as the number.
std::string format_number(double value);

/// 'text' in quotes for a message: cut at 60 characters, control characters and bad UTF-8 replaced.
std::string quote(std::string_view text);

/// The candidate nearest to text by edit distance; empty when none is near.
std::string_view nearest_word(std::string_view text, const std::vector<std::string_view>& candidates);

/// " (did you mean 'mass'?)" for the candidate nearest to text by edit distance, or nothing when none is
/// near.
std::string did_you_mean(std::string_view text, const std::vector<std::string_view>& candidates);

/// Letters A to Z as a to z, the rest as it is.
std::string lower(std::string_view text);

/// "a, b, c"
std::string join(const std::vector<std::string_view>& words);

/// What is wrong with a name, or empty: 1 to 63 of A-Z a-z 0-9 _ . - without "..", not "all".
std::string name_problem(std::string_view name);

/// Byte offset of the first byte that is not UTF-8 or is a control character other than tab, LF, CR; or npos.
std::size_t find_bad_byte(std::string_view text);

/// Line and column from 1 of a byte offset; columns count characters.
struct TextPlace {
  int line = 1;
  int column = 1;
};
TextPlace locate(std::string_view text, std::size_t offset);

}  // namespace freeflex::io::reader
