// Two motions beside each other, tick by tick and column by column.
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
  double tolerance = 0.0;  // [-] of the largest value of each quantity; 0: every bit of a value
  std::string prefix = channels::kDefaultPrefix;
  std::optional<std::int64_t> session_a = {}, session_b = {};  // of a recording that holds several
  bool is_common_enough = false;                               // what only one of them holds is no fault
};

/// One value in both.
struct ValuePair {
  std::int64_t tick = 0;
  std::string column;
  double a = 0.0, b = 0.0;
};

/// All columns that measure one thing.
struct QuantityDifference {
  std::string name;  // with its unit
  std::int64_t num_values = 0;
  double scale = 0.0;               // largest |value| of either
  std::string largest_column = {};  // which has it
  double largest = 0.0;             // difference; infinite where one is no number
  ValuePair at;                     // where it is
  bool is_beyond = false;           // the tolerance
};

struct CompareOutcome {
  enum class Result : std::uint8_t { kSame, kDiffers, kIncomplete, kNothing, kStopped, kError };
  Result result = Result::kSame;
  std::string error;               // why not kSame; beside kDiffers: what is damaged and was not compared
  std::int64_t num_rows = 0;       // compared, of all parts
  std::optional<ValuePair> first;  // beyond the tolerance, the earliest tick
  std::vector<QuantityDifference> quantities;
  std::vector<std::string> not_compared;  // what one of them holds and the other not, in words
  std::vector<std::string> beside;        // what they hold that is no motion, in words
};

/// Rows of one tick are compared by the names of their columns; q and -q are one attitude.
CompareOutcome compare_motions(const CompareRequest& request);

/// Calls take with the tick, which of the columns it is, and the value in either, of every tick that both
/// hold. \pre compare_motions compared rows
using TakeValues = std::function<void(std::int64_t tick, std::size_t column, double a, double b)>;
void trace_columns(const CompareRequest& request, const std::vector<std::string>& columns,
                   const TakeValues& take);

}  // namespace freeflex::tools
