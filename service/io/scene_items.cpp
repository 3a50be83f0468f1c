// Points and links: inline, in chains, from tables and matrices.
#include <algorithm>

#include "service/io/scene_reader.hpp"

namespace freeflex::io::reader {
namespace {

constexpr Quantity kMass{"kg", Bound::kPositive};
constexpr Quantity kStiffness{"N/m", Bound::kPositive};
constexpr Quantity kForce{"N", Bound::kPositive};
constexpr Quantity kRigidity{"N m^2", Bound::kPositive};
constexpr Quantity kAny{"-", Bound::kAny};

bool is_table(const Node& node) {
  return node.kind == Node::Kind::kMapping &&
         std::any_of(node.entries.begin(), node.entries.end(),
                     [](const auto& entry) { return entry.first->text == "csv"; });
}

}  // namespace

void SceneReader::read_points(const Node& node) {
  for (const Node* item : read_list(node, "points", "points or {csv: FILE}")) {
    if (scene_.points.size() > kMaxPoints) break;  // reported
    if (is_table(*item))
      read_points_table(*item);
    else
      read_point(*item);
  }
  if (scene_.points.empty() && !report_.has_error())
    report_.error(node.origin, "points is empty; a scene has at least one point");
}

bool SceneReader::add_point(PointMass point) {
  points_.add(report_, point.name, point.origin);
  if (scene_.points.size() == kMaxPoints)
    report_.error(point.origin, "more than " + std::to_string(kMaxPoints) + " points; the rest is not read");
  scene_.points.push_back(std::move(point));
  if (scene_.points.size() <= kMaxPoints) return true;
  points_.mark_incomplete();
  return false;
}

void SceneReader::read_point(const Node& node) {
  const std::string number = std::to_string(scene_.points.size() + 1);
  const Fields fields(report_, node, item_label("point", node, number), {"name", "mass", "at"});
  PointMass point;
  point.origin = node.origin;
  point.name = number;
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
    const std::string label = "point " + quote(point.name);
    if (const std::string problem = name_problem(point.name); !problem.empty()) {
      report_.error(row.origin(kName),
                    "point " + std::to_string(scene_.points.size() + 1) + ": name " + problem);
      points_.mark_incomplete();
    }
    point.mass = row.number(kMassColumn, label, kMass);
    for (int axis = 0; axis < 3; ++axis)
      point.position[axis] = row.number(kX + static_cast<std::size_t>(axis), label, {"m"});
    return add_point(std::move(point));
  });
  if (!is_whole) points_.mark_incomplete();
}

void SceneReader::read_links(const Node& node) {
  for (const Node* item : read_list(node, "links", "links or {csv: FILE}")) {
    if (scene_.links.size() > kMaxLinks) break;  // reported
    if (is_table(*item))
      read_links_table(*item);
    else
      read_link(*item);
  }
}

bool SceneReader::add_link(Link link) {
  links_.add(report_, link.name, link.origin);
  if (scene_.links.size() == kMaxLinks)
    report_.error(link.origin, "more than " + std::to_string(kMaxLinks) + " links; the rest is not read");
  scene_.links.push_back(std::move(link));
  return scene_.links.size() <= kMaxLinks;
}

void SceneReader::read_link(const Node& node) {
  const std::string number = std::to_string(scene_.links.size() + 1);
  const std::string label = item_label("link", node, number);
  if (node.kind != Node::Kind::kMapping) {
    report_.error(node.origin,
                  label + " is " + describe(node) + ", must be a mapping with spring, bar, beam or matrix");
    links_.mark_incomplete();
    return;
  }
  const auto find = [&](std::string_view key) {
    const auto entry = std::find_if(node.entries.begin(), node.entries.end(),
                                    [&](const auto& e) { return e.first->text == key; });
    return entry == node.entries.end() ? nullptr : entry->second;
  };
  std::string name = number;
  if (const Node* given = find("name"))
    if (const auto text = read_name(report_, *given, label + ": name")) name = *text;
  struct Kind {
    std::string_view key;
    std::vector<std::string_view> keys;
  };
  static const std::vector<Kind> kKinds{{"spring", {"name", "spring", "stiffness"}},
                                        {"bar", {"name", "bar", "EA"}},
                                        {"beam", {"name", "beam", "EA", "GJ", "EIy", "EIz", "y_axis"}},
                                        {"matrix", {"name", "matrix", "points"}}};
  const auto kind =
      std::find_if(kKinds.begin(), kKinds.end(), [&](const Kind& k) { return find(k.key) != nullptr; });
  if (kind == kKinds.end()) {
    std::string meant;
    for (const auto& [key, value] : node.entries)
      if (meant.empty() && key->text != "name")
        meant = did_you_mean(key->text, {"spring", "bar", "beam", "matrix"});
    report_.error(node.origin,
                  label + " has no kind" + meant + "; must have one of spring, bar, beam, matrix");
    links_.mark_incomplete();
    return;
  }
  const auto second =
      std::find_if(kind + 1, kKinds.end(), [&](const Kind& k) { return find(k.key) != nullptr; });
  if (second != kKinds.end()) {
    report_.error(node.origin, label + " is both " + std::string(kind->key) + " and " +
                                   std::string(second->key) + "; must have one of spring, bar, beam, matrix");
    return links_.mark_incomplete();
  }
  const Fields fields(report_, node, label, kind->keys);
  read_link_of_kind(fields, std::string(kind->key), *find(kind->key), name);
}

void SceneReader::read_link_of_kind(const Fields& fields, const std::string& kind, const Node& value,
                                    const std::string& name) {
  if (kind == "spring") {
    Spring spring;
    fields.require("stiffness", kStiffness, spring.stiffness);
    read_chain(fields, value, spring, kind, name);
  } else if (kind == "bar") {
    Bar bar;
    fields.require("EA", kForce, bar.EA);
    read_chain(fields, value, bar, kind, name);
  } else if (kind == "beam") {
    Beam beam;
    fields.require("EA", kForce, beam.EA);
    fields.require("GJ", kRigidity, beam.GJ);
    fields.require("EIy", kRigidity, beam.EI_y);
    fields.require("EIz", kRigidity, beam.EI_z);
    if (const Node* axis = fields.find("y_axis")) {
      const auto direction = read_vector(report_, *axis, fields.label() + ": y_axis", kAny.unit);
      if (direction && direction->isZero(0.0))
        report_.error(axis->origin, fields.label() + ": y_axis is zero, must be a direction");
      if (direction) beam.y_axis = *direction;
    }
    read_chain(fields, value, beam, kind, name);
  } else {
    read_matrix(fields, value, name);
  }
}

void SceneReader::read_chain(const Fields& fields, const Node& ends,
                             const std::variant<Spring, Bar, Beam, MatrixLink>& kind,
                             const std::string& kind_name, const std::string& name) {
  const std::string label = fields.label() + ": " + kind_name;
  const auto chain = read_selection(report_, ends, label, points_, true);
  if (chain && chain->size() < 2)
    report_.error(ends.origin, label + " has " + std::to_string(chain->size()) +
                                   (chain->size() == 1 ? " point" : " points") +
                                   ", must be a list of 2 or more");
  if (!chain || chain->size() < 2) {
    links_.mark_incomplete();
    return;
  }
  for (std::size_t i = 0; i + 1 < chain->size(); ++i) {
    Link link;
    link.origin = fields.origin();
    // a chain's links are name.1, name.2, ...; one without a name numbers them on
    link.name = chain->size() == 2    ? name
                : fields.find("name") ? name + "." + std::to_string(i + 1)
                                      : std::to_string(scene_.links.size() + 1);
    link.points = {(*chain)[i], (*chain)[i + 1]};
    link.kind = kind;
    if (link.points[0] == link.points[1]) {
      report_.error(ends.origin, label + " joins the point " +
                                     quote(scene_.points[static_cast<std::size_t>(link.points[0])].name) +
                                     " to itself");
      return;
    }
    if (!add_link(std::move(link))) return;
  }
}

void SceneReader::read_matrix(const Fields& fields, const Node& file, const std::string& name) {
  MatrixLink matrix;
  const Node* chosen =
      fields.require("points", "must be all or a list of points in the order of the matrix rows");
  const auto points =
      chosen ? read_selection(report_, *chosen, fields.label() + ": points", points_) : std::nullopt;
  const auto source = open_beside(file, fields.label() + ": matrix");
  // the link stands even when its matrix does not, so that its name is known
  Link link;
  link.name = name;
  link.origin = fields.origin();
  if (points && source && points->empty())
    report_.error(chosen->origin, fields.label() + ": points is empty");
  if (points && source && !points->empty()) {
    auto stiffness = read_matrix_market(report_, *source, 3 * points->size(),
                                        "3 rows for each of " + std::to_string(points->size()) + " points");
    if (stiffness) matrix.stiffness.swap(*stiffness);
    matrix.points = *points;
  }
  link.kind = std::move(matrix);
  add_link(std::move(link));
}

void SceneReader::read_links_table(const Node& node) {
  const Fields fields(report_, node, "links", {"csv"});
  const auto source = open_beside(*fields.find("csv"), "links: csv");
  if (!source) return links_.mark_incomplete();
  enum { kName, kFrom, kTo, kStiffnessColumn, kEA, kGJ, kEIy, kEIz };
  CsvTable table(report_, *source, {"name", "from", "to", "stiffness", "EA", "GJ", "EIy", "EIz"},
                 {"from", "to"});
  if (!table.is_good()) return links_.mark_incomplete();
  const bool is_spring = table.has("stiffness");
  const bool is_beam = table.has("GJ") || table.has("EIy") || table.has("EIz");
  const bool is_beam_whole = table.has("GJ") && table.has("EIy") && table.has("EIz") && table.has("EA");
  if ((is_spring && (is_beam || table.has("EA"))) || (is_beam && !is_beam_whole) ||
      !(is_spring || is_beam || table.has("EA"))) {
    report_.error({*source, 1, 1},
                  "the columns give no kind of link; beside from and to they must be stiffness (springs), EA "
                  "(bars), or EA, GJ, EIy, EIz (beams)");
    return links_.mark_incomplete();
  }
  const bool is_whole = table.each_row([&](const CsvRow& row) {
    Link link;
    link.origin = row.origin();
    link.name = table.has("name") ? std::string(row.text(kName)) : std::to_string(scene_.links.size() + 1);
    const std::string label = "link " + quote(link.name);
    if (const std::string problem = name_problem(link.name); !problem.empty()) {
      report_.error(row.origin(kName),
                    "link " + std::to_string(scene_.links.size() + 1) + ": name " + problem);
      links_.mark_incomplete();
    }
    if (is_spring) {
      link.kind = Spring{row.number(kStiffnessColumn, label, kStiffness)};
    } else if (is_beam) {
      Beam beam;
      beam.EA = row.number(kEA, label, kForce);
      beam.GJ = row.number(kGJ, label, kRigidity);
      beam.EI_y = row.number(kEIy, label, kRigidity);
      beam.EI_z = row.number(kEIz, label, kRigidity);
      link.kind = beam;
    } else {
      link.kind = Bar{row.number(kEA, label, kForce)};
    }
    const auto from = points_.resolve(report_, row.text(kFrom), row.origin(kFrom), label + ": from");
    const auto to = points_.resolve(report_, row.text(kTo), row.origin(kTo), label + ": to");
    if (from && to && *from == *to)
      report_.error(row.origin(kTo), label + " joins the point " + quote(row.text(kTo)) + " to itself");
    link.points = {from.value_or(-1), to.value_or(-1)};
    return add_link(std::move(link));
  });
  if (!is_whole) links_.mark_incomplete();
}

}  // namespace freeflex::io::reader
