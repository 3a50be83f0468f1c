// Measures of one case: numbers that quantities leave behind over time.
#pragma once

#include <string>
#include <vector>

#include "service/campaign/campaign.hpp"
#include "service/campaign/quantities.hpp"

namespace freeflex::campaign {

/// Takes the values of a quantity tick by tick.
class Tally {
 public:
  /// \param period  [s] of a tick; `from` and `to` count as ticks, so that rounding does not lose one
  Tally(const Measure& measure, double period);

  std::int64_t first_tick() const { return first_tick_; }
  std::int64_t last_tick() const { return last_tick_; }
  /// \param tick  ascending
  void take(std::int64_t tick, double value) noexcept;
  /// Returns the statistic over the values taken; not a number if there was none, or if one was not a number.
  ///   largest: of the absolute values.  rms: sqrt(sum x^2 / n)
  ///   settling_time [s]: from `from` to the first value after which all lie within `band` of the target;
  ///     infinite if the last one does not
  ///   overshoot: largest distance beyond the target, seen from the first value; 0 if no value is beyond
  double result() const noexcept;

 private:
  const Measure* measure_;
  double period_;
  std::int64_t first_tick_, last_tick_;
  std::int64_t count_ = 0;
  double first_ = 0.0, last_ = 0.0;
  double max_ = 0.0, min_ = 0.0;
  double sum_ = 0.0, sum_low_ = 0.0;  // compensated sum of values, or of their squares
  double settled_since_ = 0.0;        // [s]
  bool is_settled_ = false;
};

/// The tallies of all measures of a case.
class Measuring {
 public:
  /// \param measures  must outlive this object
  /// \param num_ticks  of the case
  Measuring(const Plan& plan, const std::vector<Measure>& measures, std::int64_t num_ticks);

  /// Returns why a measure has no value, or an empty text.
  const std::string& error() const { return error_; }
  /// Reads the motion at its present tick.
  void take(const Motion& motion) noexcept;
  std::vector<double> results() const;

 private:
  struct TallyOf {
    std::size_t number;
    bool waits;  // the quantity has no value before the first verdict
  };
  /// Measures that take values at the same ticks. No other quantities are read at these ticks.
  struct Window {
    std::int64_t first, last;
    Quantities quantities;
    std::vector<TallyOf> tallies;  // in the order of the quantities
  };
  std::vector<Window> windows_;
  std::vector<Tally> tallies_;
  std::string error_;
};

/// Returns true if a measure needs a verdict.
bool need_verdict(const std::vector<Measure>& measures);

/// Returns "pointing is 0.02, above 0.01" for the first measure that fails the case, or an empty text. A
/// result that is not a number fails if it has a limit.
std::string find_failure(const std::vector<Measure>& measures, const std::vector<double>& results);

}  // namespace freeflex::campaign
