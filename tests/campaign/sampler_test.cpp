// The values of the cases of a campaign: moments, correlations, designs, and independence of everything but
// the seed and the number of the case.
#include "service/campaign/sampler.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <boost/math/distributions/chi_squared.hpp>
#include <boost/math/distributions/normal.hpp>
#include <boost/random/sobol.hpp>
#include <cmath>
#include <cstdio>
#include <set>

namespace freeflex::campaign {
namespace {

constexpr std::int64_t kCases = 20000;

Sampling sampling_of(std::vector<Distribution> variables, std::uint64_t seed = 7) {
  Sampling sampling;
  sampling.seed = seed;
  sampling.cases = kCases;
  sampling.variables = std::move(variables);
  return sampling;
}
std::vector<std::vector<double>> columns_of(const Sampling& sampling) {
  const Sampler sampler(sampling);
  std::vector<std::vector<double>> columns(sampling.variables.size());
  for (std::int64_t i = 0; i < sampling.cases; ++i) {
    const std::vector<double> values = sampler.values(i);
    for (std::size_t k = 0; k < values.size(); ++k) columns[k].push_back(values[k]);
  }
  return columns;
}
double mean_of(const std::vector<double>& x) {
  double sum = 0.0;
  for (const double each : x) sum += each;
  return sum / static_cast<double>(x.size());
}
double correlation_of(const std::vector<double>& x, const std::vector<double>& y) {
  const double mx = mean_of(x), my = mean_of(y);
  double xx = 0.0, xy = 0.0, yy = 0.0;
  for (std::size_t i = 0; i < x.size(); ++i)
    xx += (x[i] - mx) * (x[i] - mx), yy += (y[i] - my) * (y[i] - my), xy += (x[i] - mx) * (y[i] - my);
  return xy / std::sqrt(xx * yy);
}
// [-] A mean or correlation of n independent numbers is within this many standard errors in all but 1 of 1e5
// samples.
constexpr double kStandardErrors = 4.4;
const double kBound = kStandardErrors / std::sqrt(static_cast<double>(kCases));

TEST(Sampler, MomentsAreThoseOfTheDistributions) {
  const double inf = HUGE_VAL;
  const auto columns = columns_of(
      sampling_of({Normal{40.0, 2.0, {}}, Uniform{-1.0, 3.0}, LogNormal{5.0, 0.3, {}},
                   Normal{0.0, 1.0, {0.5, inf}}, Normal{0.0, 1.0, {6.0, 7.0}}, Choice{{"a", "b", "c"}}}));
  EXPECT_NEAR(mean_of(columns[0]), 40.0, 2.0 * kBound);
  EXPECT_NEAR(mean_of(columns[1]), 1.0, 4.0 / std::sqrt(12.0) * kBound);
  const double log_mean = 5.0 * std::exp(0.5 * 0.3 * 0.3);
  EXPECT_NEAR(mean_of(columns[2]), log_mean, log_mean * std::sqrt(std::expm1(0.09)) * kBound);
  const boost::math::normal normal;
  const double above = pdf(normal, 0.5) / cdf(complement(normal, 0.5));
  EXPECT_NEAR(mean_of(columns[3]), above, kBound);
  const double far = (pdf(normal, 6.0) - pdf(normal, 7.0)) / (cdf(normal, -6.0) - cdf(normal, -7.0));
  EXPECT_NEAR(mean_of(columns[4]), far, 0.16 * kBound) << "far in a tail";
  EXPECT_GE(*std::min_element(columns[4].begin(), columns[4].end()), 6.0);
  for (const double index : {0.0, 1.0, 2.0}) {
    const auto count = static_cast<double>(std::count(columns[5].begin(), columns[5].end(), index));
    EXPECT_NEAR(count / static_cast<double>(kCases), 1.0 / 3.0, std::sqrt(2.0) / 3.0 * kBound);
  }
  double squares = 0.0;
  for (const double x : columns[0]) squares += (x - 40.0) * (x - 40.0);
  EXPECT_NEAR(squares / static_cast<double>(kCases), 4.0, 4.0 * std::sqrt(2.0) * kBound);
}

TEST(Sampler, CorrelationsAreTheGivenOnes) {
  Sampling sampling = sampling_of({Normal{}, Normal{3.0, 2.0, {}}, Uniform{}});
  sampling.correlation = {1.0, 0.8, -0.3, 0.8, 1.0, 0.1, -0.3, 0.1, 1.0};
  ASSERT_EQ(find_fault(sampling), "");
  const auto columns = columns_of(sampling);
  EXPECT_NEAR(correlation_of(columns[0], columns[1]), 0.8, (1.0 - 0.64) * kBound);
  // the correlation of a uniform variable with a normal one is sqrt(3 / pi) of that of their normal scores
  EXPECT_NEAR(correlation_of(columns[0], columns[2]), -0.3 * std::sqrt(3.0 / M_PI), kBound);
}

TEST(Sampler, NeighbouringSeedsVariablesAndCasesAreIndependent) {
  const auto a = columns_of(sampling_of({Uniform{}, Uniform{}}, 7)),
             b = columns_of(sampling_of({Uniform{}, Uniform{}}, 8));
  EXPECT_LT(std::abs(correlation_of(a[0], b[0])), kBound);
  EXPECT_LT(std::abs(correlation_of(a[0], a[1])), kBound);
  std::vector<double> shifted(a[0].begin() + 1, a[0].end());
  EXPECT_LT(std::abs(correlation_of({a[0].begin(), a[0].end() - 1}, shifted)), kBound);
  // the two-dimensional distribution of seeds 7 and 8 over 20 x 20 cells
  std::vector<double> counts(400, 0.0);
  for (std::size_t i = 0; i < a[0].size(); ++i)
    counts[static_cast<std::size_t>(20.0 * a[0][i]) * 20 + static_cast<std::size_t>(20.0 * b[0][i])] += 1.0;
  double chi = 0.0;
  for (const double count : counts)
    chi += (count - kCases / 400.0) * (count - kCases / 400.0) / (kCases / 400.0);
  const boost::math::chi_squared distribution(399);
  EXPECT_LT(chi, quantile(distribution, 1.0 - 1e-5));
  EXPECT_GT(chi, quantile(distribution, 1e-5));
}

TEST(Sampler, ALatinHypercubeHasOneCaseInEachShare) {
  Sampling sampling = sampling_of({Uniform{}, Uniform{}, Normal{}});
  sampling.design = Design::kLatinHypercube;
  for (const std::int64_t cases : {1, 2, 7, 1000, 1025}) {
    sampling.cases = cases;
    const Sampler sampler(sampling);
    for (std::size_t k = 0; k < 3; ++k) {
      std::set<std::int64_t> shares;
      for (std::int64_t i = 0; i < cases; ++i)
        shares.insert(static_cast<std::int64_t>(sampler.shares(i)[k] * static_cast<double>(cases)));
      EXPECT_EQ(shares.size(), static_cast<std::size_t>(cases));
    }
  }
  sampling.cases = kCases;
  const auto columns = columns_of(sampling);
  EXPECT_LT(std::abs(correlation_of(columns[0], columns[1])), kBound);
  EXPECT_NEAR(mean_of(columns[2]), 0.0, 1e-3 * kBound * std::sqrt(static_cast<double>(kCases)));
}

// Each of the first 2^m elements lies in another interval of length 2^-m, in each dimension and shifted
// alike.
TEST(Sampler, SobolsSequenceIsThatOfJoeAndKuoShifted) {
  constexpr std::size_t kVariables = 40;
  Sampling sampling = sampling_of(std::vector<Distribution>(kVariables, Uniform{}));
  sampling.design = Design::kSobol;
  const Sampler sampler(sampling);
  boost::random::sobol engine(kVariables);
  const auto bits_of = [](double u) { return static_cast<std::uint64_t>(u * 0x1p52); };
  const std::vector<double> zero = sampler.shares(0);
  std::vector<std::set<std::uint64_t>> intervals(kVariables);
  for (std::int64_t i = 0; i < 1024; ++i) {
    const std::vector<double> u = sampler.shares(i);
    for (std::size_t k = 0; k < kVariables; ++k) {
      intervals[k].insert(bits_of(u[k]) >> 42);
      // Boost's first element is element 1
      if (i > 0) {
        EXPECT_EQ(bits_of(u[k]) ^ bits_of(zero[k]), engine() >> 12) << i << ", " << k;
      }
    }
  }
  for (const auto& each : intervals) EXPECT_EQ(each.size(), 1024u);
}

TEST(Sampler, FaultsSayWhatIsAllowed) {
  EXPECT_EQ(find_fault(Distribution(Normal{1.0, 0.0, {}})), "sd must be > 0");
  EXPECT_EQ(find_fault(Distribution(Normal{1.0, 1.0, {3.0, 2.0}})), "min must be below max");
  EXPECT_EQ(
      find_fault(Distribution(Normal{0.0, 1.0, {9.0, 10.0}})),
      "less than 1e-12 of the values lie between min and max; use limits that are nearer to the middle");
  EXPECT_EQ(find_fault(Distribution(LogNormal{0.0, 1.0, {}})), "median must be > 0");
  EXPECT_EQ(find_fault(Distribution(Uniform{2.0, 2.0})), "min must be below max, and both finite");
  EXPECT_EQ(find_fault(Distribution(Choice{})), "a choice needs a value");
  Sampling sampling = sampling_of({Normal{}, Normal{}});
  sampling.correlation = {1.0, 1.0, 1.0, 1.0};
  EXPECT_NE(find_fault(sampling).find("positive definite"), std::string::npos);
  sampling.correlation = {1.0, 0.5, 0.4, 1.0};
  EXPECT_EQ(find_fault(sampling), "the matrix of correlations must be symmetric");
}

}  // namespace
}  // namespace freeflex::campaign
