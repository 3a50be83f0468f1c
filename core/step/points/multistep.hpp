// The methods that advance the points: a symmetric multistep method, and Stoermer's method with extrapolation
// that starts it   (THEORY 12.128 to 12.131).
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>

#include "core/step/plan/points.hpp"

namespace freeflex {

/// Coefficients of the multistep method from the earliest past value on: those of the differences of
/// positions, without the first, which is 1, and those of the accelerations   (THEORY 12.128).
inline constexpr std::array<double, 5> kChangeWeights{-2.3, 4.39, -5.933, 7.96, -9.15164};
inline constexpr std::array<double, 6> kAccelerationWeights{1.6280058763843794, -5.425247068804112,
                                                            17.31566496031295,  -34.97148120501443,
                                                            56.411526368497476, -63.82357786275252};
/// [rad] Largest phase of a vibration in a step at which it does not grow   (THEORY 12.128).
inline constexpr double kUnstablePhase = 0.645;
/// [-] Error of the phase of a vibration for each radian that it advances, where x [rad] is its phase in a
/// step:
///   kPhaseError x^12 exp(kPhaseGrowth x^2)   (THEORY 12.129)
inline constexpr double kPhaseError = 4.797e-3, kPhaseGrowth = 4.2;

/// Points to the past values that a step reads, the earliest first.
using Past = std::array<const double*, kPastSteps>;

/// Points to positions as values with low parts [m].
struct Positions {
  const double *x, *low;
};
struct NextPositions {
  double *x, *low;
};

/// Makes a step   (THEORY 12.128). Sets `change` to that of the positions [m], and `to` to the new positions:
///   e_11 = e_0 + sum_{j=1..5} a_j (e_j - e_(11-j)) + h^2 (sum_{j=0..4} b_j (f_j + f_(10-j)) + b_5 f_5)
/// \param changes  [m] e_0 to e_10
/// \param accelerations  [m/s^2] f_0 to f_10, the last of them at the present positions
/// \param size  of all arrays, a multiple of kLanes
void advance_multistep(const Past& changes, const Past& accelerations, double h, std::size_t size,
                       const Positions& from, double* change, const NextPositions& to) noexcept;

/// Sets `to` to share * change + scale * sum_k weights_k past_k, with the latest past value first
/// (THEORY 12.132).
void sum_past(const double* weights, double scale, const Past& past, double share, const double* change,
              std::size_t size, double* to) noexcept;

/// Returns the sum of the squares of the differences of order 10 of past values.
/// \param weight  of each component
double square_of_differences(const Past& past, const double* weight, std::size_t size) noexcept;

/// Memory of an extrapolated step. All arrays have the same size.
struct ExtrapolationWorkspace {
  Array u, d, at, f, sum_d, sum_u;
  Array u_before, d_before, v_at;  // of the midpoint rule
};
ExtrapolationWorkspace make_extrapolation_workspace(std::size_t size);

/// Makes a step of length h [s] by Stoermer's method with extrapolation (THEORY 12.130). Leaves the change of
/// the positions [m] in w.sum_d, and the new velocities [m/s] in w.sum_u.
/// \param a  [m/s^2] accelerations at x, v
/// \param accelerate  sets the accelerations at positions and at a fraction of the step:
///   accelerate(fraction, x, a)
template <class Accelerate>
void extrapolate(int columns, double h, const double* x, const double* v, const double* a,
                 const Accelerate& accelerate, ExtrapolationWorkspace& w) noexcept;

/// Makes a step of length h [s] by the midpoint rule with extrapolation, for forces that depend on velocities
/// (THEORY 12.137). Leaves the change of the positions [m] in w.sum_d, and the new velocities [m/s] in
/// w.sum_u. \param accelerate  sets the accelerations: accelerate(fraction, x, v, a)
template <class Accelerate>
void extrapolate_midpoint(int columns, double h, const double* x, const double* v, const double* a,
                          const Accelerate& accelerate, ExtrapolationWorkspace& w) noexcept;

/// Returns the weight of column j of a number of columns, prod_{i != j} j^2 / (j^2 - i^2)   (THEORY 12.130).
constexpr double extrapolation_weight(int j, int columns) noexcept {
  double weight = 1.0;
  for (int i = 1; i <= columns; ++i)
    if (i != j) weight *= static_cast<double>(j * j) / static_cast<double>(j * j - i * i);
  return weight;
}

/// Parts of extrapolate(): begins a column, makes one of its substeps, ends it.
void begin_column(double substep, const double* x, const double* v, const double* a,
                  ExtrapolationWorkspace& w) noexcept;
void continue_column(double substep, const double* x, ExtrapolationWorkspace& w) noexcept;
void end_column(double substep, double weight, ExtrapolationWorkspace& w) noexcept;

template <class Accelerate>
void extrapolate(int columns, double h, const double* x, const double* v, const double* a,
                 const Accelerate& accelerate, ExtrapolationWorkspace& w) noexcept {
  for (Array* sum : {&w.sum_d, &w.sum_u}) std::fill(sum->begin(), sum->end(), 0.0);
  for (int j = 1; j <= columns; ++j) {
    const double substep = h / j;
    begin_column(substep, x, v, a, w);
    for (int k = 1; k <= j; ++k) {
      accelerate(static_cast<double>(k) / j, w.at.data(), w.f.data());
      if (k < j) continue_column(substep, x, w);
    }
    end_column(substep, extrapolation_weight(j, columns), w);
  }
}

/// Parts of extrapolate_midpoint(): the first substep, which is Euler's, and each of the others.
void begin_midpoint(double substep, const double* x, const double* v, const double* a,
                    ExtrapolationWorkspace& w) noexcept;
void continue_midpoint(double substep, const double* x, const double* v, ExtrapolationWorkspace& w) noexcept;

template <class Accelerate>
void extrapolate_midpoint(int columns, double h, const double* x, const double* v, const double* a,
                          const Accelerate& accelerate, ExtrapolationWorkspace& w) noexcept {
  std::fill(w.sum_d.begin(), w.sum_d.end(), 0.0);
  std::copy_n(v, w.sum_u.size(), w.sum_u.begin());
  for (int j = 1; j <= columns; ++j) {
    const double substep = h / (2 * j), weight = extrapolation_weight(j, columns);
    begin_midpoint(substep, x, v, a, w);
    for (int k = 1; k < 2 * j; ++k) {
      accelerate(static_cast<double>(k) / (2 * j), w.at.data(), w.v_at.data(), w.f.data());
      continue_midpoint(substep, x, v, w);
    }
    for (std::size_t i = 0; i < w.sum_d.size(); ++i) {
      w.sum_d[i] += weight * w.d[i];
      w.sum_u[i] += weight * w.u[i];
    }
  }
}

}  // namespace freeflex
