// Compares the fields of the JSON that a command prints with the fields that a text documents.
#pragma once

#include <cctype>
#include <nlohmann/json.hpp>
#include <set>
#include <string>

namespace freeflex::testing {

/// Adds every key of a JSON value, at all levels, to `keys`.
inline void add_keys(const nlohmann::json& value, std::set<std::string>& keys) {
  if (value.is_object())
    for (const auto& [key, item] : value.items()) keys.insert(key);
  if (value.is_structured())
    for (const auto& item : value) add_keys(item, keys);
}

/// Returns the keys that do not occur as a word in the text, each followed by a blank. The result is "" if
/// all keys are documented.
inline std::string undocumented(const nlohmann::json& value, const std::string& text) {
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
