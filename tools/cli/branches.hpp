// Small motions followed over a range of spins, and their picture (a Campbell diagram).
#pragma once

#include <complex>
#include <string>
#include <vector>

#include "core/steady/relative_equilibrium.hpp"
#include "core/step/plan.hpp"

namespace freeflex::tools {

// [-] A motion grows if its rate exceeds this share of its frequency. Less is the rounding error of equal
// frequencies.
inline constexpr double kGrowth = 1e-7;
inline bool grows(std::complex<double> rate) { return rate.real() > kGrowth * std::abs(rate); }

/// Returns the growth [1/s] of a motion, negative if it decays. Rounding errors are zero.
inline double growth_of(std::complex<double> rate) {
  return std::abs(rate.real()) < kGrowth * std::abs(rate) ? 0.0 : rate.real();
}

/// Returns the number of a mode in the scene, from 1.
inline int number_of(const StepPlan& plan, int mode) {
  return plan.mode_numbers.empty() ? mode + 1 : plan.mode_numbers[index(mode)];
}

/// A motion followed over a range of spins; NaN where it does not exist.
struct Branch {
  std::string name;
  std::vector<std::complex<double>> rates;  // [1/s]
};

/// Follows the motions from spin to spin: each continues the branch whose linear extrapolation is nearest.
std::vector<Branch> branches_of(const StepPlan& plan, const std::vector<RelativeEquilibrium>& all);

/// Draws frequency and damping of branches over the spins [rad/s]. Returns an empty text or the error.
std::string draw_branches(const std::string& title, const std::string& path, const std::vector<double>& spins,
                          const std::vector<Branch>& branches);

}  // namespace freeflex::tools
