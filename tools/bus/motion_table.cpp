// Reads a table of a motion.
#include <algorithm>
#include <cerrno>
#include <charconv>
#include <cstring>
#include <filesystem>
#include <fstream>

#include "tools/bus/motion_rows.hpp"
#include "tools/bus/motion_sources.hpp"
#include "tools/terminal/console.hpp"

namespace freeflex::tools {
namespace {

class TableReader : public RowReader {
 public:
  TableReader(const std::string& path, std::size_t num_columns)
      : path_(path), file_(path), num_columns_(num_columns) {
    std::getline(file_, line_);
  }

  bool next(MotionRow& row) override {
    if (!error_.empty() || !std::getline(file_, line_)) {
      if (error_.empty() && file_.bad()) error_ = path_ + ": " + std::strerror(errno);
      return false;
    }
    ++number_;
    // if the last line has no end of line, it was cut
    if (file_.eof()) return damage("the last line has no end, so the table was cut off");
    row.values.resize(num_columns_);
    const char *at = line_.data(), *end = at + line_.size();
    if (end != at && end[-1] == '\r') --end;
    if (!read(at, end, row.tick)) return damage("the line has no tick");
    if (row.tick <= last_)
      return damage("tick " + std::to_string(row.tick) + " follows tick " + std::to_string(last_) +
                    ", but ticks must increase");
    last_ = row.tick;
    for (double& value : row.values) {
      if (at == end) return damage("the line has fewer columns than the first line names");
      if (!read(++at, end, value)) return damage("a column has no number");
    }
    return at == end || damage("the line has more columns than the first line names");
  }

 private:
  // reads a number up to the next comma or the end
  template <typename T>
  static bool read(const char*& at, const char* end, T& value) {
    const auto [behind, error] = std::from_chars(at, end, value);
    at = behind;
    return error == std::errc() && (at == end || *at == ',');
  }
  bool damage(const std::string& what) {
    error_ = path_ + ", line " + std::to_string(number_) + ": " + what;
    return false;
  }

  std::string path_;
  std::ifstream file_;
  std::size_t num_columns_;
  std::string line_;
  std::int64_t number_ = 1, last_ = -1;
};

class Table : public MotionFile {
 public:
  Table(std::string path, Columns columns) : path_(std::move(path)) {
    parts_.push_back({"the table", std::move(columns)});
  }
  bool is_recording() const override { return false; }
  std::unique_ptr<RowReader> open(std::size_t) override {
    return std::make_unique<TableReader>(path_, parts_[0].columns.size());
  }

 private:
  std::string path_;
};

}  // namespace

std::unique_ptr<MotionFile> open_table(const std::string& path, std::string& error) {
  // the file is read several times, so it must not be a pipe
  std::error_code fault;
  if (std::filesystem::exists(path, fault) && !std::filesystem::is_regular_file(path, fault)) {
    error = path + " is not a regular file";
    return nullptr;
  }
  std::ifstream file(path);
  std::string line;
  if (!std::getline(file, line)) {
    error = path + ": " + (file.is_open() ? "the file is empty" : std::strerror(errno));
    return nullptr;
  }
  if (!line.empty() && line.back() == '\r') line.pop_back();
  if (!line.starts_with("tick,")) {
    error = path +
            " is neither a recording nor a table; the first line of a table must name the columns, beginning "
            "with tick";
    return nullptr;
  }
  Columns columns;
  for (std::size_t at = 0; at != std::string::npos;) {
    const std::size_t end = line.find(',', at);
    columns.push_back(line.substr(at, end == std::string::npos ? end : end - at));
    at = end == std::string::npos ? end : end + 1;
  }
  columns.erase(columns.begin());
  Columns sorted = columns;
  std::sort(sorted.begin(), sorted.end());
  if (const auto twice = std::adjacent_find(sorted.begin(), sorted.end()); twice != sorted.end()) {
    error = path + ": the first line names the column '" + printable(*twice) +
            "' twice; each must have its own name";
    return nullptr;
  }
  return std::make_unique<Table>(path, std::move(columns));
}

}  // namespace freeflex::tools
