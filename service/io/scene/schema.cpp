#include "service/io/scene/schema.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <nlohmann/json.hpp>

#include "service/io/scene/keys.hpp"

namespace freeflex::io {
namespace {

using namespace reader;
using Json = nlohmann::ordered_json;

Json schema_of(const Section& section);

// a name may be written 3, 1e5 or true, which YAML reads as a number or a truth value, so the schema allows
// these types; a pattern restricts only text
Json text_schema() { return {{"type", {"string", "number", "boolean"}}}; }
Json matching(const char* pattern) {
  Json schema = text_schema();
  schema["pattern"] = pattern;
  return schema;
}

// definitions to which sections refer by name
Json common_definitions() {
  return {{"name", matching(R"(^(?!all$)(?!.*\.\.)[A-Za-z0-9_.-]{1,63}$)")},
          {"name_or_range", matching("^[A-Za-z0-9_.-]{1,128}$")}};
}
Json reference(std::string_view name) { return {{"$ref", "#/definitions/" + std::string(name)}}; }

Json one_or_list(const Json& item) { return {{"anyOf", {item, {{"type", "array"}, {"items", item}}}}}; }

Json list_of(const Json& item, std::size_t count) {
  return {{"type", "array"}, {"items", item}, {"minItems", count}, {"maxItems", count}};
}

// returns the range of the quantity, narrowed by the range of the key
Range range_of(const Key& key) {
  const Range &narrow = key.range, wide = reader::range_of(key.quantity.bound);
  const Range &low = narrow.least > wide.least ? narrow : wide,
              &high = narrow.most < wide.most ? narrow : wide;
  return {low.least, high.most, low.has_least, high.has_most};
}

Json number_schema(const Key& key) {
  const Range range = range_of(key);
  Json schema{{"type", key.form == Form::kWhole ? "integer" : "number"}};
  if (std::isfinite(range.least)) schema[range.has_least ? "minimum" : "exclusiveMinimum"] = range.least;
  if (std::isfinite(range.most)) schema[range.has_most ? "maximum" : "exclusiveMaximum"] = range.most;
  return schema;
}

Json numbers_schema(const Key& key) {
  const Json number = number_schema(key);
  if (key.counts.size() == 1) return list_of(number, key.counts[0]);
  Json schema{{"type", "array"}, {"items", number}};
  for (const std::size_t count : key.counts)
    schema["anyOf"].push_back({{"minItems", count}, {"maxItems", count}});
  return schema;
}

Json gain_schema() {
  const Json number{{"type", "number"}}, row = list_of(number, 3);
  return {{"anyOf", {number, row, list_of(row, 3)}}};
}

Json word_schema(const Key& key) {
  const bool is_truth = key.words == std::vector<std::string_view>{"true", "false"};
  Json words = is_truth ? Json{true, false} : Json::array();
  for (const std::string_view word : key.words) words.push_back(word);
  return {{"enum", words}};
}

Json words_schema(const Key& key) {
  Json schema = one_or_list(word_schema(key));
  schema["anyOf"][1]["uniqueItems"] = true;
  return schema;
}

Json items_schema(const Key& key) {
  Json item;
  for (const Section* section : key.sections) item["anyOf"].push_back(reference(section->name));
  return one_or_list(key.sections.size() == 1 ? reference(key.sections[0]->name) : item);
}

Json section_schema(const Key& key) {
  if (key.words.empty()) return schema_of(*key.sections[0]);
  Json words = Json::array();
  for (const std::string_view word : key.words) {
    words.push_back(word);
    if (word == "off") words.push_back(false);  // as some readers of YAML read it
  }
  return {{"anyOf", {schema_of(*key.sections[0]), {{"enum", words}}}}};
}

Json value_schema(const Key& key) {
  switch (key.form) {
    case Form::kNumber:
    case Form::kWhole:
      return number_schema(key);
    case Form::kNumbers:
      return numbers_schema(key);
    case Form::kGain:
      return gain_schema();
    case Form::kName:
    case Form::kReference:
      return {{"allOf", {reference("name")}}};
    case Form::kSelection:
      return one_or_list(reference("name_or_range"));
    case Form::kText:
      return text_schema();
    case Form::kWord:
      return word_schema(key);
    case Form::kWords:
      return words_schema(key);
    case Form::kSection:
      return section_schema(key);
    case Form::kItems:
      return items_schema(key);
  }
  return true;
}

std::string text_of(double value) {
  std::array<char, 32> text{};
  std::snprintf(text.data(), text.size(), "%.10g", value);
  return text.data();
}

// returns a text such as "Number >= 0 [kg]."
std::string describe_value(const Key& key) {
  std::string text;
  if (key.form == Form::kNumber) text = " Number";
  if (key.form == Form::kWhole) text = " Whole number";
  if (key.form == Form::kGain)
    text = " Number, 3 numbers (one for each axis) or 3 lists of 3 (rows of a matrix)";
  if (key.form == Form::kNumbers) {
    for (const std::size_t count : key.counts) text += (text.empty() ? " " : " or ") + std::to_string(count);
    text += key.counts.empty() ? " Numbers" : " numbers";
  }
  if (text.empty()) return {};
  const Range range = range_of(key);
  const bool has_least = std::isfinite(range.least);
  if (has_least) text += (range.has_least ? " >= " : " > ") + text_of(range.least);
  if (std::isfinite(range.most))
    text += std::string(has_least ? " and" : "") + (range.has_most ? " <= " : " < ") + text_of(range.most);
  if (key.quantity.unit != "-") text += " [" + std::string(key.quantity.unit) + "]";
  return text + ".";
}

Json schema_of(const Key& key) {
  Json schema{{"description", std::string(key.about) + describe_value(key)}};
  const Json value = value_schema(key);
  if (key.per == Per::kNothing) {
    schema.update(value);
  } else {
    schema["type"] = "object";
    if (key.per == Per::kMode) schema["propertyNames"] = {{"pattern", "^[1-9][0-9]*$"}};
    // a reader of YAML may convert the key 1e22 to 1e+22, so the pattern allows +
    if (key.per == Per::kNewName) schema["propertyNames"] = {{"pattern", "^[A-Za-z0-9_.+-]+$"}};
    schema["additionalProperties"] = value;
  }
  if (!key.example.empty()) schema["examples"] = Json::array({Json::parse(key.example)});
  return schema;
}

Json schema_of(const Section& section) {
  Json schema{{"type", "object"}, {"properties", Json::object()}};
  for (const Key& key : section.keys) {
    schema["properties"][std::string(key.name)] = schema_of(key);
    if (key.is_required) schema["required"].push_back(key.name);
  }
  for (const std::string_view key : section.any_of) schema["anyOf"].push_back({{"required", {key}}});
  schema["additionalProperties"] = false;
  return schema;
}

// adds a definition of each kind of item. The schema of a key refers to this definition twice: as a single
// item, and as an item of a list.
void add_definitions(const Section& section, Json& definitions) {
  for (const Key& key : section.keys)
    for (const Section* of : key.sections) {
      add_definitions(*of, definitions);
      if (key.form != Form::kItems) continue;
      Json schema{{"title", of->name}};
      schema.update(schema_of(*of));
      definitions[std::string(of->name)] = std::move(schema);
    }
}

// adds every path by which a value can be set; * stands for each name and each item
void add_paths(const Section& section, const std::string& before, bool is_item, Json& paths) {
  for (const Key& key : section.keys) {
    if (is_item && key.form == Form::kName) continue;
    std::string path = before + std::string(key.name);
    const auto add = [&] {
      if (std::find(paths.begin(), paths.end(), path) == paths.end()) paths.push_back(path);
    };
    add();
    if (key.per != Per::kNothing || key.form == Form::kItems) path += ".*";
    if (key.per != Per::kNothing) add();
    for (const Section* of : key.sections)
      if (key.form != Form::kItems || of->find("csv") == nullptr)
        add_paths(*of, path + ".", key.form == Form::kItems, paths);
  }
}

constexpr const char* kPathsAbout =
    "Paths of values, which 'freeflex run SCENE --set PATH=VALUE' sets before the scene is read. Dots "
    "separate keys. For * write the name of an item (in quotes if it has dots or is a number), the item's "
    "position in the list from 1, or * for all items that have the key. VALUE is YAML.";

}  // namespace

std::string scene_schema() {
  Json schema{
      {"$schema", "http://json-schema.org/draft-07/schema#"},
      {"title", "freeflex scene"},
      {"description", "A free flexible structure, the loads on it and the published data. SI units."}};
  schema.update(schema_of(sections::kScene));
  // a scene with a base has no points of its own
  schema.erase("required");
  schema["anyOf"] = {{{"required", {"points"}}}, {{"required", {"base"}}}};
  schema["dependencies"] = {{"set", {"base"}}};
  schema["properties"]["base"] = {{"type", "string"},
                                  {"description", sections::kBasedScene.at("base").about}};
  schema["properties"]["set"] = {{"type", {"object", "array"}},
                                 {"description", sections::kBasedScene.at("set").about}};
  Json definitions = common_definitions();
  add_definitions(sections::kScene, definitions);
  schema["definitions"] = std::move(definitions);
  Json paths = Json::array();
  add_paths(sections::kScene, "", false, paths);
  schema["x-paths"] = {{"description", kPathsAbout}, {"paths", std::move(paths)}};
  return schema.dump(2) + "\n";
}

}  // namespace freeflex::io
