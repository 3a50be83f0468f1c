// Checks of the values of freeflex's options, and the errors for values that are not allowed.
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

/// Parses a decimal number by the rules for numbers in scenes. The number must be finite, not hexadecimal,
/// and without blanks or leading zeros. Returns nullopt for any other text.
std::optional<double> read_number(std::string_view text);

/// The parts of NAME=1,2,3. If there is no =, `numbers` is empty.
struct NamedNumbers {
  std::string name;
  std::vector<double> numbers;
};
/// Splits NAME=1,2,3. Returns nullopt if there is a = and the text after it is not `count` numbers.
std::optional<NamedNumbers> parse_named_numbers(const std::string& text, std::size_t count);

// validators that several options use; some of them are also used in freeflexd
using service::add_settings;
using service::channel_prefix;
using service::found;
using service::must_be;
using service::one_of;
using service::rate_in_hertz;
CLI::Validator not_negative();   // a number >= 0
CLI::Validator positive_time();  // [s] > 0
CLI::Validator
study_time();  // [s] > 0, at most 1000, because the reference of a report stores the motion every 10 ms
CLI::Validator whole_number(std::int64_t least, std::int64_t most);
/// Checks that a file name is not empty and has the ending `ending`, so that a typing error does not
/// overwrite a file of another kind.
CLI::Validator file_name(std::string ending = {});

/// Adds an option whose value is three numbers, X,Y,Z. The error for any other value describes this form.
/// \param unit  "newton"
CLI::Option* add_vector(CLI::App& command, const std::string& name, std::vector<double>& vector,
                        const std::string& meaning, const std::string& unit);

/// Largest value of an integer type.
template <class Integer>
inline constexpr std::int64_t kMost = std::numeric_limits<Integer>::max();

using service::explain;

/// Returns a formatter of --help with lines of at most kLineWidth columns. The formatter prints the footer
/// unchanged.
std::shared_ptr<CLI::FormatterBase> make_help_formatter();

}  // namespace freeflex::tools
