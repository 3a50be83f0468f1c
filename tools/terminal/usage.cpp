#include "tools/terminal/usage.hpp"

#include <CLI/Formatter.hpp>
#include <string_view>
#include <vector>

#include "service/io/scene/text.hpp"
#include "tools/terminal/console.hpp"

namespace freeflex::tools {
namespace {

/// Column of --help at which the text of an option begins.
constexpr std::size_t kTextColumn = 30;

class HelpFormatter : public CLI::Formatter {
 public:
  std::string make_option(const CLI::Option* option, bool is_positional) const override {
    std::string line = "  " + make_option_name(option, is_positional) + make_option_opts(option);
    const std::string text = make_option_desc(option);
    if (line.size() >= kTextColumn)
      line += "\n" + std::string(kTextColumn, ' ');
    else
      line.resize(kTextColumn, ' ');
    return line + wrapped(text, kTextColumn) + "\n";
  }
};

}  // namespace

std::optional<double> read_number(std::string_view text) {
  return io::reader::parse_number(text, {"-"}).value;
}

std::optional<NamedNumbers> parse_named_numbers(const std::string& text, std::size_t count) {
  const std::size_t equals = text.find('=');
  NamedNumbers named{text.substr(0, equals), {}};
  if (equals == std::string::npos) return named;
  std::size_t begin = equals + 1;
  for (std::size_t k = 0; k < count; ++k) {
    const std::size_t end = k + 1 < count ? text.find(',', begin) : text.size();
    if (end == std::string::npos) return std::nullopt;
    const std::optional<double> value = read_number(std::string_view(text).substr(begin, end - begin));
    if (!value) return std::nullopt;
    named.numbers.push_back(*value);
    begin = end + 1;
  }
  return named;
}

CLI::Validator not_negative() {
  return must_be("a number >= 0", [](double value) { return value >= 0.0; });
}

CLI::Validator positive_time() {
  return must_be("a number > 0 and at most 1e9 [s]",
                 [](double value) { return value > 0.0 && value <= 1e9; });
}

CLI::Validator study_time() {
  return must_be("a number > 0 and at most 1000 [s]",
                 [](double value) { return value > 0.0 && value <= 1000.0; });
}

CLI::Validator whole_number(std::int64_t least, std::int64_t most) {
  return {[least, most](std::string& text) {
            return io::reader::parse_integer(text, least, most)
                       ? std::string()
                       : found(text, "a whole number from " + std::to_string(least) + " to " +
                                         std::to_string(most));
          },
          ""};
}

CLI::Validator file_name(std::string ending) {
  return {[ending = std::move(ending)](std::string& text) {
            if (text.empty()) return std::string("must name a file");
            return text.ends_with(ending) ? std::string() : found(text, "a name that ends with " + ending);
          },
          ""};
}

CLI::Option* add_vector(CLI::App& command, const std::string& name, std::vector<double>& vector,
                        const std::string& meaning, const std::string& unit) {
  const auto take = [&vector, name, unit](const CLI::results_t& texts) {
    vector.clear();
    for (const std::string& each : texts)
      if (const std::optional<double> number = read_number(each)) vector.push_back(*number);
    if (texts.size() == 3 && vector.size() == 3) return true;
    std::string text;
    for (const std::string& each : texts) text += (text.empty() ? "" : ",") + each;
    throw CLI::ValidationError(name + " " + text,
                               "must be three finite numbers X,Y,Z in " + unit + ", as 0,5,0");
  };
  return command.add_option(name, CLI::callback_t(take), meaning)
      ->type_name("X,Y,Z")
      ->delimiter(',')
      ->expected(1, 3)
      ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll);
}

std::shared_ptr<CLI::FormatterBase> make_help_formatter() { return std::make_shared<HelpFormatter>(); }

}  // namespace freeflex::tools
