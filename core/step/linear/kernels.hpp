// Loops over modes (kernels). Each mode is computed by itself, and sums are accumulated in fixed lanes, so
// that every vector width gives the same bits.
#pragma once

#include <cstddef>
#include <span>

#include "core/step/plan.hpp"

namespace freeflex {

/// Returns the sum of a_l b_l over n elements (n is a multiple of kLanes), in kLanes partial sums combined in
/// a fixed order.
double dot_lanes(const double* a, const double* b, std::size_t n) noexcept;

/// Returns the sum of (a_l b_l)^2, in the same lanes as dot_lanes.
double dot_squares(const double* a, const double* b, std::size_t n) noexcept;

/// Returns the product of rows (3 x n) with x, in the same lanes as dot_lanes.
inline Vec3 contract_rows(const double* rows, const double* x, std::size_t n) noexcept {
  return {dot_lanes(rows, x, n), dot_lanes(rows + n, x, n), dot_lanes(rows + 2 * n, x, n)};
}

/// Returns the three rows of a block of StepPlan::rows. These rows are the unit elastic displacements b_l of
/// one point.
inline const double* point_rows(const StepPlan& plan, std::int32_t row) noexcept {
  return plan.rows.data() + 3 * index(row) * index(plan.num_padded);
}

/// Holds the elastic displacement, velocity and acceleration of a point.
struct PointMotion {
  Vec3 V{}, V_dot{}, V_ddot{};  // [m], [m/s], [m/s^2] body axes
};
/// Returns the products of rows (3 x num_padded) with q, q' and q'', in the same lanes as dot_lanes:
///   V = sum_l b_l q_l   (THEORY 2.14),   q_l'' = Q_l / M - 2 decay_l q_l' - omega_l^2 q_l   (THEORY 4.22)
PointMotion contract_motion(const double* rows, const StepPlan& plan, const double* q, const double* q_dot,
                            const double* Q) noexcept;

/// Sets y to f_0 rows_0 + f_1 rows_1 + f_2 rows_2, or adds this to y if `accumulate` is true. The array
/// `rows` is (3 x n).
void combine_rows(const double* rows, const Vec3& f, bool accumulate, std::size_t n, double* y) noexcept;
/// Sets y to sum_k weights_k table_k, or adds this to y if `accumulate` is true. The array `table` is (9 x
/// n).
void combine_table(const double* table, const Mat3& weights, bool accumulate, std::size_t n,
                   double* y) noexcept;
/// Sets y to s x, or adds this to y if `accumulate` is true.
void combine_one(const double* x, double s, bool accumulate, std::size_t n, double* y) noexcept;
/// Adds rows_a F_b to table_ab. The array `rows` is (3 x n), and `table` is (9 x n).
void add_outer(const double* rows, const Vec3& F, std::size_t n, double* table) noexcept;

/// Computes x = rows a and y = rows b, in the same lanes as dot_lanes. Uses the first n columns of rows
/// (num_rows x stride).
void contract_two(const double* rows, std::size_t num_rows, std::size_t stride, std::size_t n,
                  const double* a, const double* b, double* x, double* y) noexcept;
/// Computes x = rows a, in the same lanes as dot_lanes. The array `rows` is (num_rows x n).
void contract_one(const double* rows, std::size_t num_rows, std::size_t n, const double* a,
                  double* x) noexcept;
/// Computes y_k = rows x_k for `count` vectors of n values, in the same lanes as dot_lanes. The array `rows`
/// is (3 x stride).
void contract_vectors(const double* rows, std::size_t stride, std::size_t n, const double* x,
                      std::size_t count, Vec3* y) noexcept;
/// Computes the accelerations of the modes, q'' [m/s^2], with the bits of contract_motion   (THEORY 4.22).
/// All arrays are (num_moving). \param q  [m] \param q_dot  [m/s] \param Q  [N]
void modal_accelerations(const StepPlan& plan, const double* q, const double* q_dot, const double* Q,
                         double* q_ddot) noexcept;
/// Computes V = rows a and W = rows b over all points, in the same lanes as dot_lanes. Uses the first
/// num_moving columns of rows (3 num_points x num_padded).
void contract_points(const StepPlan& plan, const double* a, const double* b, std::span<Vec3> V,
                     std::span<Vec3> W) noexcept;
/// Computes x = rows^T f and y = rows^T g over all points, for the first n columns, summed from the first
/// point to the last.
void project_columns(const StepPlan& plan, std::size_t n, std::span<const Vec3> f, std::span<const Vec3> g,
                     double* x, double* y) noexcept;
/// Computes rows^T f and rows^T g for the modes. The arrays x and y are (num_moving).
inline void project_points(const StepPlan& plan, std::span<const Vec3> f, std::span<const Vec3> g, double* x,
                           double* y) noexcept {
  project_columns(plan, index(plan.num_moving), f, g, x, y);
}
/// Computes rows^T f and rows^T g for modes and constraint shapes. The arrays x and y are (num_padded).
inline void project_all_points(const StepPlan& plan, std::span<const Vec3> f, std::span<const Vec3> g,
                               double* x, double* y) noexcept {
  project_columns(plan, index(plan.num_padded), f, g, x, y);
}
/// Computes the n values of y = sum_k weights_k row_k. The number of rows, `count`, is a multiple of kLanes.
/// Each row begins `stride` values after the row before it.
void sum_rows(const double* rows, std::size_t stride, const double* weights, std::size_t count, std::size_t n,
              double* y) noexcept;

/// Points to the elastic coordinates of all modes and their rates, as values and low parts.
struct ModalState {
  const double *q, *q_low, *q_dot, *q_dot_low;
};
struct ModalResult {
  double *q, *q_low, *q_dot, *q_dot_low;
};
/// Advances every mode by one period under a load linear from Q^0 to Q^1, y = (q, q'):
///   y^1 = (C + L) y^0 + w_0 Q^0 + w_1 (Q^1 - Q^0)   (THEORY 6.1, 6.5)
/// This is the exact solution of M q'' + c q = Q (THEORY 4.21), with decay (THEORY 4.22). Returns true if
/// every new value is finite.
bool advance_modes(const Propagator& propagator, std::size_t n, const ModalState& from, const double* Q0,
                   const double* Q1, const ModalResult& to) noexcept;

}  // namespace freeflex
