#include "service/io/scene/reader.hpp"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <numeric>

#include "core/scene/bodies.hpp"
#include "core/scene/check/plausibility.hpp"
#include "core/scene/link_kinds.hpp"
#include "service/io/scene/input.hpp"

namespace freeflex::io {

namespace {

// returns the default name of a scene: the file name, with invalid characters replaced
std::string name_from_path(const std::string& path) {
  std::string name = std::filesystem::path(path).stem().string().substr(0, 63);
  for (char& c : name)
    if (!reader::name_problem(std::string_view(&c, 1)).empty()) c = '_';
  return reader::name_problem(name).empty() ? name : "scene";
}

void report_implausible(const Scene& scene, reader::Report& report) {
  Faults found;
  warn_of_implausible(scene, found);
  for (const Fault& fault : found) report.warning(fault.origin, fault.message);
}

/// Reads a source of the report.
/// \param source  nullopt: the file or text was refused, which was reported
SceneResult read_source(reader::Report& report, std::optional<int> source, const std::string& folder,
                        const std::string& name, const Settings& settings) {
  reader::SceneReader scene_reader(report, folder, settings);
  Scene scene;
  if (source) scene = scene_reader.read(*source, name);
  scene.sources = report.sources();
  scene.hash = report.hash();
  SceneResult result;
  result.sources = report.sources();
  const bool is_read = !report.has_error();
  // if there are faults of reading, also reports faults of physics in the items that were read without a
  // fault
  if (!is_read && scene_reader.is_judged())
    reader::report_physics(scene, scene_reader.other_places(), report);
  if (is_read) place_lumped_masses(scene);
  if (is_read) report_implausible(scene, report);
  if (is_read) result.scene = std::move(scene);
  result.faults = report.take_faults();
  return result;
}

SceneResult refuse_for_memory(const std::string& name) {
  return {std::nullopt,
          {{Fault::Severity::kError,
            {0, 0, 0},
            "memory ran out while the scene was read; put points and links into CSV files, which need less "
            "memory, use fewer points and links, or allow more memory (ulimit -v)"}},
          {name}};
}

}  // namespace

SceneResult read_scene(const std::string& path, const Settings& settings) {
  try {
    reader::Report report;
    const std::string folder = std::filesystem::path(path).parent_path().string();
    return read_source(report, report.open(path, {}), folder, name_from_path(path), settings);
  } catch (const std::bad_alloc&) {
    return refuse_for_memory(path);
  }
}

SceneResult read_scene_text(const SceneText& scene, const Settings& settings) {
  try {
    reader::Report report;
    const int source = report.add_text(scene.name, scene.text);
    const bool is_small = scene.text.size() <= reader::kMaxFileBytes;
    if (!is_small)
      report.error({source, 0, 0}, "the text has " + std::to_string(scene.text.size()) +
                                       " bytes, but at most " + std::to_string(reader::kMaxFileBytes) +
                                       " are read");
    return read_source(report, is_small ? std::optional<int>(source) : std::nullopt, scene.folder, "scene",
                       settings);
  } catch (const std::bad_alloc&) {
    return refuse_for_memory(scene.name);
  }
}

namespace reader {
namespace {

std::vector<int> every(std::size_t count) {
  std::vector<int> indices(count);
  std::iota(indices.begin(), indices.end(), 0);
  return indices;
}

}  // namespace

bool is_table(const Node& node) {
  return node.kind == Node::Kind::kMapping &&
         std::any_of(node.entries.begin(), node.entries.end(),
                     [](const auto& entry) { return entry.first->text == "csv"; });
}

Scene SceneReader::read(int source, const std::string& name) {
  scene_.name = name;
  const Node* root = read_bases(tree_.parse(report_, source));
  settings_.emplace(report_, tree_, settings_of_all_);
  if (const Node* changed = settings_->apply(root)) read_sections(*changed);
  if (!given_name_.empty()) scene_.name = given_name_;
  return std::move(scene_);
}

void SceneReader::read_sections(const Node& root) {
  const Fields fields(report_, root, "scene", sections::kScene);
  if (!fields.is_mapping()) return;
  for (const auto& entry : root.entries) other_places_.push_back(entry.first->origin);
  if (const Node* name = fields.find("name"))
    if (const auto text = read_name(report_, *name, "scene: name")) scene_.name = *text;
  fields.read("rate", scene_.rate);
  read_fidelity(fields);
  if (const Node* integration = fields.find("integration")) read_integration(*integration);
  if (const Node* verdict = fields.find("verdict")) read_verdict(*verdict);
  // points are read first, then links, then the items that refer to points and links
  const Node* points = fields.require("points", "must be a list of {name, mass, at} or {csv: FILE}");
  if (points)
    read_points(*points);
  else
    points_.mark_incomplete();
  if (fields.is_misspelt({"links"})) links_.mark_incomplete();
  if (fields.is_misspelt({"groups"})) groups_.mark_incomplete();
  if (fields.is_misspelt({"wheels"})) wheels_.mark_incomplete();
  if (const Node* links = fields.find("links")) read_links(*links);
  if (const Node* groups = fields.find("groups")) read_groups(*groups);
  if (const Node* damping = fields.find("damping")) read_damping(*damping);
  fields.read("gravity", scene_.gravity);
  if (const Node* attractor = fields.find("attractor")) read_attractor(*attractor);
  if (const Node* initial = fields.find("initial")) read_initial(*initial);
  if (const Node* wheels = fields.find("wheels"))
    for (const Node* item : read_list(*wheels, "wheels", "wheels")) read_wheel(*item);
  if (const Node* loads = fields.find("loads")) read_loads(*loads);
  if (const Node* feedback = fields.find("feedback")) read_feedbacks(*feedback);
  if (const Node* leave_out = fields.find("leave_out")) read_leave_out(*leave_out);
  if (const Node* modes = fields.find("modes")) read_modes(*modes);
  read_publish(fields.find("publish"));
  read_commands(fields.find("commands"));
}

std::vector<const Node*> SceneReader::read_list(const Node& node, const std::string& label,
                                                const std::string& of) {
  if (node.kind == Node::Kind::kMapping) return {&node};
  if (node.kind == Node::Kind::kList && report_.count_mentions(node.items.size(), node.origin))
    return node.items;
  if (node.kind != Node::Kind::kList)
    report_.error(node.origin, label + " is " + describe(node) + ", but must be a list of " + of);
  if (label == "points") points_.mark_incomplete();
  if (label == "links") links_.mark_incomplete();
  return {};
}

std::optional<int> SceneReader::open_beside(const Node& node, const std::string& label) {
  const auto name = read_text(report_, node, label);
  if (!name) return std::nullopt;
  return report_.open((std::filesystem::path(folder_) / *name).string(), node.origin);
}

void SceneReader::read_groups(const Node& node) {
  if (node.kind != Node::Kind::kMapping) {
    groups_.mark_incomplete();
    return report_.error(
        node.origin, "groups is " + describe(node) + ", but must be a mapping of names to lists of points");
  }
  for (const auto& [key, value] : node.entries) {
    const ItemOfReport item(report_);
    if (scene_.groups.size() == std::size_t{kMaxGroups}) {
      groups_.mark_incomplete();
      return report_.error(key->origin, "there are more than " + std::to_string(kMaxGroups) +
                                            " groups, so the rest is not read; remove some");
    }
    Group group;
    group.origin = key->origin;
    group.name = key->text;
    if (const std::string problem = name_problem(group.name); !problem.empty())
      report_.error(key->origin, "groups: name " + problem);
    if (auto points = read_selection(report_, *value, "group " + quote(group.name), points_)) {
      if (points->empty())
        report_.error(value->origin,
                      "group " + quote(group.name) + " is empty, but must have at least one point");
      group.points = std::move(*points);
    }
    groups_.add(report_, group.name, group.origin);
    scene_.groups.push_back(std::move(group));
  }
}

void SceneReader::read_damping(const Node& node) {
  const Fields fields(report_, node, "damping", sections::kDamping);
  scene_.damping.origin = node.origin;
  fields.read("ratio", scene_.damping.modal_ratio);
  if (const Node* rayleigh = fields.find("rayleigh")) {
    const Fields terms(report_, *rayleigh, "damping: rayleigh", sections::kRayleigh);
    terms.read("alpha", scene_.damping.alpha);
    terms.read("beta", scene_.damping.beta);
  }
  const Node* modes = fields.find("modes");
  if (!modes) return;
  if (modes->kind != Node::Kind::kMapping)
    return report_.error(modes->origin, "damping: modes is " + describe(*modes) +
                                            ", but must be a mapping of mode numbers to ratios");
  for (const auto& [key, value] : modes->entries) {
    const ItemOfReport item(report_);
    const auto mode = parse_integer(key->text, 1, 3 * std::int64_t{kMaxNamedPoints});
    if (!mode)
      report_.error(key->origin, "damping: modes: " + quote(key->text) +
                                     " is not the number of a mode; it must be a whole number from 1");
    const auto ratio =
        read_number(report_, *value, "damping: mode " + key->text, fields.key("modes").quantity);
    if (mode && ratio) scene_.damping.mode_ratios.emplace_back(static_cast<int>(*mode), *ratio);
  }
}

void SceneReader::read_modes(const Node& node) {
  const Fields fields(report_, node, "modes", sections::kModes);
  ModesAsked& modes = scene_.modes;
  modes.origin = node.origin;
  fields.read("below", modes.below);
  double count = 1.0;
  fields.read("count", count);
  const Range& range = fields.key("count").range;
  if (count != std::floor(count) || !range.holds(count))
    report_.error(fields.find("count")->origin,
                  "modes: count is " + format_number(count) + ", but must be a whole number from 1 to " +
                      format_number(range.most) + ", the most that one state message can hold");
  else if (fields.find("count"))
    modes.count = static_cast<int>(count);
  if (fields.find("below") && fields.find("count"))
    report_.error(node.origin, "modes has both below and count; give one of them");
  if (fields.lacks_all({"below", "count"}))
    report_.error(node.origin, "modes is empty, but must be {below: HZ} or {count: N}");
}

void SceneReader::read_attractor(const Node& node) {
  const Fields fields(report_, node, "attractor", sections::kAttractor);
  scene_.attractor.origin = node.origin;
  fields.read("at", scene_.attractor.position);
  fields.read("mu", scene_.attractor.mu);
}

void SceneReader::read_initial(const Node& node) {
  const Fields fields(report_, node, "initial", sections::kInitial);
  Initial& initial = scene_.initial;
  initial.origin = node.origin;
  fields.read("position", initial.position);
  fields.read("velocity", initial.velocity);
  fields.read("angular_velocity", initial.angular_velocity);
  if (const Node* attitude = fields.find("attitude")) {
    if (const auto q = read_unit_quaternion(report_, *attitude, "initial: attitude"))
      initial.attitude << q->w(), q->x(), q->y(), q->z();
  }
  if (const Node* points = fields.find("points")) read_initial_points(*points);
  if (const Node* modes = fields.find("modes")) read_initial_modes(*modes);
}

void SceneReader::read_initial_points(const Node& node) {
  if (node.kind != Node::Kind::kMapping)
    return report_.error(node.origin,
                         "initial: points is " + describe(node) +
                             ", but must be a mapping of point names to {displacement, velocity}");
  for (const auto& [key, value] : node.entries) {
    const ItemOfReport item(report_);
    Initial::PointElastic point;
    point.point = points_.resolve(report_, key->text, key->origin, "initial: points").value_or(-1);
    const Fields fields(report_, *value, "initial: point " + quote(key->text), sections::kInitialPoint);
    fields.read("displacement", point.displacement);
    fields.read("velocity", point.velocity);
    scene_.initial.points.push_back(point);
  }
}

void SceneReader::read_initial_modes(const Node& node) {
  if (node.kind != Node::Kind::kMapping)
    return report_.error(node.origin, "initial: modes is " + describe(node) +
                                          ", but must be a mapping of mode numbers to {q, q_dot}");
  for (const auto& [key, value] : node.entries) {
    const ItemOfReport item(report_);
    Initial::ModeElastic mode;
    const auto number = parse_integer(key->text, 1, 3 * std::int64_t{kMaxNamedPoints});
    if (!number)
      report_.error(key->origin, "initial: modes: " + quote(key->text) +
                                     " is not the number of a mode; it must be a whole number from 1");
    mode.mode = static_cast<int>(number.value_or(0));
    const Fields fields(report_, *value, "initial: mode " + key->text, sections::kInitialMode);
    fields.read("q", mode.q);
    fields.read("q_dot", mode.q_dot);
    scene_.initial.modes.push_back(mode);
  }
}

void SceneReader::check_publication_rate(const Node* node, const std::string& label, double rate) {
  if (node && rate > scene_.rate)
    report_.warning(node->origin, label + " " + format_number(rate) + " Hz is above the tick rate of " +
                                      format_number(scene_.rate) +
                                      " Hz; each tick is published at most once");
}

void SceneReader::read_rate_and_selection(const Node& node, const std::string& label, const Section& section,
                                          const Names& names, const std::vector<int>& all, double& rate,
                                          std::vector<int>& chosen) {
  const Fields fields(report_, node, label, section);
  fields.read("rate", rate);
  check_publication_rate(fields.find("rate"), label + ": rate", rate);
  const Node* of = fields.find("of");
  if (of && of->kind == Node::Kind::kText && of->text == "all")
    chosen = all;
  else if (of)
    if (auto selection = read_selection(report_, *of, label + ": of", names)) chosen = std::move(*selection);
}

void SceneReader::read_publish(const Node* node) {
  Publication& publication = scene_.publication;
  const std::vector<int> all_points = every(scene_.points.size());
  std::vector<int> all_links;
  for (std::size_t i = 0; i < scene_.links.size(); ++i)
    // links that publish a force for each of their points are published only if the scene lists them
    if (!has_point_forces(scene_.links[i]) && publishes_forces(scene_, scene_.links[i]))
      all_links.push_back(static_cast<int>(i));
  publication.groups = every(scene_.groups.size());
  if (scene_.points.size() <= std::size_t{kMostByDefault}) {
    publication.points = all_points;
    publication.links = all_links;
  }
  if (!node) return;
  const Fields fields(report_, *node, "publish", sections::kPublish);
  for (std::size_t i = 0; i < kNumMotionChannels; ++i) {
    if (kMotionChannels[i].lists_items) continue;
    const std::string key = kMotionChannels[i].key;
    fields.read(key, publication.rates[i]);
    check_publication_rate(fields.find(key), "publish: " + key, publication.rates[i]);
  }
  fields.read("status", publication.status_rate);
  check_publication_rate(fields.find("status"), "publish: status", publication.status_rate);
  if (const Node* points = fields.find("points"))
    read_rate_and_selection(*points, "publish: points", sections::kPublishedPoints, points_, all_points,
                            publication.rates[kPointsChannel], publication.points);
  if (const Node* groups = fields.find("groups"))
    if (auto selection = read_selection(report_, *groups, "publish: groups", groups_))
      publication.groups = std::move(*selection);
  if (const Node* loads = fields.find("loads"))
    read_rate_and_selection(*loads, "publish: loads", sections::kPublishedLoads, links_, all_links,
                            publication.rates[kLoadsChannel], publication.links);
}

void SceneReader::warn_of_defaults() {
  if (report_.has_error() || !scene_.publication.points.empty() || !scene_.publication.groups.empty()) return;
  report_.warning(scene_.points.front().origin,
                  "none of the " + std::to_string(scene_.points.size()) +
                      " points is published, because in a scene of more than " +
                      std::to_string(kMostByDefault) +
                      " points, only points and links that the scene names are published, can be pushed and "
                      "are listed on the bus; name them in 'publish: points: of', 'publish: loads: of' and "
                      "'commands: points', or in groups");
}

void SceneReader::read_commands(const Node* node) {
  if (scene_.points.size() <= std::size_t{kMostByDefault})
    scene_.pushable = every(scene_.points.size());
  else
    warn_of_defaults();
  if (!node) return;
  const Fields fields(report_, *node, "commands", sections::kCommands);
  if (const Node* points = fields.find("points"))
    if (auto selection = read_selection(report_, *points, "commands: points", points_))
      scene_.pushable = std::move(*selection);
  fields.read("force_limit", scene_.force_limit);
  fields.read("torque_limit", scene_.torque_limit);
  fields.read("max_age", scene_.command_limits.max_age);
  fields.read("sender_share", scene_.command_limits.sender_share);
  fields.read("max_hold", scene_.command_limits.max_hold);
  const Range& ages = fields.key("max_age").range;
  if (const double age = scene_.command_limits.max_age; !ages.holds(age))
    report_.error(fields.find("max_age")->origin,
                  "commands: max_age is " + format_number(age) + " s, but must be at least " +
                      format_number(ages.least) +
                      " s, because between slow ticks commands are read every 50 ms");
  if (const double share = scene_.command_limits.sender_share; !fields.key("sender_share").range.holds(share))
    report_.error(fields.find("sender_share")->origin, "commands: sender_share is " + format_number(share) +
                                                           ", but must be a fraction, at most 1");
}

}  // namespace reader
}  // namespace freeflex::io
