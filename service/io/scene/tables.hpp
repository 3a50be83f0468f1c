// Reads the tables of a scene: CSV files of points and links, Matrix Market files of stiffness and
// flexibility.
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

/// One row of a CSV table: fields in the order of the known columns. The fields of absent columns are empty.
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
  /// Returns "in row 3", counted from 1 below the header.
  std::string place() const { return "in row " + std::to_string(number_); }
  /// Returns "point 'hub'" if the row has a valid name, else "point in row 3".
  std::string label(const std::string& noun, std::size_t name_column) const;
  /// Returns the row converted to an item of a scene, with the given columns as keys.
  Node& as_item(YamlTree& tree, const std::vector<std::size_t>& columns) const;
  /// Adds to the item a key whose value is the list of the fields in these columns.
  void add_list(YamlTree& tree, Node& item, std::string_view key,
                const std::vector<std::size_t>& columns) const;
  /// Returns the number in a column, or 0 after reporting "<label>: <column> ...".
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

/// Comma-separated text with a header line. Blank lines and lines that start with # are skipped. Quotes have
/// no special meaning.
class CsvTable {
 public:
  /// Reads the header and reports unknown, repeated and missing columns.
  CsvTable(Report& report, int source, std::vector<std::string_view> known,
           const std::vector<std::string_view>& required);
  /// Returns false if the header has a fault; each_row() then reads no row.
  bool is_good() const { return is_good_; }
  bool has(std::string_view column) const;
  /// Returns the position of the header line.
  const Origin& header() const { return header_; }
  /// Calls `take` for each row that has as many fields as the header, and reports all other rows. Stops if
  /// `take` returns false. Returns true if no row was reported and `take` did not return false.
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
  std::vector<int> known_of_field_;  // index of each field in known_; -1: unknown
  bool is_good_ = true;
};

/// Describes the matrix that a file must contain.
struct MatrixContent {
  std::string_view noun, unit;  // "stiffness", "N/m"
  std::size_t size;             // rows and columns
  std::string size_reason;      // why the matrix has this size: "3 rows for each of 115 points"
};

/// Reads a symmetric matrix from Matrix Market text: coordinate or array, real or integer, symmetric or
/// general. A general matrix must be symmetric within 1e-6 of its largest entry. The matrix gets the mean of
/// each entry and its mirror. If there is a fault, reports it and does not change the matrix.
void read_matrix_market(Report& report, int source, const MatrixContent& content,
                        Eigen::SparseMatrix<double>& matrix);

}  // namespace freeflex::io::reader
