#include "tools/terminal/usage.hpp"

#include <algorithm>
#include <string_view>
#include <vector>

#include "service/io/scene/text.hpp"
#include "tools/terminal/console.hpp"

namespace freeflex::tools {
namespace {

std::string found(const std::string& text, const std::string& allowed) {
  return "found '" + text + "', must be " + allowed;
}

std::vector<std::string> command_names(const CLI::App& app) {
  std::vector<std::string> names;
  for (const CLI::App* command : app.get_subcommands({})) names.push_back(command->get_name());
  return names;
}

std::vector<std::string> option_names(const CLI::App& app) {
  std::vector<std::string> names;
  for (const CLI::Option* option : app.get_options()) {
    for (const std::string& name : option->get_lnames()) names.push_back("--" + name);
  }
  return names;
}

std::string joined(const std::vector<std::string>& names) { return listed(names, names.size()); }

std::string did_you_mean(const std::string& word, const std::vector<std::string>& names) {
  return io::reader::did_you_mean(word, {names.begin(), names.end()});
}

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

CLI::Validator must_be(const char* allowed, bool (*is_right)(double)) {
  return {[allowed, is_right](std::string& text) {
            const std::optional<double> value = read_number(text);
            return value && is_right(*value) ? std::string() : found(text, allowed);
          },
          ""};
}

CLI::Validator rate_in_hertz() {
  return must_be("a number from 0.001 to 1000000 [Hz]",
                 [](double value) { return value >= 1e-3 && value <= 1e6; });
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

CLI::Validator file_name() {
  return {[](std::string& text) { return text.empty() ? std::string("must name a file") : std::string(); },
          ""};
}

CLI::Validator channel_prefix() {
  return {[](std::string& text) {
            const bool is_right =
                !text.empty() && text.size() <= 32 && std::all_of(text.begin(), text.end(), [](char c) {
                  return (c >= 'A' && c <= 'Z') || (c >= 'a' && c <= 'z') || (c >= '0' && c <= '9') ||
                         c == '_' || c == '-';
                });
            return is_right ? std::string() : found(text, "1 to 32 of A-Z a-z 0-9 _ -");
          },
          ""};
}

CLI::Option* add_vector(CLI::App& command, const std::string& name, std::vector<double>& vector,
                        const std::string& meaning, const std::string& unit) {
  const auto take = [&vector, name, unit](const CLI::results_t& words) {
    vector.clear();
    for (const std::string& word : words)
      if (const std::optional<double> number = read_number(word)) vector.push_back(*number);
    if (words.size() == 3 && vector.size() == 3) return true;
    std::string text;
    for (const std::string& word : words) text += (text.empty() ? "" : ",") + word;
    throw CLI::ValidationError(name + " " + text, "three numbers X,Y,Z in " + unit + " are wanted, as 0,5,0");
  };
  return command.add_option(name, CLI::callback_t(take), meaning)
      ->type_name("X,Y,Z")
      ->delimiter(',')
      ->expected(1, 3)
      ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll);
}

std::string explain(const CLI::App& app, const CLI::ParseError& error) {
  const std::vector<CLI::App*> parsed = app.get_subcommands();
  const std::vector<std::string> left = app.remaining(true);
  const bool is_about_words = error.get_exit_code() == static_cast<int>(CLI::ExitCodes::ExtrasError) ||
                              error.get_exit_code() == static_cast<int>(CLI::ExitCodes::RequiredError);
  std::string text = error.what();
  if (parsed.empty() && left.empty()) {
    text = "no command given; there are " + joined(command_names(app));
  } else if (!left.empty() && is_about_words) {
    // a misspelt option also leaves a required one missing: name the word
    const CLI::App& active = parsed.empty() ? app : *parsed.front();
    const std::string& word = left.front();
    if (word.starts_with("-")) {
      text = "no option '" + word + "'" + did_you_mean(word.substr(0, word.find('=')), option_names(active));
    } else if (parsed.empty()) {
      const std::vector<std::string> names = command_names(app);
      text = "no command '" + word + "'" + did_you_mean(word, names) + "; there are " + joined(names);
    } else {
      text = "'" + word + "' is one argument too many";
    }
  }
  return text + "\nTry 'freeflex " + (parsed.empty() ? "" : parsed.front()->get_name() + " ") + "--help'.";
}

}  // namespace freeflex::tools
