// Reads typed values from a tree of nodes and reports their faults.
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

/// Each function reads a number, a list of numbers or a vector. After reporting a fault, whose text begins
/// with the label, for example "point 'hub': mass", it returns nullopt.
std::optional<double> read_number(Report& report, const Node& node, const std::string& label,
                                  const Quantity& quantity);
std::optional<std::vector<double>> read_numbers(Report& report, const Node& node, const std::string& label,
                                                const Quantity& quantity, std::optional<std::size_t> count);
std::optional<Eigen::Vector3d> read_vector(Report& report, const Node& node, const std::string& label,
                                           std::string_view unit);

/// Reads [w, x, y, z] of norm 1 within 1e-6.
std::optional<Eigen::Quaterniond> read_unit_quaternion(Report& report, const Node& node,
                                                       const std::string& label);

/// Returns the advice for a list that is too long because of decimal commas, as in [0,5, 1, 0], or an empty
/// text if decimal commas cannot be the cause.
std::string comma_hint(const Node& list, std::size_t wanted);

/// Reads a text, such as a file name or word. A mapping, a list or an empty node is a fault.
std::optional<std::string> read_text(Report& report, const Node& node, const std::string& label);
/// Returns the index of the text in the list of allowed words, or nullopt after reporting a fault.
std::optional<std::size_t> read_word(Report& report, const Node& node, const std::string& label,
                                     const std::vector<std::string_view>& allowed);
/// Reads a name. A name that name_problem rejects is a fault.
std::optional<std::string> read_name(Report& report, const Node& node, const std::string& label);

/// Returns "point 'hub'" if the mapping has a valid name, else "point 3", where 3 is the item's position in
/// the list, counted from 1.
std::string item_label(const std::string& noun, const Node& node, const std::string& place);

/// Gives access to a YAML mapping whose allowed keys are listed in a `Section`. The constructor reports a
/// node that is not a mapping, and keys that are unknown or refused.
class Fields {
 public:
  /// \param section  must outlive this object
  Fields(Report& report, const Node& node, std::string label, const Section& section);

  bool is_mapping() const { return is_mapping_; }
  const std::string& label() const { return label_; }
  const Origin& origin() const { return node_.origin; }

  /// Returns the value of a key, or nullptr if the key is absent or unknown.
  const Node* find(std::string_view key) const;
  /// Returns the value as find() does. Reports a missing key as "<label>: <key> is missing; it <allowed>",
  /// unless an unknown key may be a misspelling of the missing key.
  const Node* require(std::string_view key, const std::string& allowed) const;

  /// Returns true if a reported unknown key may be a misspelling of one of these keys.
  bool is_misspelt(std::initializer_list<std::string_view> keys) const;
  /// Returns true if the mapping has none of these keys, correctly spelt or misspelt.
  bool lacks_all(std::initializer_list<std::string_view> keys) const;

  /// Returns the description of a key of the section.
  const Key& key(std::string_view key) const { return section_.at(key); }
  std::string label_of(std::string_view key) const { return label_ + ": " + std::string(key); }

  /// Each function reads the key into `value` if the key is known, present and valid. Reports an invalid
  /// value, and a missing key that the section requires.
  void read(std::string_view key, double& value) const;
  void read(std::string_view key, Eigen::Vector3d& value) const;
  /// Reads a number and treats its key as required, even if the key is optional in the section.
  void require(std::string_view key, double& value) const;
  /// Returns the index of the key's word in the list of allowed words, or nullopt if the key is absent or its
  /// value was reported as a fault.
  std::optional<std::size_t> read_word(std::string_view key) const;

 private:
  Report& report_;
  const Node& node_;
  std::string label_;
  const Section& section_;
  bool is_mapping_;
  std::vector<std::string_view> misspelt_;  // absent keys that unknown keys may misspell
};

/// The names of one kind of item, in the order of the scene.
class Names {
 public:
  explicit Names(std::string noun) : noun_(std::move(noun)) {}
  const std::string& noun() const { return noun_; }
  std::size_t size() const { return names_.size(); }
  /// Adds a name. A name that another item has already is a fault.
  void add(Report& report, std::string name, const Origin& origin);
  std::optional<int> find(std::string_view name) const;
  /// Returns the index of the name, or nullopt after reporting "<label> names the point 'hbu', ...".
  std::optional<int> resolve(Report& report, std::string_view name, const Origin& origin,
                             const std::string& label) const;
  /// Returns the index of the name that is the text of the node, or nullopt after reporting a fault.
  std::optional<int> resolve(Report& report, const Node& node, const std::string& label) const;
  /// Records that some names could not be read. After this call, unknown names are not reported.
  void mark_incomplete() { is_complete_ = false; }
  bool is_complete() const { return is_complete_; }

 private:
  std::string noun_;
  std::vector<std::string> names_;
  std::vector<Origin> origins_;
  std::unordered_map<std::string, int> index_;
  bool is_complete_ = true;
};

/// Reads `all`, a name, a range `a..b` in the order of the scene, or a list of names and ranges. Returns
/// nullopt after reporting a fault. An item that is selected twice is a fault unless may_repeat is true.
std::optional<std::vector<int>> read_selection(Report& report, const Node& node, const std::string& label,
                                               const Names& names, bool may_repeat = false);

}  // namespace freeflex::io::reader
