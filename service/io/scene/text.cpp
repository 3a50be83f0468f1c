#include "service/io/scene/text.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <iterator>
#include <numeric>

#include "core/limits.hpp"
#include "core/scene/scene.hpp"

namespace freeflex::io::reader {
namespace {

bool is_digit(char c) { return c >= '0' && c <= '9'; }

char lower(char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c; }

// returns the length of the longest decimal number at the start of text: sign, digits, point, exponent
std::size_t number_length(std::string_view text) {
  std::size_t i = 0;
  const auto skip_digits = [&] {
    const std::size_t start = i;
    while (i < text.size() && is_digit(text[i])) ++i;
    return i - start;
  };
  if (i < text.size() && (text[i] == '+' || text[i] == '-')) ++i;
  std::size_t digits = skip_digits();
  if (i < text.size() && text[i] == '.') {
    ++i;
    digits += skip_digits();
  }
  if (digits == 0) return 0;
  if (i < text.size() && lower(text[i]) == 'e') {
    const std::size_t mantissa = i++;
    if (i < text.size() && (text[i] == '+' || text[i] == '-')) ++i;
    if (skip_digits() == 0) return mantissa;
  }
  return i;
}

std::optional<double> to_double(std::string_view text) {
  if (!text.empty() && text.front() == '+') text.remove_prefix(1);
  double value = 0.0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc{} || end != text.data() + text.size() || !std::isfinite(value)) return std::nullopt;
  return value;
}

// common units with their SI unit and factor. Spaces, * and ^ are removed before the look-up.
struct UnitName {
  std::string_view name;
  std::string_view si;
  double factor;
};
constexpr double kRadian = 0.017453292519943295;  // [rad] in a degree
constexpr auto kUnits = std::to_array<UnitName>({
    {"m", "m", 1},
    {"km", "m", 1e3},
    {"cm", "m", 1e-2},
    {"mm", "m", 1e-3},
    {"um", "m", 1e-6},
    {"nm", "m", 1e-9},
    {"angstrom", "m", 1e-10},
    {"in", "m", 0.0254},
    {"ft", "m", 0.3048},
    {"kg", "kg", 1},
    {"g", "kg", 1e-3},
    {"mg", "kg", 1e-6},
    {"t", "kg", 1e3},
    {"lb", "kg", 0.45359237},
    {"s", "s", 1},
    {"ms", "s", 1e-3},
    {"us", "s", 1e-6},
    {"min", "s", 60},
    {"h", "s", 3600},
    {"Hz", "Hz", 1},
    {"kHz", "Hz", 1e3},
    {"MHz", "Hz", 1e6},
    {"1/s", "1/s", 1},
    {"1/s", "Hz", 1},
    {"N", "N", 1},
    {"mN", "N", 1e-3},
    {"kN", "N", 1e3},
    {"MN", "N", 1e6},
    {"GN", "N", 1e9},
    {"lbf", "N", 4.4482216152605},
    {"N/m", "N/m", 1},
    {"kN/m", "N/m", 1e3},
    {"MN/m", "N/m", 1e6},
    {"N/mm", "N/m", 1e3},
    {"kN/mm", "N/m", 1e6},
    {"Nm", "N m", 1},
    {"kNm", "N m", 1e3},
    {"Nmm", "N m", 1e-3},
    {"Nm/rad", "N m/rad", 1},
    {"kNm/rad", "N m/rad", 1e3},
    {"Nmm/rad", "N m/rad", 1e-3},
    {"Nm", "N m/rad", 1},
    {"kNm", "N m/rad", 1e3},
    {"Nmm", "N m/rad", 1e-3},
    {"Ns/m", "N s/m", 1},
    {"kNs/m", "N s/m", 1e3},
    {"Ns/mm", "N s/m", 1e3},
    {"kg/s", "N s/m", 1},
    {"Ns2/m", "N s^2/m", 1},
    {"kg", "N s^2/m", 1},
    {"m/N", "m/N", 1},
    {"mm/N", "m/N", 1e-3},
    {"m/kN", "m/N", 1e-3},
    {"Pa", "Pa", 1},
    {"kPa", "Pa", 1e3},
    {"MPa", "Pa", 1e6},
    {"GPa", "Pa", 1e9},
    {"N/m2", "Pa", 1},
    {"N/mm2", "Pa", 1e6},
    {"Nm2", "N m^2", 1},
    {"kNm2", "N m^2", 1e3},
    {"Nmm2", "N m^2", 1e-6},
    {"m/s", "m/s", 1},
    {"mm/s", "m/s", 1e-3},
    {"km/s", "m/s", 1e3},
    {"km/h", "m/s", 1 / 3.6},
    {"m/s2", "m/s^2", 1},
    {"mm/s2", "m/s^2", 1e-3},
    {"m3/s2", "m^3/s^2", 1},
    {"km3/s2", "m^3/s^2", 1e9},
    {"rad", "rad", 1},
    {"deg", "rad", kRadian},
    {"\u00b0", "rad", kRadian},
    {"rad/s", "rad/s", 1},
    {"deg/s", "rad/s", kRadian},
    {"rpm", "rad/s", 0.10471975511965977},
    {"%", "-", 1e-2},
});

// returns a number that has commas in its correct form, or in both possible forms, or an empty text if there
// is none. A single comma may be a decimal point, and one or more commas may separate thousands.
std::string without_commas(std::string_view text) {
  const auto num_commas = std::count(text.begin(), text.end(), ',');
  std::string point(text), whole;
  std::replace(point.begin(), point.end(), ',', '.');
  std::copy_if(text.begin(), text.end(), std::back_inserter(whole), [](char c) { return c != ','; });
  const auto is_number = [](std::string_view number) { return number_length(number) == number.size(); };
  bool has_thousands = is_number(whole);
  for (std::size_t at = text.find(','); at != std::string_view::npos; at = text.find(',', at + 1)) {
    const std::size_t digits = text.substr(at + 1).find_first_not_of("0123456789");
    has_thousands =
        has_thousands && at > 0 && is_digit(text[at - 1]) && std::min(digits, text.size() - at - 1) == 3;
  }
  if (num_commas == 1 && is_number(point)) return point + (has_thousands ? ", or " + whole : "");
  return has_thousands ? whole : "";
}

std::string explain_comma(std::string_view text) {
  const std::string better = without_commas(text);
  return quote(text) + " has a comma, but must be a number with a decimal point" +
         (better.empty() ? "" : "; write " + better);
}

// returns the fault of a number that is followed by more text
std::string explain_tail(std::string_view number, std::string_view tail, std::string_view text,
                         const Quantity& quantity) {
  const std::string found = quote(text);
  if ((number == "0" || number == "-0" || number == "+0") && lower(tail.front()) == 'x')
    return found + " is hexadecimal, but must be a decimal number";
  if (tail.front() == ',') return explain_comma(text);
  if (tail.front() == '_') return found + " has an underscore, but must be digits only";
  std::string unit;
  for (const char c : tail)
    if (c != ' ' && c != '\t' && c != '*' && c != '^') unit += c;
  const bool is_known =
      std::any_of(kUnits.begin(), kUnits.end(), [&](const UnitName& u) { return u.name == unit; });
  if (!is_known)
    return found + " is not a number, but must be " + describe(quantity) + ", in SI without a unit";
  for (const UnitName& candidate : kUnits)
    if (candidate.name == unit && candidate.si == quantity.unit) {
      const auto value = to_double(number);
      if (!value) break;
      std::array<char, 32> converted{};
      std::snprintf(converted.data(), converted.size(), "%.12g", *value * candidate.factor);
      return found + " has a unit, but must be a plain number in SI units" +
             (quantity.unit == "-" ? "" : " [" + std::string(quantity.unit) + "]") + "; write " +
             converted.data();
    }
  return found + " has a unit of another kind, but must be " + describe(quantity) + ", in SI without a unit";
}

bool has_leading_zero(std::string_view number) {
  if (number.front() == '+' || number.front() == '-') number.remove_prefix(1);
  return number.size() > 1 && number[0] == '0' && is_digit(number[1]);
}

std::string without_leading_zeros(std::string_view number) {
  std::string result;
  if (number.front() == '-') result = "-";
  if (number.front() == '+' || number.front() == '-') number.remove_prefix(1);
  while (number.size() > 1 && number[0] == '0' && is_digit(number[1])) number.remove_prefix(1);
  return result + std::string(number);
}

// returns the number of insertions, deletions, substitutions and swaps of neighbouring characters that change
// a into b
std::size_t edit_distance(std::string_view a, std::string_view b) {
  std::vector<std::size_t> before(b.size() + 1), last(b.size() + 1), row(b.size() + 1);
  std::iota(last.begin(), last.end(), std::size_t{0});
  for (std::size_t i = 1; i <= a.size(); ++i) {
    row[0] = i;
    for (std::size_t j = 1; j <= b.size(); ++j) {
      row[j] = std::min({last[j] + 1, row[j - 1] + 1, last[j - 1] + (a[i - 1] == b[j - 1] ? 0 : 1)});
      if (i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1])
        row[j] = std::min(row[j], before[j - 2] + 1);
    }
    std::swap(before, last);
    std::swap(last, row);
  }
  return last[b.size()];
}

// returns the length [bytes] of the UTF-8 character at the start of text, or 0 if the character is invalid
std::size_t utf8_length(std::string_view text) {
  const auto byte = [&](std::size_t i) { return static_cast<unsigned char>(text[i]); };
  const unsigned char first = byte(0);
  if (first < 0x80) return 1;
  const std::size_t length = first >= 0xc2 && first < 0xe0   ? 2
                             : first >= 0xe0 && first < 0xf0 ? 3
                             : first >= 0xf0 && first < 0xf5 ? 4
                                                             : 0;
  if (length == 0 || text.size() < length) return 0;
  for (std::size_t i = 1; i < length; ++i)
    if ((byte(i) & 0xc0) != 0x80) return 0;
  if (first == 0xe0 && byte(1) < 0xa0) return 0;  // overlong
  if (first == 0xed && byte(1) > 0x9f) return 0;  // surrogates
  if (first == 0xf0 && byte(1) < 0x90) return 0;  // overlong
  if (first == 0xf4 && byte(1) > 0x8f) return 0;  // above U+10FFFF
  return length;
}

bool is_control(std::string_view character) {
  const auto first = static_cast<unsigned char>(character[0]);
  if (character.size() == 1) return first < 0x20 || first == 0x7f;
  return first == 0xc2 && static_cast<unsigned char>(character[1]) < 0xa0;  // U+0080 to U+009F
}

}  // namespace

std::string lower(std::string_view text) {
  std::string result(text);
  for (char& c : result) c = lower(c);
  return result;
}

Range range_of(Bound bound) {
  Range range;
  if (bound == Bound::kNonNegative || bound == Bound::kPositive) range.least = 0.0;
  range.has_least = bound != Bound::kPositive;
  if (bound == Bound::kPoissonRatio) range = {-1.0, 0.5, false, false};
  if (bound == Bound::kTickRate) range = {kLeastRate, kMostRate};
  if (bound == Bound::kShare) range = {1e-3, 1.0};
  if (bound == Bound::kMicrosecond) range.least = 1e-6;
  if (bound == Bound::kAccuracy) range = {kLeastAccuracy, kMostAccuracy};
  return range;
}

std::string describe(const Quantity& quantity) {
  std::string text = "a number";
  if (quantity.bound == Bound::kPositive) text += " > 0";
  if (quantity.bound == Bound::kNonNegative) text += " >= 0";
  if (quantity.bound == Bound::kPoissonRatio) text += " > -1 and < 0.5";
  if (quantity.bound == Bound::kTickRate) text += " from 0.001 to 1000000";
  if (quantity.bound == Bound::kShare) text += " from 0.001 to 1";
  if (quantity.bound == Bound::kMicrosecond) text += " >= 1e-6";
  if (quantity.bound == Bound::kAccuracy) text += " from 1e-10 to 0.001";
  if (quantity.unit != "-") text += " [" + std::string(quantity.unit) + "]";
  return text;
}

NumberResult parse_number(std::string_view text, const Quantity& quantity) {
  const std::size_t length = number_length(text);
  if (length == 0) {
    std::string word = lower(text);
    if (!word.empty() && (word[0] == '+' || word[0] == '-')) word.erase(0, 1);
    if (!word.empty() && word[0] == '.') word.erase(0, 1);
    if (word == "nan" || word == "inf" || word == "infinity")
      return {{}, quote(text) + " is not finite, but must be " + describe(quantity)};
    if (text.find(',') != std::string_view::npos && !without_commas(text).empty())
      return {{}, explain_comma(text)};
    return {{}, quote(text) + " is not a number, but must be " + describe(quantity)};
  }
  if (length < text.size())
    return {{}, explain_tail(text.substr(0, length), text.substr(length), text, quantity)};
  if (has_leading_zero(text))
    return {{},
            quote(text) + " has a leading zero, which some programs read as octal; write " +
                without_leading_zeros(text)};
  const auto value = to_double(text);
  if (!value)
    return {{}, quote(text) + " is too large or too small for a double, but must be " + describe(quantity)};
  if (!range_of(quantity.bound).holds(*value)) {
    const std::string range = describe({"-", quantity.bound}).substr(std::string_view("a number ").size());
    return {{},
            "is " + std::string(text) + (quantity.unit == "-" ? "" : " " + std::string(quantity.unit)) +
                ", but must be " + range};
  }
  return {value, {}};
}

std::optional<std::int64_t> parse_integer(std::string_view text, std::int64_t least, std::int64_t most) {
  std::int64_t value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc{} || end != text.data() + text.size() || text.empty()) return std::nullopt;
  if (text.size() > 1 && has_leading_zero(text)) return std::nullopt;
  if (value < least || value > most) return std::nullopt;
  return value;
}

std::string format_number(double value) {
  std::array<char, 32> text{};
  const auto end = std::to_chars(text.data(), text.data() + text.size(), value).ptr;
  return {text.data(), end};
}

std::string quote(std::string_view text) {
  constexpr std::size_t kShown = 60;
  std::string shown = "'";
  std::size_t i = 0;
  for (std::size_t count = 0; i < text.size() && count < kShown; ++count) {
    const std::size_t length = utf8_length(text.substr(i));
    const std::string_view character = text.substr(i, std::max<std::size_t>(length, 1));
    shown += length == 0 || is_control(character) ? std::string_view("?") : character;
    i += character.size();
  }
  return shown + (i < text.size() ? "...'" : "'");
}

std::string_view nearest_word(std::string_view text, const std::vector<std::string_view>& candidates) {
  if (text.empty() || text.size() > 64) return {};
  const std::string wanted = lower(text);
  const std::size_t allowed = std::max<std::size_t>(1, text.size() / 3);
  std::size_t best = allowed + 1;
  std::string_view nearest;
  for (const std::string_view candidate : candidates) {
    const std::size_t difference =
        candidate.size() > text.size() ? candidate.size() - text.size() : text.size() - candidate.size();
    if (difference >= best) continue;
    const std::size_t distance = edit_distance(wanted, lower(candidate));
    // a suggestion that equals the refused word would not help
    if (distance < best && distance < candidate.size() && candidate != text) {
      best = distance;
      nearest = candidate;
    }
  }
  return nearest;
}

std::string did_you_mean(std::string_view text, const std::vector<std::string_view>& candidates) {
  const std::string_view nearest = nearest_word(text, candidates);
  if (nearest.empty()) return {};
  return " (did you mean " + quote(nearest) + "?)";
}

std::string join(const std::vector<std::string_view>& words) {
  std::string text;
  for (const std::string_view word : words) {
    if (!text.empty()) text += ", ";
    text += word;
  }
  return text;
}

std::string name_problem(std::string_view name) {
  const bool has_good_characters = std::all_of(name.begin(), name.end(), [](char c) {
    return is_digit(c) || (lower(c) >= 'a' && lower(c) <= 'z') || c == '_' || c == '.' || c == '-';
  });
  if (name.empty() || name.size() > 63 || !has_good_characters)
    return quote(name) + " must be 1 to 63 of A-Z a-z 0-9 _ . -";
  if (name.find("..") != std::string_view::npos)
    return quote(name) + " must not contain '..', which stands for a range of names";
  if (name == "all") return "'all' stands for every name; choose another";
  return {};
}

std::size_t find_bad_byte(std::string_view text) {
  for (std::size_t i = 0; i < text.size();) {
    const std::size_t length = utf8_length(text.substr(i));
    if (length == 0) return i;
    const bool is_space = text[i] == '\t' || text[i] == '\n' || text[i] == '\r';
    if (!is_space && is_control(text.substr(i, length))) return i;
    i += length;
  }
  return std::string_view::npos;
}

TextPlace locate(std::string_view text, std::size_t offset) {
  TextPlace place;
  for (std::size_t i = 0; i < std::min(offset, text.size()); ++i) {
    if (text[i] == '\n') {
      ++place.line;
      place.column = 1;
    } else if ((static_cast<unsigned char>(text[i]) & 0xc0) != 0x80) {
      ++place.column;
    }
  }
  return place;
}

}  // namespace freeflex::io::reader
