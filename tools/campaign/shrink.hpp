// Finds the values that make a case fail.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "service/campaign/campaign.hpp"

namespace freeflex::campaign {

/// Shrinks a failing case by trials. Variables go to their nominal values one by one while the case still
/// fails. Then the distances of all others from their nominal values are scaled by one factor, which is
/// bisected.
class Shrinking {
 public:
  /// \param values  texts of a case that fails
  Shrinking(const Campaign& campaign, std::vector<std::string> values);

  /// Returns the values to try next, or nullopt at the end.
  std::optional<std::vector<std::string>> next();
  /// Takes the result of the last trial.
  void take(bool fails);

  /// Returns the values that fail and are nearest to the nominal ones.
  const std::vector<std::string>& values() const { return values_; }
  /// Returns the indices of the variables that differ from their nominal values.
  std::vector<std::size_t> remaining() const;
  /// Returns the largest factor that was seen to pass, and the smallest that was seen to fail.
  double failing_factor() const { return high_; }
  int num_trials() const { return num_trials_; }

 private:
  std::vector<std::string> scaled(double factor) const;

  const Campaign& campaign_;
  std::vector<std::string> values_, trial_, whole_;  // whole_: with the factor 1
  std::vector<std::size_t> open_;                    // variables that are still to be tried, the last first
  bool is_scaling_ = false, has_changed_ = false;
  double low_ = 0.0, high_ = 1.0, factor_ = 0.0;
  int num_trials_ = 0;
};

}  // namespace freeflex::campaign
