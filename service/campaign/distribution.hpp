// Distributions of the values of a campaign.
#pragma once

#include <limits>
#include <string>
#include <variant>
#include <vector>

namespace freeflex::campaign {

/// Limits outside of which there are no values. The distribution within is scaled to a probability of 1.
struct Truncation {
  double min = -std::numeric_limits<double>::infinity();
  double max = std::numeric_limits<double>::infinity();
};
struct Normal {
  double mean = 0.0;
  double sd = 1.0;  // > 0, before the truncation
  Truncation truncation{};
};
/// The logarithm of the value is normal.
struct LogNormal {
  double median = 1.0;      // > 0
  double log_sd = 1.0;      // [-] > 0, standard deviation of the natural logarithm, before the truncation
  Truncation truncation{};  // of the value
};
struct Uniform {
  double min = 0.0;
  double max = 1.0;  // > min
};
/// One of several YAML texts, each with the same probability.
struct Choice {
  std::vector<std::string> values;
};
using Distribution = std::variant<Normal, LogNormal, Uniform, Choice>;

/// Returns why a distribution has no values, or an empty text.
std::string find_fault(const Distribution& distribution);

/// Returns the value below which the share u of all values lies, 0 < u < 1. For a choice, returns the index
/// of the value.  \pre find_fault() found none
double quantile(const Distribution& distribution, double u);

}  // namespace freeflex::campaign
