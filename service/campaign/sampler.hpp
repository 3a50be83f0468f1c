// The values of each case of a campaign.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "service/campaign/distribution.hpp"

namespace freeflex::campaign {

/// How the cases are spread over the unit cube of the variables.
enum class Design {
  kRandom,          // independent cases
  kLatinHypercube,  // each variable has one case in each of as many equal shares as there are cases
  kSobol,           // low-discrepancy sequence of Sobol with the direction numbers of Joe and Kuo (2008), and
                    // random digital shifts
};

struct Sampling {
  std::uint64_t seed = 1;
  std::int64_t cases = 0;  // > 0
  Design design = Design::kRandom;
  std::vector<Distribution> variables;
  /// Correlations of normal scores, row by row (num_variables x num_variables): symmetric, 1 on the diagonal,
  /// positive definite. Those of normal variables without truncation are the correlations of the values.
  /// Empty: all variables are independent.
  std::vector<double> correlation;
};

/// Draws the values of cases. The result depends only on the sampling and the number of the case.
class Sampler {
 public:
  /// \pre find_fault(sampling) is empty
  explicit Sampler(Sampling sampling);

  /// Returns the quantiles of all variables in one case, in (0, 1).
  /// \param number  0 to cases - 1
  std::vector<double> shares(std::int64_t number) const;
  /// Returns the values of all variables in one case; of a choice, the index of its value.
  std::vector<double> values(std::int64_t number) const;

 private:
  double unit(std::int64_t number, std::size_t variable) const;

  Sampling sampling_;
  std::vector<double> factor_;          // lower Cholesky factor of the correlations, row by row
  std::vector<std::uint64_t> lattice_;  // direction numbers of Sobol's sequence (64 x num_variables)
};

/// Returns what is wrong with a sampling, or an empty text. Faults of single variables are those of
/// find_fault(Distribution).
std::string find_fault(const Sampling& sampling);

}  // namespace freeflex::campaign
