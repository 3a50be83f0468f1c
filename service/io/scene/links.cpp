// Reads links in the scene itself: single links, chains, rigid bodies and matrices.
#include "service/io/scene/links.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "service/io/scene/reader.hpp"

namespace freeflex::io::reader {

/// The form in which a scene writes a kind of link.
struct LinkForm {
  enum class Extent {
    kChain,  // num_points or more points; one link for each run of num_points successive points
    kOne,    // exactly num_points points
    kBody,   // num_points or more points in one link
    kFile,   // a file; the key `points` lists the points
  };
  std::string_view key;  // key that gives the kind; its value is the points, or the file of a matrix
  Extent extent;
  std::size_t num_points;
  LinkKind (*read)(Report& report, const Fields& fields);
};

std::optional<int> find_repeated(const std::vector<int>& points) {
  for (auto point = points.begin(); point != points.end(); ++point)
    if (std::find(points.begin(), point, *point) != point) return *point;
  return std::nullopt;
}

namespace {

using Extent = LinkForm::Extent;

std::string count_points(std::size_t count) {
  return std::to_string(count) + (count == 1 ? " point" : " points");
}

std::string describe_repeated(const std::string& label, const std::string& point, std::size_t size) {
  if (size == 2) return label + " joins the point " + quote(point) + " to itself; give two different points";
  return label + " names the point " + quote(point) + " twice among " + std::to_string(size) +
         " successive points, which must be different points";
}

LinkKind read_spring(Report&, const Fields& fields) {
  Spring spring;
  fields.read("stiffness", spring.stiffness);
  return spring;
}

// reads `lumped` or `mean_axial`, which only a link with mass may have
MassDistribution read_mass_distribution(Report& report, const Fields& fields, bool has_mass) {
  const auto is_set = [&](std::string_view key) {
    const Node* node = fields.find(key);
    if (node == nullptr) return false;
    if (!has_mass)
      report.error(node->origin,
                   fields.label_of(key) +
                       " sets how the mass of the link is distributed, but the link has no mass; give a "
                       "mass, or remove this key");
    return fields.read_word(key) == 0;
  };
  const bool is_lumped = is_set("lumped"), is_mean = is_set("mean_axial");
  if (is_lumped && is_mean)
    report.error(fields.origin(),
                 fields.label() + ": lumped and mean_axial exclude each other; remove one of them");
  if (is_lumped) return MassDistribution::kLumped;
  return is_mean ? MassDistribution::kMeanAxial : MassDistribution::kConsistent;
}

LinkKind read_bar(Report& report, const Fields& fields) {
  Bar bar;
  fields.read("EA", bar.EA);
  fields.read("mass_per_length", bar.mass_per_length);
  bar.mass_distribution = read_mass_distribution(report, fields, fields.find("mass_per_length") != nullptr);
  return bar;
}

// reads the rotations that the joint at one end of a beam releases, as letters of the local axes
void read_released(Report& report, const Node& node, const std::string& label,
                   std::array<bool, 3>& released) {
  constexpr std::string_view kLetters = "xyz";
  const std::vector<const Node*> single{&node};
  const bool is_list = node.kind == Node::Kind::kList;
  if ((!is_list && node.kind != Node::Kind::kText) || node.items.size() > kLetters.size())
    return report.error(
        node.origin,
        label + (is_list ? " has " + std::to_string(node.items.size()) + " items" : " is " + describe(node)) +
            ", but must be a list of x, y, z, the local axes about which the end rotates freely");
  for (const Node* item : is_list ? node.items : single) {
    const std::size_t axis = item->text.size() == 1 ? kLetters.find(item->text) : std::string_view::npos;
    if (axis == std::string_view::npos) {
      report.error(item->origin, label + " holds " +
                                     (item->kind == Node::Kind::kEmpty ? "nothing" : describe(*item)) +
                                     ", but must be x, y or z, a local axis about which the end rotates "
                                     "freely");
      continue;
    }
    if (released[axis])
      report.error(item->origin, label + ": " + quote(item->text) + " appears twice; remove one");
    released[axis] = true;
  }
}

LinkKind read_beam(Report& report, const Fields& fields) {
  Beam beam;
  fields.read("EA", beam.EA);
  fields.read("GJ", beam.GJ);
  fields.read("EIy", beam.EI_y);
  fields.read("EIz", beam.EI_z);
  fields.read("GAy", beam.GA_y);
  fields.read("GAz", beam.GA_z);
  fields.read("mass_per_length", beam.mass_per_length);
  beam.mass_distribution = read_mass_distribution(report, fields, fields.find("mass_per_length") != nullptr);
  if (const Node* axis = fields.find("y_axis")) {
    const auto direction = read_vector(report, *axis, fields.label() + ": y_axis", "-");
    if (direction && direction->isZero(0.0))
      report.error(axis->origin, fields.label() + ": y_axis is zero, but must be a direction");
    if (direction) beam.y_axis = *direction;
  }
  if (const Node* release = fields.find("release")) {
    const Fields ends(report, *release, fields.label() + ": release", sections::kRelease);
    if (const Node* from = ends.find("from"))
      read_released(report, *from, ends.label() + ": from", beam.released[0]);
    if (const Node* to = ends.find("to")) read_released(report, *to, ends.label() + ": to", beam.released[1]);
  }
  return beam;
}

LinkKind read_bending(Report&, const Fields& fields) {
  BendingSpring spring;
  fields.read("stiffness", spring.stiffness);
  return spring;
}

LinkKind read_torsion(Report&, const Fields& fields) {
  TorsionSpring spring;
  fields.read("stiffness", spring.stiffness);
  return spring;
}

LinkKind read_plate(Report& report, const Fields& fields) {
  Plate plate;
  fields.read("E", plate.E);
  fields.read("nu", plate.nu);
  fields.read("thickness", plate.thickness);
  fields.read("density", plate.density);
  plate.mass_distribution = read_mass_distribution(report, fields, fields.find("density") != nullptr);
  return plate;
}

LinkKind read_stiffness_matrix(Report& report, const Fields& fields) {
  LinkKind kind(std::in_place_type<MatrixLink>);
  auto& matrix = std::get<MatrixLink>(kind);
  matrix.has_rotations = fields.read_word("rotations") == 0;
  double num_inner = 0.0;
  fields.read("inner", num_inner);
  const Range& range = fields.key("inner").range;
  if (num_inner != std::floor(num_inner) || !range.holds(num_inner))
    report.error(fields.find("inner")->origin, fields.label() + ": inner is " + format_number(num_inner) +
                                                   ", but must be a whole number from 0 to " +
                                                   format_number(range.most));
  else
    matrix.num_inner = static_cast<int>(num_inner);
  if (matrix.num_inner > 0 && fields.find("mass") == nullptr)
    report.error(fields.find("inner")->origin,
                 fields.label() +
                     ": inner coordinates need a mass matrix, which determines their motion; give mass: "
                     "FILE");
  return kind;
}

LinkKind read_flexibility_matrix(Report&, const Fields&) {
  LinkKind kind(std::in_place_type<MatrixLink>);
  std::get<MatrixLink>(kind).is_flexibility = true;
  return kind;
}

LinkKind read_rigid(Report&, const Fields&) { return Rigid{}; }

LinkKind read_dashpot(Report&, const Fields& fields) {
  Dashpot dashpot;
  fields.read("damping", dashpot.damping);
  return dashpot;
}

constexpr std::array kLinkForms{LinkForm{"spring", Extent::kChain, 2, read_spring},
                                LinkForm{"bar", Extent::kChain, 2, read_bar},
                                LinkForm{"beam", Extent::kChain, 2, read_beam},
                                LinkForm{"bending", Extent::kChain, 3, read_bending},
                                LinkForm{"torsion", Extent::kChain, 4, read_torsion},
                                LinkForm{"plate", Extent::kOne, 3, read_plate},
                                LinkForm{"matrix", Extent::kFile, 2, read_stiffness_matrix},
                                LinkForm{"flexibility", Extent::kFile, 2, read_flexibility_matrix},
                                LinkForm{"rigid", Extent::kBody, 2, read_rigid},
                                LinkForm{"dashpot", Extent::kChain, 2, read_dashpot}};

const Section& section_of(const LinkForm& form) {
  return *std::find_if(sections::kLinks.begin(), sections::kLinks.end(),
                       [&](const Section& section) { return section.name == form.key; });
}

std::vector<std::string_view> kinds_of_link() {
  std::vector<std::string_view> kinds;
  kinds.reserve(kLinkForms.size());
  for (const LinkForm& form : kLinkForms) kinds.push_back(form.key);
  return kinds;
}

}  // namespace

void SceneReader::read_links(const Node& node) {
  std::size_t position = 0;
  for (const Node* item : read_list(node, "links", "links or {csv: FILE}")) {
    ++position;
    if (scene_.links.size() > kMaxLinks) break;  // reported
    if (is_table(*item))
      read_links_table(*item);
    else
      read_link(*item, std::to_string(position));
  }
  settings_->report_unmatched("links", links_.is_complete());
}

std::string SceneReader::next_link_name() const {
  return std::to_string(scene_.links.size() + num_unread_links_ + 1);
}

void SceneReader::leave_link_unread(const Origin& origin) {
  other_places_.push_back(origin);
  links_.mark_incomplete();
  ++num_unread_links_;
}

bool SceneReader::add_link(Link link) {
  links_.add(report_, link.name, link.origin);
  if (scene_.links.size() == kMaxLinks)
    report_.error(link.origin, "there are more than " + std::to_string(kMaxLinks) +
                                   " links, so the rest is not read; remove some");
  scene_.links.push_back(std::move(link));
  return scene_.links.size() <= kMaxLinks;
}

const LinkForm* SceneReader::find_form(const Node& node, const std::string& label) {
  const auto allowed = [] { return "; it must have one of " + join(kinds_of_link()); };
  const auto has = [&](std::string_view key) {
    return std::any_of(node.entries.begin(), node.entries.end(),
                       [&](const auto& entry) { return entry.first->text == key; });
  };
  const LinkForm* found = nullptr;
  for (const LinkForm& form : kLinkForms) {
    if (!has(form.key)) continue;
    if (found) {
      report_.error(node.origin, label + " is both " + std::string(found->key) + " and " +
                                     std::string(form.key) + allowed());
      return nullptr;
    }
    found = &form;
  }
  if (found) return found;
  std::string meant;
  for (const auto& [key, value] : node.entries)
    if (meant.empty() && key->text != "name") meant = did_you_mean(key->text, kinds_of_link());
  report_.missing(node, "kind", label + " has no kind" + meant + allowed());
  return nullptr;
}

void SceneReader::read_link(const Node& node, const std::string& place) {
  const ItemOfReport item(report_);
  const std::string label = item_label("link", node, place);
  if (node.kind != Node::Kind::kMapping) {
    report_.error(node.origin, label + " is " + describe(node) + ", but must be a mapping with one of " +
                                   join(kinds_of_link()));
    return leave_link_unread(node.origin);
  }
  const LinkForm* form = find_form(node, label);
  if (!form) return leave_link_unread(node.origin);
  const Fields fields(report_, node, label, section_of(*form));
  if (fields.is_misspelt({"name"})) links_.mark_incomplete();
  Link link;
  link.origin = node.origin;
  link.name = next_link_name();
  if (const Node* given = fields.find("name")) {
    if (const auto text = read_name(report_, *given, label + ": name")) link.name = *text;
  } else {
    link.label = place;
  }
  link.kind = form->read(report_, fields);
  fields.read("viscous", link.viscous);
  fields.read("loss_factor", link.loss_factor);
  if (form->extent == Extent::kFile)
    read_matrix(fields, *form, std::move(link));
  else
    read_chain(fields, *form, std::move(link));
}

void SceneReader::read_chain(const Fields& fields, const LinkForm& form, Link link) {
  const Node& ends = *fields.find(form.key);
  const std::string label = fields.label() + ": " + std::string(form.key);
  const bool is_chain = form.extent == Extent::kChain;
  const auto points = read_selection(report_, ends, label, points_, is_chain);
  if (!points) return leave_link_unread(link.origin);
  const std::size_t count = points->size();
  if (count < form.num_points || (form.extent == Extent::kOne && count > form.num_points)) {
    report_.error(ends.origin, label + " has " + count_points(count) + ", but must be a list of " +
                                   std::to_string(form.num_points) +
                                   (form.extent == Extent::kOne ? "" : " or more"));
    return leave_link_unread(link.origin);
  }
  const std::size_t size = is_chain ? form.num_points : count;
  const std::size_t num_links = count - size + 1;
  if (const Node* release = fields.find("release"); release && num_links > 1)
    report_.error(release->origin, fields.label() + ": release belongs to one beam, but this chain has " +
                                       std::to_string(num_links) +
                                       "; write the beam with released ends as a link of its own");
  const std::string name = link.name, place = link.label;
  for (std::size_t i = 0; i < num_links; ++i) {
    // the links of a chain are called name.1, name.2, ...; the links of a chain without a name are named by
    // the next numbers
    const std::string part = "." + std::to_string(i + 1);
    if (num_links > 1) link.name = place.empty() ? name + part : next_link_name();
    if (num_links > 1 && !place.empty()) link.label = place + part;
    const auto first = points->begin() + static_cast<std::ptrdiff_t>(i);
    link.points.assign(first, first + static_cast<std::ptrdiff_t>(size));
    if (const auto point = is_chain ? find_repeated(link.points) : std::nullopt) {
      const std::string& name_twice = scene_.points[index(*point)].name;
      report_.error(ends.origin, describe_repeated(label, name_twice, size));
      return leave_link_unread(link.origin);
    }
    if (!add_link(link)) return;
  }
}

void SceneReader::read_matrix(const Fields& fields, const LinkForm& form, Link link) {
  const Node* chosen =
      fields.require("points", "must be all or a list of points in the order of the matrix rows");
  const auto points =
      chosen ? read_selection(report_, *chosen, fields.label() + ": points", points_) : std::nullopt;
  const auto source = open_beside(*fields.find(form.key), fields.label() + ": " + std::string(form.key));
  auto& matrix = std::get<MatrixLink>(link.kind);
  const bool is_whole = matrix.has_rotations || fields.find("mass") != nullptr;
  const std::size_t least = is_whole ? 1 : form.num_points;
  if (points && points->size() < least)
    report_.error(chosen->origin, fields.label() + ": points has " + count_points(points->size()) +
                                      ", but must be a list of " + std::to_string(least) + " or more");
  // the link is added even if its matrix is missing, so that references to its name are not reported
  else if (points && source) {
    const std::string rows =
        std::string(matrix.has_rotations ? "6" : "3") + " rows for each of " + count_points(points->size()) +
        (matrix.num_inner > 0 ? " and " + std::to_string(matrix.num_inner) + " of inner coordinates" : "");
    const auto size = index(num_rows(matrix, points->size()));
    const MatrixContent content{matrix.is_flexibility ? "flexibility" : "stiffness",
                                matrix.is_flexibility ? "m/N" : "N/m", size, rows};
    read_matrix_market(report_, *source, content, matrix.matrix);
    if (const Node* mass = fields.find("mass"))
      if (const auto file = open_beside(*mass, fields.label() + ": mass"))
        read_matrix_market(report_, *file, {"mass", "kg", size, rows}, matrix.mass);
    link.points = *points;
  }
  add_link(std::move(link));
}

}  // namespace freeflex::io::reader
