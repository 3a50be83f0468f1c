// Random numbers of a campaign, and the functions that turn them into values. Each number depends only on the
// seed, the case and the variable, so it does not matter which process draws it, or when. The functions use
// only operations whose result IEEE 754 fixes, so all machines and compilers give the same bits. Those of the
// C library differ between its versions.
#pragma once

#include <array>
#include <cstdint>

namespace freeflex::campaign {

/// Returns 256 random bits, by the counter-based generator Philox-4x64-10 (Salmon et al., Parallel random
/// numbers: as easy as 1, 2, 3, SC11, 2011).
std::array<std::uint64_t, 4> random_bits(const std::array<std::uint64_t, 4>& counter,
                                         const std::array<std::uint64_t, 2>& key) noexcept;

/// Returns the middle of the interval of length 2^-52 in which bits / 2^64 lies: a number in (0, 1).
double to_unit(std::uint64_t bits) noexcept;

/// Returns ln x for x > 0 and finite. The error is below 0.9 units in the last place.
double natural_log(double x) noexcept;
/// Returns e^x; 0 below -745.2, infinity above 709.8. The error is below 1 unit in the last place, or of the
/// smallest number.
double exponential(double x) noexcept;
/// Returns the probability Phi(x) that a standard normal number is below x. The relative error is below
/// 1e-13 for x > -37.
double normal_probability(double x) noexcept;
/// Returns the x with Phi(x) = u, 0 < u < 1, by algorithm AS 241 (Wichura, Applied Statistics 37, 477-484,
/// 1988). The relative error is below 1e-15.
double normal_quantile(double u) noexcept;

/// Returns the angle of the vector (x, y) from the x axis [rad], for x >= 0 and y >= 0: 0 to pi / 2; 0 at the
/// origin. The relative error is below 1e-15.
double arc_tangent(double y, double x) noexcept;

}  // namespace freeflex::campaign
