// Reads the Matrix Market exchange format: R. F. Boisvert, R. Pozo, K. A. Remington, NISTIR 5935 (1996).
#include <algorithm>
#include <array>
#include <cmath>

#include "core/structure/links/link_factor.hpp"
#include "service/io/scene/tables.hpp"

namespace freeflex::io::reader {
namespace {

struct Word {
  std::string_view text;
  Origin origin;
};

struct Entry {
  std::size_t row, column;  // from 0
  double value;
  int line;
};

class MatrixReader {
 public:
  MatrixReader(Report& report, int source, const MatrixContent& content)
      : report_(report),
        source_(source),
        content_(content),
        size_(content.size),
        rest_(report.text(source)) {}

  void read(Eigen::SparseMatrix<double>& matrix) {
    if (!read_header() || !read_sizes()) return;
    read_entries();
    check_count();
    if (num_faults_ == 0) check_duplicates();
    if (num_faults_ == 0 && !is_symmetric_) check_symmetry();
    if (num_faults_ == 0) assemble(matrix);
  }

 private:
  std::string noun() const { return std::string(content_.noun); }

  bool fail(const Origin& origin, std::string message) {
    report_.error(origin, std::move(message));
    ++num_faults_;
    return false;
  }

  // reads the words of the next line that is neither blank nor a comment, but stops after `most` + 1 words
  bool next_words(std::size_t most, bool skips_comments = true) {
    words_.clear();
    while (!rest_.empty() && words_.empty()) {
      const std::size_t end = std::min(rest_.find('\n'), rest_.size());
      const std::string_view line = rest_.substr(0, end);
      rest_.remove_prefix(std::min(end + 1, rest_.size()));
      ++line_;
      if (skips_comments && line.starts_with('%')) continue;
      for (std::size_t i = 0; i < line.size() && words_.size() <= most;) {
        const std::size_t start = std::min(line.find_first_not_of(" \t\r", i), line.size());
        i = std::min(line.find_first_of(" \t\r", start), line.size());
        if (start < i)
          words_.push_back({line.substr(start, i - start), {source_, line_, static_cast<int>(start) + 1}});
      }
    }
    return !words_.empty();
  }

  bool read_header() {
    constexpr std::string_view kHeader =
        "%%MatrixMarket matrix coordinate|array real|integer symmetric|general";
    if (!next_words(5, false) || line_ != 1 || lower(words_[0].text) != "%%matrixmarket")
      return fail({source_, 1, 1},
                  "this is not a Matrix Market file; the first line must be " + std::string(kHeader));
    if (words_.size() != 5)
      return fail({source_, 1, 1}, "the header must have 5 words: " + std::string(kHeader));
    const auto must_be = [&](std::size_t i, std::array<std::string_view, 2> allowed) {
      const std::string word = lower(words_[i].text);
      if (word == allowed[0] || word == allowed[1]) return;
      fail(words_[i].origin, quote(words_[i].text) + " is not supported; it must be " +
                                 std::string(allowed[0]) +
                                 (allowed[1] == allowed[0] ? "" : " or " + std::string(allowed[1])));
    };
    must_be(1, {"matrix", "matrix"});
    must_be(2, {"coordinate", "array"});
    must_be(3, {"real", "integer"});
    must_be(4, {"symmetric", "general"});
    is_coordinate_ = lower(words_[2].text) == "coordinate";
    is_symmetric_ = lower(words_[4].text) == "symmetric";
    return num_faults_ == 0;
  }

  // reads a whole number from `least` to `most`, or reports a fault and returns nullopt
  std::optional<std::size_t> read_index(const Word& word, const char* what, std::int64_t least,
                                        std::int64_t most) {
    if (const auto value = parse_integer(word.text, least, most)) return index(*value);
    fail(word.origin, "the " + std::string(what) + " is " + quote(word.text) +
                          ", but must be a whole number from " + std::to_string(least) + " to " +
                          std::to_string(most));
    return std::nullopt;
  }

  bool read_sizes() {
    const std::size_t expected = is_coordinate_ ? 3 : 2;
    if (!next_words(expected))
      return fail({source_, line_, 1}, "the size line is missing; it must follow the header");
    if (words_.size() != expected)
      return fail(words_[0].origin, std::string("the size line must hold rows, columns") +
                                        (is_coordinate_ ? " and entries" : "") + " only");
    constexpr std::int64_t kMost = 1'000'000'000;
    const auto rows = read_index(words_[0], "number of rows", 1, kMost);
    const auto columns = read_index(words_[1], "number of columns", 1, kMost);
    const auto entries = is_coordinate_ ? read_index(words_[2], "number of entries", 0, kMost) : 0;
    if (!rows || !columns || !entries) return false;
    if (*rows != size_ || *columns != size_)
      return fail(words_[0].origin, "the " + noun() + " matrix is " + std::to_string(*rows) + " x " +
                                        std::to_string(*columns) + ", but must be " + std::to_string(size_) +
                                        " x " + std::to_string(size_) + " (" + content_.size_reason + ")");
    num_declared_ = is_coordinate_ ? *entries : is_symmetric_ ? size_ * (size_ + 1) / 2 : size_ * size_;
    if (num_declared_ > kMaxMatrixEntries)
      return fail(words_[0].origin, "the matrix has " + std::to_string(num_declared_) +
                                        " entries, but at most " + std::to_string(kMaxMatrixEntries) +
                                        " are read");
    return true;
  }

  void read_entries() {
    const std::size_t expected = is_coordinate_ ? 3 : 1;
    const auto most = static_cast<std::int64_t>(size_);
    // position of the next entry of an array, which lists entries column by column
    std::size_t row = 0, column = 0;
    while (num_read_ <= num_declared_ && next_words(expected)) {
      ++num_read_;
      if (num_read_ > num_declared_) return;
      if (words_.size() != expected) {
        fail(words_[0].origin,
             is_coordinate_ ? "an entry must be row, column and value" : "an entry must be one value");
        continue;
      }
      if (is_coordinate_) {
        const auto r = read_index(words_[0], "row", 1, most);
        const auto c = read_index(words_[1], "column", 1, most);
        if (!r || !c) continue;
        row = *r - 1;
        column = *c - 1;
        if (is_symmetric_ && row < column) {
          fail(words_[0].origin,
               "row " + std::to_string(*r) + ", column " + std::to_string(*c) +
                   " is above the diagonal, but a symmetric file holds the lower triangle only");
          continue;
        }
      }
      const NumberResult number = parse_number(words_.back().text, {content_.unit});
      if (number.value)
        entries_.push_back({row, column, *number.value, line_});
      else
        fail(words_.back().origin, noun() + " " + number.problem);
      if (!is_coordinate_ && ++row == size_) {
        ++column;
        row = is_symmetric_ ? column : 0;
      }
    }
  }

  void check_count() {
    if (num_read_ == num_declared_) return;
    const Origin place{source_, line_, 1};
    if (num_read_ < num_declared_)
      fail(place, "the file ends after " + std::to_string(num_read_) + " entries, but the size line gives " +
                      std::to_string(num_declared_));
    else
      fail(place,
           "there are more entries than the " + std::to_string(num_declared_) + " that the size line gives");
  }

  void check_duplicates() {
    std::stable_sort(entries_.begin(), entries_.end(), [](const Entry& a, const Entry& b) {
      return std::pair(a.column, a.row) < std::pair(b.column, b.row);
    });
    for (std::size_t i = 1; i < entries_.size(); ++i)
      if (entries_[i].row == entries_[i - 1].row && entries_[i].column == entries_[i - 1].column)
        fail({source_, entries_[i].line, 1}, "row " + std::to_string(entries_[i].row + 1) + ", column " +
                                                 std::to_string(entries_[i].column + 1) +
                                                 " is given twice, first on line " +
                                                 std::to_string(entries_[i - 1].line) + "; remove one");
  }

  const Entry* find(std::size_t row, std::size_t column) const {
    const auto found =
        std::lower_bound(entries_.begin(), entries_.end(), std::pair(column, row),
                         [](const Entry& e, const auto& key) { return std::pair(e.column, e.row) < key; });
    return found != entries_.end() && found->row == row && found->column == column ? &*found : nullptr;
  }

  // if mirrored entries differ too much, reports the pair that differs most.  \pre entries are sorted
  void check_symmetry() {
    double largest = 0.0, worst = 0.0;
    const Entry* at = nullptr;
    for (const Entry& entry : entries_) {
      largest = std::max(largest, std::abs(entry.value));
      const Entry* mirror = find(entry.column, entry.row);
      const double difference = std::abs(entry.value - (mirror ? mirror->value : 0.0));
      if (difference > worst) {
        worst = difference;
        at = &entry;
      }
    }
    if (worst <= kSymmetryTolerance * largest) return;
    const Entry* mirror = find(at->column, at->row);
    fail({source_, at->line, 1}, "the " + noun() + " matrix is not symmetric. Row " +
                                     std::to_string(at->row + 1) + ", column " +
                                     std::to_string(at->column + 1) + " is " + format_number(at->value) +
                                     " and its mirror is " + format_number(mirror ? mirror->value : 0.0) +
                                     ", but they may differ by at most " + format_number(kSymmetryTolerance) +
                                     " of the largest entry; correct one, or write their mean in both");
  }

  void assemble(Eigen::SparseMatrix<double>& matrix) const {
    std::vector<Eigen::Triplet<double>> triplets;
    triplets.reserve(2 * entries_.size());
    for (const Entry& entry : entries_) {
      const int row = static_cast<int>(entry.row), column = static_cast<int>(entry.column);
      if (row == column) {
        triplets.emplace_back(row, column, entry.value);
        continue;
      }
      // in a general matrix, an entry and its mirror are averaged: each adds half of its value at both
      // positions
      const double value = is_symmetric_ ? entry.value : 0.5 * entry.value;
      triplets.emplace_back(row, column, value);
      triplets.emplace_back(column, row, value);
    }
    const auto size = static_cast<Eigen::Index>(size_);
    matrix.resize(size, size);
    matrix.setFromTriplets(triplets.begin(), triplets.end());
  }

  Report& report_;
  int source_;
  const MatrixContent& content_;
  std::size_t size_;
  std::string_view rest_;
  int line_ = 0;
  std::vector<Word> words_;
  bool is_coordinate_ = true;
  bool is_symmetric_ = true;
  std::size_t num_declared_ = 0;
  std::size_t num_read_ = 0;
  std::size_t num_faults_ = 0;
  std::vector<Entry> entries_;
};

}  // namespace

void read_matrix_market(Report& report, int source, const MatrixContent& content,
                        Eigen::SparseMatrix<double>& matrix) {
  MatrixReader(report, source, content).read(matrix);
}

}  // namespace freeflex::io::reader
