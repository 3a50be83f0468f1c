#include "service/campaign/sampler.hpp"

#include <algorithm>
#include <boost/random/sobol.hpp>
#include <cmath>
#include <utility>

#include "service/campaign/numbers.hpp"

namespace freeflex::campaign {
namespace {

// What a random number is drawn for. It is a word of the counter, so that no two numbers share their bits.
enum Purpose : std::uint64_t { kUnit, kJitter, kPermutation, kShift };

std::uint64_t bits_for(std::uint64_t seed, Purpose purpose, std::uint64_t variable, std::uint64_t number) {
  return random_bits({number, variable, purpose, 0}, {seed, 0})[0];
}

/// Returns the image of `number` under a random permutation of 0 .. count - 1. A Feistel network permutes the
/// numbers of 2 half bits; those beyond the count are permuted again.
std::uint64_t permuted(std::uint64_t seed, std::uint64_t variable, std::uint64_t number,
                       std::uint64_t count) {
  constexpr int kRounds = 8;
  unsigned half = 1;
  while (half < 32 && (std::uint64_t{1} << (2 * half)) < count) ++half;
  const std::uint64_t mask = (std::uint64_t{1} << half) - 1;
  do {
    std::uint64_t left = number >> half, right = number & mask;
    for (std::uint64_t round = 0; round < kRounds; ++round) {
      const std::uint64_t mixed = random_bits({right, variable, kPermutation, round}, {seed, 0})[0] & mask;
      left = std::exchange(right, left ^ mixed);
    }
    number = left << half | right;
  } while (number >= count);
  return number;
}

/// Returns the lower Cholesky factor of a matrix; empty if the matrix is not positive definite. Written out,
/// because the order of additions in a library depends on the processor.
std::vector<double> cholesky_factor(const std::vector<double>& matrix, std::size_t n) {
  std::vector<double> factor(n * n, 0.0);
  for (std::size_t i = 0; i < n; ++i) {
    for (std::size_t j = 0; j <= i; ++j) {
      double rest = matrix[i * n + j];
      for (std::size_t k = 0; k < j; ++k) rest -= factor[i * n + k] * factor[j * n + k];
      if (i == j && !(rest > 1e-12)) return {};
      factor[i * n + j] = i == j ? std::sqrt(rest) : rest / factor[j * n + j];
    }
  }
  return factor;
}

constexpr unsigned kBits = 64;

}  // namespace

Sampler::Sampler(Sampling sampling) : sampling_(std::move(sampling)) {
  const std::size_t n = sampling_.variables.size();
  if (!sampling_.correlation.empty()) factor_ = cholesky_factor(sampling_.correlation, n);
  if (sampling_.design != Design::kSobol || n == 0) return;
  // element 2^(b+1) - 1 has the Gray code 2^b, so it is a direction number; Boost does not count element 0
  boost::random::sobol engine(n);
  for (unsigned bit = 0; bit < kBits; ++bit) {
    engine.seed((std::uint64_t{2} << bit) - 2);
    for (std::size_t k = 0; k < n; ++k) lattice_.push_back(engine());
  }
}

double Sampler::unit(std::int64_t number, std::size_t variable) const {
  const auto i = static_cast<std::uint64_t>(number);
  switch (sampling_.design) {
    case Design::kRandom:
      return to_unit(bits_for(sampling_.seed, kUnit, variable, i));
    case Design::kLatinHypercube: {
      const auto count = static_cast<std::uint64_t>(sampling_.cases);
      const double within = to_unit(bits_for(sampling_.seed, kJitter, variable, i));
      const double u = (static_cast<double>(permuted(sampling_.seed, variable, i, count)) + within) /
                       static_cast<double>(count);
      return std::min(u, 1.0 - 0x1p-53);
    }
    case Design::kSobol: {
      std::uint64_t bits = bits_for(sampling_.seed, kShift, variable, 0);
      const std::uint64_t gray = i ^ (i >> 1);
      for (unsigned bit = 0; bit < kBits; ++bit)
        if ((gray >> bit & 1) != 0) bits ^= lattice_[bit * sampling_.variables.size() + variable];
      return to_unit(bits);
    }
  }
  return 0.5;
}

std::vector<double> Sampler::shares(std::int64_t number) const {
  const std::size_t n = sampling_.variables.size();
  std::vector<double> u(n);
  for (std::size_t k = 0; k < n; ++k) u[k] = unit(number, k);
  if (factor_.empty()) return u;
  std::vector<double> z(n);
  for (std::size_t k = 0; k < n; ++k) z[k] = normal_quantile(u[k]);
  for (std::size_t i = 0; i < n; ++i) {
    double sum = 0.0;
    for (std::size_t k = 0; k <= i; ++k) sum += factor_[i * n + k] * z[k];
    u[i] = std::clamp(normal_probability(sum), 0x1p-60, 1.0 - 0x1p-53);
  }
  return u;
}

std::vector<double> Sampler::values(std::int64_t number) const {
  std::vector<double> values = shares(number);
  for (std::size_t k = 0; k < values.size(); ++k) values[k] = quantile(sampling_.variables[k], values[k]);
  return values;
}

std::string find_fault(const Sampling& sampling) {
  const std::size_t n = sampling.variables.size();
  if (sampling.cases < 1) return "cases must be at least 1";
  if (sampling.design == Design::kSobol && n > boost::random::default_sobol_table::max_dimension)
    return "a Sobol sequence has at most " +
           std::to_string(std::size_t{boost::random::default_sobol_table::max_dimension}) + " variables";
  if (sampling.correlation.empty()) return {};
  if (sampling.correlation.size() != n * n)
    return "the correlations must be a square matrix of all variables";
  for (std::size_t i = 0; i < n; ++i) {
    if (sampling.correlation[i * n + i] != 1.0) return "the diagonal of the correlations must be 1";
    for (std::size_t j = 0; j < i; ++j)
      if (sampling.correlation[i * n + j] != sampling.correlation[j * n + i])
        return "the matrix of correlations must be symmetric";
  }
  if (cholesky_factor(sampling.correlation, n).empty())
    return "no variables have these correlations, because the matrix is not positive definite; make some "
           "smaller";
  return {};
}

}  // namespace freeflex::campaign
