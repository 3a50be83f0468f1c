// Random numbers against the published vectors, and functions against 50 digits of another library.
#include "service/campaign/numbers.hpp"

#include <gtest/gtest.h>

#include <boost/math/distributions/normal.hpp>
#include <boost/multiprecision/cpp_bin_float.hpp>
#include <cmath>
#include <cstdio>
#include <functional>
#include <random>

namespace freeflex::campaign {
namespace {

using Exact = boost::multiprecision::cpp_bin_float_50;

// kat_vectors of Random123, the library of the generator's authors
TEST(RandomBits, AreThePublishedOnes) {
  using Bits = std::array<std::uint64_t, 4>;
  constexpr std::uint64_t kAll = ~std::uint64_t{0};
  EXPECT_EQ(random_bits({0, 0, 0, 0}, {0, 0}),
            (Bits{0x16554d9eca36314c, 0xdb20fe9d672d0fdc, 0xd7e772cee186176b, 0x7e68b68aec7ba23b}));
  EXPECT_EQ(random_bits({kAll, kAll, kAll, kAll}, {kAll, kAll}),
            (Bits{0x87b092c3013fe90b, 0x438c3c67be8d0224, 0x9cc7d7c69cd777b6, 0xa09caebf594f0ba0}));
  // digits of pi
  EXPECT_EQ(random_bits({0x243f6a8885a308d3, 0x13198a2e03707344, 0xa4093822299f31d0, 0x082efa98ec4e6c89},
                        {0x452821e638d01377, 0xbe5466cf34e90c6c}),
            (Bits{0xa528f45403e61d95, 0x38c72dbd566e9788, 0xa5a1610e72fd18b5, 0x57bd43b5e52b7fe6}));
}

TEST(RandomBits, GiveNumbersBetweenZeroAndOne) {
  EXPECT_EQ(to_unit(0), 0x1p-53);
  EXPECT_EQ(to_unit(~std::uint64_t{0}), 1.0 - 0x1p-53);
  EXPECT_EQ(to_unit(std::uint64_t{1} << 63), 0.5 + 0x1p-53);
}

// Returns the largest error of `f`, in units in the last place of the exact value.
double largest_error(const std::function<double(double)>& f, const std::function<Exact(const Exact&)>& exact,
                     const std::function<double(std::mt19937_64&)>& draw) {
  std::mt19937_64 engine(1);
  Exact largest = 0;
  for (int k = 0; k < 20000; ++k) {
    const double x = draw(engine);
    const Exact wanted = exact(Exact(x));
    const auto rounded = static_cast<double>(wanted);
    const double unit = std::nextafter(std::fabs(rounded), HUGE_VAL) - std::fabs(rounded);
    largest = std::max(largest, Exact(abs(Exact(f(x)) - wanted) / unit));
  }
  return static_cast<double>(largest);
}
double uniform(std::mt19937_64& engine, double a, double b) {
  return std::uniform_real_distribution<double>(a, b)(engine);
}

TEST(Functions, AreWithinTheErrorsThatAreStated) {
  const auto log_of = [](const Exact& x) { return Exact(log(x)); };
  const double wide =
      largest_error(natural_log, log_of, [](auto& e) { return std::pow(10.0, uniform(e, -300, 300)); });
  const double near_one = largest_error(natural_log, log_of, [](auto& e) { return uniform(e, 0.5, 2.0); });
  const double exp_error = largest_error(
      exponential, [](const Exact& x) { return Exact(exp(x)); },
      [](auto& e) { return uniform(e, -700.0, 700.0); });
  const double small = largest_error(
      exponential, [](const Exact& x) { return Exact(exp(x)); },
      [](auto& e) { return uniform(e, -1.0, 1.0); });
  std::printf("units in the last place: log %.2f and %.2f, exp %.2f and %.2f\n", wide, near_one, exp_error,
              small);
  EXPECT_LT(wide, 0.9);
  EXPECT_LT(near_one, 0.9);
  EXPECT_LT(exp_error, 1.0);
  EXPECT_LT(small, 1.0);
}

TEST(Functions, OfTheNormalDistributionAreWithinTheErrorsThatAreStated) {
  const boost::math::normal_distribution<Exact> normal;
  double of_probability = 0.0, of_quantile = 0.0, back = 0.0;
  for (double x = -37.0; x < 8.0; x += 0.0137) {
    const Exact wanted = cdf(normal, Exact(x));
    of_probability = std::max(of_probability, static_cast<double>(abs(normal_probability(x) / wanted - 1)));
  }
  std::mt19937_64 engine(2);
  for (int k = 0; k < 3000; ++k) {
    const double u = k % 2 == 0 ? uniform(engine, 0.0, 1.0) : std::pow(10.0, uniform(engine, -300.0, -0.1));
    const Exact wanted = quantile(normal, Exact(u));
    of_quantile = std::max(of_quantile, static_cast<double>(abs(normal_quantile(u) / wanted - 1)));
    if (u > 1e-290) back = std::max(back, std::fabs(normal_probability(normal_quantile(u)) / u - 1.0));
  }
  std::printf("relative errors: probability %.1e, quantile %.1e, probability of quantile %.1e\n",
              of_probability, of_quantile, back);
  EXPECT_LT(of_probability, 1e-13);
  EXPECT_LT(of_quantile, 1e-15);
  EXPECT_EQ(normal_probability(0.0), 0.5);
  EXPECT_EQ(normal_quantile(0.5), 0.0);
}

}  // namespace
}  // namespace freeflex::campaign
