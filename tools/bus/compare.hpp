// Compares two motions tick by tick and column by column.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "messages/channels.hpp"

namespace freeflex::tools {

struct CompareRequest {
  std::string a, b;        // recordings or tables
  double tolerance = 0.0;  // [-] relative to the largest value of each quantity; 0: values must be equal
  std::string prefix = channels::kDefaultPrefix;
  std::optional<std::int64_t> session_a = {}, session_b = {};  // sessions, for recordings that contain
                                                               // several
  bool is_common_enough = false;  // true: contents of only one file do not make the result kIncomplete
};

/// The values of one column at one tick in the two files.
struct ValuePair {
  std::int64_t tick = 0;
  std::string column;
  double a = 0.0, b = 0.0;
};

/// Differences of all columns of one quantity.
struct QuantityDifference {
  std::string name;  // name with unit
  std::int64_t num_values = 0;
  double scale = 0.0;               // largest finite |value| in the two files
  std::string largest_column = {};  // column of that value
  double largest = 0.0;             // largest difference, infinite if only one of two values is NaN
  ValuePair at;                     // the values that have the largest difference
  bool is_beyond = false;           // true if a difference exceeds the tolerance
};

struct CompareOutcome {
  enum class Result : std::uint8_t { kSame, kDiffers, kIncomplete, kNothing, kStopped, kError };
  Result result = Result::kSame;
  // the reason why the result is not kSame; for kDiffers: damaged parts that were not compared
  std::string error;
  std::int64_t num_rows = 0;       // rows compared, in all parts
  std::optional<ValuePair> first;  // the earliest difference beyond the tolerance
  std::vector<QuantityDifference> quantities;
  std::vector<std::string> not_compared;   // texts about contents that only one file has
  std::vector<std::string> other_content;  // texts about contents that do not belong to a motion
};

/// Compares the columns of equal names in rows of equal ticks. Quaternions that differ only in sign count as
/// equal, because q and -q are the same attitude.
CompareOutcome compare_motions(const CompareRequest& request);

/// For every tick in both files and every chosen column, calls `take` with the tick, the index of the column
/// in `columns`, and the values of the column in the two files.
/// \pre compare_motions compared rows
using TakeValues = std::function<void(std::int64_t tick, std::size_t column, double a, double b)>;
void trace_columns(const CompareRequest& request, const std::vector<std::string>& columns,
                   const TakeValues& take);

}  // namespace freeflex::tools
