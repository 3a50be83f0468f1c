#include "service/usage.hpp"

#include <algorithm>
#include <optional>
#include <string_view>

#include "core/limits.hpp"
#include "service/io/scene/text.hpp"
#include "service/io/wire/lcm_url.hpp"

namespace freeflex::service {
namespace {

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

std::string joined(const std::vector<std::string>& names) {
  return io::reader::join({names.begin(), names.end()});
}

std::string did_you_mean(const std::string& word, const std::vector<std::string>& names) {
  return io::reader::did_you_mean(word, {names.begin(), names.end()});
}

/// Returns the parser's message, reworded if it uses a programmer's terms.
std::string reworded(const CLI::ParseError& error) {
  std::string text = error.what();
  constexpr std::string_view kRequired = " is required";
  if (text.ends_with(kRequired)) return text.substr(0, text.size() - kRequired.size()) + " is missing";
  constexpr std::string_view kValueOfFlag = " was given a disallowed flag override";
  if (text.ends_with(kValueOfFlag))
    return "--" + text.substr(0, text.size() - kValueOfFlag.size()) +
           " takes no value; omit '=' and the text after it";
  const bool is_count = error.get_exit_code() == static_cast<int>(CLI::ExitCodes::ArgumentMismatch);
  const std::size_t colon = text.find(": ");
  if (!is_count || colon == std::string::npos) return text;
  const std::string name = text.substr(0, colon);
  if (text.ends_with(" missing")) return name + ": its value is missing";
  return text.find("At Most 1 ") != std::string::npos ? name + " is given more than once; give it once"
                                                      : text;
}

}  // namespace

std::string found(const std::string& text, const std::string& allowed) {
  return "the value is '" + text + "', but must be " + allowed;
}

CLI::Validator must_be(const char* allowed, bool (*is_right)(double)) {
  return {[allowed, is_right](std::string& text) {
            const std::optional<double> value = io::reader::parse_number(text, {"-"}).value;
            return value && is_right(*value) ? std::string() : found(text, allowed);
          },
          ""};
}

CLI::Validator one_of(const std::vector<std::string>& names) {
  return {[names](std::string& text) {
            if (std::find(names.begin(), names.end(), text) != names.end()) return std::string();
            return "found '" + text + "'; allowed: " + joined(names);
          },
          ""};
}

CLI::Validator rate_in_hertz() {
  return must_be("a number from 0.001 to 1000000 [Hz]",
                 [](double value) { return value >= kLeastRate && value <= kMostRate; });
}

CLI::Validator channel_prefix() {
  return {
      [](std::string& text) { return is_channel_prefix(text) ? std::string() : found(text, kPrefixAllowed); },
      ""};
}

void add_settings(CLI::App& command, io::Settings& settings) {
  const auto take = [&settings](const std::vector<std::string>& arguments) {
    for (const std::string& argument : arguments) settings.push_back(*io::parse_setting(argument));
  };
  const auto problem = [](const std::string& argument) {
    return io::parse_setting(argument)
               ? std::string()
               : found(argument, "PATH=VALUE, as in points.hub.mass=41 or 'links.*.E=6.9e10'");
  };
  command
      .add_option_function<std::vector<std::string>>(
          "--set", take,
          "sets a value of the scene before it is read, as points.hub.mass=41; may be repeated")
      ->type_name("PATH=VALUE")
      ->allow_extra_args(false)
      ->check(CLI::Validator(problem, ""));
}

std::string explain(const CLI::App& app, const CLI::ParseError& error) {
  const CLI::App* deepest = &app;
  std::string path;  // of the command to which the words belong
  for (std::vector<CLI::App*> parsed = app.get_subcommands(); !parsed.empty();
       parsed = deepest->get_subcommands()) {
    deepest = parsed.front();
    path += deepest->get_name() + " ";
  }
  const CLI::App& active = *deepest;
  const std::vector<std::string> commands = command_names(active), left = app.remaining(true);
  const bool is_about_words = error.get_exit_code() == static_cast<int>(CLI::ExitCodes::ExtrasError) ||
                              error.get_exit_code() == static_cast<int>(CLI::ExitCodes::RequiredError);
  std::string text = reworded(error);
  if (!commands.empty() && left.empty()) {
    text = "no command is given; the commands are " + joined(commands);
  } else if (!left.empty() && is_about_words) {
    // if a required argument is misspelt, the parser calls the argument missing, but the misspelt word tells
    // the user more
    const std::string& word = left.front();
    if (word.starts_with("-")) {
      text = "there is no option '" + word + "'" +
             did_you_mean(word.substr(0, word.find('=')), option_names(active));
    } else if (!commands.empty()) {
      text = "there is no command '" + word + "'" + did_you_mean(word, commands) + "; the commands are " +
             joined(commands);
    } else {
      text = "'" + word + "' is one argument too many; omit it";
    }
  }
  return text + "\nTry '" + app.get_name() + " " + path + "--help'.";
}

}  // namespace freeflex::service
