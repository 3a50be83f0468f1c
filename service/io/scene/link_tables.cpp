// Reads links from CSV tables. The columns of a table determine the kind of its links.
#include <algorithm>

#include "core/scene/link_kinds.hpp"
#include "service/io/scene/links.hpp"
#include "service/io/scene/reader.hpp"

namespace freeflex::io::reader {
namespace {

enum Column : std::size_t {
  kName,
  kFrom,
  kTo,
  kThird,
  kStiffnessColumn,
  kEA,
  kGJ,
  kEIy,
  kEIz,
  kGAy,
  kGAz,
  kDampingColumn,
  kE,
  kNu,
  kThicknessColumn,
  kMassColumn,
  kDensityColumn,
  kViscousColumn,
  kLossFactorColumn
};
const std::vector<std::string_view> kColumns{
    "name",    "from",    "to",         "third",   "stiffness", "EA", "GJ",        "EIy",
    "EIz",     "GAy",     "GAz",        "damping", "E",         "nu", "thickness", "mass_per_length",
    "density", "viscous", "loss_factor"};

/// A kind of link that a table may contain, with its columns. A table may also have the column name, and
/// viscous and loss_factor if `losses` does not refuse them.
struct TableForm {
  std::string_view kind;
  std::vector<Column> required, optional;  // columns in addition to from and to
  LossRefusal losses;
  LinkKind (*read)(const CsvTable& table, const CsvRow& row, const std::string& label);
};

LinkKind read_spring(const CsvTable&, const CsvRow& row, const std::string& label) {
  return Spring{row.number(kStiffnessColumn, label, kStiffness)};
}

LinkKind read_bar(const CsvTable& table, const CsvRow& row, const std::string& label) {
  Bar bar;
  bar.EA = row.number(kEA, label, kAxialRigidity);
  if (table.has(kColumns[kMassColumn])) bar.mass_per_length = row.number(kMassColumn, label, kMassPerLength);
  return bar;
}

LinkKind read_beam(const CsvTable& table, const CsvRow& row, const std::string& label) {
  Beam beam;
  beam.EA = row.number(kEA, label, kAxialRigidity);
  beam.GJ = row.number(kGJ, label, kRigidity);
  beam.EI_y = row.number(kEIy, label, kRigidity);
  beam.EI_z = row.number(kEIz, label, kRigidity);
  if (table.has(kColumns[kGAy])) beam.GA_y = row.number(kGAy, label, kAxialRigidity);
  if (table.has(kColumns[kGAz])) beam.GA_z = row.number(kGAz, label, kAxialRigidity);
  if (table.has(kColumns[kMassColumn])) beam.mass_per_length = row.number(kMassColumn, label, kMassPerLength);
  return beam;
}

LinkKind read_dashpot(const CsvTable&, const CsvRow& row, const std::string& label) {
  return Dashpot{row.number(kDampingColumn, label, kDampingCoefficient)};
}

LinkKind read_plate(const CsvTable& table, const CsvRow& row, const std::string& label) {
  Plate plate;
  plate.E = row.number(kE, label, kModulus);
  plate.nu = row.number(kNu, label, kPoissonRatio);
  plate.thickness = row.number(kThicknessColumn, label, kThickness);
  if (table.has(kColumns[kDensityColumn])) plate.density = row.number(kDensityColumn, label, kDensity);
  return plate;
}

// returns the kind whose required columns the table has and which allows all other columns of the table, or
// nullptr if there is none
const TableForm* form_of(const CsvTable& table) {
  static const std::vector<TableForm> kForms{
      {"spring", {kStiffnessColumn}, {}, kElasticLosses, read_spring},
      {"bar", {kEA}, {kMassColumn}, kElasticLosses, read_bar},
      {"beam", {kEA, kGJ, kEIy, kEIz}, {kGAy, kGAz, kMassColumn}, kRotationLosses, read_beam},
      {"dashpot", {kDampingColumn}, {}, kDashpotLosses, read_dashpot},
      {"plate", {kThird, kE, kNu, kThicknessColumn}, {kDensityColumn}, kRotationLosses, read_plate}};
  const auto fits = [&](const TableForm& form) {
    for (std::size_t column = kThird; column < kViscousColumn; ++column) {
      const auto holds = [&](const std::vector<Column>& columns) {
        return std::find(columns.begin(), columns.end(), column) != columns.end();
      };
      const bool is_there = table.has(kColumns[column]);
      if (is_there ? !holds(form.required) && !holds(form.optional) : holds(form.required)) return false;
    }
    return true;
  };
  const auto form = std::find_if(kForms.begin(), kForms.end(), fits);
  return form == kForms.end() ? nullptr : &*form;
}

}  // namespace

void SceneReader::read_ends(const CsvRow& row, const std::string& label, bool has_third, Link& link) {
  for (std::size_t column = kFrom; column <= (has_third ? kThird : kTo); ++column) {
    const auto point = points_.resolve(report_, row.text(column), row.origin(column),
                                       label + ": " + std::string(kColumns[column]));
    const bool is_repeated =
        point && std::find(link.points.begin(), link.points.end(), *point) != link.points.end();
    if (is_repeated && !has_third)
      report_.error(row.origin(column), label + " joins the point " + quote(row.text(column)) +
                                            " to itself; give two different points");
    else if (is_repeated)
      report_.error(row.origin(column), label + " names the point " + quote(row.text(column)) +
                                            " twice, but a plate needs three different points");
    link.points.push_back(point.value_or(-1));
  }
}

Node& SceneReader::link_row_as_item(const CsvRow& row, const CsvTable& table, std::string_view kind,
                                    bool has_viscous, bool has_loss_factor) {
  std::vector<std::size_t> columns;
  for (std::size_t column = 0; column < kColumns.size(); ++column) {
    const bool is_end = column == kFrom || column == kTo || column == kThird;
    const bool is_refused =
        (column == kViscousColumn && !has_viscous) || (column == kLossFactorColumn && !has_loss_factor);
    if (table.has(kColumns[column]) && !is_end && !is_refused) columns.push_back(column);
  }
  Node& item = row.as_item(tree_, columns);
  std::vector<std::size_t> ends{kFrom, kTo};
  if (table.has(kColumns[kThird])) ends.push_back(kThird);
  row.add_list(tree_, item, kind, ends);
  return item;
}

void SceneReader::read_links_table(const Node& node) {
  const ItemOfReport item(report_);
  const Fields fields(report_, node, "links", sections::kLinkTable);
  const auto source = open_beside(*fields.find("csv"), "links: csv");
  if (!source) return links_.mark_incomplete();
  CsvTable table(report_, *source, kColumns, {"from", "to"});
  if (!table.is_good()) return links_.mark_incomplete();
  const TableForm* form = form_of(table);
  if (!form) {
    report_.error(table.header(),
                  "the columns do not give a kind of link; in addition to from and to there must be "
                  "stiffness (for springs); EA and optionally mass_per_length (for bars); EA, GJ, EIy, EIz "
                  "and optionally GAy, GAz, mass_per_length (for beams); damping (for dashpots); or third, "
                  "E, nu, thickness and optionally density (for plates)");
    return links_.mark_incomplete();
  }
  const auto check_loss = [&](Column column, std::string_view refusal) {
    const std::string_view name = kColumns[column];
    if (table.has(name) && !refusal.empty())
      report_.error(table.header(), "column " + quote(name) + " " + std::string(refusal));
    return table.has(name) && refusal.empty();
  };
  const bool has_viscous = check_loss(kViscousColumn, form->losses.viscous);
  const bool has_loss_factor = check_loss(kLossFactorColumn, form->losses.loss_factor);
  const bool is_whole = table.each_row([&](const CsvRow& row) {
    Link link;
    link.origin = row.origin();
    link.name = table.has("name") ? std::string(row.text(kName)) : next_link_name();
    if (!table.has("name")) link.label = row.place();
    if (settings_->wants_row("links", link.name)) {
      Node& changed = link_row_as_item(row, table, form->kind, has_viscous, has_loss_factor);
      settings_->apply_to_row("links", link.name, changed);
      read_link(changed, row.place());
      return scene_.links.size() <= kMaxLinks;
    }
    const std::string label = row.label("link", kName);
    if (const std::string problem = name_problem(link.name); !problem.empty()) {
      report_.error(row.origin(kName), label + ": name " + problem);
      links_.mark_incomplete();
    }
    link.kind = form->read(table, row, label);
    if (has_viscous) link.viscous = row.number(kViscousColumn, label, kViscous);
    if (has_loss_factor) link.loss_factor = row.number(kLossFactorColumn, label, kLossFactor);
    read_ends(row, label, traits_of(link).is_surface, link);
    return add_link(std::move(link));
  });
  if (!is_whole) links_.mark_incomplete();
}

}  // namespace freeflex::io::reader
