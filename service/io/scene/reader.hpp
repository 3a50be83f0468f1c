// Reads the sections of a scene file, each by a function of its own. service/scenes/README.md describes the
// sections.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "service/io/scene/fields.hpp"
#include "service/io/scene/settings.hpp"
#include "service/io/scene/tables.hpp"

namespace freeflex::io::reader {

struct LinkForm;

/// Returns true for {csv: FILE}, which stands for the rows of a table.
bool is_table(const Node& node);

class SceneReader {
 public:
  /// \param folder    base of relative file names
  /// \param settings  values set in the scene
  SceneReader(Report& report, std::string folder, Settings settings)
      : report_(report), folder_(std::move(folder)), settings_of_all_(std::move(settings)) {}
  /// Reads the text of a source. Adds every fault to the report. The scene is complete only if there is no
  /// error.
  /// \param name  name of a scene that has none
  Scene read(int source, const std::string& name);
  /// Returns false if physics cannot be checked, because there is no point, a point could not be read, or
  /// there are too many links.
  bool is_judged() const { return points_.size() > 0 && points_.is_complete() && links_.size() <= kMaxLinks; }

  /// Returns the positions at which sections begin, and those of links that could not be read.
  const std::vector<Origin>& other_places() const { return other_places_; }

 private:
  // reader.cpp
  void read_sections(const Node& root);
  void read_groups(const Node& node);
  void read_damping(const Node& node);
  void read_modes(const Node& node);
  void read_attractor(const Node& node);
  void warn_of_defaults();
  void read_initial(const Node& node);
  void read_initial_points(const Node& node);
  void read_initial_modes(const Node& node);
  void read_publish(const Node* node);
  void read_commands(const Node* node);
  /// \param chosen  holds the default selection; if the key `of` is present, its selection replaces the
  ///   default
  void read_rate_and_selection(const Node& node, const std::string& label, const Section& section,
                               const Names& names, const std::vector<int>& all, double& rate,
                               std::vector<int>& chosen);
  void check_publication_rate(const Node* node, const std::string& label, double rate);
  /// Opens the file that the node names, or reports a fault and returns nullopt.
  std::optional<int> open_beside(const Node& node, const std::string& label);
  /// Returns the items of a list, or an empty list after reporting a fault. A mapping is treated as a list of
  /// one item.
  std::vector<const Node*> read_list(const Node& node, const std::string& label, const std::string& of);

  // base.cpp
  /// Returns the root of the scene on which all others are based, and adds the values that they set.
  /// Returns nullptr after reporting a fault.
  const Node* read_bases(const Node* root);

  // points.cpp
  void read_points(const Node& node);
  /// Reads a point. Returns false if there are too many points.
  /// \param place  where the point is: "3" in the list, "in row 3" of a table
  bool read_point(const Node& node, const std::string& place);
  void read_body(const Fields& fields, PointMass& point);
  void read_points_table(const Node& node);
  bool add_point(PointMass point);

  // links.cpp
  void read_links(const Node& node);
  /// \param place  where the link is: "3" in the list, "in row 3" of a table; messages call a link without a
  ///   name by its place
  void read_link(const Node& node, const std::string& place);
  /// Returns the name for the next link if the scene gives it none: its number among all links, including
  /// links that could not be read.
  std::string next_link_name() const;
  void leave_link_unread(const Origin& origin);
  /// Returns the form of the link's kind, or nullptr after reporting that the mapping has no kind or has two.
  const LinkForm* find_form(const Node& node, const std::string& label);
  /// Adds the link, or one copy of the link for each segment of a chain.
  void read_chain(const Fields& fields, const LinkForm& form, Link link);
  void read_matrix(const Fields& fields, const LinkForm& form, Link link);
  bool add_link(Link link);

  // link_tables.cpp
  void read_links_table(const Node& node);
  /// Returns a row converted to the node of a link, without the loss keys that its kind refuses.
  Node& link_row_as_item(const CsvRow& row, const CsvTable& table, std::string_view kind, bool has_viscous,
                         bool has_loss_factor);
  void read_ends(const CsvRow& row, const std::string& label, bool has_third, Link& link);

  // loads.cpp
  void read_loads(const Node& node);
  void read_load(const Node& node);
  void read_forces(const Fields& fields, const Node& node, Load& load);
  void read_wheel(const Node& node);
  void read_wheel_torques(const Fields& fields, const Node& node, Load& load);
  void read_torques(const Fields& fields, const Node& node, Load& load);
  void read_wrenches(const Fields& fields, const Node& node, Load& load);
  History read_history(const Fields& fields);

  // leave_out.cpp
  void read_leave_out(const Node& node);

  // fidelity.cpp
  void read_fidelity(const Fields& scene);
  void read_integration(const Node& node);
  void read_verdict(const Node& node);

  // feedback.cpp
  void read_feedbacks(const Node& node);
  void read_feedback(const Node& node);

  Report& report_;
  std::string folder_;
  Settings settings_of_all_;  // those of the scene's bases, then those that the caller gave
  std::string given_name_;    // name that a scene with a base gives itself, or empty
  YamlTree tree_;
  std::optional<SceneSettings> settings_;  // set once the scene is parsed
  Scene scene_;
  Names points_{"point"};
  Names links_{"link"};
  std::size_t num_unread_links_ = 0;
  std::vector<Origin> other_places_;
  Names groups_{"group"};
  Names loads_{"load"};
  Names wheels_{"wheel"};
  Names feedbacks_{"feedback"};
};

/// Returns YAML text of one line that parses to the same node.
std::string flow_text(const Node& node);
/// Reads a mapping of paths to values, or a list of such mappings.
/// \param file  file that messages name with the path and the value
Settings read_settings(Report& report, const Node& node, const std::string& label, const std::string& file);

/// Reports the first point that exceeds the largest number of points, if there is one.
/// \param is_whole  false: reading stopped, so the file may have more points than the scene
void report_num_points(const Scene& scene, bool is_whole, Report& report);

/// Reports faults of physics, except in items of the scene that have a fault of reading.
/// \param other_places  positions where text begins that belongs to no item of the scene; without these
///   positions, a fault of such text would be assigned to the item before the text
void report_physics(const Scene& scene, const std::vector<Origin>& other_places, Report& report);

}  // namespace freeflex::io::reader
