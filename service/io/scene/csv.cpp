#include <algorithm>

#include "service/io/scene/tables.hpp"

namespace freeflex::io::reader {
namespace {

// a field without surrounding blanks, and the position where it starts
struct Field {
  std::string_view text;
  int column;  // from 1, in characters
};

// returns a node of plain text, as the YAML reader does. An empty text gives an empty node.
Node text_node(std::string_view text, const Origin& origin) {
  Node node;
  node.kind = text.empty() ? Node::Kind::kEmpty : Node::Kind::kText;
  node.text = text;
  node.origin = origin;
  return node;
}

bool is_padding(char c) { return c == ' ' || c == '\t' || c == '\r'; }

std::vector<Field> split(std::string_view line) {
  std::vector<Field> fields;
  int column = 1;
  for (std::size_t start = 0; start <= line.size();) {
    const std::size_t end = std::min(line.find(',', start), line.size());
    Field field{line.substr(start, end - start), column};
    column += locate(field.text, field.text.size()).column;  // the characters of the field, and the comma
    while (!field.text.empty() && is_padding(field.text.front())) {
      field.text.remove_prefix(1);
      ++field.column;
    }
    while (!field.text.empty() && is_padding(field.text.back())) field.text.remove_suffix(1);
    fields.push_back(field);
    start = end + 1;
  }
  return fields;
}

}  // namespace

double CsvRow::number(std::size_t column, const std::string& label, const Quantity& quantity) const {
  const NumberResult number = parse_number(fields_[column], quantity);
  if (number.value) return *number.value;
  report_.error(places_[column], label + ": " + std::string(columns_[column]) + " " +
                                     (fields_[column].empty() ? "is empty, but must be " + describe(quantity)
                                                              : number.problem));
  return 0.0;
}

Node& CsvRow::as_item(YamlTree& tree, const std::vector<std::size_t>& columns) const {
  Node& item = tree.create({});
  item.kind = Node::Kind::kMapping;
  item.origin = line_;
  for (const std::size_t column : columns)
    item.entries.emplace_back(&tree.create(text_node(columns_[column], places_[column])),
                              &tree.create(text_node(fields_[column], places_[column])));
  return item;
}

void CsvRow::add_list(YamlTree& tree, Node& item, std::string_view key,
                      const std::vector<std::size_t>& columns) const {
  Node& list = tree.create({});
  list.kind = Node::Kind::kList;
  list.origin = places_[columns.front()];
  for (const std::size_t column : columns)
    list.items.push_back(&tree.create(text_node(fields_[column], places_[column])));
  item.entries.emplace_back(&tree.create(text_node(key, list.origin)), &list);
}

std::string CsvRow::label(const std::string& noun, std::size_t name_column) const {
  const std::string_view name = fields_[name_column];
  if (!name_problem(name).empty()) return noun + " " + place();
  return noun + " " + quote(name);
}

CsvTable::CsvTable(Report& report, int source, std::vector<std::string_view> known,
                   const std::vector<std::string_view>& required)
    : report_(report), source_(source), rest_(report.text(source)), known_(std::move(known)) {
  if (rest_.starts_with("\xef\xbb\xbf")) rest_.remove_prefix(3);  // byte order mark
  if (const std::size_t bad = find_bad_byte(rest_); bad != std::string_view::npos) {
    const TextPlace place = locate(rest_, bad);
    report_.error({source_, place.line, place.column},
                  "this is not text, but a CSV table must be UTF-8 without control characters");
    is_good_ = false;
    return;
  }
  std::string_view line;
  if (!next_line(line)) {
    report_.error({source_, 1, 1},
                  "the table is empty; its first line must name the columns " + join(known_));
    is_good_ = false;
    return;
  }
  header_ = {source_, line_, 1};
  // `meant` lists, for each unknown column, the known column that it may misspell
  std::vector<std::string_view> found, meant;
  for (const Field& field : split(line)) {
    const Origin place{source_, line_, field.column};
    const auto column = std::find(known_.begin(), known_.end(), field.text);
    const bool is_repeated = std::find(found.begin(), found.end(), field.text) != found.end();
    if (column == known_.end()) meant.push_back(nearest_word(field.text, known_));
    if (column == known_.end())
      report_.error(place, "the column " + quote(field.text) + " is unknown" +
                               did_you_mean(field.text, known_) + "; allowed are " + join(known_));
    else if (is_repeated)
      report_.error(place, "column " + quote(field.text) + " appears twice; remove one");
    if (column == known_.end() || is_repeated) is_good_ = false;
    found.push_back(field.text);
    known_of_field_.push_back(column == known_.end() ? -1 : static_cast<int>(column - known_.begin()));
  }
  std::vector<std::string_view> missing;
  for (const std::string_view column : required)
    if (std::find(found.begin(), found.end(), column) == found.end() &&
        std::find(meant.begin(), meant.end(), column) == meant.end())
      missing.push_back(column);
  if (!missing.empty()) {
    report_.error(header_, "the header has no column " + join(missing) +
                               "; commas must separate the names in the header");
    is_good_ = false;
  }
}

bool CsvTable::has(std::string_view column) const {
  return std::any_of(known_of_field_.begin(), known_of_field_.end(), [&](int index) {
    return index >= 0 && known_[static_cast<std::size_t>(index)] == column;
  });
}

bool CsvTable::next_line(std::string_view& line) {
  while (!rest_.empty()) {
    const std::size_t end = std::min(rest_.find('\n'), rest_.size());
    line = rest_.substr(0, end);
    rest_.remove_prefix(std::min(end + 1, rest_.size()));
    ++line_;
    const auto first = std::find_if_not(line.begin(), line.end(), is_padding);
    if (first != line.end() && *first != '#') return true;
  }
  return false;
}

void CsvTable::report_length(std::size_t num_fields) {
  std::vector<std::string_view> header;
  for (const int index : known_of_field_) header.push_back(known_[static_cast<std::size_t>(index)]);
  report_.error(
      {source_, line_, 1},
      "row " + std::to_string(num_rows_) + " has " + std::to_string(num_fields) +
          (num_fields == 1 ? " field" : " fields") + ", but the header has " + std::to_string(header.size()) +
          " (" + join(header) + ")" +
          (num_fields > header.size() ? "; a comma separates fields, so write decimals with a point" : ""));
}

bool CsvTable::each_row(const std::function<bool(const CsvRow&)>& take) {
  std::string_view line;
  bool is_whole = is_good_;
  while (is_good_ && next_line(line)) {
    const std::vector<Field> fields = split(line);
    CsvRow row(report_, {source_, line_, fields.front().column}, ++num_rows_, known_);
    if (fields.size() != known_of_field_.size()) {
      report_length(fields.size());
      is_whole = false;
      continue;
    }
    for (std::size_t i = 0; i < fields.size(); ++i) {
      const auto column = static_cast<std::size_t>(known_of_field_[i]);
      row.fields_[column] = fields[i].text;
      row.places_[column] = {source_, line_, fields[i].column};
    }
    if (!take(row)) return false;
  }
  return is_whole;
}

}  // namespace freeflex::io::reader
