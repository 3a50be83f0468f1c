// Text of a scene: numbers without units, names, and suggestions for misspelt words.
#pragma once

#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace freeflex::io::reader {

enum class Bound { kAny, kNonNegative, kPositive, kPoissonRatio, kTickRate, kShare, kMicrosecond, kAccuracy };

/// A range of numbers, of which each end may be included or excluded.
struct Range {
  double least = -std::numeric_limits<double>::infinity();
  double most = std::numeric_limits<double>::infinity();
  bool has_least = true, has_most = true;

  bool holds(double value) const {
    return (has_least ? value >= least : value > least) && (has_most ? value <= most : value < most);
  }
};
Range range_of(Bound bound);

/// SI unit of a number ("-" for no unit) and its range.
struct Quantity {
  std::string_view unit;
  Bound bound = Bound::kAny;
};

/// Returns "a number > 0 [N/m]".
std::string describe(const Quantity& quantity);

struct NumberResult {
  std::optional<double> value;
  std::string problem;  // fault of the number, to follow "stiffness "; empty if there is a value
};
/// Parses a decimal number, which must be finite and in range. Ignores the locale. Refuses, with a reason:
/// nan, inf, hexadecimal numbers, leading zeros (some readers take them as octal), decimal commas,
/// underscores and units. For a known unit of the right kind, the reason gives the value in SI.
NumberResult parse_number(std::string_view text, const Quantity& quantity);

/// Parses a decimal integer from `least` to `most`. Returns nullopt for any other text.
std::optional<std::int64_t> parse_integer(std::string_view text, std::int64_t least, std::int64_t most);

/// Returns the shortest decimal text from which the same number is read back.
std::string format_number(double value);

/// Returns the text in quotes for a message, cut at 60 characters and with control characters and invalid
/// UTF-8 replaced.
std::string quote(std::string_view text);

/// Returns the candidate with the smallest edit distance from the text, or an empty text if no candidate is
/// near.
std::string_view nearest_word(std::string_view text, const std::vector<std::string_view>& candidates);

/// Returns " (did you mean 'mass'?)" for the candidate with the smallest edit distance from the text, or an
/// empty text if no candidate is near.
std::string did_you_mean(std::string_view text, const std::vector<std::string_view>& candidates);

/// Returns the text with letters A to Z in lower case.
std::string lower(std::string_view text);

/// Returns "a, b, c".
std::string join(const std::vector<std::string_view>& words);

/// Returns an empty string if the name has 1 to 63 characters of A-Z a-z 0-9 _ . - , does not contain ".."
/// and is not "all", else the error.
std::string name_problem(std::string_view name);

/// Returns the offset of the first byte that is invalid UTF-8 or a control character other than tab, LF and
/// CR, or npos if there is none.
std::size_t find_bad_byte(std::string_view text);

/// The line and the column of a byte offset, both from 1. Columns count characters.
struct TextPlace {
  int line = 1;
  int column = 1;
};
TextPlace locate(std::string_view text, std::size_t offset);

}  // namespace freeflex::io::reader
