#include "service/io/scene/fields.hpp"

#include <algorithm>
#include <numeric>

namespace freeflex::io::reader {

std::optional<double> read_number(Report& report, const Node& node, const std::string& label,
                                  const Quantity& quantity) {
  if (node.kind != Node::Kind::kText) {
    report.error(node.origin, label + " is " + describe(node) + ", but must be " + describe(quantity));
    return std::nullopt;
  }
  NumberResult number = parse_number(node.text, quantity);
  if (number.value && node.is_quoted) {
    number.value.reset();
    number.problem =
        quote(node.text) + " is text in quotes, but must be " + describe(quantity) + "; remove the quotes";
  }
  if (!number.value) report.error(node.origin, label + " " + number.problem);
  return number.value;
}

std::optional<std::vector<double>> read_numbers(Report& report, const Node& node, const std::string& label,
                                                const Quantity& quantity, std::optional<std::size_t> count) {
  const std::string length = count ? std::to_string(*count) + " numbers" : "numbers";
  const std::string unit = quantity.unit == "-" ? "" : " [" + std::string(quantity.unit) + "]";
  if (node.kind != Node::Kind::kList) {
    report.error(node.origin, label + " is " + describe(node) + ", but must be a list of " + length + unit);
    return std::nullopt;
  }
  if (count && node.items.size() != *count) {
    report.error(node.origin, label + " has " + std::to_string(node.items.size()) +
                                  " items, but must be a list of " + length + unit +
                                  comma_hint(node, *count));
    return std::nullopt;
  }
  if (!report.count_mentions(node.items.size(), node.origin)) return std::nullopt;
  std::vector<double> values;
  for (const Node* item : node.items)
    if (const auto value = read_number(report, *item, label, quantity)) values.push_back(*value);
  if (values.size() != node.items.size()) return std::nullopt;
  return values;
}

std::string comma_hint(const Node& list, std::size_t wanted) {
  std::string joined;
  std::size_t num_pairs = 0;
  for (std::size_t i = 1; i < list.items.size(); ++i) {
    if (!is_split_number(*list.items[i - 1], *list.items[i])) continue;
    const std::string point = list.items[i - 1]->text + "." + list.items[i]->text;
    joined += (joined.empty() ? "" : ", ") + point;
    ++num_pairs;
    ++i;
  }
  if (num_pairs == 0 || list.items.size() <= wanted) return {};
  if (list.items.size() != wanted + num_pairs)
    return "; a comma separates items, so write decimals with a point";
  return "; a comma separates items, so write " + joined;
}

std::optional<Eigen::Vector3d> read_vector(Report& report, const Node& node, const std::string& label,
                                           std::string_view unit) {
  const auto values = read_numbers(report, node, label, {unit, Bound::kAny}, 3);
  if (!values) return std::nullopt;
  return Eigen::Vector3d((*values)[0], (*values)[1], (*values)[2]);
}

std::optional<Eigen::Quaterniond> read_unit_quaternion(Report& report, const Node& node,
                                                       const std::string& label) {
  const auto q = read_numbers(report, node, label, {"-"}, 4);
  if (!q) return std::nullopt;
  const Eigen::Vector4d quaternion((*q)[0], (*q)[1], (*q)[2], (*q)[3]);
  const double norm = quaternion.stableNorm();
  constexpr double kTolerance = 1e-6;  // [-] allows components that were written by hand with six digits
  if (std::abs(norm - 1.0) > kTolerance) {
    report.error(node.origin,
                 label + " has norm " + format_number(norm) + ", but must be a unit quaternion [w, x, y, z]");
    return std::nullopt;
  }
  const Eigen::Vector4d unit = quaternion / norm;
  return Eigen::Quaterniond(unit[0], unit[1], unit[2], unit[3]);
}

std::optional<std::string> read_text(Report& report, const Node& node, const std::string& label) {
  if (node.kind == Node::Kind::kText) return node.text;
  report.error(node.origin, label + " is " + describe(node) + ", but must be text");
  return std::nullopt;
}

std::optional<std::size_t> read_word(Report& report, const Node& node, const std::string& label,
                                     const std::vector<std::string_view>& allowed) {
  const auto word = std::find(allowed.begin(), allowed.end(), node.text);
  if (node.kind == Node::Kind::kText && word != allowed.end())
    return static_cast<std::size_t>(word - allowed.begin());
  const std::vector<std::string_view> all_but_last(allowed.begin(), allowed.end() - 1);
  report.error(node.origin, label + " is " + describe(node) + ", but must be " + join(all_but_last) + " or " +
                                std::string(allowed.back()) + did_you_mean(node.text, allowed));
  return std::nullopt;
}

std::optional<std::string> read_name(Report& report, const Node& node, const std::string& label) {
  auto name = read_text(report, node, label);
  if (!name) return std::nullopt;
  if (const std::string problem = name_problem(*name); !problem.empty()) {
    report.error(node.origin, label + " " + problem);
    return std::nullopt;
  }
  return name;
}

std::string item_label(const std::string& noun, const Node& node, const std::string& place) {
  for (const auto& [key, value] : node.entries)
    if (key->text == "name" && value->kind == Node::Kind::kText && name_problem(value->text).empty())
      return noun + " " + quote(value->text);
  return noun + " " + place;
}

namespace {

// returns ": write damping: {ratio: 0.02}" if a number stands in place of a mapping, or an empty text for any
// other node and for sections without a number_key
std::string advise_mapping(const Node& node, const std::string& label, std::string_view number_key) {
  constexpr std::string_view kStart = "+-.,0123456789";
  if (number_key.empty() || node.kind != Node::Kind::kText || node.text.empty() ||
      kStart.find(node.text.front()) == std::string_view::npos)
    return {};
  const std::size_t colon = label.rfind(": ");
  const bool is_good = parse_number(node.text, {"-"}).value.has_value();
  return ": write " + (colon == std::string::npos ? label : label.substr(colon + 2)) + ": {" +
         std::string(number_key) + ": " + (is_good ? node.text : "NUMBER") + "}";
}

/// The absent key that an unknown key probably stands for: the key that resembles it, or the key before a
/// colon without a blank ("mass:40"). Word and advice are empty if there is no such key.
struct MeantKey {
  std::string_view word;
  std::string advice;
};
MeantKey find_meant(std::string_view key, const std::vector<std::string_view>& absent) {
  const std::size_t colon = key.find(':');
  const auto word = std::find(absent.begin(), absent.end(), key.substr(0, colon));
  if (colon == std::string_view::npos || word == absent.end())
    return {nearest_word(key, absent), did_you_mean(key, absent)};
  return {*word, " (write a space after the colon: " +
                     quote(std::string(*word) + ": " + std::string(key.substr(colon + 1))) + ")"};
}

}  // namespace

Fields::Fields(Report& report, const Node& node, std::string label, const Section& section)
    : report_(report),
      node_(node),
      label_(std::move(label)),
      section_(section),
      is_mapping_(node.kind == Node::Kind::kMapping) {
  if (!is_mapping_) {
    report.error(node.origin, label_ + " is " + describe(node) + ", but must be a mapping of " +
                                  join(section.names()) + advise_mapping(node, label_, section.number_key));
    return;
  }
  for (const auto& entry : node.entries) {
    const Node& key = *entry.first;
    if (section.find(key.text) != nullptr) continue;
    const auto reason = std::find_if(section.refused.begin(), section.refused.end(),
                                     [&](const RefusedKey& r) { return r.key == key.text; });
    if (reason != section.refused.end()) {
      report.error(key.origin, label_of(key.text) + " " + std::string(reason->reason));
      continue;
    }
    std::vector<std::string_view> absent;  // known keys that the mapping lacks
    for (const Key& known : section.keys)
      if (!find(known.name)) absent.push_back(known.name);
    const MeantKey meant = find_meant(key.text, absent);
    if (!meant.word.empty()) misspelt_.push_back(meant.word);
    report.error(key.origin, label_ + ": the key " + quote(key.text) + " is unknown" + meant.advice +
                                 "; allowed are " + join(section.names()));
  }
}

const Node* Fields::find(std::string_view key) const {
  if (section_.find(key) == nullptr) return nullptr;
  for (const auto& [name, value] : node_.entries)
    if (name->text == key) return value;
  return nullptr;
}

const Node* Fields::require(std::string_view key, const std::string& allowed) const {
  const Node* node = find(key);
  if (!node && is_mapping_ && !is_misspelt({key}))
    report_.missing(node_, key, label_of(key) + " is missing; it " + allowed);
  return node;
}

bool Fields::is_misspelt(std::initializer_list<std::string_view> keys) const {
  return std::any_of(keys.begin(), keys.end(), [&](std::string_view key) {
    return std::find(misspelt_.begin(), misspelt_.end(), key) != misspelt_.end();
  });
}

bool Fields::lacks_all(std::initializer_list<std::string_view> keys) const {
  return is_mapping_ && !is_misspelt(keys) &&
         std::none_of(keys.begin(), keys.end(), [&](std::string_view key) { return find(key) != nullptr; });
}

void Fields::read(std::string_view key, double& value) const {
  const Key* known = section_.find(key);
  if (!known) return;
  const Node* node = known->is_required ? require(key, "must be " + describe(known->quantity)) : find(key);
  if (!node) return;
  if (const auto number = read_number(report_, *node, label_of(key), known->quantity)) value = *number;
}

void Fields::require(std::string_view key, double& value) const {
  if (require(key, "must be " + describe(section_.at(key).quantity))) read(key, value);
}

void Fields::read(std::string_view key, Eigen::Vector3d& value) const {
  const Key* known = section_.find(key);
  if (!known) return;
  const std::string_view unit = known->quantity.unit;
  const std::string suffix = unit == "-" ? "" : " [" + std::string(unit) + "]";
  const Node* node = known->is_required ? require(key, "must be a list of 3 numbers" + suffix) : find(key);
  if (!node) return;
  if (const auto vector = read_vector(report_, *node, label_of(key), unit)) value = *vector;
}

std::optional<std::size_t> Fields::read_word(std::string_view key) const {
  const Node* node = find(key);
  if (!node) return std::nullopt;
  return reader::read_word(report_, *node, label_of(key), section_.at(key).words);
}

void Names::add(Report& report, std::string name, const Origin& origin) {
  const auto [first, is_new] = index_.emplace(name, static_cast<int>(names_.size()));
  if (!is_new)
    report.error(origin,
                 noun_ + " " + quote(name) + " is defined twice, first " +
                     describe_place(report, origins_[static_cast<std::size_t>(first->second)], origin) +
                     "; give each " + noun_ + " a name of its own");
  names_.push_back(std::move(name));
  origins_.push_back(origin);
}

std::optional<int> Names::find(std::string_view name) const {
  const auto found = index_.find(std::string(name));
  return found == index_.end() ? std::nullopt : std::optional<int>(found->second);
}

std::optional<int> Names::resolve(Report& report, std::string_view name, const Origin& origin,
                                  const std::string& label) const {
  if (const auto index = find(name)) return index;
  if (!is_complete_) report.note_unresolved(origin);
  if (is_complete_ && !report.is_full()) {
    const std::vector<std::string_view> known(names_.begin(), names_.end());
    std::string allowed = did_you_mean(name, known);
    if (allowed.empty() && known.empty()) allowed = "; it has none";
    if (allowed.empty() && known.size() <= 8) allowed = "; it has " + join(known);
    if (allowed.empty())
      allowed = "; it has " + std::to_string(known.size()) + ", from " + quote(known.front()) + " to " +
                quote(known.back());
    report.error(origin, label + " names the " + noun_ + " " + quote(name) +
                             ", which the scene does not have" + allowed);
  }
  return std::nullopt;
}

std::optional<int> Names::resolve(Report& report, const Node& node, const std::string& label) const {
  if (node.kind == Node::Kind::kText) return resolve(report, node.text, node.origin, label);
  report.error(node.origin, label + " is " + describe(node) + ", but must be the name of a " + noun_);
  return std::nullopt;
}

namespace {

// appends the indices of one name or range, or reports a fault and returns false
bool append_selected(Report& report, const Node& node, const std::string& label, const Names& names,
                     std::vector<int>& indices) {
  if (node.kind != Node::Kind::kText) {
    report.error(node.origin, label + " holds " +
                                  (node.kind == Node::Kind::kEmpty ? "nothing" : describe(node)) +
                                  ", but must be the name of a " + names.noun());
    return false;
  }
  const std::string_view text = node.text;
  const std::size_t dots = text.find("..");
  if (dots == std::string_view::npos) {
    const auto index = names.resolve(report, text, node.origin, label);
    if (index) indices.push_back(*index);
    return index.has_value() && report.count_mentions(1, node.origin);
  }
  const auto first = names.resolve(report, text.substr(0, dots), node.origin, label);
  const auto last = names.resolve(report, text.substr(dots + 2), node.origin, label);
  if (!first || !last) return false;
  if (*first > *last) {
    report.error(node.origin,
                 label + ": range " + quote(text) + " runs backwards in the scene; swap its ends");
    return false;
  }
  const auto count = static_cast<std::size_t>(*last - *first) + 1;
  if (!report.count_mentions(count, node.origin)) return false;
  indices.resize(indices.size() + count);
  std::iota(indices.end() - static_cast<std::ptrdiff_t>(count), indices.end(), *first);
  return true;
}

}  // namespace

std::optional<std::vector<int>> read_selection(Report& report, const Node& node, const std::string& label,
                                               const Names& names, bool may_repeat) {
  std::vector<int> indices;
  if (node.kind == Node::Kind::kText && node.text == "all") {
    if (!report.count_mentions(names.size(), node.origin)) return std::nullopt;
    indices.resize(names.size());
    std::iota(indices.begin(), indices.end(), 0);
    return indices;
  }
  if (node.kind != Node::Kind::kText && node.kind != Node::Kind::kList) {
    report.error(node.origin, label + " is " + describe(node) +
                                  ", but must be all, or a list of names and ranges a..b; [] for none");
    return std::nullopt;
  }
  const std::vector<const Node*> single{&node};
  bool is_good = true;
  std::vector<bool> is_named(names.size());
  for (const Node* item : node.kind == Node::Kind::kList ? node.items : single) {
    const std::size_t start = indices.size();
    is_good = append_selected(report, *item, label, names, indices) && is_good;
    for (std::size_t i = start; i < indices.size() && !may_repeat; ++i) {
      const auto index = static_cast<std::size_t>(indices[i]);
      if (is_named[index]) {
        report.error(item->origin, label + ": " + quote(item->text) + " names a " + names.noun() +
                                       " that is in the list already; remove it");
        is_good = false;
        break;
      }
      is_named[index] = true;
    }
  }
  if (!is_good) return std::nullopt;
  return indices;
}

}  // namespace freeflex::io::reader
