// Point masses: inline and from tables.
#include "service/io/scene/reader.hpp"

namespace freeflex::io::reader {
namespace {

constexpr Quantity kMass{"kg", Bound::kPositive};

}  // namespace

void SceneReader::read_points(const Node& node) {
  std::size_t position = 0;
  for (const Node* item : read_list(node, "points", "points or {csv: FILE}")) {
    ++position;
    if (scene_.points.size() > std::size_t{kMaxNamedPoints}) break;  // reported
    if (is_table(*item))
      read_points_table(*item);
    else
      read_point(*item, position);
  }
  if (scene_.points.empty() && !report_.has_error())
    report_.error(node.origin, "points is empty; a scene has at least one point");
}

bool SceneReader::add_point(PointMass point) {
  points_.add(report_, point.name, point.origin);
  scene_.points.push_back(std::move(point));
  if (scene_.points.size() <= std::size_t{kMaxNamedPoints}) return true;
  // more than is read, and many more than are taken: the latter is what to mend
  report_num_points(scene_, false, report_);
  points_.mark_incomplete();
  return false;
}

void SceneReader::read_point(const Node& node, std::size_t position) {
  const Fields fields(report_, node, item_label("point", node, position), {"name", "mass", "at"});
  PointMass point;
  point.origin = node.origin;
  point.name = std::to_string(scene_.points.size() + 1);
  if (!fields.is_mapping()) points_.mark_incomplete();
  if (const Node* name = fields.find("name")) {
    if (const auto text = read_name(report_, *name, fields.label() + ": name")) {
      point.name = *text;
    } else {
      points_.mark_incomplete();
    }
  }
  fields.require("mass", kMass, point.mass);
  fields.require("at", "m", point.position);
  add_point(std::move(point));
}

void SceneReader::read_points_table(const Node& node) {
  const Fields fields(report_, node, "points", {"csv"});
  const auto source = open_beside(*fields.find("csv"), "points: csv");
  if (!source) return points_.mark_incomplete();
  enum { kName, kMassColumn, kX, kY, kZ };
  CsvTable table(report_, *source, {"name", "mass", "x", "y", "z"}, {"mass", "x", "y", "z"});
  const bool is_whole = table.each_row([&](const CsvRow& row) {
    PointMass point;
    point.origin = row.origin();
    point.name = table.has("name") ? std::string(row.text(kName)) : std::to_string(scene_.points.size() + 1);
    const std::string label = row.label("point", kName);
    if (const std::string problem = name_problem(point.name); !problem.empty()) {
      report_.error(row.origin(kName), label + ": name " + problem);
      points_.mark_incomplete();
    }
    point.mass = row.number(kMassColumn, label, kMass);
    for (int axis = 0; axis < 3; ++axis)
      point.position[axis] = row.number(kX + static_cast<std::size_t>(axis), label, {"m"});
    return add_point(std::move(point));
  });
  if (!is_whole) points_.mark_incomplete();
}

}  // namespace freeflex::io::reader
