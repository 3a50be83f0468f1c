// Sets values by path in the tree of a scene, before its sections are read.
#pragma once

#include <string>
#include <string_view>
#include <unordered_set>
#include <vector>

#include "service/io/scene/keys.hpp"
#include "service/io/scene/report.hpp"
#include "service/io/scene/yaml.hpp"

namespace freeflex::io::reader {

/// One step of a path, which is the text between two dots.
struct PathStep {
  std::string text;
  bool is_quoted = false;      // true: the text was in quotes, so that even a number or * is a name
  bool is_multiplied = false;  // true: a last step with * at its end, which is not in `text`
  std::size_t begin = 0;       // offset in the path [bytes]
  std::size_t end = 0;

  bool is_all() const { return !is_quoted && text == "*"; }
  /// Returns true if the step is a position in a list, counted from 1.
  bool is_place() const;
};

/// Splits a path at its dots outside quotes. Returns an empty string, or the error.
std::string parse_path(const std::string& path, std::vector<PathStep>& steps);

/// Sets values in a tree. Nodes are copied before they change, because aliases share them. The first fault of
/// a setting is reported at the setting's source, and later faults of the same setting are ignored.
class SceneSettings {
 public:
  /// Reads paths and values.  \param tree  tree of the scene; must outlive this object
  SceneSettings(Report& report, YamlTree& tree, const Settings& settings);

  /// Returns the root after setting the values in the scene's own text. Values in rows of tables are set
  /// later.
  const Node* apply(const Node* root);

  /// Returns true if a setting applies to this row of the tables under the key `list`. Stores the name for
  /// the message of report_unmatched().
  /// \param name  name of the row's item in the scene
  bool wants_row(std::string_view list, const std::string& name);
  /// Sets values in a row that was converted to an item.
  void apply_to_row(std::string_view list, const std::string& name, Node& row);

  /// Reports the settings that matched no row.  \param is_whole  false: not all tables under `list` could be
  /// read, so nothing is reported
  void report_unmatched(std::string_view list, bool is_whole);

 private:
  struct PathSetting {
    const Setting* setting;
    int source;
    std::vector<PathStep> steps;
    const Node* value;
    bool is_refused = false;  // true if a fault was reported
    bool is_matched = false;
    bool is_without_value = false;     // true if a setting that multiplies found an item without the value
    const Key* rows = nullptr;         // the list whose tables may have a row that matches
    std::size_t row_step = 0;          // the step that selects the row
    std::vector<std::string> names{};  // names of the items and rows that the step did not match

    bool multiplies() const { return steps.back().is_multiplied; }
  };

  // these functions act on the setting `current_`
  void set_in_mapping(Node& mapping, const Section& section, std::size_t step);
  void set_in_names(Node& mapping, const Key& key, std::size_t step);
  void set_in_items(Node& mapping, const Key& key, std::size_t step);
  void set_in_item(const Node*& item, const Key& key, std::size_t step);
  void set_in_list(Node& mapping, const std::string& key);
  const Node* replacement(const Node& old);
  void put(Node& mapping, const std::string& key);
  Node* find_mapping(Node& mapping, const std::string& key);
  /// Returns the indices of the items that a step names, or an empty list after reporting a fault. If a table
  /// may contain the item, the list is also empty.
  std::vector<std::size_t> choose(const std::vector<const Node*>& items, const Key& key, std::size_t step);
  /// Returns the index of the item at the position that a step gives, or an empty list after reporting a
  /// fault.
  /// \param named  indices of the items whose name is the same number
  std::vector<std::size_t> choose_place(std::size_t num_items, const std::vector<std::size_t>& named,
                                        bool has_table, std::size_t step);
  void refuse(const std::string& message);
  void refuse_key(const Section& section, std::size_t step);
  void refuse_untaken(const Key& key, std::size_t step);
  void refuse_name(std::size_t step);
  void refuse_product();

  /// Returns the path up to a step, as the user wrote it, or "scene" if that part is empty.
  std::string before(std::size_t step) const;
  /// Replaces the node by a copy, unless the node is a copy already, and returns the copy.
  Node& own(const Node*& node);
  /// Returns true if a step, the last one, is the position of a number in the list of the key.
  bool is_number_of_list(const Key& key, std::size_t step) const;
  bool is_row_of(const PathSetting& setting, std::string_view list, const std::string& name) const;

  Report& report_;
  YamlTree& tree_;
  std::vector<PathSetting> settings_;
  PathSetting* current_ = nullptr;
  std::unordered_set<const Node*> owned_;
};

}  // namespace freeflex::io::reader
