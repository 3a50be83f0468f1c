// Sums and products of doubles with their rounding errors.
#pragma once

namespace freeflex {

/// Holds the number hi + lo, where |lo| is at most half a unit in the last place of hi.
struct Sum2 {
  double hi = 0.0, lo = 0.0;
};

/// Returns the product a b exactly, as hi + lo (Dekker 1971).
constexpr Sum2 exact_product(double a, double b) noexcept {
  constexpr double kSplit = 134217729.0;  // 2^27 + 1
  const double ta = kSplit * a, tb = kSplit * b;
  const double a_hi = ta - (ta - a), b_hi = tb - (tb - b);
  const double a_lo = a - a_hi, b_lo = b - b_hi;
  const double value = a * b;
  return {value, ((a_hi * b_hi - value) + a_hi * b_lo + a_lo * b_hi) + a_lo * b_lo};
}

/// Returns the sum a + b exactly, as hi + lo (Knuth 1969).
constexpr Sum2 exact_sum(double a, double b) noexcept {
  const double sum = a + b, part = sum - a;
  return {sum, (a - (sum - part)) + (b - part)};
}

/// Return the sum, difference and product with twice the digits of a double, except for the last few digits.
constexpr Sum2 operator+(const Sum2& a, const Sum2& b) noexcept {
  const Sum2 sum = exact_sum(a.hi, b.hi);
  return exact_sum(sum.hi, sum.lo + (a.lo + b.lo));
}
constexpr Sum2 operator-(const Sum2& a) noexcept { return {-a.hi, -a.lo}; }
constexpr Sum2 operator-(const Sum2& a, const Sum2& b) noexcept { return a + -b; }
constexpr Sum2 operator*(const Sum2& a, const Sum2& b) noexcept {
  const Sum2 product = exact_product(a.hi, b.hi);
  return exact_sum(product.hi, product.lo + (a.hi * b.lo + a.lo * b.hi));
}

}  // namespace freeflex
