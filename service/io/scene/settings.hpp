// Values set by path in the tree of a scene, before its sections are read.
#pragma once

#include <string>
#include <string_view>
#include <unordered_set>
#include <vector>

#include "service/io/scene/keys.hpp"
#include "service/io/scene/report.hpp"
#include "service/io/scene/yaml.hpp"

namespace freeflex::io::reader {

/// One step of a path: what stands between two dots.
struct PathStep {
  std::string text;
  bool is_quoted = false;  // then it is a name, and neither a number nor *
  std::size_t begin = 0;   // bytes in the path
  std::size_t end = 0;

  bool is_all() const { return !is_quoted && text == "*"; }
  /// True for a place in a list, which counts from 1.
  bool is_place() const;
};

/// Takes a path apart at its dots outside quotes. Returns what is wrong with it; empty: it is good.
std::string parse_path(const std::string& path, std::vector<PathStep>& steps);

/// Sets values in a tree. Nodes are copied before they change, because aliases share them. The first fault
/// of a setting is reported at the setting's source, and the setting is then left.
class SceneSettings {
 public:
  /// Reads paths and values. \param tree  of the scene; it outlives this
  SceneSettings(Report& report, YamlTree& tree, const Settings& settings);

  /// The root with what is set in the scene's own text. Rows of tables come later.
  const Node* apply(const Node* root);

  /// True when a setting is for a row of the tables under the key `list`. \param name  that the row has in
  /// the scene
  bool wants_row(std::string_view list, const std::string& name);
  /// Sets values in a row that is written as an item.
  void apply_to_row(std::string_view list, const std::string& name, Node& row);

  /// Reports the settings that found no row. \param is_whole  false: the tables under `list` could not be
  /// read, so that nothing can be said
  void report_unmatched(std::string_view list, bool is_whole);

 private:
  struct PathSetting {
    const Setting* setting;
    int source;
    std::vector<PathStep> steps;
    const Node* value;
    bool is_refused = false;  // a fault is reported
    bool is_matched = false;
    const Key* rows = nullptr;         // the list whose tables may have the row
    std::size_t row_step = 0;          // the step that names the row
    std::vector<std::string> names{};  // of items and rows that are not the one
  };

  // each acts on the setting `current_`
  void set_in_mapping(Node& mapping, const Section& section, std::size_t step);
  void set_in_names(Node& mapping, const Key& key, std::size_t step);
  void set_in_items(Node& mapping, const Key& key, std::size_t step);
  void set_in_item(const Node*& item, const Key& key, std::size_t step);
  void put(Node& mapping, const std::string& key);
  Node* find_mapping(Node& mapping, const std::string& key);
  /// Indices of the items that a step names; empty after reporting, and where tables may have the item.
  std::vector<std::size_t> choose(const std::vector<const Node*>& items, const Key& key, std::size_t step);
  /// The same of a place. \param named  items whose name is that number
  std::vector<std::size_t> choose_place(std::size_t num_items, const std::vector<std::size_t>& named,
                                        bool has_table, std::size_t step);
  void refuse(const std::string& message);
  void refuse_key(const Section& section, std::size_t step);
  void refuse_untaken(const Key& key, std::size_t step);
  void refuse_name(std::size_t step);

  /// The path up to a step, as it was written; "scene" for nothing.
  std::string before(std::size_t step) const;
  /// The node, copied unless it is a copy already.
  Node& own(const Node*& node);
  bool is_row_of(const PathSetting& setting, std::string_view list, const std::string& name) const;

  Report& report_;
  YamlTree& tree_;
  std::vector<PathSetting> settings_;
  PathSetting* current_ = nullptr;
  std::unordered_set<const Node*> owned_;
};

}  // namespace freeflex::io::reader
