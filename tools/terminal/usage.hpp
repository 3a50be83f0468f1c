// Command lines of freeflex: what an option may be, and what to say when it is something else.
#pragma once

#include <CLI/App.hpp>
#include <CLI/Validators.hpp>
#include <cstdint>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "service/usage.hpp"

namespace freeflex::tools {

/// A decimal number as scenes take it: finite, not hexadecimal, no blanks, no leading zeros.
std::optional<double> read_number(std::string_view text);

/// NAME=1,2,3 taken apart; no numbers when there is no =.
struct NamedNumbers {
  std::string name;
  std::vector<double> numbers;
};
/// nullopt when what stands behind = is not `count` numbers.
std::optional<NamedNumbers> parse_named_numbers(const std::string& text, std::size_t count);

// what several options are, beside those of freeflexd too
using service::add_settings;
using service::channel_prefix;
using service::found;
using service::must_be;
using service::one_of;
using service::rate_in_hertz;
CLI::Validator not_negative();   // a number >= 0
CLI::Validator positive_time();  // [s] > 0
CLI::Validator study_time();  // [s] > 0, at most 1000: the reference of a report keeps the motion each 10 ms
CLI::Validator whole_number(std::int64_t least, std::int64_t most);
/// Not empty; with an ending that it must have: so that a slip does not write over a file of another kind.
CLI::Validator file_name(std::string ending = {});

/// An option of three numbers, X,Y,Z; anything else is refused with what is wanted.
/// \param unit  "newton"
CLI::Option* add_vector(CLI::App& command, const std::string& name, std::vector<double>& vector,
                        const std::string& meaning, const std::string& unit);

/// No more than the type holds.
template <class Integer>
inline constexpr std::int64_t kMost = std::numeric_limits<Integer>::max();

using service::explain;

/// Lays out --help within kLineWidth columns. Texts that follow the options are taken as they are.
std::shared_ptr<CLI::FormatterBase> make_help_formatter();

}  // namespace freeflex::tools
