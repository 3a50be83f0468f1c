#include "tools/bus/compare.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <memory>
#include <unordered_map>
#include <utility>

#include "tools/bus/motion_rows.hpp"
#include "tools/bus/recording.hpp"
#include "tools/terminal/console.hpp"

namespace freeflex::tools {
namespace {

using Result = CompareOutcome::Result;

/// Indices of a column that both files have.
struct Common {
  std::size_t a, b;      // index of the column in the rows of the first and the second file
  std::size_t quantity;  // index of the column's quantity in the outcome
};

double difference(double a, double b) {
  if (std::isnan(a) && std::isnan(b)) return 0.0;
  if (std::isnan(a) || std::isnan(b)) return HUGE_VAL;
  return a == b ? 0.0 : std::abs(a - b);
}

/// Returns a text with the first names of a list and the number of the others.
std::string names_text(const std::vector<std::string>& names) {
  constexpr std::size_t kShown = 4;
  std::string text;
  for (std::size_t k = 0; k < std::min(kShown, names.size()); ++k)
    text += (k == 0 ? "" : ", ") + printable(names[k]);
  return names.size() > kShown ? text + " and " + std::to_string(names.size() - kShown) + " more" : text;
}

/// Adds a text about damage to the outcome, unless the outcome already has this text. Every part and every
/// pass reports the same damage again.
void add_damage(const std::string& text, CompareOutcome& outcome) {
  if (!text.empty() && outcome.error.find(text) == std::string::npos)
    outcome.error = joined(outcome.error, text);
}

/// Compares two parts that have columns in common, in two passes. The first pass finds the scale of each
/// quantity, and the second pass compares the rows.
class Pair {
 public:
  Pair(MotionFile& a, std::size_t part_a, MotionFile& b, std::size_t part_b, CompareOutcome& outcome)
      : a_(a), b_(b), part_a_(part_a), part_b_(part_b), outcome_(outcome) {
    const Columns &in_a = a.parts()[part_a].columns, &in_b = b.parts()[part_b].columns;
    const std::vector<std::string> quantities = quantities_of(in_a);
    std::unordered_map<std::string, std::size_t> indices;
    for (std::size_t k = 0; k < in_b.size(); ++k) indices.emplace(in_b[k], k);
    for (std::size_t k = 0; k < in_a.size(); ++k) {
      const auto found = indices.find(in_a[k]);
      if (found != indices.end()) columns_.push_back({k, found->second, quantity(quantities[k])});
    }
    find_quaternions(in_a);
  }
  const std::vector<Common>& columns() const { return columns_; }
  const std::string& name_of(const Common& column) const { return a_.parts()[part_a_].columns[column.a]; }

  /// Finds the scale of each quantity. Returns false after Ctrl-C. Records Ctrl-C, and any damage that ends
  /// the rows of a file, in the outcome.
  bool find_scales() {
    return walk([this] {
      for (const Common& column : columns_) {
        QuantityDifference& quantity = outcome_.quantities[column.quantity];
        for (const double value : {row_a_.values[column.a], row_b_.values[column.b]}) {
          if (!std::isfinite(value) || std::abs(value) <= quantity.scale) continue;
          quantity.scale = std::abs(value);
          quantity.largest_column = name_of(column);
        }
      }
    });
  }
  bool find_differences(double tolerance) {
    num_rows_ = num_only_a_ = num_only_b_ = 0;
    const bool is_done = walk([&] { take_row(tolerance); });
    outcome_.num_rows += num_rows_;
    return is_done;
  }
  bool trace(const std::vector<std::string>& columns, const TakeValues& take) {
    std::vector<std::pair<std::size_t, const Common*>> traced;
    for (std::size_t k = 0; k < columns.size(); ++k)
      for (const Common& column : columns_)
        if (name_of(column) == columns[k]) traced.emplace_back(k, &column);
    return traced.empty() || walk([&] {
             align_quaternions();
             for (const auto& [k, column] : traced)
               take(row_a_.tick, k, row_a_.values[column->a], row_b_.values[column->b]);
           });
  }
  /// Adds texts about rows that only one of the files has, and about rows that were skipped.
  void report_unmatched() {
    const auto report = [this](std::int64_t count, const MotionFile& file, std::size_t part,
                               const char* which) {
      if (count > 0)
        outcome_.not_compared.push_back(counted(count, "tick") + " of " + file.parts()[part].name +
                                        " that only " + which + " contains");
    };
    report(num_only_a_, a_, part_a_, "the first");
    report(num_only_b_, b_, part_b_, "the second");
    for (const auto& [odd, which] : {std::pair{odd_a_, "the first"}, {odd_b_, "the second"}})
      if (odd > 0)
        outcome_.not_compared.push_back(counted(odd, "tick") + " of " + a_.parts()[part_a_].name + " in " +
                                        which + " that are incomplete or have other columns than its first");
  }

 private:
  // finds the quaternions whose four components are columns of both files, in any order
  void find_quaternions(const Columns& in_a) {
    std::unordered_map<std::string, const Common*> by_name;
    for (const Common& column : columns_) by_name.emplace(in_a[column.a], &column);
    for (const Common& column : columns_) {
      const std::string& name = in_a[column.a];
      if (!name.ends_with("qw")) continue;
      std::array<Common, 4> quaternion{column, column, column, column};
      bool is_whole = true;
      for (std::size_t k = 1; k < 4; ++k) {
        const auto component = by_name.find(name.substr(0, name.size() - 1) + "xyz"[k - 1]);
        is_whole = is_whole && component != by_name.end();
        if (is_whole) quaternion[k] = *component->second;
      }
      if (is_whole) quaternions_.push_back(quaternion);
    }
  }

  std::size_t quantity(const std::string& name) {
    auto& all = outcome_.quantities;
    const auto found = std::find_if(all.begin(), all.end(),
                                    [&](const QuantityDifference& each) { return each.name == name; });
    if (found != all.end()) return index(found - all.begin());
    all.emplace_back().name = name;
    return all.size() - 1;
  }

  template <typename Visit>
  bool walk(const Visit& visit) {
    const std::unique_ptr<RowReader> a = a_.open(part_a_), b = b_.open(part_b_);
    num_only_a_ = num_only_b_ = 0;
    bool has_a = a->next(row_a_), has_b = b->next(row_b_);
    std::int64_t num_looked = 0;
    while (has_a || has_b) {
      if (++num_looked % 4096 == 0 && is_interrupted()) {
        outcome_.result = Result::kStopped;
        outcome_.error = "interrupted";
        return false;
      }
      if (has_a && has_b && row_a_.tick == row_b_.tick) {
        visit();
        has_a = a->next(row_a_);
        has_b = b->next(row_b_);
      } else if (has_a && (!has_b || row_a_.tick < row_b_.tick)) {
        ++num_only_a_;
        has_a = a->next(row_a_);
      } else {
        ++num_only_b_;
        has_b = b->next(row_b_);
      }
    }
    odd_a_ = a->num_odd();
    odd_b_ = b->num_odd();
    add_damage(a->error(), outcome_);
    add_damage(b->error(), outcome_);
    return true;
  }

  // changes the sign of the second quaternion if this makes it closer to the first, because q and -q are the
  // same attitude
  void align_quaternions() {
    for (const std::array<Common, 4>& quaternion : quaternions_) {
      double product = 0.0;
      for (const Common& each : quaternion) product += row_a_.values[each.a] * row_b_.values[each.b];
      if (!(product < 0.0)) continue;
      for (const Common& each : quaternion) row_b_.values[each.b] *= -1.0;
    }
  }

  void take_row(double tolerance) {
    ++num_rows_;
    align_quaternions();
    for (const Common& column : columns_) {
      QuantityDifference& quantity = outcome_.quantities[column.quantity];
      const double a = row_a_.values[column.a], b = row_b_.values[column.b], off = difference(a, b);
      ++quantity.num_values;
      if (off == 0.0) continue;
      const auto here = [&] { return ValuePair{row_a_.tick, name_of(column), a, b}; };
      if (off > quantity.largest) {
        quantity.largest = off;
        quantity.at = here();
      }
      if (std::isfinite(off) && off <= tolerance * quantity.scale) continue;
      quantity.is_beyond = true;
      if (!outcome_.first || row_a_.tick < outcome_.first->tick) outcome_.first = here();
    }
  }

  MotionFile &a_, &b_;
  std::size_t part_a_, part_b_;
  CompareOutcome& outcome_;
  std::vector<Common> columns_;
  std::vector<std::array<Common, 4>> quaternions_;  // w x y z
  MotionRow row_a_, row_b_;
  std::int64_t num_rows_ = 0, num_only_a_ = 0, num_only_b_ = 0, odd_a_ = 0, odd_b_ = 0;
};

std::vector<Pair> pairs_of(MotionFile& a, MotionFile& b, CompareOutcome& outcome) {
  std::vector<Pair> pairs;
  for (std::size_t part_a = 0; part_a < a.parts().size(); ++part_a)
    for (std::size_t part_b = 0; part_b < b.parts().size(); ++part_b) {
      Pair pair(a, part_a, b, part_b, outcome);
      if (!pair.columns().empty()) pairs.push_back(std::move(pair));
    }
  return pairs;
}

/// Adds a text about the columns that only one of the files has.
void report_unmatched_columns(const MotionFile& one, const MotionFile& other, const char* which,
                              CompareOutcome& outcome) {
  std::unordered_map<std::string, bool> known;
  for (const MotionFile::Part& part : other.parts())
    for (const std::string& column : part.columns) known[column] = true;
  std::vector<std::string> left;
  for (const MotionFile::Part& part : one.parts())
    for (const std::string& column : part.columns)
      if (!known.contains(column)) left.push_back(column);
  if (!left.empty())
    outcome.not_compared.push_back(counted(static_cast<std::int64_t>(left.size()), "column") + " that only " +
                                   which + " contains: " + names_text(left));
  for (const std::string& what : one.ignored()) outcome.other_content.push_back(what + " of " + which);
  add_damage(one.damage(), outcome);
}

}  // namespace

CompareOutcome compare_motions(const CompareRequest& request) {
  CompareOutcome outcome;
  const auto fail = [&outcome](const std::string& error) {
    // if a file is damaged, the result is kNothing, because damage is not an error of the arguments
    const bool is_damaged = error.find("damaged") != std::string::npos;
    outcome.result = is_damaged ? Result::kNothing : Result::kError;
    outcome.error = error;
    return outcome;
  };
  std::string error;
  const auto a = open_motion(request.a, request.prefix, request.session_a, error);
  if (!a) return fail(error);
  const auto b = open_motion(request.b, request.prefix, request.session_b, error);
  if (!b) return fail(error);
  if (!a->is_recording() && !b->is_recording() && request.prefix != channels::kDefaultPrefix)
    return fail("--prefix needs a recording, because a table has no channels");
  std::vector<Pair> pairs = pairs_of(*a, *b, outcome);
  for (Pair& pair : pairs)
    if (!pair.find_scales()) return outcome;
  for (Pair& pair : pairs)
    if (!pair.find_differences(request.tolerance)) return outcome;
  for (Pair& pair : pairs) pair.report_unmatched();
  report_unmatched_columns(*a, *b, "the first", outcome);
  report_unmatched_columns(*b, *a, "the second", outcome);
  if (outcome.num_rows == 0) {
    outcome.result = Result::kNothing;
    add_damage("the files have no tick or no column in common, so nothing was compared", outcome);
  } else if (outcome.first) {
    outcome.result = Result::kDiffers;
  } else if (!outcome.error.empty()) {
    outcome.result = Result::kIncomplete;
  } else if (!outcome.not_compared.empty() && !request.is_common_enough) {
    outcome.result = Result::kIncomplete;
    outcome.error =
        "the common part is the same, but the rest was not compared; give --common to accept this";
  }
  return outcome;
}

void trace_columns(const CompareRequest& request, const std::vector<std::string>& columns,
                   const TakeValues& take) {
  std::string error;
  CompareOutcome outcome;
  const auto a = open_motion(request.a, request.prefix, request.session_a, error);
  const auto b = open_motion(request.b, request.prefix, request.session_b, error);
  if (!a || !b) return;
  for (Pair& pair : pairs_of(*a, *b, outcome))
    if (!pair.trace(columns, take)) return;
}

}  // namespace freeflex::tools
