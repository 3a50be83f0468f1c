// The JSON that a command prints, against what its --help says of the fields.
#pragma once

#include <cctype>
#include <nlohmann/json.hpp>
#include <set>
#include <string>

namespace freeflex::testing {

/// Every key of an object, and of what is in it.
inline void add_keys(const nlohmann::json& value, std::set<std::string>& keys) {
  if (value.is_object())
    for (const auto& [key, item] : value.items()) keys.insert(key);
  if (value.is_structured())
    for (const auto& item : value) add_keys(item, keys);
}

/// Keys that are no word of the text, a blank behind each. Empty: all are said.
inline std::string unsaid(const nlohmann::json& value, const std::string& text) {
  std::set<std::string> keys, words;
  add_keys(value, keys);
  std::string word;
  for (const char c : text + " ") {
    if (std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '_') {
      word += c;
    } else {
      words.insert(word);
      word.clear();
    }
  }
  std::string missing;
  for (const std::string& key : keys)
    if (!words.contains(key)) missing += key + " ";
  return missing;
}

}  // namespace freeflex::testing
