// Tables beside a scene: CSV for points and links, Matrix Market for stiffness and flexibility.
#pragma once

#include <Eigen/SparseCore>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "service/io/scene/report.hpp"
#include "service/io/scene/text.hpp"
#include "service/io/scene/yaml.hpp"

namespace freeflex::io::reader {

/// One row of a CSV table: fields in the order of the known columns, absent columns empty.
class CsvRow {
 public:
  CsvRow(Report& report, Origin line, int number, const std::vector<std::string_view>& columns)
      : report_(report),
        line_(line),
        number_(number),
        columns_(columns),
        fields_(columns.size()),
        places_(columns.size()) {}
  const Origin& origin() const { return line_; }
  std::string_view text(std::size_t column) const { return fields_[column]; }
  const Origin& origin(std::size_t column) const { return places_[column]; }
  /// "in row 3", counted from 1 below the header.
  std::string place() const { return "in row " + std::to_string(number_); }
  /// "point 'hub'" when the row has a good name, "point in row 3" otherwise.
  std::string label(const std::string& noun, std::size_t name_column) const;
  /// The row as an item of a scene: its columns are the keys.
  Node& as_item(YamlTree& tree, const std::vector<std::size_t>& columns) const;
  /// Adds a key to the item whose value is the list of some columns.
  void add_list(YamlTree& tree, Node& item, std::string_view key,
                const std::vector<std::size_t>& columns) const;
  /// Number of a column, or 0 after reporting "<label>: <column> ...".
  double number(std::size_t column, const std::string& label, const Quantity& quantity) const;

 private:
  friend class CsvTable;
  Report& report_;
  Origin line_;
  int number_;
  const std::vector<std::string_view>& columns_;
  std::vector<std::string_view> fields_;
  std::vector<Origin> places_;
};

/// Comma-separated text with a header line; blank lines and lines that start with # are skipped. No quotes.
class CsvTable {
 public:
  /// Reads the header and reports unknown, repeated and missing columns.
  CsvTable(Report& report, int source, std::vector<std::string_view> known,
           const std::vector<std::string_view>& required);
  /// False: nothing can be read below the header.
  bool is_good() const { return is_good_; }
  bool has(std::string_view column) const;
  /// Where the header line stands.
  const Origin& header() const { return header_; }
  /// Calls `take` with each row that has as many fields as the header; others are reported. Stops when take
  /// says false. True when every line became a row.
  bool each_row(const std::function<bool(const CsvRow&)>& take);

 private:
  bool next_line(std::string_view& line);
  void report_length(std::size_t num_fields);

  Report& report_;
  int source_;
  std::string_view rest_;
  int line_ = 0;
  int num_rows_ = 0;
  std::vector<std::string_view> known_;
  Origin header_;
  std::vector<int> known_of_field_;  // index into known_ per field, -1 for one that is not
  bool is_good_ = true;
};

/// What a matrix holds, for messages.
struct MatrixContent {
  std::string_view noun, unit;  // "stiffness", "N/m"
  std::size_t size;             // rows and columns
  std::string size_reason;      // why that size: "3 rows for each of 115 points"
};

/// Reads a symmetric matrix from Matrix Market text: coordinate or array, real or integer, symmetric or
/// general. A general matrix must be symmetric to 1e-9 of its largest entry and is averaged. After a fault,
/// which is reported, the matrix is left as it was.
void read_matrix_market(Report& report, int source, const MatrixContent& content,
                        Eigen::SparseMatrix<double>& matrix);

}  // namespace freeflex::io::reader
