#include "tools/bus/push_words.hpp"

#include <array>
#include <charconv>
#include <regex>
#include <utility>

namespace freeflex::tools {
namespace {

/// Replaces indices by names: "forces[2]: point 19" by "point 'tip'", and "in point 3" by "in point 'hub'".
std::string with_names(const std::string& text, const NameOf& name_of) {
  static const std::regex entry(
      R"((?:(?:forces|torques|wrenches|wheels)\[\d+\]: |\b(in ))(point|group|wheel) (\d+))");
  std::string named;
  auto from = text.begin();
  for (std::sregex_iterator found(text.begin(), text.end(), entry), end; found != end; ++found) {
    const std::string kind = (*found)[2], number = (*found)[3];
    std::int64_t index = -1;
    std::from_chars(number.data(), number.data() + number.size(), index);
    const std::string name = name_of(kind, index);
    if (name.empty()) continue;
    named.append(from, (*found)[0].first);
    for (const std::string& part : {(*found)[1].str(), kind, std::string(" '"), name, std::string("'")})
      named += part;
    from = (*found)[0].second;
  }
  return named.append(from, text.end());
}

}  // namespace

std::string in_push_words(std::string text, const NameOf& name_of) {
  static const std::array<std::pair<std::regex, const char*>, 17> kWords{
      {{std::regex("give a later tick, -1, or late_policy 1"), "give a later tick or none, or add --late-ok"},
       {std::regex(R"(\bstart_tick\b)"), "--at-tick"},
       {std::regex(R"(^(lease|duration)_ticks is (\d+), but)"), "--$1 is $2 ticks, but"},
       {std::regex(R"(\b(lease|duration)_ticks\b)"), "--$1"},
       {std::regex(R"(^CLEAR\b)"), "--clear-sender"},
       {std::regex(R"(\b(\d+) forces\b)"), "$1 points"},
       {std::regex(R"(\b(\d+) wrenches\b)"), "$1 groups"},
       {std::regex(R"(^slot\b)"), "--slot"},
       {std::regex(R"(there is no mode (\d+); SHAPES takes an elastic mode from 1 to (\d+).*)"),
        "--control shapes=$1 must be a mode from 1 to $2"},
       {std::regex(R"(there is no page (\d+); SCENE takes a page from 1 to (\d+).*)"),
        "--control scene=$1 must be a page from 1 to $2, or scene without a number for all"},
       {std::regex("; seal it in an envelope_t"), "; add --key FILE"},
       {std::regex(R"(^control command \d+)"), "--control"},
       {std::regex(R"(\bRUN\b)"), "--control run"},
       {std::regex(R"(\bHOLD\b)"), "--control hold"},
       {std::regex(R"(\bSTEP\b)"), "--control step=N"},
       {std::regex(R"(\bRESET\b)"), "--control reset"},
       {std::regex(R"(\bSTOP\b)"), "--control stop"}}};
  for (const auto& [wire, ours] : kWords) text = std::regex_replace(text, wire, ours);
  return with_names(text, name_of);  // names are inserted last, because a name may contain any of these words
}

}  // namespace freeflex::tools
