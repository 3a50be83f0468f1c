#include "service/io/scene/settings.hpp"

#include <algorithm>
#include <optional>
#include <utility>

#include "service/io/scene/reader.hpp"
#include "service/io/scene/text.hpp"

namespace freeflex::io {

std::optional<Setting> parse_setting(const std::string& argument, const std::string& option) {
  char quote = 0;
  for (std::size_t i = 0; i < argument.size(); ++i) {
    const char c = argument[i];
    if (quote == 0 && c == '=') {
      if (i == 0) return std::nullopt;
      std::string as_given = option;
      as_given += ' ';
      as_given += argument;
      return Setting{argument.substr(0, i), argument.substr(i + 1), std::move(as_given)};
    }
    if (quote == c)
      quote = 0;
    else if (quote == 0 && (c == '"' || c == '\''))
      quote = c;
  }
  return std::nullopt;
}

namespace reader {
namespace {

std::string item_name(const Node& item) {
  for (const auto& [key, value] : item.entries)
    if (key->text == "name" && value->kind == Node::Kind::kText) return value->text;
  return {};
}

bool has_key(const Node& mapping, std::string_view key) {
  return std::any_of(mapping.entries.begin(), mapping.entries.end(),
                     [&](const auto& entry) { return entry.first->text == key; });
}

bool is_table_section(const Section& section) { return section.find("csv") != nullptr; }

// returns the section for an item of a list, or nullptr for a link without a kind
const Section* section_of(const Key& list, const Node& item) {
  const bool is_item_table = is_table(item);
  const Section* only = nullptr;
  int num_others = 0;
  for (const Section* section : list.sections) {
    if (is_table_section(*section)) {
      if (is_item_table) return section;
      continue;
    }
    if (has_key(item, section->name)) return section;
    only = section;
    ++num_others;
  }
  return num_others == 1 && !is_item_table ? only : nullptr;
}

// returns a description of what can be set at a key, for a path that wrongly continues after the key
std::string describe_whole(const Key& key) {
  switch (key.form) {
    case Form::kNumbers:
    case Form::kGain:
      return "a list of numbers";
    case Form::kSelection:
    case Form::kWords:
      return "a list";
    default:
      return "one value";
  }
}

std::string list_names(const std::vector<std::string>& names) {
  const std::vector<std::string_view> views(names.begin(), names.end());
  if (views.empty()) return "none has a name";
  if (views.size() <= 8) return "there are " + join(views);
  return "there are " + std::to_string(views.size()) + ", from " + quote(views.front()) + " to " +
         quote(views.back());
}

}  // namespace

bool PathStep::is_place() const {
  return !is_quoted && !text.empty() && text.find_first_not_of("0123456789") == std::string::npos;
}

std::string parse_path(const std::string& path, std::vector<PathStep>& steps) {
  const auto at = [](std::size_t byte) {
    return " at character " + std::to_string(byte + 1) + " of the path";
  };
  std::size_t i = 0;
  while (true) {
    PathStep step;
    step.begin = i;
    if (i < path.size() && (path[i] == '"' || path[i] == '\'')) {
      const std::size_t closing = path.find(path[i], i + 1);
      if (closing == std::string::npos) return "the quote is not closed" + at(i);
      step.text = path.substr(i + 1, closing - i - 1);
      step.is_quoted = true;
      i = closing + 1;
      if (i < path.size() && path[i] != '.') return "a dot must follow the closing quote" + at(i);
    } else {
      i = std::min(path.find('.', i), path.size());
      step.text = path.substr(step.begin, i - step.begin);
      if (step.text.find_first_of("[]{}\"' \t=,") != std::string::npos)
        return quote(step.text) + " must be a key, a name, a number or *" + at(step.begin) +
               "; separate keys and names by dots, as in points.hub.mass";
    }
    // a last step such as EA* multiplies; the step * alone means all items
    if (!step.is_quoted && i == path.size() && step.text.size() > 1 && step.text.back() == '*') {
      step.text.pop_back();
      step.is_multiplied = true;
    }
    if (step.text.empty()) return "a key or a name is missing" + at(step.begin);
    if (!step.is_quoted && step.text.size() > 1 && step.text.find('*') != std::string::npos)
      return quote(step.text) + " has a * beside other characters" + at(step.begin) +
             "; * alone stands for all items, and a * at the end of the path multiplies";
    step.end = i - (step.is_multiplied ? 1 : 0);
    steps.push_back(std::move(step));
    if (i == path.size()) return {};
    ++i;
  }
}

SceneSettings::SceneSettings(Report& report, YamlTree& tree, const Settings& settings)
    : report_(report), tree_(tree) {
  if (settings.size() > kMaxSettings) {
    report_.error({}, std::to_string(settings.size()) + " values are set, but at most " +
                          std::to_string(kMaxSettings) +
                          " are allowed; write them into the scene or its "
                          "tables");
    return;
  }
  settings_.reserve(settings.size());
  for (const Setting& setting : settings) {
    const int source = report_.add_setting(setting);
    PathSetting parsed{&setting, source, {}, nullptr};
    if (const std::string problem = parse_path(setting.path, parsed.steps); !problem.empty()) {
      report_.error({source, 0, 0}, problem);
      continue;
    }
    parsed.value = tree_.parse(report_, source);
    if (parsed.value) settings_.push_back(std::move(parsed));
  }
}

const Node* SceneSettings::apply(const Node* root) {
  if (!root || root->kind != Node::Kind::kMapping) return root;
  for (PathSetting& setting : settings_) {
    current_ = &setting;
    set_in_mapping(own(root), sections::kScene, 0);
    if (setting.is_without_value && !setting.is_matched && !setting.rows) refuse_product();
  }
  return root;
}

void SceneSettings::refuse(const std::string& message) {
  if (!current_->is_refused) report_.error({current_->source, 0, 0}, message);
  current_->is_refused = true;
}

bool SceneSettings::is_number_of_list(const Key& key, std::size_t step) const {
  return key.form == Form::kNumbers && step + 1 == current_->steps.size() && current_->steps[step].is_place();
}

std::string SceneSettings::before(std::size_t step) const {
  return step == 0 ? "scene" : current_->setting->path.substr(0, current_->steps[step - 1].end);
}

Node& SceneSettings::own(const Node*& node) {
  if (owned_.contains(node)) return const_cast<Node&>(*node);  // the node is a copy already
  Node& copy = tree_.create(*node);
  owned_.insert(&copy);
  node = &copy;
  return copy;
}

void SceneSettings::refuse_key(const Section& section, std::size_t step) {
  const std::string& key = current_->steps[step].text;
  const auto refused = std::find_if(section.refused.begin(), section.refused.end(),
                                    [&](const RefusedKey& each) { return each.key == key; });
  if (refused != section.refused.end())
    return refuse(before(step) + ": " + key + " " + std::string(refused->reason));
  if (current_->steps[step].is_all())
    return refuse(before(step) + ": * stands for items and names, but a key must follow here; the keys are " +
                  join(section.names()));
  refuse(before(step) + ": the key " + quote(key) + " is unknown" + did_you_mean(key, section.names()) +
         "; allowed are " + join(section.names()));
}

// returns the value to put in the place of another. A setting that multiplies returns a number, or a list of
// numbers, times its factor, or nullptr after reporting a fault.
const Node* SceneSettings::replacement(const Node& old) {
  if (!current_->multiplies()) return current_->value;
  const Node& factor = *current_->value;
  const auto given = factor.kind == Node::Kind::kText && !factor.is_quoted ? parse_number(factor.text, {"-"})
                                                                           : NumberResult{};
  if (!given.value) {
    refuse("the value is " + describe(factor) +
           ", but must be a number, because the path ends with * and multiplies");
    return nullptr;
  }
  Node product = old;
  const auto multiply = [&](Node& number) {
    const auto value = number.kind == Node::Kind::kText && !number.is_quoted
                           ? parse_number(number.text, {"-"})
                           : NumberResult{};
    if (!value.value) return false;
    number.text = format_number(*value.value * *given.value);
    number.origin = {current_->source, 0, 0};
    return true;
  };
  bool is_good = old.kind == Node::Kind::kList ? !old.items.empty() : multiply(product);
  for (const Node*& item : product.items) {
    Node changed = *item;
    is_good = is_good && multiply(changed);
    item = &tree_.create(std::move(changed));
  }
  if (is_good) return &tree_.create(std::move(product));
  refuse("the path ends with * and multiplies, but " + before(current_->steps.size()) + " is " +
         describe(old) + ", which is neither a number nor a list of numbers");
  return nullptr;
}

void SceneSettings::put(Node& mapping, const std::string& key) {
  const auto entry = std::find_if(mapping.entries.begin(), mapping.entries.end(),
                                  [&](const auto& each) { return each.first->text == key; });
  if (entry != mapping.entries.end()) {
    current_->is_matched = true;
    report_.note_target(current_->source, entry->first->origin);
    if (const Node* value = replacement(*entry->second)) entry->second = value;
    return;
  }
  if (current_->multiplies()) {
    // of all items, those without a value stay as they are
    current_->is_without_value = true;
    const bool is_one_of_all = std::any_of(current_->steps.begin(), current_->steps.end(),
                                           [](const PathStep& step) { return step.is_all(); });
    return is_one_of_all ? void() : refuse_product();
  }
  current_->is_matched = true;
  report_.note_target(current_->source, mapping.origin);
  Node name;
  name.kind = Node::Kind::kText;
  name.text = key;
  name.origin = {current_->source, 0, 0};
  mapping.entries.emplace_back(&tree_.create(std::move(name)), current_->value);
}

// returns the mapping at a key, or a new mapping if the key is absent. If the value is not a mapping, returns
// nullptr, because the reader will report the value.
Node* SceneSettings::find_mapping(Node& mapping, const std::string& key) {
  const auto entry = std::find_if(mapping.entries.begin(), mapping.entries.end(),
                                  [&](const auto& each) { return each.first->text == key; });
  if (entry != mapping.entries.end()) {
    if (entry->second->kind == Node::Kind::kMapping) return &own(entry->second);
    current_->is_matched = true;
    return nullptr;
  }
  Node empty;
  empty.kind = Node::Kind::kMapping;
  empty.origin = {current_->source, 0, 0};
  Node& made = tree_.create(std::move(empty));
  owned_.insert(&made);
  const Node* const value = std::exchange(current_->value, &made);
  put(mapping, key);
  current_->value = value;
  return &made;
}

// sets one number of a list; the last step of the path is its position
void SceneSettings::set_in_list(Node& mapping, const std::string& key) {
  const std::size_t step = current_->steps.size() - 1;
  const auto entry = std::find_if(mapping.entries.begin(), mapping.entries.end(),
                                  [&](const auto& each) { return each.first->text == key; });
  const auto whole = [&] { return "; set the whole list, as in " + before(step) + "=[0, 0, 1]"; };
  if (entry == mapping.entries.end()) return refuse("there is no list at " + before(step) + whole());
  if (entry->second->kind != Node::Kind::kList)
    return refuse(before(step) + " is " + describe(*entry->second) + " and has no numbers to set" + whole());
  std::vector<const Node*>& items = own(entry->second).items;
  const auto place = parse_integer(current_->steps[step].text, 1, static_cast<std::int64_t>(items.size()));
  if (!place)
    return refuse(before(step) + " has the numbers 1 to " + std::to_string(items.size()) + ", but not " +
                  current_->steps[step].text);
  current_->is_matched = true;
  const Node*& item = items[static_cast<std::size_t>(*place - 1)];
  report_.note_target(current_->source, item->origin);
  if (const Node* value = replacement(*item)) item = value;
}

void SceneSettings::set_in_mapping(Node& mapping, const Section& section, std::size_t step) {
  const PathStep& at = current_->steps[step];
  const Key* key = at.is_all() ? nullptr : section.find(at.text);
  if (!key) return refuse_key(section, step);
  const bool is_last = step + 1 == current_->steps.size();
  if (is_last && key->form == Form::kName && step > 0)
    return refuse(before(step + 1) +
                  ": a name cannot be set, because paths and the scene refer to it; "
                  "change it in the scene");
  if (is_last) return put(mapping, at.text);
  if (key->per != Per::kNothing) {
    if (Node* names = find_mapping(mapping, at.text)) set_in_names(*names, *key, step + 1);
  } else if (key->form == Form::kItems) {
    set_in_items(mapping, *key, step + 1);
  } else if (key->form == Form::kSection) {
    if (Node* inner = find_mapping(mapping, at.text)) set_in_mapping(*inner, *key->sections[0], step + 1);
  } else if (is_number_of_list(*key, step + 1)) {
    set_in_list(mapping, at.text);
  } else {
    refuse(before(step + 1) + " is " + describe_whole(*key) + " and is set as a whole; end the path there");
  }
}

// sets a value in a mapping whose keys are names or mode numbers, for example the names of groups
void SceneSettings::set_in_names(Node& mapping, const Key& key, std::size_t step) {
  std::vector<std::string> names;
  if (current_->steps[step].is_all()) {
    for (const auto& [name, value] : mapping.entries) names.push_back(name->text);
    if (names.empty()) return refuse(before(step) + " is empty, so * matches nothing");
  } else {
    names.push_back(current_->steps[step].text);
  }
  const bool is_last = step + 1 == current_->steps.size();
  const bool is_number = is_number_of_list(key, step + 1);
  if (!is_last && !is_number && key.form != Form::kSection)
    return refuse(before(step + 1) + " is " + describe_whole(key) +
                  " and is set as a whole; end the path there");
  for (const std::string& name : names) {
    if (is_last)
      put(mapping, name);
    else if (is_number)
      set_in_list(mapping, name);
    else if (Node* inner = find_mapping(mapping, name))
      set_in_mapping(*inner, *key.sections[0], step + 1);
  }
}

void SceneSettings::set_in_items(Node& mapping, const Key& key, std::size_t step) {
  const std::string list(key.name);
  const auto entry = std::find_if(mapping.entries.begin(), mapping.entries.end(),
                                  [&](const auto& each) { return each.first->text == list; });
  if (entry == mapping.entries.end())
    return refuse("the scene has no " + list + "; a path can change items but cannot add them");
  if (step + 1 == current_->steps.size()) {
    const std::string item = before(step + 1);
    return refuse(item + " is an item, and its keys are set one by one; write " + item + ".KEY");
  }
  const bool is_list = entry->second->kind == Node::Kind::kList;
  if (!is_list && entry->second->kind != Node::Kind::kMapping) {
    current_->is_matched = true;  // neither a list nor a mapping, which the reader will report
    return;
  }
  std::vector<const Node*> single{entry->second};
  std::vector<const Node*>& items = is_list ? own(entry->second).items : single;
  for (const std::size_t index : choose(items, key, step)) set_in_item(items[index], key, step);
  if (!is_list) entry->second = single.front();
  if (!current_->is_matched && !current_->rows) refuse_untaken(key, step);
}

std::vector<std::size_t> SceneSettings::choose(const std::vector<const Node*>& items, const Key& key,
                                               std::size_t step) {
  const PathStep& at = current_->steps[step];
  const bool has_table = std::any_of(items.begin(), items.end(), [](const Node* n) { return is_table(*n); });
  std::vector<std::size_t> all, named;
  for (std::size_t k = 0; k < items.size(); ++k) {
    all.push_back(k);
    const std::string name = item_name(*items[k]);
    if (!name.empty() && name == at.text) named.push_back(k);
  }
  if (at.is_place()) return choose_place(items.size(), named, has_table, step);
  if (!at.is_all() && !named.empty()) return named;
  if (has_table) current_->rows = &key;
  current_->row_step = step;
  if (at.is_all()) return all;
  std::vector<std::string>& names = current_->names;
  for (const Node* item : items)
    if (std::string name = item_name(*item); !name.empty()) names.push_back(std::move(name));
  if (!has_table) refuse_name(step);
  return {};
}

std::vector<std::size_t> SceneSettings::choose_place(std::size_t num_items,
                                                     const std::vector<std::size_t>& named, bool has_table,
                                                     std::size_t step) {
  const std::string list = before(step), place = current_->steps[step].text,
                    name = list + ".\"" + place + "\"";
  const auto found = parse_integer(place, 1, static_cast<std::int64_t>(num_items));
  if (!named.empty() && (!found || named.front() != static_cast<std::size_t>(*found - 1))) {
    refuse(list + "." + place +
           " is a position in the list, but another item has this number as its name; write " + name +
           " for the name");
    return {};
  }
  if (!found) {
    refuse(list + ": there is no item " + place + "; " +
           (num_items == 0 ? "the list is empty"
                           : "the items are numbered from 1 to " + std::to_string(num_items)) +
           (has_table ? ", and a row of a table is set by its name; write " + name : ""));
    return {};
  }
  return {static_cast<std::size_t>(*found - 1)};
}

void SceneSettings::set_in_item(const Node*& item, const Key& key, std::size_t step) {
  const Section* section = item->kind == Node::Kind::kMapping ? section_of(key, *item) : nullptr;
  if (!section) {
    current_->is_matched = true;  // not a mapping, or a link without a kind, which the reader will report
    return;
  }
  const bool is_one_of_all = current_->steps[step].is_all();
  const PathStep& next = current_->steps[step + 1];
  const bool takes_key = section->find(next.text) != nullptr;
  if (is_table_section(*section) && !takes_key && !is_one_of_all)
    return refuse(before(step + 1) + " is a table; name a row of it, as in " + before(step) + ".NAME." +
                  next.text + ", or write " + before(step) + ".*." + next.text + " for all rows");
  if (is_one_of_all && !next.is_all() && (!takes_key || is_table_section(*section))) return;
  set_in_mapping(own(item), *section, step + 1);
}

void SceneSettings::refuse_product() {
  refuse("there is no value to multiply at " + before(current_->steps.size()) +
         "; write it into the scene, or set it without the * at the end of the path");
}

// reports that * matched items, none of which allows the key
void SceneSettings::refuse_untaken(const Key& key, std::size_t step) {
  if (current_->is_without_value) return refuse_product();
  const std::string& wanted = current_->steps[step + 1].text;
  std::vector<std::string_view> known, takers;
  for (const Section* section : key.sections) {
    if (is_table_section(*section)) continue;
    if (section->find(wanted)) takers.push_back(section->name);
    for (const Key& each : section->keys)
      if (std::find(known.begin(), known.end(), each.name) == known.end()) known.push_back(each.name);
  }
  if (takers.empty())
    return refuse(before(step + 1) + ": the key " + quote(wanted) + " is unknown" +
                  did_you_mean(wanted, known) + "; allowed are " + join(known));
  refuse(before(step + 1) + ": no item here can have the key " + wanted + "; it is a key of " + join(takers));
}

void SceneSettings::refuse_name(std::size_t step) {
  const std::vector<std::string>& names = current_->names;
  // a name with dots that is not in quotes was split into steps, so the steps are joined again to find it
  std::string joined = current_->steps[step].text;
  for (std::size_t next = step + 1; next < current_->steps.size(); ++next) {
    joined += "." + current_->steps[next].text;
    if (std::find(names.begin(), names.end(), joined) != names.end())
      return refuse(before(step) + ": no item is named " + quote(current_->steps[step].text) +
                    "; write a name with dots in quotes, as in " + before(step) + ".\"" + joined + "\"");
  }
  const std::string& wanted = current_->steps[step].text;
  const std::vector<std::string_view> views(names.begin(), names.end());
  const std::string meant = did_you_mean(wanted, views);
  refuse(before(step) + ": no item is named " + quote(wanted) +
         (meant.empty() ? "; " + list_names(names) : meant));
}

bool SceneSettings::is_row_of(const PathSetting& setting, std::string_view list,
                              const std::string& name) const {
  if (!setting.rows || setting.rows->name != list || setting.is_refused) return false;
  const PathStep& at = setting.steps[setting.row_step];
  return at.is_all() || at.text == name;
}

bool SceneSettings::wants_row(std::string_view list, const std::string& name) {
  bool is_wanted = false;
  for (PathSetting& setting : settings_) {
    is_wanted = is_wanted || is_row_of(setting, list, name);
    if (setting.rows && setting.rows->name == list && !setting.is_matched) setting.names.push_back(name);
  }
  return is_wanted;
}

void SceneSettings::apply_to_row(std::string_view list, const std::string& name, Node& row) {
  owned_.insert(&row);
  for (PathSetting& setting : settings_) {
    if (!is_row_of(setting, list, name)) continue;
    current_ = &setting;
    const Section* section = section_of(*setting.rows, row);
    const std::string& key = setting.steps[setting.row_step + 1].text;
    const bool is_one_of_all = setting.steps[setting.row_step].is_all();
    if (section && (section->find(key) || !is_one_of_all))
      set_in_mapping(row, *section, setting.row_step + 1);
  }
}

void SceneSettings::report_unmatched(std::string_view list, bool is_whole) {
  for (PathSetting& setting : settings_) {
    if (!is_whole || !setting.rows || setting.rows->name != list || setting.is_matched) continue;
    current_ = &setting;
    if (setting.steps[setting.row_step].is_all())
      refuse_untaken(*setting.rows, setting.row_step);
    else
      refuse_name(setting.row_step);
  }
}

}  // namespace reader
}  // namespace freeflex::io
