// Reads point masses and bodies, inline and from tables.
#include "service/io/scene/reader.hpp"

namespace freeflex::io::reader {

void SceneReader::read_points(const Node& node) {
  std::size_t position = 0;
  for (const Node* item : read_list(node, "points", "points or {csv: FILE}")) {
    ++position;
    if (scene_.points.size() > std::size_t{kMaxNamedPoints}) break;  // reported
    if (is_table(*item))
      read_points_table(*item);
    else
      read_point(*item, std::to_string(position));
  }
  settings_->report_unmatched("points", points_.is_complete());
  if (scene_.points.empty() && !report_.has_error())
    report_.error(node.origin, "points is empty, but a scene must have at least one point");
}

bool SceneReader::add_point(PointMass point) {
  points_.add(report_, point.name, point.origin);
  scene_.points.push_back(std::move(point));
  if (scene_.points.size() <= std::size_t{kMaxNamedPoints}) return true;
  // the limit of a plan is below the limit of reading, so this call reports the first point beyond the limit
  // of a plan
  report_num_points(scene_, false, report_);
  points_.mark_incomplete();
  return false;
}

bool SceneReader::read_point(const Node& node, const std::string& place) {
  const ItemOfReport item(report_);
  const Fields fields(report_, node, item_label("point", node, place), sections::kPoint);
  PointMass point;
  point.origin = node.origin;
  point.name = std::to_string(scene_.points.size() + 1);
  if (!fields.is_mapping() || fields.is_misspelt({"name"})) points_.mark_incomplete();
  if (const Node* name = fields.find("name")) {
    if (const auto text = read_name(report_, *name, fields.label() + ": name")) {
      point.name = *text;
    } else {
      points_.mark_incomplete();
    }
  }
  fields.read("mass", point.mass);
  fields.read("at", point.position);
  read_body(fields, point);
  return add_point(std::move(point));
}

// reads the inertia (three moments, or six entries of the matrix) and the offset of the centre of mass, both
// given in the axes of the body, and converts them to the axes of the scene
void SceneReader::read_body(const Fields& fields, PointMass& point) {
  const Node *inertia = fields.find("inertia"), *axes = fields.find("axes");
  fields.read("offset", point.offset);
  if (inertia != nullptr) {
    const std::size_t size = inertia->items.size();
    const bool is_matrix = size == 6;
    if (inertia->kind != Node::Kind::kList || (size != 3 && !is_matrix))
      return report_.error(inertia->origin,
                           fields.label() + ": inertia " +
                               (inertia->kind == Node::Kind::kList ? "has " + std::to_string(size) + " items"
                                                                   : "is not a list of numbers") +
                               ", but must be 3 moments or 6 entries xx, yy, zz, xy, xz, yz [kg m^2]");
    const auto J = read_numbers(report_, *inertia, fields.label() + ": inertia",
                                fields.key("inertia").quantity, is_matrix ? std::size_t{6} : std::size_t{3});
    if (J) point.inertia.diagonal() << (*J)[0], (*J)[1], (*J)[2];
    if (J && is_matrix) {
      point.inertia(0, 1) = point.inertia(1, 0) = (*J)[3];
      point.inertia(0, 2) = point.inertia(2, 0) = (*J)[4];
      point.inertia(1, 2) = point.inertia(2, 1) = (*J)[5];
    }
  }
  if (axes == nullptr) return;
  if (inertia == nullptr && fields.find("offset") == nullptr)
    report_.error(
        axes->origin,
        fields.label() + ": axes are those of inertia and offset, but neither is given; remove axes");
  if (const auto q = read_unit_quaternion(report_, *axes, fields.label() + ": axes")) {
    const Eigen::Matrix3d rotation = q->toRotationMatrix();
    point.inertia = (rotation * point.inertia * rotation.transpose()).eval();
    point.offset = (rotation * point.offset).eval();
  }
}

void SceneReader::read_points_table(const Node& node) {
  const ItemOfReport item(report_);
  const Fields fields(report_, node, "points", sections::kPointTable);
  const auto source = open_beside(*fields.find("csv"), "points: csv");
  if (!source) return points_.mark_incomplete();
  enum { kName, kMassColumn, kX, kY, kZ };
  CsvTable table(report_, *source, {"name", "mass", "x", "y", "z"}, {"mass", "x", "y", "z"});
  const bool is_whole = table.each_row([&](const CsvRow& row) {
    PointMass point;
    point.origin = row.origin();
    point.name = table.has("name") ? std::string(row.text(kName)) : std::to_string(scene_.points.size() + 1);
    if (settings_->wants_row("points", point.name)) {
      Node& changed = row.as_item(tree_, table.has("name") ? std::vector<std::size_t>{kName, kMassColumn}
                                                           : std::vector<std::size_t>{kMassColumn});
      row.add_list(tree_, changed, "at", {kX, kY, kZ});
      settings_->apply_to_row("points", point.name, changed);
      return read_point(changed, row.place());
    }
    const std::string label = row.label("point", kName);
    if (const std::string problem = name_problem(point.name); !problem.empty()) {
      report_.error(row.origin(kName), label + ": name " + problem);
      points_.mark_incomplete();
    }
    point.mass = row.number(kMassColumn, label, kMass);
    for (int axis = 0; axis < 3; ++axis)
      point.position[axis] = row.number(kX + index(axis), label, kPosition);
    return add_point(std::move(point));
  });
  if (!is_whole) points_.mark_incomplete();
}

}  // namespace freeflex::io::reader
