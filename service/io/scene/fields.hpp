// Reading typed values out of a tree, with the fault for each way it can be wrong.
#pragma once

#include <Eigen/Geometry>
#include <initializer_list>
#include <optional>
#include <string>
#include <unordered_map>
#include <vector>

#include "service/io/scene/keys.hpp"
#include "service/io/scene/report.hpp"
#include "service/io/scene/text.hpp"
#include "service/io/scene/yaml.hpp"

namespace freeflex::io::reader {

/// Numbers and vectors; nullopt after reporting "<label> ...". Labels read like "point 'hub': mass".
std::optional<double> read_number(Report& report, const Node& node, const std::string& label,
                                  const Quantity& quantity);
std::optional<std::vector<double>> read_numbers(Report& report, const Node& node, const std::string& label,
                                                const Quantity& quantity, std::optional<std::size_t> count);
std::optional<Eigen::Vector3d> read_vector(Report& report, const Node& node, const std::string& label,
                                           std::string_view unit);

/// [w, x, y, z] of norm 1 within 1e-6.
std::optional<Eigen::Quaterniond> read_unit_quaternion(Report& report, const Node& node,
                                                       const std::string& label);

/// What to say of a list that is longer than wanted because commas stand in it for decimal points, as in
/// [0,5, 1, 0]; empty when that cannot be.
std::string comma_hint(const Node& list, std::size_t wanted);

/// Text that may be a file name or word; a mapping, list or nothing is reported.
std::optional<std::string> read_text(Report& report, const Node& node, const std::string& label);
/// Index of one of the words allowed.
std::optional<std::size_t> read_word(Report& report, const Node& node, const std::string& label,
                                     const std::vector<std::string_view>& allowed);
/// A name as name_problem allows.
std::optional<std::string> read_name(Report& report, const Node& node, const std::string& label);

/// "point 'hub'" when the mapping has a good name, "point 3" by its place in the list, from 1, otherwise.
std::string item_label(const std::string& noun, const Node& node, const std::string& place);

/// A mapping with the keys of a section: unknown and refused ones are reported at once.
class Fields {
 public:
  /// \param section  outlives this
  Fields(Report& report, const Node& node, std::string label, const Section& section);

  bool is_mapping() const { return is_mapping_; }
  const std::string& label() const { return label_; }
  const Origin& origin() const { return node_.origin; }

  /// nullptr for a key that is absent or not known.
  const Node* find(std::string_view key) const;
  /// Reports a missing key as "<label>: <key> is missing, <allowed>", unless an unknown key is near it.
  const Node* require(std::string_view key, const std::string& allowed) const;

  /// True when an unknown key, which is reported, may stand for one of these.
  bool is_misspelt(std::initializer_list<std::string_view> keys) const;
  /// True of a mapping that has none of these keys, misspelt ones included.
  bool lacks_all(std::initializer_list<std::string_view> keys) const;

  /// What the section says of one of its keys.
  const Key& key(std::string_view key) const { return section_.at(key); }
  std::string label_of(std::string_view key) const { return label_ + ": " + std::string(key); }

  /// Each reads the key into `value` when it is known, there and good, and reports one that is missing and
  /// required.
  void read(std::string_view key, double& value) const;
  void read(std::string_view key, Eigen::Vector3d& value) const;
  /// The same of a number that is required whatever the section says.
  void require(std::string_view key, double& value) const;
  /// Index of the word of the key, or nullopt when there is none or after reporting.
  std::optional<std::size_t> read_word(std::string_view key) const;

 private:
  Report& report_;
  const Node& node_;
  std::string label_;
  const Section& section_;
  bool is_mapping_;
  std::vector<std::string_view> misspelt_;  // keys that unknown ones may stand for
};

/// Names of one kind in the order of the scene.
class Names {
 public:
  explicit Names(std::string noun) : noun_(std::move(noun)) {}
  const std::string& noun() const { return noun_; }
  std::size_t size() const { return names_.size(); }
  /// Adds a name, or reports the second use of one.
  void add(Report& report, std::string name, const Origin& origin);
  std::optional<int> find(std::string_view name) const;
  /// Index of the name, or nullopt after reporting "<label> names the point 'hbu', ...".
  std::optional<int> resolve(Report& report, std::string_view name, const Origin& origin,
                             const std::string& label) const;
  /// The same for a value, which must be text.
  std::optional<int> resolve(Report& report, const Node& node, const std::string& label) const;
  /// A list could not be read whole: names that are not found are no longer reported.
  void mark_incomplete() { is_complete_ = false; }
  bool is_complete() const { return is_complete_; }

 private:
  std::string noun_;
  std::vector<std::string> names_;
  std::vector<Origin> origins_;
  std::unordered_map<std::string, int> index_;
  bool is_complete_ = true;
};

/// `all`, a name, a range `a..b` in the order of the scene, or a list of names and ranges.
/// nullopt after reporting; a name twice is a fault unless may_repeat.
std::optional<std::vector<int>> read_selection(Report& report, const Node& node, const std::string& label,
                                               const Names& names, bool may_repeat = false);

}  // namespace freeflex::io::reader
